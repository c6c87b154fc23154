//! From the wrapping counter of the encoder to an unwrapped angle.

use core::f64::consts::TAU;

use crate::Fields;
use crate::block::Block;
use crate::scalar::{Mask, Scalar};

/// Unwraps the encoder's counter. Correct if the screw turns by less than half the counter's range in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Decoder<T> {
    /// Counts per revolution.
    #[field(symbol = "N", unit = "counts", range = 40.0..=4e6, default = 10_000.0, whole)]
    pub counts_per_revolution: T,
    /// Range of the counter: it wraps to 0 after this number of counts.
    #[field(symbol = "N_c", unit = "counts", range = 256.0..=4_294_967_296.0, default = 65_536.0, whole)]
    pub counter_range: T,
}

/// Reading of the counter card.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct EncoderReading<T> {
    /// Counter, 0 … range − 1.
    #[field(unit = "counts")]
    pub count: T,
    /// 1 if the index pulse came since the last reading.
    #[field(unit = "1", flag)]
    pub index: T,
    /// Counter at the last index pulse.
    #[field(unit = "counts")]
    pub latch: T,
}

/// State of the decoder.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DecoderState<T> {
    /// Counter at the last reading.
    #[field(unit = "counts")]
    pub count: T,
    /// Counts since the start, over all wraps.
    #[field(unit = "counts")]
    pub position: T,
    /// Whether there was a reading before.
    #[field(unit = "1", flag)]
    pub started: T,
}

/// Angles from the counter.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DecoderOutput<T> {
    /// Angle of the screw since the start.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// 1 if the index pulse came since the last tick.
    #[field(unit = "1", flag)]
    pub index: T,
    /// Angle at the last index pulse.
    #[field(symbol = "φ_i", unit = "rad")]
    pub index_angle: T,
}

impl<T: Scalar> Decoder<T> {
    /// A difference of counts, wrapped into ± half the counter's range.
    #[inline(always)]
    fn shortest(&self, difference: T) -> T {
        difference - self.counter_range * (difference / self.counter_range).round()
    }

    /// Angle of one count [rad].
    #[inline(always)]
    pub fn resolution(&self) -> T {
        T::of(TAU) / self.counts_per_revolution
    }
}

impl<T: Scalar> Block<T> for Decoder<T> {
    type State = DecoderState<T>;
    type Input = EncoderReading<T>;
    type Output = DecoderOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut DecoderState<T>, reading: EncoderReading<T>, _dt: T) -> DecoderOutput<T> {
        let moved = state.started.gt(T::of(0.5)).select(self.shortest(reading.count - state.count), T::of(0.0));
        state.position += moved;
        state.count = reading.count;
        state.started = T::of(1.0);
        let index = state.position - self.shortest(reading.count - reading.latch);
        DecoderOutput {
            angle: state.position * self.resolution(),
            index: reading.index,
            index_angle: index * self.resolution(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps_do_not_show_in_the_angle() {
        let decoder = Decoder::<f64> { counts_per_revolution: 1000.0, counter_range: 4096.0 };
        let mut state = DecoderState::default();
        let mut counts: f64 = 4000.0;
        let start = counts;
        for step in [300.0, 300.0, -900.0, 2000.0, 2000.0, -2000.0, -2000.0, -2000.0] {
            let reading = EncoderReading { count: counts.rem_euclid(4096.0), index: 0.0, latch: 0.0 };
            let out = decoder.step(&mut state, reading, 1e-3);
            assert_eq!(out.angle, (counts - start) * decoder.resolution());
            counts += step;
        }
    }

    #[test]
    fn the_index_angle_is_that_of_the_latch() {
        let decoder = Decoder::<f64> { counts_per_revolution: 1000.0, counter_range: 4096.0 };
        let mut state = DecoderState::default();
        decoder.step(&mut state, EncoderReading { count: 4000.0, index: 0.0, latch: 0.0 }, 1e-3);
        // 4000 → 4096 = 0 → 50, latched at 10: 106 counts on, 40 beyond the index.
        let out = decoder.step(&mut state, EncoderReading { count: 50.0, index: 1.0, latch: 10.0 }, 1e-3);
        assert_eq!((out.index, out.index_angle), (1.0, 106.0 * decoder.resolution()));
    }
}
