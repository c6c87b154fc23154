//! A controller that was brought along, on a bench: what it computes in a sample comes into force when that ends.
//!
//! In the simulation the bench waits for it. By the clock nobody waits: it is asked when a sample begins, and what is not
//! there when the sample ends is late.

use stickslip_core::control::{AxisControl, AxisControlInput};
use stickslip_core::cycle::Sample;
use stickslip_core::supervise::ControllerFault;

use super::{Course, Foreign, ModuleSample};
use crate::preset::{CompensationChoice, ControllerChoice, ControllerMatrices, FilterChoice, Model, Settings};
use crate::{Error, design};
use stickslip_core::control::compensation::Hold;

/// Torque that what stands in for it may have [N m]: the least that a controller can be given.
const NO_TORQUE: f64 = 1e-6;

/// The controller and where it is in its sample.
pub struct Guest {
    foreign: Foreign,
    /// What the bench has in its place: while this is in force, the guest controls.
    stands_in: AxisControl<f64>,
    period: f64,
    torque_limit: f64,
    /// Samples since its begin; none where it has to begin first.
    samples: Option<u64>,
    /// Waits for its sample to end, and in force [N m].
    computed: f64,
    commanded: f64,
    failed: Option<ControllerFault>,
    /// By the clock: it has to begin, and has not been asked to.
    due: bool,
    /// How long it has for a torque [s].
    allowed: f64,
    /// Samples whose torque was not there.
    late: u64,
}

/// Settings with nothing in the place of a controller that is brought along.
pub(crate) fn without_controller(settings: &Settings<f64>) -> Settings<f64> {
    let sampling_time = settings.control_period();
    let nothing = ControllerMatrices { sampling_time, torque_limit: NO_TORQUE, ..ControllerMatrices::default() };
    Settings {
        controller: ControllerChoice::Linear(nothing),
        compensation: CompensationChoice::Nothing,
        filter: FilterChoice::Nothing,
        hold: Hold::Nothing,
        ..*settings
    }
}

impl Guest {
    /// For a bench of these settings, which become those with nothing in its place.
    ///
    /// # Errors
    /// What the design of the bench refuses.
    pub(crate) fn new(foreign: Foreign, model: &Model<f64>, settings: &mut Settings<f64>) -> Result<Self, Error> {
        let (period, torque_limit) = (settings.control_period(), settings.controller.torque_limit());
        *settings = without_controller(settings);
        let stands_in = design::axis_control(model, settings)?;
        Ok(Guest {
            foreign,
            stands_in,
            period,
            torque_limit,
            samples: None,
            computed: 0.0,
            commanded: 0.0,
            failed: None,
            due: false,
            // The tick in which a sample ends begins a tick before that.
            allowed: period - settings.tick_time(),
            late: 0,
        })
    }

    /// The same by the clock: it has begun.
    ///
    /// # Errors
    /// As [`Guest::new`]; [`Error::ForeignRate`] where its samples leave it no time; [`Error::Brought`] where it does not
    /// begin.
    pub(crate) fn by_the_clock(
        foreign: Foreign,
        model: &Model<f64>,
        settings: &mut Settings<f64>,
    ) -> Result<Self, Error> {
        if settings.divider() < 2 && !foreign.answers_at_once() {
            return Err(Error::ForeignRate { tick_rate: settings.tick_rate });
        }
        let mut guest = Self::new(foreign, model, settings)?;
        guest.foreign.begin(guest.period, guest.torque_limit).map_err(Error::Brought)?;
        Ok(guest)
    }

    /// What the bench has in its place.
    pub(crate) fn stands_in(&self) -> AxisControl<f64> {
        self.stands_in
    }

    /// The controller itself.
    pub fn foreign(&self) -> &Foreign {
        &self.foreign
    }

    /// What it failed of.
    pub fn failed(&self) -> Option<ControllerFault> {
        self.failed
    }

    /// How long it has for a torque by the clock [s], and how many were not there in time.
    pub fn lateness(&self) -> (f64, u64) {
        (self.allowed, self.late)
    }

    /// Gives the controller back.
    pub fn into_foreign(self) -> Foreign {
        self.foreign
    }

