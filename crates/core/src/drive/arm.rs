//! Elastic positioning arm on the carriage: mounted on the virtual machine, or rendered by the load motor.

use super::flow;
use crate::Fields;
use crate::scalar::Scalar;

/// Arm mounted on the carriage.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Arm<T> {
    /// No arm.
    Nothing,
    /// An elastic arm.
    Elastic(ElasticArm<T>),
}

/// Elastic arm, reduced to the screw: a rigid part that moves with the carriage, and one mode, a mass coupled to the
/// carriage by a spring and a damper.
///
/// ```text
/// J_a·φ̈_a = −M_a,   M_a = k_a·(φ_a − φ) + d_a·(φ̇_a − φ̇);   torque on the carriage: M_a − J_r·φ̈
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ElasticArm<T> {
    /// Inertia of the mode.
    #[field(symbol = "J_a", unit = "kg m^2", range = 1e-8..=1.0, default = 1.2e-4)]
    pub inertia: T,
    /// Stiffness. Default: (2π·10 Hz)²·J_a.
    #[field(symbol = "k_a", unit = "N m/rad", range = 1e-4..=1e4, default = 0.474)]
    pub stiffness: T,
    /// Damping.
    #[field(symbol = "d_a", unit = "N m s/rad", range = 0.0..=10.0, default = 1.5e-4)]
    pub damping: T,
    /// Inertia of the part that moves with the carriage.
    #[field(symbol = "J_r", unit = "kg m^2", range = 0.0..=1.0, default = 6e-5)]
    pub rigid_inertia: T,
}

impl<T: Scalar> ElasticArm<T> {
    /// Torque on the carriage [N m], in the positive direction, for the mode's twist [rad] and its rate [rad/s].
    #[inline(always)]
    pub fn torque(&self, twist: T, rate: T) -> T {
        self.stiffness * twist + self.damping * rate
    }

    /// Exact flow of twist and rate over a time [s] in which the velocity of the carriage is constant.
    pub fn flow(&self, time: T) -> [[T; 2]; 2] {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        flow(&[[zero, one], [-self.stiffness / self.inertia, -self.damping / self.inertia]], time)
    }
}

impl ElasticArm<f64> {
    /// Angular frequency of the mode on a fixed carriage [rad/s].
    pub fn angular_frequency(&self) -> f64 {
        libm::sqrt(self.stiffness / self.inertia)
    }
}

impl<T: Scalar> Arm<T> {
    /// Kick in the middle of a step: torque of the mode on the carriage [N m], in the positive direction, and the new
    /// velocity of the arm [rad/s].
    ///
    /// `twist` [rad] is that in the middle; `velocity` [rad/s] is that of the arm, `carriage` [rad/s] that of the
    /// carriage.
    #[inline(always)]
    pub fn kick(&self, twist: T, velocity: T, carriage: T, dt: T) -> (T, T) {
        match self {
            Arm::Nothing => (T::of(0.0), velocity),
            Arm::Elastic(arm) => {
                let torque = arm.torque(twist, velocity - carriage);
                (torque, velocity - torque * dt / arm.inertia)
            }
        }
    }

    /// Inertia that moves with the carriage [kg m²].
    pub fn rigid_inertia(&self) -> T {
        match self {
            Arm::Nothing => T::of(0.0),
            Arm::Elastic(arm) => arm.rigid_inertia,
        }
    }
}
