//! A drive in the cycle: its outputs and inputs.

use stickslip_bench::segment::DriveRecord;

use super::error::MainDeviceError;
use super::image::{Layout, Place};
use super::mapping::Mapping;
use super::power::{Power, State};
use super::probe::{Probe, Revolutions};
use super::units::Units;

/// Cyclic synchronous torque mode.
pub(crate) const TORQUE_MODE: i32 = 10;

/// A drive with the places of its objects.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    /// Index in the group.
    pub(crate) position: u8,
    pub(crate) units: Units,
    pub(crate) output_length: usize,
    pub(crate) input_length: usize,
    controlword: Place,
    torque: Place,
    mode: Option<Place>,
    probe_function: Option<Place>,
    statusword: Place,
    actual_position: Place,
    actual_velocity: Place,
    actual_torque: Place,
    error: Option<Place>,
    actual_mode: Option<Place>,
    probe_status: Option<Place>,
    probe_position: Option<Place>,
    /// Limits in the outputs, with their values.
    limits: Vec<(Place, i32)>,
    power: Power,
    probe: Probe,
    revolutions: Revolutions,
    function: i32,
    status: u16,
}

/// Signals of a drive.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Signals {
    /// Counter [counts].
    pub(crate) count: i64,
    /// Counter at an index pulse since the last cycle.
    pub(crate) index: Option<i64>,
    /// Velocity [rad/s].
    pub(crate) velocity: f64,
    /// Torque [N m].
    pub(crate) torque: f64,
    /// Error code.
    pub(crate) error: u16,
}

impl Drive {
    /// A drive at a position with this process data.
    pub(crate) fn new(position: u8, mapping: &Mapping, units: Units) -> Result<Self, MainDeviceError> {
        let (outputs, inputs) = (Layout::new(&mapping.outputs), Layout::new(&mapping.inputs));
        let due =
            |layout: &Layout, object: u16| layout.find(object)?.ok_or(MainDeviceError::NotMapped { position, object });
        let limits = mapping.limits.iter().map(|(object, value)| Ok((due(&outputs, *object)?, *value)));
        let limits = limits.collect::<Result<_, MainDeviceError>>()?;
        Ok(Drive {
            position,
            units,
            output_length: outputs.length,
            input_length: inputs.length,
            controlword: due(&outputs, 0x6040)?,
            torque: due(&outputs, 0x6071)?,
            mode: outputs.find(0x6060)?,
            probe_function: outputs.find(0x60B8)?,
            statusword: due(&inputs, 0x6041)?,
            actual_position: due(&inputs, 0x6064)?,
            actual_velocity: due(&inputs, 0x606C)?,
            actual_torque: due(&inputs, 0x6077)?,
            error: inputs.find(0x603F)?,
            actual_mode: inputs.find(0x6061)?,
            probe_status: inputs.find(0x60B9)?,
            probe_position: inputs.find(0x60BA)?,
            limits,
            power: Power::default(),
            probe: Probe::default(),
            revolutions: Revolutions::default(),
            function: 0,
            status: 0,
        })
    }

    /// Writes the outputs. The torque [N m] acts only if the drive is in operation; a quick stop lasts for this number
    /// of cycles at most.
    pub(crate) fn write(&mut self, bytes: &mut [u8], on: bool, torque: f64, patience: u32) {
        let control = self.power.control(self.status, on, patience);
        self.controlword.write(bytes, i32::from(control));
        let torque = if on && self.is_on() { torque / self.units.torque } else { 0.0 };
        let limited = torque.round().clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i32;
        self.torque.write(bytes, self.units.sign * limited);
        self.mode.into_iter().for_each(|place| place.write(bytes, TORQUE_MODE));
        self.limits.iter().for_each(|(place, value)| place.write(bytes, *value));
        self.probe_function.into_iter().for_each(|place| place.write(bytes, self.function));
    }

    /// Reads the inputs.
    pub(crate) fn read(&mut self, bytes: &[u8]) -> Signals {
        self.status = self.statusword.unsigned(bytes) as u16;
        let sign = i64::from(self.units.sign);
        let position = i64::from(self.actual_position.signed(bytes));
        let index = match (self.probe_function, self.probe_status, self.probe_position) {
            (Some(_), Some(status), Some(at)) => {
                let (stored, function) = self.probe.step(status.unsigned(bytes));
                self.function = function;
                stored.then(|| i64::from(at.signed(bytes)))
            }
            _ => self.revolutions.step(position, self.units.revolution as i64),
        };
        if self.actual_mode.is_some_and(|place| place.signed(bytes) != TORQUE_MODE) && self.is_on() {
            // Not in operation with another mode: it would not follow the torque.
            self.status = 0x0023;
        }
        Signals {
            count: sign * position,
            index: index.map(|index| sign * index),
            velocity: f64::from(self.units.sign * self.actual_velocity.signed(bytes)) * self.units.velocity,
            torque: f64::from(self.units.sign * self.actual_torque.signed(bytes)) * self.units.torque,
            error: self.error.map_or(0, |place| place.unsigned(bytes) as u16),
        }
    }

    /// The state in the inputs, for viewers.
    pub(crate) fn record(&self, bytes: &[u8]) -> DriveRecord {
        let statusword = self.statusword.unsigned(bytes) as u16;
        let error = self.error.map_or(0, |place| place.unsigned(bytes) as u16);
        DriveRecord { statusword, state: State::of(statusword).name(), error }
    }

    /// Whether it follows torques.
    pub(crate) fn is_on(&self) -> bool {
        State::of(self.status) == State::OperationEnabled
    }

    /// Whether it has stopped.
    pub(crate) fn is_off(&self) -> bool {
        !matches!(State::of(self.status), State::OperationEnabled | State::QuickStop | State::FaultReaction)
    }
}
