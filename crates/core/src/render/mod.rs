//! Rendering laws: which torque the load motor adds, so that the axis feels the desired friction.

mod difference;

pub use difference::DifferenceTorque;

use crate::Fields;
use crate::block::Block;
use crate::scalar::Scalar;

/// The rendering law in force.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "law")]
pub enum Law<T> {
    /// No torque.
    Off,
    /// The static difference torque with fade-out.
    Paper(DifferenceTorque<T>),
}

/// What a rendering law reads.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LawInput<T> {
    /// Estimated velocity of the screw.
    #[field(symbol = "Ω_est", unit = "rad/s")]
    pub estimated_velocity: T,
}

/// What a rendering law gives.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LawOutput<T> {
    /// Torque for the load motor, against positive motion.
    #[field(symbol = "M_diff", unit = "N m")]
    pub torque: T,
}

impl<T: Scalar> Law<T> {
    /// Torque for the load motor, against positive motion [N m], at the estimated velocity of the screw [rad/s].
    #[inline(always)]
    pub fn torque(&self, velocity: T, dt: T) -> T {
        match self {
            Law::Off => T::of(0.0),
            Law::Paper(law) => law.run(&mut (), LawInput { estimated_velocity: velocity }, dt).torque,
        }
    }
}
