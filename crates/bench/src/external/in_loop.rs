//! What was brought along, on a bench: what it computes in a sample comes into force when that ends.
//!
//! In the simulation the bench waits for it. By the clock nobody waits: it is asked when a sample begins, and what is not
//! there when the sample ends is late. Then the last torque is held, and it is not asked again before it has answered; for
//! as many ticks as a machine behind a link may be silent, and more are a fault. A controller's sample ends with its last tick; that of a friction or a law is one
//! tick, whose torque is in force from the begin of the next.

use crate::BenchError;
use stickslip_core::cycle::{ExternalTorques, Parameters, Sample};
use stickslip_core::supervise::{ExternalFault, Role};
use stickslip_core::tick::Tick;

use super::role::{self, Substitute, Turn};
use super::{Course, External, ModuleSample, read};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};

/// The file and where it is in its sample.
pub struct ExternalInLoop {
    external: External,
    /// While this is in force, it is asked.
    stands_in: Substitute,
    period: f64,
    tick: f64,
    torque_limit: f64,
    /// Samples since its begin; none where it has to begin first.
    samples: Option<u64>,
    /// Waits for its sample to end, and in force [N m].
    computed: f64,
    commanded: f64,
    failed: Option<ExternalFault>,
    /// By the clock: it has to begin, and has not been asked to.
    due: bool,
    /// How long it has for a torque [s].
    allowed: f64,
    /// Ticks in a row in which a torque that is due was not there, and samples with such.
    missing: u64,
    late: u64,
}

impl ExternalInLoop {
    /// For a bench of these settings.
    ///
    /// # Errors
    /// What the design of the bench refuses.
    pub(crate) fn new(external: External, model: &Model<f64>, settings: &Settings<f64>) -> Result<Self, Error> {
        let role = external.role();
        let (period, tick) = (role::period(role, settings), settings.tick_time());
        Ok(ExternalInLoop {
            stands_in: Substitute::new(role, model, settings)?,
            torque_limit: role::torque_limit(role, model, settings),
            external,
            period,
            tick,
            samples: None,
            computed: 0.0,
            commanded: 0.0,
            failed: None,
            due: false,
            // The tick in which a controller's sample ends begins a tick before that.
            allowed: if role == Role::Controller { period - tick } else { period },
            missing: 0,
            late: 0,
        })
    }

    /// The same by the clock: it has begun. A loop of a real-time priority gives a process of its own the next lower one, so
    /// that nothing ordinary comes between question and torque.
    ///
    /// # Errors
    /// As [`ExternalInLoop::new`]; [`BenchError::ForeignRate`] where its samples leave it no time; [`BenchError::ExternalTorques`] where it does not
    /// begin.
    pub(crate) fn in_real_time(
        external: External,
        model: &Model<f64>,
        settings: &Settings<f64>,
        priority: Option<u8>,
    ) -> Result<Self, Error> {
        if external.role() == Role::Controller && settings.divider() < 2 && !external.answers_at_once() {
            return Err(BenchError::ForeignRate { tick_rate: settings.tick_rate }.into());
        }
        let mut guest = Self::new(external, model, settings)?;
        guest
            .external
            .begin(guest.period, guest.torque_limit)
            .map_err(|fault| BenchError::ExternalTorques(guest.external.told(fault)))?;
        // Not before: what it does at its begin may take long.
        if let Some(priority) = priority {
            guest.external.hurry(priority.saturating_sub(1), guest.period);
        }
        Ok(guest)
    }

    /// What was brought along itself.
    pub fn external(&self) -> &External {
        &self.external
    }

    /// What it failed of.
    pub fn failed(&self) -> Option<ExternalFault> {
        self.failed
    }

    /// How long it has for a torque by the clock [s], and how many were not there in time.
    pub fn lateness(&self) -> (f64, u64) {
        (self.allowed, self.late)
    }

    /// Gives it back.
    pub fn into_external(self) -> External {
        self.external
    }

    /// Its torque in this tick; `tick` is what the bench has in force.
    ///
    /// # Errors
    /// What it fails of, each time it is in the loop; it stays so.
    pub(crate) fn torque(&mut self, sample: &Sample, tick: &Tick<f64>) -> Result<ExternalTorques, ExternalFault> {
        let torque = self.waited_for(sample, &self.stands_in.turn(sample, tick))?;
        Ok(role::brought(self.external.role(), torque))
    }

