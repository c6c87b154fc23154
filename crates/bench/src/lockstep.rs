//! The software of the bench in lockstep with its machine.

use stickslip_core::friction::Stribeck;
use stickslip_core::tick::{Measurement, Tick, TickInput, TickState};
use stickslip_software::cycle::{Change, Command, ExternalTorques, Frame, Parameters, Software};
use stickslip_software::supervise::SafetyState;

use super::io::Io;
use super::tap::{ChangeKind, Changed, Tap};
use super::{Bench, Injection};
use crate::external::{External, ExternalInLoop, role};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};
use stickslip_design as design;

/// Settling time of the load after the set-point has come to rest [s].
pub(super) const SETTLING: f64 = 0.1;

/// The software of the bench in lockstep with a machine. The software computes with the readings at the start of the
/// tick; the voltages of the previous tick act meanwhile.
pub struct LockstepBench<M> {
    pub(super) machine: M,
    model: Model<f64>,
    settings: Settings<f64>,
    software: Software,
    /// Readings at the start of the tick.
    readings: Measurement<f64>,
    /// Recorder or viewer.
    tap: Option<Tap>,
    /// External controller, friction or law.
    external: Option<ExternalInLoop>,
}

impl<M: Io> LockstepBench<M> {
    /// The software for a model and settings, with a machine that has these readings at rest.
    pub(super) fn over(
        model: &Model<f64>,
        settings: &Settings<f64>,
        machine: M,
        readings: Measurement<f64>,
    ) -> Result<Self, Error> {
        design::check_delays(model, settings)?;
        let software = Software::new(design::parameters(model, settings)?, settings.tick_time());
        Ok(LockstepBench { machine, model: *model, settings: *settings, software, readings, tap: None, external: None })
    }

    /// Connects a recorder or viewer; the bench waits for it.
    pub fn tap(&mut self, tap: Tap) {
        self.tap = Some(tap);
    }

    /// Activates an external controller, friction or law. It replaces the corresponding settings of the preset: for a
    /// controller, these are controller, filter, compensation and holding.
    ///
    /// # Errors
    /// Errors of the design of the bench; [`BenchError::FollowsNoFriction`](crate::BenchError::FollowsNoFriction).
    pub fn bring(&mut self, external: External) -> Result<(), Error> {
        let (role, mut parameters) = (external.role(), *self.software.parameters());
        let in_loop = ExternalInLoop::new(external, &self.model, &self.settings)?;
        role::enter(role, true, &mut parameters, &self.model, &self.settings)?;
        self.settings = role::without(role, &self.settings);
        self.external = Some(in_loop);
        self.change(Change::Parameters(parameters))
    }

    /// Removes it: these settings become active again.
    ///
    /// # Errors
    /// Errors of the design of the bench.
    pub fn take_back(&mut self, settings: &Settings<f64>) -> Result<Option<External>, Error> {
        let Some(in_loop) = self.external.take() else { return Ok(None) };
        let mut parameters = *self.software.parameters();
        role::enter(in_loop.external().role(), false, &mut parameters, &self.model, settings)?;
        self.settings = *settings;
        self.change(Change::Parameters(parameters))?;
        Ok(Some(in_loop.into_external()))
    }

    /// Injects a fault.
    ///
    /// # Errors
    /// [`BenchError::Injection`](crate::BenchError::Injection) if the machine is not [`Faulty`](crate::Faulty).
    pub fn inject(&mut self, injection: Injection) -> Result<(), Error> {
        self.machine.inject(injection)?;
        self.report(ChangeKind::Fault(injection));
        Ok(())
    }

    fn report(&self, what: ChangeKind) {
        if let Some(tap) = &self.tap {
            // The listener may have ended.
            let _ = tap.changes.send(Changed { cycle: self.software.cycle(), what });
        }
    }

    /// Inputs of the next tick with this command: parameters, state and readings. A replay or another processor
    /// computes the same result from them.
    pub fn next_tick(&self, command: &Command) -> (Tick<f64>, TickState<f64>, TickInput<f64>) {
        self.software.next_tick(self.readings, command)
    }

    /// Torque of the external controller, friction or law in the next tick. If it fails, supervision brakes.
    fn external_torques(&mut self, command: Option<&Command>) -> ExternalTorques {
        let Some(external) = &mut self.external else { return ExternalTorques::default() };
        let sample = self.software.sample(&self.readings, command);
        match external.torque(&sample, &self.software.parameters().tick) {
            Ok(torque) => torque,
            Err(fault) => {
                let failed = Change::ForeignFailed(external.external().role(), fault);
                // This change is never refused. Reported first, since it is made before this cycle.
                self.report(ChangeKind::Software(failed, None));
                let _ = self.software.change(&failed);
                ExternalTorques::default()
            }
        }
    }

    /// One tick.
    fn tick(&mut self, command: Option<Command>) -> Result<Frame, Error> {
        let acting = self.software.voltages();
        let external = self.external_torques(command.as_ref());
        let frame = self.software.step_with(self.readings, command, external);
        if let Some(tap) = &mut self.tap {
            tap.samples.wait(&frame);
        }
        let fault = |reason: String| Error::BenchFault { cycle: frame.cycle, reason };
        self.readings = self.machine.exchange(acting).map_err(|link| fault(link.to_string()))?;
        self.machine.disturb(&mut self.software);
        match frame.safety {
            SafetyState::Fault(reason) => Err(fault(reason.to_string())),
            _ => Ok(frame),
        }
    }
}

impl<M: Io> Bench for LockstepBench<M> {
    fn model(&self) -> &Model<f64> {
        &self.model
    }

    fn settings(&self) -> &Settings<f64> {
        &self.settings
    }

    fn hand_over(&mut self, command: Command) -> Result<Option<Frame>, Error> {
        self.tick(Some(command)).map(Some)
    }

    fn outstanding(&mut self) -> Result<Option<Frame>, Error> {
        Ok(None)
    }

    fn come_to_rest(&mut self) -> Result<(), Error> {
        // Not `!= 0`: a non-finite set-point never comes to rest.
        while self.tick(None)?.command.setpoint.velocity.abs() > 0.0 {}
        for _ in 0..(SETTLING * self.settings.tick_rate) as u64 {
            self.tick(None)?;
        }
        Ok(())
    }

    fn change(&mut self, change: Change) -> Result<(), Error> {
        let changed = self.software.change(&change);
        self.report(ChangeKind::Software(change, changed.err()));
        Ok(changed?)
    }

    fn parameters(&self) -> &Parameters<f64> {
        self.software.parameters()
    }

    fn safety(&self) -> SafetyState {
        self.software.safety().state()
    }

    fn zero(&self) -> Option<f64> {
        self.software.safety().zero()
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        self.machine.set_preload(preload)?;
        self.report(ChangeKind::Preload(preload));
        Ok(())
    }

    fn preload(&self) -> f64 {
        self.machine.preload()
    }

    fn learn_own(&mut self, own: Stribeck<f64>) {
        self.model.own = own;
    }
}
