//! The plan of a capture.

use super::admit;
use super::segment::{Gap, Segment};
use stickslip_base::Error;

/// The rows that a capture stores around its trigger.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Signals by index, in the order of the columns.
    pub signals: Vec<usize>,
    /// Decimation, at least 1: one of `decimation` ticks is stored, counted from the trigger, whose own tick is always
    /// stored.
    pub decimation: u64,
    /// Ticks before the trigger.
    pub before: u64,
    /// Ticks after the trigger.
    pub after: u64,
    /// The segments to keep.
    pub keep: Keep,
}

/// The segments that a capture keeps, at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// This number of segments; the capture is then complete. 1 is a single shot.
    First(usize),
    /// The latest segments that have not been taken, up to this number; the capture continues.
    Latest(usize),
}

impl Plan {
    /// Largest memory of a capture of this plan [bytes]: history and segments full, each second row lost.
    pub fn bytes(&self) -> u128 {
        let [before, after] = [self.before, self.after].map(u128::from);
        let step = u128::from(self.decimation.max(1));
        let row = (size_of::<u64>() + self.signals.len() * size_of::<f64>()) as u128;
        // The lists of gaps and of segments grow by doubling and have space for twice their largest content.
        let gaps = (before + after + 4) * size_of::<Gap>() as u128;
        let frame = (2 * size_of::<Segment>() + self.signals.len() * size_of::<Vec<f64>>()) as u128;
        let segment = (before / step + 1 + after / step) * row + gaps + frame;
        let segments = match self.keep {
            Keep::First(segments) => segments as u128,
            // One more segment grows while the others wait.
            Keep::Latest(segments) => segments as u128 + 1,
        };
        segments.saturating_mul(segment).saturating_add(before * row)
    }

    /// # Errors
    /// Nothing to store, or more than `limit` bytes.
    pub(super) fn check(&self, limit: usize) -> Result<(), Error> {
        let (Keep::First(segments) | Keep::Latest(segments)) = self.keep;
        let least = [
            ("signals of a capture", self.signals.len(), "Choose at least one."),
            ("ticks of decimation", usize::from(self.decimation > 0), "Choose 1 for every row."),
            ("segments of a capture", segments, "Choose 1 for a single shot."),
        ];
        for (what, found, remedy) in least {
            if found == 0 {
                return Err(Error::TooFew { what, found, needed: 1, remedy });
            }
        }
        let remedy = "Choose fewer signals, a shorter history or fewer segments, decimate more, or raise the limit.";
        admit("the capture", self.bytes(), limit, remedy)
    }
}
