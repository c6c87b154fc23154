//! What happened lately, by cycle: faults, changes of parameters, what began and ended.

use std::collections::VecDeque;

use super::protocol::Mark;

/// So many are kept.
const MOST: usize = 64;

/// The marks.
#[derive(Default)]
pub(super) struct Marks {
    kept: VecDeque<Mark>,
    count: u64,
}

impl Marks {
    pub(super) fn push(&mut self, mark: Mark) {
        if self.kept.len() == MOST {
            self.kept.pop_front();
        }
        self.kept.push_back(mark);
        self.count += 1;
    }

    /// Those that are kept, the newest last.
    pub(super) fn all(&self) -> Vec<Mark> {
        self.kept.iter().cloned().collect()
    }

    /// How many there have been.
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
        assert_eq!((marks.count(), marks.all().len(), marks.all()[0].cycle), (100, MOST, 36));
    }
}
