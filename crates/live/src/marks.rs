//! Latest events by cycle: faults, changes of parameters, start and end of motions and measurements.

use std::collections::VecDeque;

use super::protocol::Mark;

/// Capacity of the list.
const CAPACITY: usize = 64;

/// The latest marks.
#[derive(Default)]
pub(super) struct Marks {
    newest: VecDeque<Mark>,
    count: u64,
}

impl Marks {
    pub(super) fn push(&mut self, mark: Mark) {
        if self.newest.len() == CAPACITY {
            self.newest.pop_front();
        }
        self.newest.push_back(mark);
        self.count += 1;
    }

    /// The kept marks, the newest last.
    pub(super) fn all(&self) -> Vec<Mark> {
        self.newest.iter().cloned().collect()
    }

    /// Number of all marks.
    pub(super) fn count(&self) -> u64 {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::super::protocol::MarkKind;
    use super::*;

    #[test]
    fn the_newest_marks_are_kept_and_all_are_counted() {
        let mut marks = Marks::default();
        for cycle in 0..100 {
            marks.push(Mark { cycle, kind: MarkKind::Begin, text: String::new() });
        }
        assert_eq!((marks.count(), marks.all().len(), marks.all()[0].cycle), (100, CAPACITY, 36));
    }
}
