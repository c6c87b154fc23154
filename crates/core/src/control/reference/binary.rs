//! Pseudo-random binary speed, for identification.

use super::Setpoint;
use crate::Fields;
use crate::fields::{Relation, at_most};
use crate::scalar::Scalar;

/// A speed that jumps between two values of opposite sign at each chip of a maximum-length sequence, smoothed to a
/// limited acceleration. White up to 0.44 of the chip rate.
///
/// The sequence has one chip more of one sign than of the other; its mean is taken off, so that the position repeats
/// with each period of 2ⁿ − 1 chips. Golomb, *Shift Register Sequences* (1967). The acceleration jumps.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = Prbs::law)]
pub struct Prbs<T> {
    /// Half the distance between the two speeds.
    #[field(symbol = "Ω", unit = "rad/s", range = 0.0..=1e3, default = 5.0)]
    pub amplitude: T,
    /// Time of one chip, rounded to whole cycles.
    #[field(symbol = "T_c", unit = "s", range = 1e-4..=100.0, default = 0.05)]
    pub chip_time: T,
    /// Length n of the shift register.
    #[field(symbol = "n", unit = "1", whole, range = 3.0..=16.0, default = 9.0)]
    pub order: T,
    /// Acceleration between the two speeds.
    #[field(symbol = "α", unit = "rad/s^2", range = 1e-3..=1e6, default = 500.0)]
    pub acceleration: T,
}

/// Feedback taps of maximum length for orders 3 to 16, right-shifting Fibonacci registers: a one at each tap's bit.
const TAPS: [u32; 14] = [0x3, 0x3, 0x5, 0x3, 0x3, 0x1d, 0x11, 0x9, 0x5, 0x53, 0x1b, 0x2b, 0x3, 0x2d];

impl<T: Scalar> Prbs<T> {
    /// The speed arrives within its chip.
    fn law(&self) -> [Relation<T>; 1] {
        let remedy = "Increase the chip time or the acceleration, so that the speed is reached within its chip.";
        [at_most("amplitude", self.amplitude, T::of(0.5) * self.acceleration * self.chip_time, remedy)]
    }
}

/// Position within the sequence.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinarySequence {
    prbs: Prbs<f64>,
    register: u32,
    /// Cycles of one chip, and into the present one.
    chip: u64,
    within: u64,
    /// Position at the chip's start [rad], and the speeds before and after its change [rad/s].
    position: f64,
    from: f64,
    to: f64,
}

impl BinarySequence {
    /// The start of the sequence, at rest; `rate` in cycles a second.
    pub(super) fn new(prbs: Prbs<f64>, rate: f64) -> Self {
        let chip = (libm::rint(prbs.chip_time * rate) as u64).max(1);
        let mut sequence = BinarySequence { prbs, register: 1, chip, within: 0, position: 0.0, from: 0.0, to: 0.0 };
        sequence.to = sequence.draw();
        sequence
    }

    /// The next speed.
    fn draw(&mut self) -> f64 {
        let order = (self.prbs.order as u32).clamp(3, 16);
        let bit = self.register & 1;
        let feedback = (self.register & TAPS[order as usize - 3]).count_ones() & 1;
        self.register = self.register >> 1 | feedback << (order - 1);
        let sign = if bit == 1 { 1.0 } else { -1.0 };
        self.prbs.amplitude * (sign - 1.0 / f64::from((1u32 << order) - 1))
    }

    /// The set-point at a time [s] in the present chip.
    fn at(&self, time: f64) -> Setpoint<f64> {
        let change = self.to - self.from;
        let acceleration = if change < 0.0 { -self.prbs.acceleration } else { self.prbs.acceleration };
        let arrival = change / acceleration;
        if time < arrival {
            let position = self.position + time * (self.from + 0.5 * acceleration * time);
            Setpoint { position, velocity: self.from + acceleration * time, acceleration }
        } else {
            let position = self.position + self.to * time - 0.5 * change * arrival;
            Setpoint { position, velocity: self.to, acceleration: 0.0 }
        }
    }

    /// The set-point of this cycle.
    pub(super) fn next(&mut self, rate: f64) -> Setpoint<f64> {
        if self.within == self.chip {
            let end = self.at(self.chip as f64 / rate);
            (self.position, self.from, self.within) = (end.position, end.velocity, 0);
            self.to = self.draw();
        }
        let setpoint = self.at(self.within as f64 / rate);
        self.within += 1;
        setpoint
    }
}
