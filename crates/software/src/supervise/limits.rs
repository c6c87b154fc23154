//! Limits of supervision.

use stickslip_core::Fields;
use stickslip_core::fields::{Relation, at_least};
use stickslip_core::scalar::Scalar;

/// Limits of supervision. The stroke counts from the screw's zero; currents are torques over the motor's torque
/// constant.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = SafetyLimits::law)]
pub struct SafetyLimits<T> {
    /// Largest distance between set-point and screw.
    #[field(symbol = "e_max", unit = "rad", range = 1e-6..=1e4, default = 1.0)]
    pub following_error: T,
    /// Highest speed of the screw.
    #[field(symbol = "Ω_max", unit = "rad/s", range = 1e-2..=1e4, default = 350.0)]
    pub speed: T,
    /// Lower end of the stroke.
    #[field(symbol = "φ_min", unit = "rad", range = -1e6..=1e6, default = -157.0)]
    pub lower_end: T,
    /// Upper end of the stroke.
    #[field(symbol = "φ_max", unit = "rad", range = -1e6..=1e6, default = 157.0)]
    pub upper_end: T,
    /// Current of the drive above which the screw must move: well above that of breakaway.
    #[field(symbol = "i_f", unit = "A", range = 1e-3..=1e3, default = 8.0)]
    pub moving_current: T,
    /// Velocity of the tacho above which the encoder must count, and allowed difference of tacho and encoder at low
    /// speed.
    #[field(symbol = "Ω_f", unit = "rad/s", range = 1e-2..=1e3, default = 5.0)]
    pub moving_velocity: T,
    /// Allowed time of a constant encoder under these conditions, and of a larger difference of tacho and encoder.
    #[field(symbol = "T_f", unit = "s", range = 1e-3..=10.0, default = 0.05)]
    pub frozen_time: T,
    /// Allowed difference of tacho and encoder at high speed, as a share of the speed.
    #[field(symbol = "r_Ω", unit = "1", range = 1e-3..=1.0, default = 0.1)]
    pub velocity_share: T,
    /// Allowed deviation of two index pulses from whole revolutions: some counts.
    #[field(symbol = "Δφ_i", unit = "rad", range = 1e-6..=1.0, default = 0.02)]
    pub index_deviation: T,
    /// Allowed difference of the accelerations of accelerometer and tacho, without the slow offset.
    #[field(symbol = "Δα", unit = "rad/s^2", range = 1.0..=1e6, default = 400.0)]
    pub acceleration_difference: T,
    /// Allowed time of a larger difference.
    #[field(symbol = "T_α", unit = "s", range = 1e-3..=10.0, default = 0.02)]
    pub acceleration_time: T,
    /// Allowed difference of the load motor's current to its reference.
    #[field(symbol = "Δi", unit = "A", range = 1e-3..=1e3, default = 1.0)]
    pub current_difference: T,
    /// Allowed time of a larger difference.
    #[field(symbol = "T_i", unit = "s", range = 1e-3..=10.0, default = 0.02)]
    pub current_time: T,
    /// Highest current of the drive motor.
    #[field(symbol = "i_max,M", unit = "A", range = 1e-2..=1e3, default = 50.0)]
    pub drive_current: T,
    /// Highest current of the load motor.
    #[field(symbol = "i_max,L", unit = "A", range = 1e-2..=1e3, default = 50.0)]
    pub load_current: T,
    /// Continuous current of the drive motor.
    #[field(symbol = "i_c,M", unit = "A", range = 1e-2..=1e3, default = 10.0)]
    pub drive_continuous_current: T,
    /// Continuous current of the load motor.
    #[field(symbol = "i_c,L", unit = "A", range = 1e-2..=1e3, default = 8.0)]
    pub load_continuous_current: T,
    /// Thermal time constant of a motor's winding.
    #[field(symbol = "T_th", unit = "s", range = 0.1..=1e5, default = 30.0)]
    pub thermal_time: T,
    /// Allowed number of missed ticks in a row: ticks of the software, answers of a machine behind a link, or torques
    /// of an external file.
    #[field(symbol = "n_m", unit = "1", range = 1.0..=1000.0, default = 8.0, whole)]
    pub missed_ticks: T,
    /// Allowed time without a command while the bench has torque; after it the bench stops. 0: no limit, the bench
    /// holds its position.
    #[field(symbol = "T_c", unit = "s", range = 0.0..=3600.0)]
    pub command_time: T,
    /// Deceleration of every stop: of the brake, and of a set-point without commands.
    #[field(symbol = "a_stop", unit = "rad/s^2", range = 1.0..=1e6, default = 600.0)]
    pub stop_deceleration: T,
    /// Speed below which the screw counts as standing: above the tacho's noise.
    #[field(symbol = "Ω_0", unit = "rad/s", range = 1e-3..=100.0, default = 1.0)]
    pub standstill_velocity: T,
    /// Time for which the speed must stay below this value.
    #[field(symbol = "T_0", unit = "s", range = 1e-3..=10.0, default = 0.02)]
    pub standstill_time: T,
}

impl<T: Scalar> SafetyLimits<T> {
    /// The upper end of the stroke is not below the lower end.
    fn law(&self) -> [Relation<T>; 1] {
        [at_least("upper_end", self.upper_end, self.lower_end, "The upper end of the stroke is above the lower one.")]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_without_length_is_refused() {
        let limits = SafetyLimits { lower_end: 1.0, upper_end: -1.0, ..SafetyLimits::<f64>::default() };
        assert_eq!(
            limits.law()[0].check().map_err(|error| (error.field, error.value, error.bound)),
            Err(("upper_end", -1.0, 1.0))
        );
    }
}
