//! A delayed command with a slope over its delay.

use stickslip_core::drive::LONGEST_DELAY;
use stickslip_core::scalar::Scalar;

/// Weights of the commands of this tick and of those before. Between two whole ticks the mean over a tick acts, as in
/// [`Delay`](stickslip_core::drive::Delay); beyond the first and the last tick it is continued, so that a search that
/// goes too far returns.
pub(super) struct Delayed<T> {
    weights: [T; LONGEST_DELAY + 1],
}

impl<T: Scalar> Delayed<T> {
    /// For a delay in ticks.
    pub(super) fn new(delay: T) -> Self {
        let zero = T::of(0.0);
        let weight = |tick: usize| {
            let (mut rises, mut falls) = (delay - T::of(tick as f64 - 1.0), T::of(tick as f64 + 1.0) - delay);
            if tick == 0 {
                return falls.max(zero);
            }
            if tick == LONGEST_DELAY {
                return rises.max(zero);
            }
            if tick > 1 {
                rises = rises.max(zero);
            }
            if tick < LONGEST_DELAY - 1 {
                falls = falls.max(zero);
            }
            rises.min(falls)
        };
        Delayed { weights: std::array::from_fn(weight) }
    }

    /// The acting command; `before` gives the one sent a number of ticks before.
    pub(super) fn of(&self, before: impl Fn(usize) -> f64) -> T {
        let mut sum = T::of(0.0);
        for (late, weight) in self.weights.iter().enumerate() {
            sum += *weight * T::of(before(late));
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_core::drive::Delay;

    #[test]
    fn a_delay_acts_as_in_the_machine() {
        let commands: Vec<f64> = (0..40).map(|k: i32| f64::from(k * k % 17)).collect();
        for ticks in [0.0, 0.3, 1.0, 2.7, 7.5, 8.0] {
            let delay = Delay::new(ticks, 1.0).unwrap();
            let (delayed, mut past) = (Delayed::new(ticks), [0.0; LONGEST_DELAY]);
            for (k, command) in commands.iter().enumerate() {
                let exact = delay.next(&mut past, *command);
                if k >= LONGEST_DELAY {
                    let acting = delayed.of(|late| commands[k - late]);
                    assert!((acting - exact).abs() < 1e-12, "{ticks} ticks: {acting} instead of {exact}");
                }
            }
        }
    }

    #[test]
    fn a_ramp_is_continued_before_the_first_and_after_the_last_tick() {
        for ticks in [-0.5, -0.01, 8.3, 9.0] {
            let acting = Delayed::new(ticks).of(|late| 100.0 - late as f64);
            assert!((acting - (100.0 - ticks)).abs() < 1e-12, "{ticks}: {acting}");
        }
    }
}
