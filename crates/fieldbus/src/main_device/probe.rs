//! Index pulses: by the touch probe of the drive, or by its position.

/// Touch probe 1 on the index pulse, at the first event (0x60B8).
const ARMED: i32 = 0x0015;
/// Enabled, and stored, in 0x60B9.
const ENABLED: u32 = 1;
const STORED: u32 = 2;

/// The touch probe, switched on again after each pulse. The drive takes three to eight cycles for this, in which it
/// ignores pulses.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Probe {
    function: i32,
}

impl Probe {
    /// A cycle with this state of the probe: whether a pulse was stored, and the next function.
    pub(crate) fn step(&mut self, status: u32) -> (bool, i32) {
        let stored = self.function == ARMED && status & STORED != 0;
        if stored {
            self.function = 0;
        } else if self.function == 0 && status & (ENABLED | STORED) == 0 {
            self.function = ARMED;
        }
        (stored, self.function)
    }
}

/// Whole revolutions of the position, for drives without a touch probe: exact with an absolute encoder; with an
/// incremental one the zero is where it was switched on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Revolutions {
    last: Option<i64>,
}

impl Revolutions {
    /// A new position [counts]: position of a whole revolution since the last one.
    pub(crate) fn step(&mut self, position: i64, revolution: i64) -> Option<i64> {
        let turn = position.div_euclid(revolution.max(1));
        let last = self.last.replace(turn)?;
        (turn != last).then(|| turn.max(last) * revolution)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pulse_is_reported_once_and_the_probe_is_armed_again() {
        let mut probe = Probe::default();
        let statuses = [0, 1, 1, 3, 3, 3, 0, 1, 3];
        let steps: Vec<(bool, i32)> = statuses.iter().map(|status| probe.step(*status)).collect();
        let stored: Vec<usize> = (0..statuses.len()).filter(|at| steps[*at].0).collect();
        assert_eq!(stored, [3, 8]);
        assert_eq!((steps[0].1, steps[3].1, steps[5].1, steps[6].1), (ARMED, 0, 0, ARMED));
    }

    #[test]
    fn whole_revolutions_are_found_in_both_directions() {
        let mut revolutions = Revolutions::default();
        let found: Vec<_> = [950, 990, 1010, 1020, 995, 5, -3].map(|at| revolutions.step(at, 1000)).to_vec();
        assert_eq!(found, [None, None, Some(1000), None, Some(1000), None, Some(0)]);
    }
}
