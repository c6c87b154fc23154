//! Correction of a rendering law, from a measurement of the rendered friction.

use crate::Fields;
use crate::block::Block;
use crate::fields::{Relation, at_least};
use crate::scalar::{Mask, Scalar};

/// Number of points of the table.
pub const POINTS: usize = 24;

/// Torque added to that of the active rendering law.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "correction")]
pub enum Correction<T> {
    /// None.
    Nothing,
    /// A torque over the speed.
    Table(CorrectionTable<T>),
}

/// A torque over the speed, equal against both directions of motion.
///
/// ```text
/// M_corr = sign(Ω)·s(|Ω|)·M(ln |Ω|),   s = 0 up to Ω_0, rising to 1 at Ω_1
/// ```
///
/// M is linear in ln Ω between points that are evenly spaced in ln Ω from Ω_1 to Ω_24, and constant beyond. The torque
/// rises from standstill if Ω_0 = 0. If Ω_0 is the Ω_fade of a law, no torque is added in the fade-out interval, and
/// the torque has no step at its limits.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = CorrectionTable::law)]
pub struct CorrectionTable<T> {
    /// Speed up to which nothing is added.
    #[field(symbol = "Ω_0", unit = "rad/s", range = 0.0..=100.0)]
    pub begin: T,
    /// Speed of the first point.
    #[field(symbol = "Ω_1", unit = "rad/s", range = 1e-4..=1e3, default = 0.05)]
    pub slowest: T,
    /// Speed of the last point.
    #[field(symbol = "Ω_24", unit = "rad/s", range = 1e-3..=1e4, default = 50.0)]
    pub fastest: T,
    /// Torques at the points.
    #[field(symbol = "M", unit = "N m", range = -200.0..=200.0)]
    pub torque: [T; POINTS],
}

impl<T: Scalar> CorrectionTable<T> {
    /// The speeds rise by a factor of at least 1.0001.
    fn law(&self) -> [Relation<T>; 2] {
        const APART: f64 = 1.000_1;
        let remedy = "The order must be begin, slowest, fastest, each at least 0.01 % above the one before.";
        [
            at_least("slowest", self.slowest, self.begin * T::of(APART), remedy),
            at_least("fastest", self.fastest, self.slowest * T::of(APART), remedy),
        ]
    }

    /// Torque against positive motion [N m] at a velocity [rad/s]; 0 for NaN.
    #[inline(always)]
    pub fn torque_at(&self, velocity: T) -> T {
        let (speed, zero, one) = (velocity.abs(), T::of(0.0), T::of(1.0));
        let (low, high) = (self.slowest.ln(), self.fastest.ln());
        let within = speed.clamp(self.slowest, self.fastest);
        let place = (within.ln() - low) * (T::of((POINTS - 1) as f64) / (high - low));
        let mut torque = self.torque[0];
        for k in 1..POINTS {
            let share = (place - T::of((k - 1) as f64)).clamp(zero, one);
            torque += (self.torque[k] - self.torque[k - 1]) * share;
        }
        let share = ((speed - self.begin) / (self.slowest - self.begin)).clamp(zero, one);
        // Not `speed ≥ 1e9`: a NaN must give zero.
        speed.lt(T::of(1e9)).select(torque * share * velocity.sign(), zero)
    }
}

impl CorrectionTable<f64> {
    /// Speeds of the points [rad/s].
    pub fn speeds(&self) -> impl Iterator<Item = f64> + use<> {
        let (low, high) = (Scalar::ln(self.slowest), Scalar::ln(self.fastest));
        (0..POINTS).map(move |k| Scalar::exp(low + (high - low) * k as f64 / (POINTS - 1) as f64))
    }
}

/// Inputs of a correction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CorrectionInput<T> {
    /// Velocity of the screw, as used by the law.
    #[field(symbol = "Ω_est", unit = "rad/s")]
    pub velocity: T,
}

/// Outputs of a correction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CorrectionOutput<T> {
    /// Torque for the load motor, against positive motion.
    #[field(symbol = "M_corr", unit = "N m")]
    pub torque: T,
}

impl<T: Scalar> Block<T> for CorrectionTable<T> {
    type State = ();
    type Input = CorrectionInput<T>;
    type Output = CorrectionOutput<T>;

    #[inline(always)]
    fn step(&self, _state: &mut (), input: CorrectionInput<T>, _dt: T) -> CorrectionOutput<T> {
        CorrectionOutput { torque: self.torque_at(input.velocity) }
    }
}

impl<T: Scalar> Correction<T> {
    /// The law's torque [N m] at a velocity [rad/s], corrected.
    #[inline(always)]
    pub fn correct(&self, torque: T, velocity: T, dt: T) -> T {
        match self {
            Correction::Nothing => torque,
            Correction::Table(table) => torque + table.run(&mut (), CorrectionInput { velocity }, dt).torque,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> CorrectionTable<f64> {
        let torque = core::array::from_fn(|k| 0.01 * (k as f64 - 5.0));
        CorrectionTable { begin: 0.3, slowest: 0.5, fastest: 50.0, torque }
    }

    #[test]
    fn each_point_is_met_and_between_two_the_torque_is_linear_in_the_logarithm() {
        let table = table();
        for (k, speed) in table.speeds().enumerate() {
            assert!((table.torque_at(speed) - table.torque[k]).abs() < 1e-15, "{k}");
        }
        let middle = table.torque_at(0.5 * 100f64.powf(7.5 / 23.0));
        assert!((middle - 0.5 * (table.torque[7] + table.torque[8])).abs() < 1e-15, "{middle}");
    }

    #[test]
    fn the_torque_is_odd_zero_in_the_fade_out_and_constant_beyond_the_ends() {
        let table = table();
        for velocity in [0.0, 0.1, 0.3, 0.4, 0.7, 12.0, 49.0, 90.0] {
            assert_eq!(table.torque_at(-velocity), -table.torque_at(velocity), "{velocity}");
        }
        assert_eq!((table.torque_at(0.3), table.torque_at(0.1), table.torque_at(0.0)), (0.0, 0.0, 0.0));
        // In the middle of the rise.
        assert!((table.torque_at(0.4) - 0.5 * table.torque[0]).abs() < 1e-15);
        // The differences of the points add up to the last one, except for rounding.
        assert!((table.torque_at(1e3) - table.torque[POINTS - 1]).abs() < 1e-15);
    }

    #[test]
    fn a_table_of_zeros_has_no_effect_and_a_non_finite_velocity_gives_no_torque() {
        let zeros = Correction::Table(CorrectionTable::default());
        for velocity in [-70.0, -0.1, 0.0, 0.02, 3.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(zeros.correct(0.123, velocity, 1e-3), 0.123, "{velocity}");
            assert_eq!(Correction::Nothing.correct(0.123, velocity, 1e-3), 0.123);
        }
        for velocity in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(table().torque_at(velocity), 0.0);
        }
    }

    #[test]
    fn a_table_whose_speeds_do_not_rise_is_refused() {
        let holds = |table: CorrectionTable<f64>| table.law().map(|law| law.check().is_ok());
        assert_eq!(holds(table()), [true, true]);
        assert_eq!(holds(CorrectionTable { begin: 0.5, ..table() }), [false, true]);
        assert_eq!(holds(CorrectionTable { fastest: 0.5, ..table() }), [true, false]);
    }
}
