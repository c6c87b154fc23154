//! From columns as read to plausible signals: one check per file.
//!
//! A check corrects what is certain and returns a [`Finding`] for each correction, or a [`Refusal`] with the row, the
//! fault and the remedy. The checks know no roles and no machine: `stickslip-identify` applies them to the columns of an
//! axis.

pub mod clock;
pub mod drive;
pub mod hold;
pub mod order;
pub mod position;
pub mod register;
pub mod stamp_unit;

use std::ops::Range;

/// A peculiarity of a recording, and what was done about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Whole sentences, without the rows.
    pub text: String,
    /// The rows concerned, from 0; empty where it concerns all.
    pub rows: Vec<Range<usize>>,
}

impl Finding {
    /// A finding about the whole recording.
    pub fn everywhere(text: String) -> Self {
        Finding { text, rows: Vec::new() }
    }
}

/// A recording that cannot be used as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The row, from 0.
    pub row: usize,
    /// The fault, with numbers.
    pub fault: String,
    /// The remedy: a whole sentence.
    pub remedy: String,
}

/// The value below which this share of the values is; 0 for none.
pub(crate) fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let at = ((values.len() - 1) as f64 * share) as usize;
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Line and slope of the least squares of values over their index, and the range of the residuals [smallest, largest].
pub(crate) fn line(values: &[f64]) -> (f64, f64, [f64; 2]) {
    let n = values.len() as f64;
    let (middle, mean) = (0.5 * (n - 1.0), values.iter().sum::<f64>() / n);
    let [product, square] = values.iter().enumerate().fold([0.0; 2], |[product, square], (i, value)| {
        let index = i as f64 - middle;
        [product + index * (value - mean), square + index * index]
    });
    let slope = product / square;
    let start = mean - slope * middle;
    let residuals = values.iter().enumerate().map(|(i, value)| value - start - slope * i as f64);
    let range = residuals.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], r| [low.min(r), high.max(r)]);
    (start, slope, range)
}
