//! Delay between a command and its action.

use crate::Fields;
use crate::scalar::Scalar;

/// Longest delay, in samples.
pub const LONGEST_DELAY: usize = 8;

/// Constant delay of a command that is held over each sample. Past commands are stored with the newest first.
///
/// Within a sample in which the acting command changes, its mean acts: exact for the momentum over the sample.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Delay<T> {
    /// The delay in samples, rounded down and rounded up.
    #[field(fixed)]
    samples: (usize, usize),
    /// Fraction of a sample beyond the whole ones.
    #[field(unit = "1", range = 0.0..=1.0)]
    fraction: T,
}

impl Delay<f64> {
    /// A delay of `time` [s] in samples of `sample` [s]; `None` beyond [`LONGEST_DELAY`] samples, and for a negative one.
    pub fn new(time: f64, sample: f64) -> Option<Self> {
        let samples = time / sample;
        // A small deviation from a whole number is a rounding error.
        let whole = libm::floor(samples + 1e-6);
        let fraction = samples - whole;
        let rounded_up = whole + if fraction > 1e-6 { 1.0 } else { 0.0 };
        (whole >= 0.0 && rounded_up <= LONGEST_DELAY as f64).then_some(Delay {
            samples: (whole as usize, rounded_up as usize),
            fraction: if fraction > 1e-6 { fraction } else { 0.0 },
        })
    }
}

impl<T> Delay<T> {
    /// Whole samples of the delay.
    pub fn whole(&self) -> usize {
        self.samples.0
    }
}

impl<T: Scalar> Delay<T> {
    /// Fraction of a sample beyond the whole ones.
    pub fn fraction(&self) -> T {
        self.fraction
    }

    /// The command that acts in this sample, for the newest one, which is stored.
    #[inline(always)]
    pub fn next(&self, past: &mut [T; LONGEST_DELAY], command: T) -> T {
        if self.samples.1 == 0 {
            return command;
        }
        let acting = self.ahead(past, command, 0);
        for age in (1..self.samples.1.min(LONGEST_DELAY)).rev() {
            past[age] = past[age - 1];
        }
        past[0] = command;
        acting
    }

    /// The command that acts `lead` samples later if the newest one remains.
    #[inline(always)]
    pub fn ahead(&self, past: &[T; LONGEST_DELAY], command: T, lead: usize) -> T {
        // The bound is known to the compiler: no check in a tick.
        let aged = |age: usize| if age == 0 { command } else { past[(age - 1).min(LONGEST_DELAY - 1)] };
        let (late, later) = (self.samples.0.saturating_sub(lead), self.samples.1.saturating_sub(lead));
        let acting = aged(late);
        if late == later { acting } else { acting + self.fraction * (aged(later) - acting) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Acting commands for the numbers 1, 2, 3 … after zeros.
    fn acting(samples: f64) -> [f64; 12] {
        let delay = Delay::new(samples * 1e-3, 1e-3).unwrap();
        let mut past = [0.0; LONGEST_DELAY];
        core::array::from_fn(|k| delay.next(&mut past, (k + 1) as f64))
    }

    #[test]
    fn a_command_acts_after_its_delay_and_in_between_with_its_mean() {
        assert_eq!(acting(0.0), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0]);
        assert_eq!(acting(8.0), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0]);
        let late = acting(2.25);
        assert_eq!(late[..2], [0.0, 0.0]);
        // On a ramp a delay is its length.
        for k in 3..12 {
            assert!((late[k] - ((k + 1) as f64 - 2.25)).abs() < 1e-12, "{late:?}");
        }
    }

    #[test]
    fn the_commands_ahead_are_those_that_act_later() {
        for samples in [0.0, 0.5, 1.0, 2.25, 3.0, 7.9] {
            let delay = Delay::new(samples, 1.0).unwrap();
            let mut past = [0.0; LONGEST_DELAY];
            for k in 0..20 {
                delay.next(&mut past, f64::from(k * k));
            }
            let newest = 400.0;
            let foreseen: [f64; 12] = core::array::from_fn(|lead| delay.ahead(&past, newest, lead));
            let came: [f64; 12] = core::array::from_fn(|_| delay.next(&mut past, newest));
            assert_eq!(foreseen, came, "{samples}");
        }
    }

    #[test]
    fn a_delay_beyond_the_stored_commands_is_refused() {
        assert!(Delay::new(8.0, 1.0).is_some());
        assert!(Delay::new(8.1, 1.0).is_none());
        assert!(Delay::new(-0.1, 1.0).is_none());
        assert!(Delay::new(f64::NAN, 1.0).is_none());
        // Rounding does not cost a sample.
        assert_eq!(Delay::new(3.0 * 250e-6 * (1.0 + 1e-12), 250e-6).unwrap().samples, (3, 3));
        assert_eq!(Delay::new(3.0 * 250e-6 * (1.0 - 1e-12), 250e-6).unwrap().samples, (3, 3));
    }
}
