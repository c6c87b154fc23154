//! The bench as an experiment sees it: tick by tick, through converters and counters.
//!
//! Experiments are written over [`Bench`] and run unchanged on the virtual machine, in lockstep or by the clock, and
//! on hardware. What they know of the machine is [`Bench::model`]. [`LockstepBench`] is the software over any [`Io`].

pub(crate) mod io;
mod lockstep;
pub mod remote;
mod traveller;
mod virtual_bench;

pub use io::{Io, Voltages};
pub use lockstep::LockstepBench;
pub use remote::RemoteBench;
pub use traveller::Traveller;
pub use virtual_bench::{InProcess, VirtualBench};

use stickslip_core::control::PositionController;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::friction::Stribeck;
use stickslip_core::render::{Correction, Law};
use stickslip_core::supervise::Safety;
use stickslip_core::tick::{Measurement, TickOutput};

use crate::Error;
use crate::preset::{Model, Settings};

/// What an experiment asks for in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Set-point, counted from the screw's zero once it is known.
    pub setpoint: Setpoint<f64>,
    /// Whether the position controller is on.
    pub control: bool,
    /// Whether the rendering law is on.
    pub render: bool,
    /// Torque added to the controller's [N m].
    pub added_torque: f64,
    /// Torque of the load motor added to the law's, against positive motion [N m].
    pub added_load_torque: f64,
}

/// What an experiment gets in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Number of the tick since the start.
    pub cycle: u64,
    /// Screw angle by the encoder [rad], counted from the screw's zero once it is known.
    pub angle: f64,
    /// The set-point that was followed.
    pub setpoint: Setpoint<f64>,
    /// What the interfaces delivered at the begin of the tick.
    pub measurement: Measurement<f64>,
    /// Everything that the software knows.
    pub signals: TickOutput<f64>,
}

/// A bench to experiment on.
pub trait Bench {
    /// What is believed of the machine.
    fn model(&self) -> &Model<f64>;

    /// How the bench runs.
    fn settings(&self) -> &Settings<f64>;

    /// One tick.
    ///
    /// # Errors
    /// [`Error::BenchFault`] once supervision has taken the torque away.
    fn step(&mut self, command: Command) -> Result<Frame, Error>;

    /// Supervision: requests of the operator, the screw's zero, the state.
    fn safety(&mut self) -> &mut Safety;

    /// The position controller in force from the next tick on, run every `divider` ticks; it takes the torque over.
    fn set_controller(&mut self, controller: PositionController<f64>, divider: u64);

    /// The rendering law in force from the next tick on, with the current control that belongs to it. It begins with the
    /// torque of the law before.
    ///
    /// # Errors
    /// What the design of the current control refuses.
    fn set_law(&mut self, law: Law<f64>) -> Result<(), Error>;

    /// What is added to the rendering law from the next tick on.
    fn set_correction(&mut self, correction: Correction<f64>);

    /// Presses the friction wheel's linings on, 0 … 1. On hardware it asks the operator to do it.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] beyond 0 … 1.
    fn set_preload(&mut self, preload: f64) -> Result<(), Error>;

    /// How far the linings are pressed on.
    fn preload(&self) -> f64;

    /// The load's own friction as just measured, friction wheel included: belief follows measurement.
    fn learn_own(&mut self, own: Stribeck<f64>);
}