    /// Its torque in this tick [N m]; `control` is what the bench has in force.
    ///
    /// # Errors
    /// What it fails of, each time it should control; it stays so.
    pub(crate) fn torque(&mut self, sample: &Sample, control: &AxisControl<f64>) -> Result<f64, ControllerFault> {
        if !sample.controls || *control != self.stands_in {
            (self.samples, self.computed, self.commanded) = (None, 0.0, 0.0);
            self.foreign.take_for_begin();
            return Ok(0.0);
        }
        if let Some(fault) = self.failed {
            return Err(fault);
        }
        if sample.begins {
            let computed = self.compute(&sample.input);
            self.fail(computed.err());
            self.computed = computed?;
        }
        if sample.ends {
            self.commanded = self.computed;
        }
        Ok(self.commanded)
    }

    /// Its torque in this tick by the clock [N m]: no wait, no allocation, a system call only where it has to be woken.
    ///
    /// # Errors
    /// As [`torque`](Self::torque); [`ControllerFault::Late`].
    pub(crate) fn torque_by_the_clock(
        &mut self,
        sample: &Sample,
        control: &AxisControl<f64>,
    ) -> Result<f64, ControllerFault> {
        if self.failed.is_some() || !sample.controls || *control != self.stands_in {
            self.due |= self.samples.take().is_some();
            self.commanded = 0.0;
            // Whatever was awaited comes too late to count.
            let course = self.foreign.look();
            self.due |= self.foreign.take_for_begin();
            if let (true, Ok(Course::Nothing), None) = (self.due, course, self.failed) {
                self.foreign.ask_to_begin(self.period, self.torque_limit);
                self.due = false;
            }
            let controls = sample.controls && *control == self.stands_in;
            return self.failed.filter(|_| controls).map_or(Ok(0.0), Err);
        }
        let torque = self.in_time(sample);
        self.fail(torque.err());
        self.late += u64::from(matches!(self.failed, Some(ControllerFault::Late { .. })));
        torque
    }

    fn fail(&mut self, fault: Option<ControllerFault>) {
        self.failed = fault;
        fault.iter().for_each(|_| self.foreign.fail());
    }

    fn in_time(&mut self, sample: &Sample) -> Result<f64, ControllerFault> {
        if sample.begins {
            // What is still awaited is that of a sample whose end was missed, or a begin.
            let course = self.take()?;
            if course == Course::Open && self.samples.is_some() {
                return Err(ControllerFault::Late { time: self.allowed });
            }
            if self.due && course != Course::Open {
                self.foreign.ask_to_begin(self.period, self.torque_limit);
                self.due = false;
            } else if course != Course::Open {
                let samples = self.samples.unwrap_or(0);
                self.samples = Some(samples + 1);
                self.foreign.ask(&self.read(samples, &sample.input));
            }
        }
        if sample.ends && self.take()? == Course::Open {
            return Err(ControllerFault::Late { time: self.allowed });
        }
        Ok(self.commanded)
    }

    /// What has become of what was asked for; a torque is in force.
    fn take(&mut self) -> Result<Course, ControllerFault> {
        let course = self.foreign.look()?;
        if let Course::Torque(torque) = course {
            self.commanded = torque;
        }
        Ok(course)
    }

    /// By the clock: why it was late, where that has become known since.
    pub(crate) fn reason(&mut self) -> Option<ControllerFault> {
        if !matches!(self.failed, Some(ControllerFault::Late { .. })) {
            return None;
        }
        let why = self.foreign.ended()?;
        self.failed = Some(why);
        Some(why)
    }

    fn compute(&mut self, input: &AxisControlInput<f64>) -> Result<f64, ControllerFault> {
        let samples = match self.samples {
            Some(samples) => samples,
            None => {
                self.foreign.begin(self.period, self.torque_limit)?;
                0
            }
        };
        self.samples = Some(samples + 1);
        self.foreign.step(&self.read(samples, input))
    }

    /// What it reads in a sample.
    fn read(&self, samples: u64, input: &AxisControlInput<f64>) -> ModuleSample {
        let AxisControlInput { reference, measured_angle, measured_velocity } = *input;
        ModuleSample {
            time: samples as f64 * self.period,
            reference_position: reference.position,
            reference_velocity: reference.velocity,
            reference_acceleration: reference.acceleration,
            measured_angle,
            measured_velocity,
        }
    }
}
