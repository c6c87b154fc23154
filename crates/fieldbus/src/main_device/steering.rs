//! The ticks of the bench follow the distributed clock: its frames pass the reference in the middle between two pulses
//! of SYNC0.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

/// Correction per deviation of the phase.
const PROPORTIONAL: f64 = 0.02;
/// Correction per deviation and cycle: takes the difference of the two clocks.
const INTEGRAL: f64 = 1e-4;
/// Largest correction in a cycle, as a share of the period. Clocks differ by less; late frames do not shift the phase.
const LIMIT: f64 = 5e-4;

/// PI control of the phase.
#[derive(Debug)]
pub(crate) struct Steering {
    period: i64,
    integral: f64,
    exact: f64,
    has_started: bool,
    shift: Arc<AtomicI64>,
}

impl Steering {
    /// For SYNC0 with this period [ns], at whole multiples of it.
    pub(crate) fn new(period: i64, shift: Arc<AtomicI64>) -> Self {
        Steering { period, integral: 0.0, exact: 0.0, has_started: false, shift }
    }

    /// Starts again: the clock may have another phase.
    pub(crate) fn restart(&mut self) {
        (self.has_started, self.integral) = (false, 0.0);
    }

    /// Deviation from the middle, within half a period [ns]; positive for a late frame.
    fn deviation(&self, time: u64) -> i64 {
        (time % self.period as u64) as i64 - self.period / 2
    }

    /// Time of the clock at which a frame passed [ns]. Returns the deviation [ns].
    pub(crate) fn follow(&mut self, time: u64) -> i64 {
        let deviation = self.deviation(time);
        if self.has_started {
            let limit = LIMIT * self.period as f64;
            self.integral = (self.integral + INTEGRAL * deviation as f64).clamp(-limit, limit);
            let correction = PROPORTIONAL * deviation as f64 + self.integral;
            self.exact -= correction.clamp(-limit, limit);
        } else {
            // Once, a tick may be later by less than a period.
            self.exact += (-deviation).rem_euclid(self.period) as f64;
            self.has_started = true;
        }
        self.shift.store(self.exact as i64, Ordering::Relaxed);
        deviation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: i64 = 1_000_000;

    /// Deviations over a number of cycles, with a clock that is faster by this share, and a disturbance.
    fn run(cycles: i64, drift: f64, mut disturbance: impl FnMut(i64) -> i64) -> Vec<i64> {
        let shift = Arc::<AtomicI64>::default();
        let mut steering = Steering::new(PERIOD, shift.clone());
        let time = |cycle: i64, shift: i64| ((cycle * PERIOD + shift) as f64 * (1.0 + drift)) as i64 + 777_000_000;
        (0..cycles)
            .map(|cycle| {
                let now = time(cycle, shift.load(Ordering::Relaxed)) + disturbance(cycle);
                steering.follow(now as u64)
            })
            .collect()
    }

    #[test]
    fn frames_are_in_the_middle_after_the_first_one_and_stay_there_in_spite_of_drift() {
        for drift in [-1e-4, 0.0, 1e-4] {
            let deviations = run(20_000, drift, |_| 0);
            assert!(deviations[1..].iter().all(|deviation| deviation.abs() < 12_000), "{drift}");
            assert!(deviations[19_000..].iter().all(|deviation| deviation.abs() < 200), "{drift}");
        }
    }

    #[test]
    fn a_clock_with_another_phase_is_followed_from_the_second_frame_on() {
        let shift = Arc::<AtomicI64>::default();
        let mut steering = Steering::new(PERIOD, shift.clone());
        let mut follow = |cycle: i64, phase: i64| {
            if cycle == 1000 {
                steering.restart();
            }
            steering.follow((cycle * PERIOD + shift.load(Ordering::Relaxed) + phase) as u64)
        };
        assert!((1..1000).all(|cycle| follow(cycle, 0).abs() < 500 || cycle == 1));
        assert!((1000..2000).all(|cycle| follow(cycle, 300_000).abs() < 500 || cycle == 1000));
    }

    #[test]
    fn late_frames_hardly_shift_the_ticks() {
        let late = |cycle: i64| if cycle > 5000 && cycle % 50 == 0 { 450_000 } else { 0 };
        let deviations = run(10_000, 2e-5, late);
        let worst = (6000..10_000).filter(|cycle| cycle % 50 != 0).map(|cycle| deviations[cycle as usize].abs());
        assert!(worst.max() < Some(20_000));
    }
}