    fn waited_for(&mut self, sample: &Sample, turn: &Turn) -> Result<f64, ExternalFault> {
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

    /// Its torque in this tick by the clock: no wait, no allocation, a system call only where it has to be woken. Where it
    /// is not there when it is due, the last one is held, as the voltages are of a tick that is missed.
    ///
    /// # Errors
    /// As [`torque`](Self::torque); [`ExternalFault::Late`] where it is missing for more ticks in a row than may be missed.
    pub(crate) fn torque_by_the_clock(
        &mut self,
        sample: &Sample,
        parameters: &Parameters<f64>,
    ) -> Result<ExternalTorques, ExternalFault> {
        let turn = self.stands_in.turn(sample, &parameters.tick);
        let torque = self.not_waited_for(sample, &turn, parameters.safety.missed_ticks)?;
        Ok(role::brought(self.external.role(), torque))
    }

    fn not_waited_for(&mut self, sample: &Sample, turn: &Turn, bearable: f64) -> Result<f64, ExternalFault> {
        if self.failed.is_some() || !turn.acts {
            self.due |= self.samples.take().is_some();
            (self.commanded, self.missing) = (0.0, 0);
            // Whatever was awaited comes too late to count.
            let course = self.external.look();
            self.due |= self.external.take_for_begin();
            if let (true, Ok(Course::Nothing), None) = (self.due, course, self.failed) {
                self.external.ask_to_begin(self.period, self.torque_limit);
                self.due = false;
            }
            return self.failed.filter(|_| turn.acts).map_or(Ok(0.0), Err);
        }
        let torque = self.in_time(sample, turn).and_then(|()| self.bear(bearable));
        self.fail(torque.err());
        torque
    }

    fn fail(&mut self, fault: Option<ExternalFault>) {
        self.failed = fault;
        fault.iter().for_each(|_| self.external.fail());
    }

    /// Asks where a sample begins, and takes what is there; what is due and not there is missing.
    fn in_time(&mut self, sample: &Sample, turn: &Turn) -> Result<(), ExternalFault> {
        let mut open = false;
        if turn.begins || self.missing > 0 {
            // What is still awaited is the torque of a sample whose end has passed, or a begin, which may take its time.
            let course = self.take()?;
            open = course == Course::Open && (self.samples.is_some() || self.missing > 0);
            if turn.begins && course == Course::Open {
                // It is not asked: its time goes on.
                self.samples = self.samples.map(|samples| samples + 1);
            } else if turn.begins && self.due {
                self.external.ask_to_begin(self.period, self.torque_limit);
                self.due = false;
            } else if turn.begins {
                let samples = self.samples.unwrap_or(0);
                self.samples = Some(samples + 1);
                self.external.ask(&self.read(samples, sample));
            }
        }
        if turn.ends {
            open = self.take()? == Course::Open;
        }
        self.missing = if open { self.missing + 1 } else { 0 };
        Ok(())
    }

    /// The torque in force, where no other one is missing for longer than is bearable [ticks].
    fn bear(&mut self, bearable: f64) -> Result<f64, ExternalFault> {
        if self.missing == 1 {
            self.late += 1;
            self.external.count_late();
        }
        if self.missing > 0 {
            // Where it is known that none will come, nothing is to be waited for.
            self.external.ended().map_or(Ok(()), Err)?;
        }
        if self.missing as f64 > bearable {
            return Err(ExternalFault::Late { time: self.allowed + (self.missing - 1) as f64 * self.tick });
        }
        Ok(self.commanded)
    }

    /// What has become of what was asked for; a torque is in force.
    fn take(&mut self) -> Result<Course, ExternalFault> {
        let course = self.external.look()?;
        if let Course::Torque(torque) = course {
            self.commanded = torque;
        }
        Ok(course)
    }

    /// By the clock: why it was late, where that has become known since.
    pub(crate) fn reason(&mut self) -> Option<ExternalFault> {
        if !matches!(self.failed, Some(ExternalFault::Late { .. })) {
            return None;
        }
        let why = self.external.ended()?;
        self.failed = Some(why);
        Some(why)
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
        self.external.step(&self.read(samples, sample))
    }

    /// What it reads in a sample.
    fn read(&self, samples: u64, sample: &Sample) -> ModuleSample {
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
