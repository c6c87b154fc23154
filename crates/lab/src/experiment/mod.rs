//! Experiments: named recipes that run on any [`Bench`](crate::bench::Bench).
//!
//! A plan is a struct of parameters, an experiment a function, a result data with uncertainty. The same recipe runs
//! on the virtual bench and on hardware; it may not look into the virtual machine.

mod friction;
mod homing;
mod plan;
mod plateau;
mod rendering;

pub use friction::{FrictionCurve, TORQUE_UNCERTAINTY, measure_friction};
pub use homing::home;
pub use plan::{FrictionPlan, Phase};
pub use plateau::{Block, Dropped, Plateau};
pub use rendering::{
    PreloadAdvice, advise_preload, expected_deviation, expected_inside_fade, predicted_velocity_noise,
    sweep_through_standstill,
};
