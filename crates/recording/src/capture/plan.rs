//! What a capture keeps.

use super::admit;
use super::segment::{Gap, Segment};
use stickslip_base::Error;

/// What a capture keeps around its trigger.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Which signals, by index; in the order of the columns.
    pub signals: Vec<usize>,
    /// Of so many ticks one is kept, at least 1; counted from the trigger, whose own tick is always kept.
    pub decimation: u64,
    /// Ticks before the trigger.
    pub before: u64,
    /// Ticks after the trigger.
    pub after: u64,
    /// Which segments.
    pub keep: Keep,
}

/// Which segments a capture keeps, at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// The first so many, then it is complete: 1 is a single shot.
    First(usize),
    /// It goes on; of those that nobody has taken, the latest so many.
    Latest(usize),
}

impl Plan {
    /// Memory that a capture of this plan takes at most [bytes]: history and segments full, each second row lost.
    pub fn bytes(&self) -> u128 {
        let [before, after] = [self.before, self.after].map(u128::from);
        let step = u128::from(self.decimation.max(1));
        let row = (size_of::<u64>() + self.signals.len() * size_of::<f64>()) as u128;
        // What grows by doubling has room for twice what it holds at most: the lists of gaps and of segments.
        let gaps = (before + after + 4) * size_of::<Gap>() as u128;
        let frame = (2 * size_of::<Segment>() + self.signals.len() * size_of::<Vec<f64>>()) as u128;
        let segment = (before / step + 1 + after / step) * row + gaps + frame;
        let segments = match self.keep {
            Keep::First(segments) => segments as u128,
            // One grows while the others wait.
            Keep::Latest(segments) => segments as u128 + 1,
        };
        segments.saturating_mul(segment).saturating_add(before * row)
    }

    /// # Errors
    /// Nothing to keep, or more than `limit` bytes.
    pub(super) fn check(&self, limit: usize) -> Result<(), Error> {
        let (Keep::First(segments) | Keep::Latest(segments)) = self.keep;
        let least = [
            ("signals of a capture", self.signals.len(), "Choose one at least."),
            ("ticks of decimation", usize::from(self.decimation > 0), "1 keeps every row."),
            ("segments of a capture", segments, "A single shot keeps 1."),
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
