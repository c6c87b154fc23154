//! The software of the bench in lockstep with its machine.

use stickslip_core::cycle::{Change, Command, ExternalTorques, Frame, Parameters, Software};
use stickslip_core::friction::Stribeck;
use stickslip_core::supervise::SafetyState;
use stickslip_core::tick::{Measurement, Tick, TickInput, TickState};

use super::io::Io;
use super::tap::{Changed, Tap, What};
use super::{Bench, Injection};
use crate::external::{External, ExternalInLoop, role};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};
use stickslip_design as design;

/// How long a load takes to follow a set-point that has come to rest [s].
pub(super) const SETTLING: f64 = 0.1;

/// The software of the bench over a machine that it keeps step with: the software computes on the readings of the
/// tick's begin; what it wrote in the tick before acts meanwhile.
pub struct LockstepBench<M> {
    pub(super) machine: M,
    model: Model<f64>,
    settings: Settings<f64>,
    software: Software,
    /// Readings at the begin of the tick.
    readings: Measurement<f64>,
    /// Who records or watches.
    tap: Option<Tap>,
    /// Who controls the position instead, or gives the friction or the law.
    guest: Option<ExternalInLoop>,
}

impl<M: Io> LockstepBench<M> {
    /// The software for what is believed and set, over a machine with these readings at rest.
    pub(super) fn over(
        model: &Model<f64>,
        settings: &Settings<f64>,
        machine: M,
        readings: Measurement<f64>,
    ) -> Result<Self, Error> {
        let software = Software::new(design::parameters(model, settings)?, settings.tick_time());
        Ok(LockstepBench { machine, model: *model, settings: *settings, software, readings, tap: None, guest: None })
    }

    /// Lets somebody record or watch from now on; the bench waits for it.
    pub fn tap(&mut self, tap: Tap) {
        self.tap = Some(tap);
    }

    /// Lets a file of one's own play its role from now on; what the preset has for it is out of force. Of a controller
    /// these are controller, filter, compensation and holding.
    ///
    /// # Errors
    /// What the design of the bench refuses; [`BenchError::FollowsNoFriction`](crate::BenchError::FollowsNoFriction).
    pub fn bring(&mut self, external: External) -> Result<(), Error> {
        let (role, mut parameters) = (external.role(), *self.software.parameters());
        let guest = ExternalInLoop::new(external, &self.model, &self.settings)?;
        role::enter(role, true, &mut parameters, &self.model, &self.settings)?;
        self.settings = role::without(role, &self.settings);
        self.guest = Some(guest);
        self.change(Change::Parameters(parameters))
    }

    /// Takes it away again: these settings are in force, with what they have in its place.
    ///
    /// # Errors
    /// What the design of the bench refuses.
    pub fn take_back(&mut self, settings: &Settings<f64>) -> Result<Option<External>, Error> {
        let Some(guest) = self.guest.take() else { return Ok(None) };
        let mut parameters = *self.software.parameters();
        role::enter(guest.external().role(), false, &mut parameters, &self.model, settings)?;
        self.settings = *settings;
        self.change(Change::Parameters(parameters))?;
        Ok(Some(guest.into_external()))
    }

    /// Injects a fault.
    ///
    /// # Errors
    /// [`BenchError::Injection`](crate::BenchError::Injection) where the machine is not wrapped for it.
    pub fn inject(&mut self, injection: Injection) -> Result<(), Error> {
        self.machine.inject(injection)?;
        self.tell(What::Fault(injection));
        Ok(())
    }

    fn tell(&self, what: What) {
        if let Some(tap) = &self.tap {
            // Who does not listen any more misses nothing.
            let _ = tap.changes.send(Changed { cycle: self.software.cycle(), what });
        }
    }

    /// What the next tick computes on under this command: the software with its parameters, its state, what it reads.
    /// A replay or another processor that is given the same gives the same.
    pub fn next_tick(&self, command: &Command) -> (Tick<f64>, TickState<f64>, TickInput<f64>) {
        self.software.next_tick(self.readings, command)
    }

    /// Torque of the guest in the next tick; where it fails, supervision brakes.
    fn brought(&mut self, command: Option<&Command>) -> ExternalTorques {
        let Some(guest) = &mut self.guest else { return ExternalTorques::default() };
        let sample = self.software.sample(&self.readings, command);
        match guest.torque(&sample, &self.software.parameters().tick) {
            Ok(torque) => torque,
            Err(fault) => {
                let failed = Change::ForeignFailed(guest.external().role(), fault);
                // It cannot be refused. Told before: it is made before this cycle.
                self.tell(What::Software(failed, None));
                let _ = self.software.change(&failed);
                ExternalTorques::default()
            }
        }
    }

    /// One tick.
    fn tick(&mut self, command: Option<Command>) -> Result<Frame, Error> {
        let acting = self.software.voltages();
        let brought = self.brought(command.as_ref());
        let frame = self.software.step_with(self.readings, command, brought);
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
        // Not `!= 0`: a set-point that is no number never rests.
        while self.tick(None)?.command.setpoint.velocity.abs() > 0.0 {}
        for _ in 0..(SETTLING * self.settings.tick_rate) as u64 {
            self.tick(None)?;
        }
        Ok(())
    }

    fn change(&mut self, change: Change) -> Result<(), Error> {
        let changed = self.software.change(&change);
        self.tell(What::Software(change, changed.err()));
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
        self.tell(What::Preload(preload));
        Ok(())
    }

    fn preload(&self) -> f64 {
        self.machine.preload()
    }

    fn learn_own(&mut self, own: Stribeck<f64>) {
        self.model.own = own;
    }
}
