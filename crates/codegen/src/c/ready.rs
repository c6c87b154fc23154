//! Blocks whose projects are compiled with this crate: crates that generate code call them without compiling them
//! again.

use stickslip_core::control::compensation::{Compensation, StictionHold};
use stickslip_core::control::{
    AxisControl, Cascade, CurrentControl, LinearController, Pid, PositionController, Predictive, VelocityObserver,
};
use stickslip_core::friction::{FrictionElement, Stribeck};
use stickslip_core::plant::{Machine, VirtualMachine};
use stickslip_core::render::DifferenceTorque;
use stickslip_core::sensor::{Encoder, Pickups};
use stickslip_core::tick::{Decoder, Tick, VirtualBench};

use super::NotAName;
use super::project::{Project, evaluated};
use crate::record::record;

/// A block with its parameters, ready to become a project. The recorded program computes the vectors of its self-test,
/// so that this crate compiles the block only over one kind of number; tests compare them with those of the block.
pub trait Ready {
    /// [`project`](super::project) in `double`.
    ///
    /// # Errors
    /// If the name is not valid in C.
    fn double(&self, name: &str, step: f64) -> Result<Project, NotAName>;

    /// [`project`](super::project) in `float`.
    ///
    /// # Errors
    /// If the name is not valid in C.
    fn single(&self, name: &str, step: f64) -> Result<Project, NotAName>;
}

macro_rules! ready {
    ($($Block:ident),+ $(,)?) => {$(
        impl Ready for $Block<f64> {
            fn double(&self, name: &str, step: f64) -> Result<Project, NotAName> {
                evaluated::<f64>(record::<Self, f64>(self), name, step)
            }

            fn single(&self, name: &str, step: f64) -> Result<Project, NotAName> {
                evaluated::<f32>(record::<Self, f32>(self), name, step)
            }
        }
    )+};
}

ready!(
    AxisControl,
    Cascade,
    Compensation,
    CurrentControl,
    Decoder,
    DifferenceTorque,
    Encoder,
    FrictionElement,
    LinearController,
    Machine,
    Pickups,
    Pid,
    PositionController,
    Predictive,
    StictionHold,
    Stribeck,
    Tick,
    VelocityObserver,
    VirtualBench,
    VirtualMachine,
);
