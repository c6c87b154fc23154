//! An elastic positioning arm on the carriage.

use crate::Fields;
use crate::scalar::Scalar;

/// What is mounted on the carriage.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Arm<T> {
    /// Nothing.
    Nothing,
    /// An elastic arm.
    Elastic(ElasticArm<T>),
}

/// One mode of an arm, reduced to the screw: a mass on a spring that the carriage drags along.
///
/// ```text
/// J_a·φ̈_a = −M_a,   M_a = k_a·(φ_a − φ) + d_a·(φ̇_a − φ̇);   the carriage feels +M_a
/// ```
///
/// The part of the arm that moves rigidly with the carriage belongs to J_L.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ElasticArm<T> {
    /// Inertia of the mode.
    #[field(symbol = "J_a", unit = "kg m^2", range = 1e-8..=1.0, default = 1.2e-4)]
    pub inertia: T,
    /// Stiffness; (2π·10 Hz)²·J_a.
    #[field(symbol = "k_a", unit = "N m/rad", range = 1e-4..=1e4, default = 0.474)]
    pub stiffness: T,
    /// Damping.
    #[field(symbol = "d_a", unit = "N m s/rad", range = 0.0..=10.0, default = 1.5e-4)]
    pub damping: T,
}

impl<T: Scalar> Arm<T> {
    /// Kick at the middle of a step: torque on the carriage [N m] with positive motion, and the arm's new velocity.
    ///
    /// `twist` [rad] at the middle, `velocity` of the arm and `carriage` of the carriage [rad/s].
    #[inline(always)]
    pub fn kick(&self, twist: T, velocity: T, carriage: T, dt: T) -> (T, T) {
        match self {
            Arm::Nothing => (T::of(0.0), velocity),
            Arm::Elastic(arm) => {
                let torque = arm.stiffness * twist + arm.damping * (velocity - carriage);
                (torque, velocity - torque * dt / arm.inertia)
            }
        }
    }
}
