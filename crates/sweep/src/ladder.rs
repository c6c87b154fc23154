//! The rungs of a sweep, and what two of them say about the error.

/// How finely a sample is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rung {
    /// Passes of a step; see [`stickslip_core::ideal`].
    pub passes: usize,
    /// Steps a sample in which the load slides steadily.
    pub sliding: usize,
    /// Steps a sample in which it sticks, breaks away or comes to rest.
    pub presliding: usize,
}

const fn rung(passes: usize, sliding: usize, presliding: usize) -> Rung {
    Rung { passes, sliding, presliding }
}

/// What a sweep climbs. From rung to rung the error falls to 0.4 or less, from the first to the second to a third.
pub const RUNGS: [Rung; 8] = [
    rung(1, 1, 2),
    rung(2, 1, 3),
    rung(2, 2, 5),
    rung(3, 3, 8),
    rung(3, 5, 14),
    rung(3, 9, 25),
    rung(3, 16, 45),
    rung(3, 30, 80),
];

/// The bristles forget where they have been as many times over within a sample, or the load does not slide steadily.
pub(super) const FORGETS: f64 = 8.0;

/// Largest difference of two courses over the largest magnitude of the finer one; NaN where one is no number.
pub(super) fn apart(coarser: &[f64], finer: &[f64]) -> f64 {
    let (mut difference, mut size) = (0.0_f64, 0.0_f64);
    for (coarse, fine) in coarser.iter().zip(finer) {
        // `max` passes over NaN, the sum does not.
        if (coarse + fine).is_nan() {
            return f64::NAN;
        }
        difference = difference.max((coarse - fine).abs());
        size = size.max(fine.abs());
    }
    share(difference, size)
}

/// A difference over a size. An axis that does not move has no error where both rungs say so.
pub(super) fn share(difference: f64, size: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference / size }
}

/// What is left of the error on the second rung, of its difference from the first.
const LEFT_AT_FIRST: f64 = 0.5;
/// What is left of it on a rung above, of the difference from the one below.
const LEFT: f64 = 0.7;
/// From rung to rung an estimate falls to this part and no further.
const FALL: f64 = 0.25;

/// Error of the finer of two rungs by their difference, and by what was estimated on the rung below, if it was.
///
/// Of an error that falls to a third, half of the difference is left; of one that falls to 0.4, 0.7 of it. That it falls
/// much faster is not believed: two rungs may agree by chance.
pub(super) fn estimate(difference: f64, before: Option<f64>) -> f64 {
    let (by_difference, least) = match before {
        None => (LEFT_AT_FIRST * difference, 0.0),
        Some(before) => (LEFT * difference, FALL * before),
    };
    // Not `max`: a difference that is no number stays one.
    if by_difference < least { least } else { by_difference }
}

/// Whether an estimate that falls as fast as it may is still too large so many rungs further up.
pub(super) fn hopeless(error: f64, rungs: usize, tolerance: f64) -> bool {
    error * FALL.powi(rungs as i32) > tolerance
}
