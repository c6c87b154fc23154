//! An external controller, friction or law in the loop of a bench. The torque computed in a sample becomes active at
//! its end.
//!
//! In the simulation the bench waits for the answer. In real time it does not wait: the torque is requested at the
//! start of a sample and is late if it is missing at the end. The last torque is then held, and no further request is
//! sent before the answer. More missing ticks than permitted for a machine behind a link are a fault. The sample of a
//! controller ends with its last tick; the sample of a friction or law is one tick, and its torque is active from the
//! start of the next tick.

use crate::BenchError;
use stickslip_core::tick::Tick;
use stickslip_software::cycle::{ExternalTorques, Parameters, Sample};
use stickslip_software::supervise::{ExternalFault, Role};

use super::role::{self, Substitute, Turn};
use super::{Course, External, ModuleSample, read};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};

/// The external file and the state of its sample.
pub struct ExternalInLoop {
    external: External,
    /// While this substitute is active, the external file is in the loop.
    substitute: Substitute,
    period: f64,
    tick: f64,
    torque_limit: f64,
    /// Samples since its start; `None` if it must be started first.
    samples: Option<u64>,
    /// Torque of the present sample, and active torque [N m].
    computed: f64,
    commanded: f64,
    failed: Option<ExternalFault>,
    /// In real time: it must be started, and the request is not sent yet.
    due: bool,
    /// Time available to compute a torque [s].
    allowed: f64,
    /// Consecutive ticks with a missing torque, and number of late samples.
    missing: u64,
    late: u64,
}

impl ExternalInLoop {
    /// For a bench with these settings.
    ///
    /// # Errors
    /// Errors of the design of the bench.
    pub(crate) fn new(external: External, model: &Model<f64>, settings: &Settings<f64>) -> Result<Self, Error> {
        let role = external.role();
        let (period, tick) = (role::period(role, settings), settings.tick_time());
        Ok(ExternalInLoop {
            substitute: Substitute::new(role, model, settings)?,
            torque_limit: role::torque_limit(role, model, settings),
            external,
            period,
            tick,
            samples: None,
            computed: 0.0,
            commanded: 0.0,
            failed: None,
            due: false,
            // The last tick of a controller's sample starts one tick before the end.
            allowed: if role == Role::Controller { period - tick } else { period },
            missing: 0,
            late: 0,
        })
    }

    /// For real time: it is already started. If the loop has a real-time priority, the host process gets the next lower
    /// one, so that ordinary threads do not delay the torque.
    ///
    /// # Errors
    /// As [`ExternalInLoop::new`]; [`BenchError::ForeignRate`] if a sample is too short;
    /// [`BenchError::ExternalNotStarted`] if it does not start.
    pub(crate) fn in_real_time(
        external: External,
        model: &Model<f64>,
        settings: &Settings<f64>,
        priority: Option<u8>,
    ) -> Result<Self, Error> {
        if external.role() == Role::Controller && settings.divider() < 2 && !external.answers_at_once() {
            return Err(BenchError::ForeignRate { tick_rate: settings.tick_rate }.into());
        }
        let mut in_loop = Self::new(external, model, settings)?;
        in_loop
            .external
            .begin(in_loop.period, in_loop.torque_limit)
            .map_err(|fault| BenchError::ExternalNotStarted(in_loop.external.fault(fault)))?;
        // Not before: its start may take long.
        if let Some(priority) = priority {
            in_loop.external.hurry(priority.saturating_sub(1), in_loop.period);
        }
        Ok(in_loop)
    }

    /// The external controller, friction or law.
    pub fn external(&self) -> &External {
        &self.external
    }

    /// Its fault.
    pub fn failed(&self) -> Option<ExternalFault> {
        self.failed
    }

    /// Time available to compute a torque in real time [s], and number of late torques.
    pub fn lateness(&self) -> (f64, u64) {
        (self.allowed, self.late)
    }

    /// Returns the external controller, friction or law.
    pub fn into_external(self) -> External {
        self.external
    }

    /// Its torque in this tick; `tick` has the active parameters of the bench.
    ///
    /// # Errors
    /// Its fault, in every tick in which it is in the loop; the fault is permanent.
    pub(crate) fn torque(&mut self, sample: &Sample, tick: &Tick<f64>) -> Result<ExternalTorques, ExternalFault> {
        let torque = self.simulated_torque(sample, &self.substitute.turn(sample, tick))?;
        Ok(role::torques(self.external.role(), torque))
    }

    fn simulated_torque(&mut self, sample: &Sample, turn: &Turn) -> Result<f64, ExternalFault> {
        if !turn.acts {
            (self.samples, self.computed, self.commanded) = (None, 0.0, 0.0);
            self.external.take_for_begin();
            return Ok(0.0);
        }
        if let Some(fault) = self.failed {
            return Err(fault);
        }
        if turn.begins {
            self.commanded = self.computed;
            let computed = self.compute(sample);
            self.fail(computed.err());
            self.computed = computed?;
        }
        if turn.ends {
            self.commanded = self.computed;
        }
        Ok(self.commanded)
    }

