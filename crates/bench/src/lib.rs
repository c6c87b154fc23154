//! The bench as an experiment sees it: tick by tick, through converters and counters.
//!
//! Experiments are written over [`Bench`] and run unchanged on the virtual machine, in lockstep or in real time, and on
//! hardware. Their only knowledge of the machine is [`Bench::model`].
//!
//! | part | in |
//! |-|-|
//! | software with any [`Io`]: in lockstep, in real time | [`LockstepBench`], [`ClockedBench`] |
//! | machine: virtual, in another process, on a board | [`VirtualBench`], [`remote`] (its frames: `docs/src/frame.md`) |
//! | wrappers of the machine: injected faults | [`faults`] |
//! | loaded controllers, frictions and laws | [`external`] |
//! | parameter sets of a running bench | [`tuning`] |
//! | every cycle and every change, for recorders and viewers | [`tap`] |
//! | record, replay, simulation with other parameters | [`run`] |
//! | real-time performance of the computer | [`realtime`] |
//!
//! A parameter set becomes active on a real-time bench with one cycle: in order after the queued commands, or before
//! all of them (`clocked/immediate.rs`). A record may start in any cycle: `clocked/keyframe.rs` makes the loop write
//! the whole state into preallocated memory.
//!
//! ```
//! use stickslip_base::{Preset, parameters};
//! use stickslip_bench::{Bench as _, Command, VirtualBench};
//!
//! let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
//! let mut bench = VirtualBench::new(&preset, 1)?;
//! let frame = bench.step(Command::default())?;
//! assert!(frame.angle.is_finite());
//! # Ok::<(), stickslip_base::Error>(())
//! ```
#![forbid(unsafe_code)]

pub mod bins;
mod clocked;
mod drives;
mod error;
pub mod external;
pub mod faults;
mod homing;
pub mod io;
mod lockstep;
pub mod realtime;
pub mod remote;
pub mod run;
pub mod segment;
mod servo;
mod speed_ramp;
pub mod tap;
pub mod tuning;
mod virtual_bench;

pub use clocked::{ClockedBench, ImmediateChanges, Keyframe, Keyframes, TimingReport, refusals};
pub use clocked::{keyframe, overrun_sentence};
pub use drives::{DriveSignals, MachineWithDrives, Rating};
pub use error::BenchError;
pub use faults::{Faulty, FaultyBench, Injection};
pub use homing::home;
pub use io::{Arrival, Io, OpenFieldbus, check_preload};
pub use lockstep::LockstepBench;
pub use remote::RemoteBench;
pub use servo::{ServoScaling, ServoSignals};
pub use speed_ramp::SpeedRamp;
pub use stickslip_rt::{Cpu, ThreadSettings, hurry, keep_off};
pub use stickslip_software::cycle::Voltages;
pub use virtual_bench::{InProcess, VirtualBench};

use stickslip_core::control::{AxisControl, PositionController};
use stickslip_core::friction::Stribeck;
use stickslip_core::render::{Correction, Law};
pub use stickslip_software::cycle::{Change, Command, Frame, Parameters};
pub use stickslip_software::supervise::Request;
use stickslip_software::supervise::SafetyState;

use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};
use stickslip_design as design;

/// A bench to experiment on.
///
/// In real time, commands are some ticks ahead of their frames: [`hand_over`](Bench::hand_over) sends a command and
/// returns an available frame, [`outstanding`](Bench::outstanding) returns the remaining frames. In lockstep each
/// command returns its frame at once. In both cases no frame is lost and all are in order.
pub trait Bench {
    /// The controller's model of the machine.
    fn model(&self) -> &Model<f64>;

    /// Settings of the bench.
    fn settings(&self) -> &Settings<f64>;

    /// Sends the command of the next tick; returns the oldest frame that was not fetched yet, if available.
    ///
    /// # Errors
    /// [`Error::BenchFault`] after supervision has removed the torque.
    fn hand_over(&mut self, command: Command) -> Result<Option<Frame>, Error>;

    /// Waits for the next outstanding frame; `None` if all were fetched.
    ///
    /// # Errors
    /// As [`hand_over`](Bench::hand_over).
    fn outstanding(&mut self) -> Result<Option<Frame>, Error>;

    /// Sends no commands until set-point and load have come to rest.
    ///
    /// # Errors
    /// As [`hand_over`](Bench::hand_over).
    fn come_to_rest(&mut self) -> Result<(), Error>;

    /// Makes a change after the queued commands.
    ///
    /// # Errors
    /// [`Error::Refused`] for a request that the state of the bench does not permit.
    fn change(&mut self, change: Change) -> Result<(), Error>;

    /// Parameters of the software after the queued commands.
    fn parameters(&self) -> &Parameters<f64>;

    /// Safety state of the bench.
    fn safety(&self) -> SafetyState;

    /// Encoder angle of the screw's zero [rad], if known.
    fn zero(&self) -> Option<f64>;

    /// Executes one command and returns its frame. Frames that were not fetched are lost.
    ///
    /// # Errors
    /// As [`hand_over`](Bench::hand_over).
    fn step(&mut self, command: Command) -> Result<Frame, Error> {
        let mut last = self.hand_over(command)?;
        while let Some(frame) = self.outstanding()? {
            last = Some(frame);
        }
        Ok(last.expect("every command has a frame or an error"))
    }

    /// Waits for all outstanding frames.
    ///
    /// # Errors
    /// As [`hand_over`](Bench::hand_over).
    fn drain(&mut self, see: &mut dyn FnMut(&Frame)) -> Result<(), Error> {
        while let Some(frame) = self.outstanding()? {
            see(&frame);
        }
        Ok(())
    }

    /// Activates this position controller only, from the next tick on, run every `divider` ticks. It starts with the
    /// present torque.
    ///
    /// # Errors
    /// As [`change`](Bench::change).
    fn set_controller(&mut self, controller: PositionController<f64>, divider: u64) -> Result<(), Error> {
        self.set_control(controller.into(), divider)
    }

    /// The same with its filter, compensation and hold.
    ///
    /// # Errors
    /// As [`change`](Bench::change).
    fn set_control(&mut self, control: AxisControl<f64>, divider: u64) -> Result<(), Error> {
        let mut parameters = *self.parameters();
        (parameters.tick.control, parameters.tick.control_period) =
            (control, self.settings().tick_time() * divider as f64);
        self.change(Change::Parameters(parameters))
    }

    /// Activates a rendering law from the next tick on, with its current control. It starts with the torque of the
    /// previous law.
    ///
    /// # Errors
    /// Errors of the design of the current control.
    fn set_law(&mut self, law: Law<f64>) -> Result<(), Error> {
        let mut parameters = *self.parameters();
        parameters.tick.current = design::load_current_control(&law, self.model(), self.settings())?;
        parameters.tick.law = law;
        self.change(Change::Parameters(parameters))
    }

    /// Activates a correction of the rendering law from the next tick on.
    ///
    /// # Errors
    /// As [`change`](Bench::change).
    fn set_correction(&mut self, correction: Correction<f64>) -> Result<(), Error> {
        let mut parameters = *self.parameters();
        parameters.tick.correction = correction;
        self.change(Change::Parameters(parameters))
    }

    /// Sets the preload of the friction wheel, 0 … 1. On hardware the operator is prompted.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] outside 0 … 1.
    fn set_preload(&mut self, preload: f64) -> Result<(), Error>;

    /// Preload of the friction wheel, 0 … 1.
    fn preload(&self) -> f64;

    /// Sets the own friction of the model to a measured one, friction wheel included.
    fn learn_own(&mut self, own: Stribeck<f64>);
}
