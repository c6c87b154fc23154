//! The bench as an experiment sees it: tick by tick, through converters and counters.
//!
//! Experiments are written over [`Bench`] and run unchanged on the virtual machine, in lockstep or in real time, and on
//! hardware. Their only knowledge of the machine is [`Bench::model`].
//!
//! | part | in |
//! |-|-|
//! | software over any [`Io`]: in lockstep, in real time | [`LockstepBench`], [`ClockedBench`] |
//! | machine: virtual, in another process, on a board | [`VirtualBench`], [`remote`] (its frames: `docs/src/frame.md`) |
//! | wrappers of the machine: injected faults | [`faults`] |
//! | loaded controllers, frictions and laws | [`external`] |
//! | parameter sets of a running bench | [`tuning`] |
//! | every cycle and every change, for recorders and viewers | [`tap`] |
//! | record, replay, simulation with other parameters | [`run`] |
//!
//! Parameters enter a real-time bench as one set with one cycle: in order behind the commands, or before all of them
//! (`clocked/urgent.rs`). A record may begin in any cycle: `clocked/keyframe.rs` has the loop write the whole state into
//! memory that was allocated before.
#![forbid(unsafe_code)]

mod clocked;
mod error;
pub mod external;
pub mod faults;
mod homing;
pub mod io;
mod lockstep;
pub mod remote;
pub mod run;
mod speed_ramp;
pub mod tap;
pub mod tuning;
mod virtual_bench;

pub use clocked::{ClockedBench, ImmediateChanges, Keyframe, Keyframes, TimingReport, refusals};
pub use clocked::{keyframe, overrun_sentence};
pub use error::BenchError;
pub use faults::{Faulty, FaultyBench, Injection};
pub use homing::home;
pub use io::{Arrival, Io};
pub use lockstep::LockstepBench;
pub use remote::RemoteBench;
pub use speed_ramp::SpeedRamp;
pub use stickslip_core::cycle::Voltages;
pub use stickslip_rt::{Cpu, ThreadSettings, keep_off};
pub use virtual_bench::{InProcess, VirtualBench};

use stickslip_core::control::PositionController;
pub use stickslip_core::cycle::{Change, Command, Frame, Parameters};
use stickslip_core::friction::Stribeck;
use stickslip_core::render::{Correction, Law};
pub use stickslip_core::supervise::Request;
use stickslip_core::supervise::SafetyState;

use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};
use stickslip_design as design;

/// A bench to experiment on.
///
/// Where it runs by the clock, commands go some ticks ahead of what comes of them: [`hand_over`](Bench::hand_over) gives
/// one and takes what is there, [`outstanding`](Bench::outstanding) fetches the rest. In lockstep each command's frame
/// comes at once. Either way no frame is lost and all come in their order.
pub trait Bench {
    /// What is believed of the machine.
    fn model(&self) -> &Model<f64>;

    /// How the bench runs.
    fn settings(&self) -> &Settings<f64>;

    /// Hands over the command of the next tick; returns the oldest frame that was not fetched yet, if it is there.
    ///
    /// # Errors
    /// [`Error::BenchFault`] once supervision has taken the torque away.
    fn hand_over(&mut self, command: Command) -> Result<Option<Frame>, Error>;

    /// Waits for the next frame of a command that was handed over; none where all were fetched.
    ///
    /// # Errors
    /// As [`hand_over`](Bench::hand_over).
    fn outstanding(&mut self) -> Result<Option<Frame>, Error>;

    /// Hands over nothing until the set-point has come to rest, and the load with it.
    ///
    /// # Errors
    /// As [`hand_over`](Bench::hand_over).
    fn come_to_rest(&mut self) -> Result<(), Error>;

    /// Changes what runs, behind the commands that were handed over.
    ///
    /// # Errors
    /// [`Error::Refused`] for a request that the state of the bench does not admit.
    fn change(&mut self, change: Change) -> Result<(), Error>;

    /// What the software computes with, behind the commands that were handed over.
    fn parameters(&self) -> &Parameters<f64>;

    /// What the bench may do.
    fn safety(&self) -> SafetyState;

    /// Encoder angle of the screw's zero [rad], where known.
    fn zero(&self) -> Option<f64>;

    /// Carries one command out and waits for what comes of it. Frames that were not fetched are lost.
    ///
    /// # Errors
    /// As [`hand_over`](Bench::hand_over).
    fn step(&mut self, command: Command) -> Result<Frame, Error> {
        let mut last = self.hand_over(command)?;
        while let Some(frame) = self.outstanding()? {
            last = Some(frame);
        }
        Ok(last.expect("a command that was handed over has a frame or an error"))
    }

    /// Waits for all frames of commands that were handed over.
    ///
    /// # Errors
    /// As [`hand_over`](Bench::hand_over).
    fn drain(&mut self, see: &mut dyn FnMut(&Frame)) -> Result<(), Error> {
        while let Some(frame) = self.outstanding()? {
            see(&frame);
        }
        Ok(())
    }

    /// This position controller alone in force from the next tick on, run every `divider` ticks; it takes the torque over.
    ///
    /// # Errors
    /// As [`change`](Bench::change).
    fn set_controller(&mut self, controller: PositionController<f64>, divider: u64) -> Result<(), Error> {
        let mut parameters = *self.parameters();
        (parameters.tick.control, parameters.tick.control_period) =
            (controller.into(), self.settings().tick_time() * divider as f64);
        self.change(Change::Parameters(parameters))
    }

    /// The rendering law in force from the next tick on, with the current control that belongs to it. It begins with the
    /// torque of the law before.
    ///
    /// # Errors
    /// What the design of the current control refuses.
    fn set_law(&mut self, law: Law<f64>) -> Result<(), Error> {
        let mut parameters = *self.parameters();
        parameters.tick.current = design::load_current_control(&law, self.model(), self.settings())?;
        parameters.tick.law = law;
        self.change(Change::Parameters(parameters))
    }

    /// What is added to the rendering law from the next tick on.
    ///
    /// # Errors
    /// As [`change`](Bench::change).
    fn set_correction(&mut self, correction: Correction<f64>) -> Result<(), Error> {
        let mut parameters = *self.parameters();
        parameters.tick.correction = correction;
        self.change(Change::Parameters(parameters))
    }

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