    /// Its torque in this tick in real time: no wait, no allocation, a system call only to wake the host process. If
    /// the torque is missing, the last one is held, as the voltages in a missed tick.
    ///
    /// # Errors
    /// As [`torque`](Self::torque); [`ExternalFault::Late`] if it is missing for more consecutive ticks than permitted.
    pub(crate) fn real_time_torque(
        &mut self,
        sample: &Sample,
        parameters: &Parameters<f64>,
    ) -> Result<ExternalTorques, ExternalFault> {
        let turn = self.substitute.turn(sample, &parameters.tick);
        let torque = self.polled_torque(sample, &turn, parameters.safety.missed_ticks)?;
        Ok(role::torques(self.external.role(), torque))
    }

    fn polled_torque(&mut self, sample: &Sample, turn: &Turn, permitted: f64) -> Result<f64, ExternalFault> {
        if self.failed.is_some() || !turn.acts {
            self.due |= self.samples.take().is_some();
            (self.commanded, self.missing) = (0.0, 0);
            // An outstanding answer is discarded.
            let course = self.external.look();
            self.due |= self.external.take_for_begin();
            if let (true, Ok(Course::Nothing), None) = (self.due, course, self.failed) {
                self.external.ask_to_begin(self.period, self.torque_limit);
                self.due = false;
            }
            return self.failed.filter(|_| turn.acts).map_or(Ok(0.0), Err);
        }
        let torque = self.poll(sample, turn).and_then(|()| self.active_torque(permitted));
        self.fail(torque.err());
        torque
    }

    fn fail(&mut self, fault: Option<ExternalFault>) {
        self.failed = fault;
        fault.iter().for_each(|_| self.external.fail());
    }

    /// Sends a request at the start of a sample and takes available answers; a due answer that is not available is
    /// missing.
    fn poll(&mut self, sample: &Sample, turn: &Turn) -> Result<(), ExternalFault> {
        let mut open = false;
        if turn.begins || self.missing > 0 {
            // An outstanding answer belongs to a sample whose end has passed, or to a start, which may take longer.
            let course = self.take()?;
            open = course == Course::Open && (self.samples.is_some() || self.missing > 0);
            if turn.begins && course == Course::Open {
                // No request is sent; its time continues.
                self.samples = self.samples.map(|samples| samples + 1);
            } else if turn.begins && self.due {
                self.external.ask_to_begin(self.period, self.torque_limit);
                self.due = false;
            } else if turn.begins {
                let samples = self.samples.unwrap_or(0);
                self.samples = Some(samples + 1);
                self.external.ask(&self.inputs(samples, sample));
            }
        }
        if turn.ends {
            open = self.take()? == Course::Open;
        }
        self.missing = if open { self.missing + 1 } else { 0 };
        Ok(())
    }

    /// The active torque, unless a torque is missing for more ticks than permitted.
    fn active_torque(&mut self, permitted: f64) -> Result<f64, ExternalFault> {
        if self.missing == 1 {
            self.late += 1;
            self.external.count_late();
        }
        if self.missing > 0 {
            // If no answer can follow, the fault is reported at once.
            self.external.ended().map_or(Ok(()), Err)?;
        }
        if self.missing as f64 > permitted {
            return Err(ExternalFault::Late { time: self.allowed + (self.missing - 1) as f64 * self.tick });
        }
        Ok(self.commanded)
    }

    /// State of the last request; a received torque becomes active.
    fn take(&mut self) -> Result<Course, ExternalFault> {
        let course = self.external.look()?;
        if let Course::Torque(torque) = course {
            self.commanded = torque;
        }
        Ok(course)
    }

    /// In real time: reason of a late torque, if known meanwhile.
    pub(crate) fn reason(&mut self) -> Option<ExternalFault> {
        if !matches!(self.failed, Some(ExternalFault::Late { .. })) {
            return None;
        }
        let reason = self.external.ended()?;
        self.failed = Some(reason);
        Some(reason)
    }

    fn compute(&mut self, sample: &Sample) -> Result<f64, ExternalFault> {
        let samples = match self.samples {
            Some(samples) => samples,
            None => {
                self.external.begin(self.period, self.torque_limit)?;
                0
            }
        };
        self.samples = Some(samples + 1);
        self.external.step(&self.inputs(samples, sample))
    }

    /// Inputs of a sample.
    fn inputs(&self, samples: u64, sample: &Sample) -> ModuleSample {
        let read = read(samples as f64 * self.period, &sample.input);
        match self.external.role() {
            Role::Controller => read,
            Role::Friction | Role::Law => ModuleSample {
                estimated_velocity: sample.estimated_velocity,
                measured_load_torque: sample.measured_load_torque,
                commanded_torque: sample.commanded_torque,
                ..read
            },
        }
    }
}
