//! Tasks with a lower rate than the cycle.

/// Every `divider`-th cycle, starting with cycle `offset`. Different offsets distribute slow tasks over the cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    divider: u64,
    offset: u64,
}

impl Rate {
    /// Every `divider`-th cycle; `None` for 0. The offset counts modulo the divider.
    pub const fn new(divider: u64, offset: u64) -> Option<Self> {
        if divider == 0 { None } else { Some(Rate { divider, offset: offset % divider }) }
    }

    /// Whether the task runs in this cycle. In a missed cycle the task is skipped.
    pub const fn due(self, cycle: u64) -> bool {
        cycle % self.divider == self.offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_tasks_are_spread_over_the_cycles() {
        let tasks = [0, 1, 6].map(|offset| Rate::new(4, offset).unwrap());
        let due: Vec<_> = (0..8).map(|cycle| tasks.map(|task| u8::from(task.due(cycle)))).collect();
        assert_eq!(due[..4], [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]]);
        assert_eq!(due[4..], due[..4]);
    }

    #[test]
    fn a_divider_of_zero_is_refused() {
        assert_eq!(Rate::new(0, 3), None);
        assert!((0..5).all(|cycle| Rate::new(1, 0).unwrap().due(cycle)));
    }
}
