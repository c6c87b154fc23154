//! A controller that was brought along, on a bench: what it computes in a sample comes into force when that ends.

use stickslip_core::control::{AxisControl, AxisControlInput};
use stickslip_core::cycle::Sample;
use stickslip_core::supervise::ControllerFault;

use super::{Foreign, ModuleSample};
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
}

impl Guest {
    /// For a bench of these settings, which become those with nothing in its place.
    ///
    /// # Errors
    /// What the design of the bench refuses.
    pub(crate) fn new(foreign: Foreign, model: &Model<f64>, settings: &mut Settings<f64>) -> Result<Self, Error> {
        let (period, torque_limit) = (settings.control_period(), settings.controller.torque_limit());
        let nothing =
            ControllerMatrices { sampling_time: period, torque_limit: NO_TORQUE, ..ControllerMatrices::default() };
        settings.controller = ControllerChoice::Linear(nothing);
        settings.compensation = CompensationChoice::Nothing;
        settings.filter = FilterChoice::Nothing;
        settings.hold = Hold::Nothing;
        let stands_in = design::axis_control(model, settings)?;
        let (samples, failed) = (None, None);
        Ok(Guest { foreign, stands_in, period, torque_limit, samples, computed: 0.0, commanded: 0.0, failed })
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
            return Ok(0.0);
        }
        if let Some(fault) = self.failed {
            return Err(fault);
        }
        if sample.begins {
            let computed = self.compute(&sample.input);
            self.failed = computed.err();
            self.computed = computed?;
        }
        if sample.ends {
            self.commanded = self.computed;
        }
        Ok(self.commanded)
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
        let AxisControlInput { reference, measured_angle, measured_velocity } = *input;
        self.foreign.step(&ModuleSample {
            time: samples as f64 * self.period,
            reference_position: reference.position,
            reference_velocity: reference.velocity,
            reference_acceleration: reference.acceleration,
            measured_angle,
            measured_velocity,
        })
    }
}
