//! Incremental encoder with a counter that wraps and an index pulse once a revolution.

use core::f64::consts::TAU;

use crate::Fields;
use crate::block::Block;
use crate::scalar::{Mask, Scalar};
use crate::tick::EncoderReading;

/// An encoder on the screw.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Encoder<T> {
    /// Counts per revolution, four times the lines.
    #[field(symbol = "N", unit = "counts", range = 40.0..=4e6, default = 10_000.0, whole)]
    pub counts_per_revolution: T,
    /// Range of the counter: it wraps to 0 after this number of counts.
    #[field(symbol = "N_c", unit = "counts", range = 256.0..=4_294_967_296.0, default = 65_536.0, whole)]
    pub counter_range: T,
    /// Angle of the screw at the index pulse.
    #[field(symbol = "φ_i", unit = "rad", range = -7.0..=7.0, default = 2.0)]
    pub index_angle: T,
    /// Fault.
    pub fault: EncoderFault<T>,
}

/// Faults of an encoder.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum EncoderFault<T> {
    /// None.
    Nothing,
    /// Missing index pulse.
    NoIndex,
    /// Constant counter.
    Frozen,
    /// Lines are lost: the counter runs slow by a share.
    LostLines(LostLines<T>),
}

/// Share of lost lines.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LostLines<T> {
    /// Lost share of the counts.
    #[field(symbol = "p", unit = "1", range = 0.0..=1.0, default = 0.01)]
    pub share: T,
}

/// State of the encoder.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct EncoderState<T> {
    /// Revolution, counted from the index, at the last reading.
    #[field(unit = "1")]
    pub revolution: T,
    /// Counter at the last index pulse.
    #[field(unit = "counts")]
    pub latch: T,
    /// Whether there was a reading before.
    #[field(unit = "1", flag)]
    pub running: T,
}

impl<T: Scalar> Encoder<T> {
    #[inline(always)]
    fn wrapped(&self, count: T) -> T {
        count - self.counter_range * (count / self.counter_range).floor()
    }
}

impl<T: Scalar> Block<T> for Encoder<T> {
    type State = EncoderState<T>;
    /// Angle of the screw [rad].
    type Input = T;
    type Output = EncoderReading<T>;

    #[inline(always)]
    fn step(&self, state: &mut EncoderState<T>, angle: T, _dt: T) -> EncoderReading<T> {
        let zero = T::of(0.0);
        let per_angle = self.counts_per_revolution * T::of(1.0 / TAU);
        let revolution = ((angle - self.index_angle) * T::of(1.0 / TAU)).floor();
        let forward = revolution.gt(state.revolution);
        let passed = forward | revolution.lt(state.revolution);
        // In both directions the counter latches the same count at the pulse: that of the index angle.
        let edge = forward.select(revolution, state.revolution);
        let index_count = (self.index_angle * per_angle).floor() + edge * self.counts_per_revolution;
        let mut pulse = passed.select(state.running, zero);
        let mut seen = angle;
        match self.fault {
            EncoderFault::Nothing => {}
            EncoderFault::NoIndex => pulse = zero,
            EncoderFault::Frozen => {
                pulse = zero;
                seen = zero;
            }
            EncoderFault::LostLines(lost) => seen = angle * (T::of(1.0) - lost.share),
        }
        state.latch = pulse.gt(zero).select(self.wrapped(index_count), state.latch);
        state.revolution = revolution;
        state.running = T::of(1.0);
        EncoderReading { count: self.wrapped((seen * per_angle).floor()), index: pulse, latch: state.latch }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_counter_wraps_and_the_index_latches_the_same_count_both_ways() {
        let encoder = Encoder::<f64> { counter_range: 4096.0, ..Encoder::default() };
        let mut state = EncoderState::default();
        let mut latches = std::vec::Vec::new();
        let angles = (0..2000).map(|k| 0.01 * f64::from(k)).chain((0..2000).rev().map(|k| 0.01 * f64::from(k)));
        for angle in angles {
            let reading = encoder.step(&mut state, angle, 1e-3);
            let exact = (angle / TAU * 10_000.0).floor().rem_euclid(4096.0);
            assert_eq!(reading.count, exact);
            if reading.index > 0.0 {
                latches.push(reading.latch);
            }
        }
        // 20 rad from 0 pass 2, 8.28 and 14.57 rad.
        assert_eq!(latches.len(), 6);
        assert_eq!(latches[0], (2.0 / TAU * 10_000.0).floor());
        assert_eq!((latches[0], latches[1], latches[2]), (latches[5], latches[4], latches[3]));
    }

    #[test]
    fn each_fault_shows() {
        let healthy = Encoder::<f64>::default();
        for (fault, counts, pulses) in [
            (EncoderFault::Nothing, 15_915.0, 2),
            (EncoderFault::NoIndex, 15_915.0, 0),
            (EncoderFault::Frozen, 0.0, 0),
            (EncoderFault::LostLines(LostLines { share: 0.1 }), 14_323.0, 2),
        ] {
            let encoder = Encoder { fault, ..healthy };
            let mut state = EncoderState::default();
            let (mut last, mut seen) = (0.0, 0);
            for k in 0..=1000 {
                let reading = encoder.step(&mut state, 0.01 * f64::from(k), 1e-3);
                last = reading.count;
                seen += usize::from(reading.index > 0.0);
            }
            assert_eq!((last, seen), (counts, pulses));
        }
    }
}
