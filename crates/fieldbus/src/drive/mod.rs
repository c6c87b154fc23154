//! An emulated servo drive after CiA 402: torque, velocity or position as cyclic set-points, limits and faults.

pub(crate) mod state;

use std::collections::VecDeque;
use std::f64::consts::TAU;

use stickslip_bench::Rating;

use self::state::Power;
use crate::coe::object::Objects;
use crate::machine::Shaft;

/// Torque per 0.1 % of the rated torque.
const PER_MILLE: f64 = 1e-3;
/// Speed below which a quick stop has ended [rad/s].
const STANDSTILL: f64 = 0.1;

const CYCLIC_POSITION: i64 = 8;
const CYCLIC_VELOCITY: i64 = 9;
const CYCLIC_TORQUE: i64 = 10;

/// Error codes of [`Drive::fail`].
pub(crate) const OVER_CURRENT: u16 = 0x2310;
pub(crate) const FOLLOWING_ERROR: u16 = 0x8611;
pub(crate) const COMMUNICATION: u16 = 0x7500;

/// Data sheet of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveSheet {
    /// Name in the EEPROM and in object 0x1008.
    pub name: String,
    /// Rated torque [N m]: set-points are in 0.1 % of it.
    pub rated_torque: f64,
    /// Rated current [A].
    pub rated_current: f64,
    /// Counts of the encoder per revolution.
    pub counts_per_revolution: u32,
    /// Gain of the velocity control [N m s/rad], for the modes of velocity and position.
    pub velocity_gain: f64,
    /// Gain of the position control [1/s].
    pub position_gain: f64,
    /// Entries of outputs and inputs that a main device cannot change, up to eight each; `None`: it can map objects.
    pub fixed_mapping: Option<[&'static [u32]; 2]>,
}

/// A fixed mapping of torque drives: with gaps, a torque limit, and set-points of other modes; without touch probe.
pub const FIXED_MAPPING: [&[u32]; 2] = [
    &[0x6040_0010, 0x6060_0008, 0x0000_0008, 0x607A_0020, 0x60FF_0020, 0x6071_0010, 0x6072_0010],
    &[0x603F_0010, 0x6041_0010, 0x6061_0008, 0x0000_0008, 0x6064_0020, 0x606C_0020, 0x6077_0010, 0x60F4_0020],
];

impl DriveSheet {
    /// Sheets of drive motor and load motor for these ratings; `inertia` is that of the whole shaft [kg m²].
    pub fn of_bench(ratings: [Rating; 2], inertia: f64) -> [Self; 2] {
        let named = |name: &str, rating: Rating| DriveSheet {
            name: name.into(),
            rated_torque: rating.torque,
            rated_current: rating.current,
            // Velocity control of 20 Hz.
            velocity_gain: inertia * 125.0,
            ..DriveSheet::default()
        };
        let [motor, load] = ratings;
        [named("stickslip drive motor", motor), named("stickslip load motor", load)]
    }
}

impl Default for DriveSheet {
    fn default() -> Self {
        DriveSheet {
            name: "stickslip emulated drive".into(),
            rated_torque: 0.5,
            rated_current: 5.0,
            counts_per_revolution: 65_536,
            velocity_gain: 0.1,
            position_gain: 20.0,
            fixed_mapping: None,
        }
    }
}

/// Set-points of a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SetPoint {
    mode: i64,
    /// Torque or torque offset [N m].
    torque: f64,
    /// Velocity or velocity offset [rad/s].
    velocity: f64,
    /// Position [counts].
    position: i64,
}

/// A drive.
#[derive(Debug)]
pub(crate) struct Drive {
    sheet: DriveSheet,
    power: Power,
    control: u16,
    error: u16,
    active: SetPoint,
    /// Set-points on their way.
    delayed: VecDeque<SetPoint>,
    /// Integral part of the velocity control [N m].
    integral: f64,
    /// Time with too large a following error [s].
    apart: f64,
    is_limited: bool,
    probe: u16,
}

impl Drive {
    pub(crate) fn new(sheet: &DriveSheet, objects: &mut Objects) -> Self {
        let counts = i64::from(sheet.counts_per_revolution);
        objects.set(0x1000, 0, 0x0002_0192);
        objects.set(0x6075, 0, (sheet.rated_current * 1e3).round() as i64);
        objects.set(0x6076, 0, (sheet.rated_torque * 1e3).round() as i64);
        objects.set(0x608F, 1, counts);
        objects.set(0x6092, 1, counts);
        Drive {
            sheet: sheet.clone(),
            power: Power::SwitchOnDisabled,
            control: 0,
            error: 0,
            active: SetPoint::default(),
            delayed: VecDeque::new(),
            integral: 0.0,
            apart: 0.0,
            is_limited: false,
            probe: 0,
        }
    }

    fn radians(&self, counts: i64) -> f64 {
        counts as f64 * TAU / f64::from(self.sheet.counts_per_revolution)
    }

    fn counts(&self, radians: f64) -> i64 {
        (radians / TAU * f64::from(self.sheet.counts_per_revolution)).floor() as i64
    }

    /// New outputs: state machine and set-points.
    pub(crate) fn cycle(&mut self, objects: &Objects, shaft: &Shaft) {
        let control = objects.number(0x6040, 0) as u16;
        let before = self.power;
        self.power = before.next(control, self.control);
        self.control = control;
        if before == Power::Fault && self.power != Power::Fault {
            self.error = 0;
        }
        if self.power != before {
            (self.integral, self.apart) = (0.0, 0.0);
        }
        let mode = objects.number(0x6060, 0);
        let per_mille = match mode {
            CYCLIC_TORQUE => objects.number(0x6071, 0) + objects.number(0x60B2, 0),
            _ => objects.number(0x60B2, 0),
        };
        let counts = match mode {
            CYCLIC_VELOCITY => objects.number(0x60FF, 0) + objects.number(0x60B1, 0),
            _ => objects.number(0x60B1, 0),
        };
        self.delayed.push_back(SetPoint {
            mode,
            torque: per_mille as f64 * PER_MILLE * self.sheet.rated_torque,
            velocity: self.radians(counts),
            // Without operation the target follows, so that enabling it does not jump.
            position: match self.power {
                Power::OperationEnabled => objects.number(0x607A, 0),
                _ => self.counts(shaft.angle),
            },
        });
        while self.delayed.len() > objects.number(0x2010, 2) as usize {
            self.active = self.delayed.pop_front().unwrap_or_default();
        }
    }

    /// Torque of the motor over the next step of the machine [N m].
    pub(crate) fn torque(&mut self, objects: &Objects, shaft: &Shaft, dt: f64) -> f64 {
        let rated = self.sheet.rated_torque;
        let trip = objects.number(0x2010, 1) as f64 * PER_MILLE * rated;
        if shaft.torque.abs() > trip || !shaft.torque.is_finite() {
            self.fail(OVER_CURRENT);
        }
        let demand = match self.power {
            Power::OperationEnabled => self.demand(objects, shaft, dt),
            Power::QuickStop if shaft.velocity.abs() < STANDSTILL => {
                self.power = Power::SwitchOnDisabled;
                0.0
            }
            Power::QuickStop => -self.sheet.velocity_gain * shaft.velocity,
            _ => 0.0,
        };
        let limit = |index: u16| objects.number(index, 0).min(objects.number(0x6072, 0)) as f64 * PER_MILLE * rated;
        let limited = demand.clamp(-limit(0x60E1), limit(0x60E0));
        self.is_limited = limited != demand;
        if self.power == Power::OperationEnabled || self.power == Power::QuickStop { limited } else { 0.0 }
    }

    fn demand(&mut self, objects: &Objects, shaft: &Shaft, dt: f64) -> f64 {
        let SetPoint { mode, torque, velocity, position } = self.active;
        let velocity = match mode {
            CYCLIC_TORQUE => return torque,
            CYCLIC_VELOCITY => velocity,
            CYCLIC_POSITION => {
                let error = position - self.counts(shaft.angle);
                self.apart = if error.abs() > objects.number(0x6065, 0) { self.apart + dt } else { 0.0 };
                if self.apart * 1e3 > objects.number(0x6066, 0) as f64 {
                    self.fail(FOLLOWING_ERROR);
                    return 0.0;
                }
                velocity + self.sheet.position_gain * self.radians(error)
            }
            _ => return 0.0,
        };
        let error = velocity - shaft.velocity;
        if !self.is_limited {
            self.integral += self.sheet.velocity_gain * self.sheet.position_gain * error * dt;
        }
        torque + self.sheet.velocity_gain * error + self.integral
    }

    /// Switches the power stage off because of a fault; the first error code counts.
    pub(crate) fn fail(&mut self, error: u16) {
        if self.power != Power::Fault {
            (self.power, self.error) = (Power::Fault, error);
        }
    }

    /// The main device has left OP: without set-points the drive is switched off.
    pub(crate) fn release(&mut self) {
        if self.power != Power::Fault {
            self.power = Power::SwitchOnDisabled;
        }
        self.delayed.clear();
        self.active = SetPoint::default();
        self.control = 0;
    }

    /// An index pulse within a step: the touch probe takes its position.
    pub(crate) fn index(&mut self, objects: &mut Objects, shaft: &Shaft) {
        let function = objects.number(0x60B8, 0) as u16;
        // Enabled, at the positive edge, with the index as the source.
        let enabled = function & 0x15 == 0x15;
        self.probe = if enabled { self.probe | 1 } else { 0 };
        let waits = self.probe & 2 == 0 || function & 2 != 0;
        if let Some(angle) = shaft.index.filter(|_| enabled && waits) {
            self.probe |= 2;
            objects.set(0x60BA, 0, self.counts(angle));
        }
        objects.set(0x60B9, 0, i64::from(self.probe));
    }

    /// Writes the actual values.
    pub(crate) fn report(&self, objects: &mut Objects, shaft: &Shaft) {
        let follows = self.power == Power::OperationEnabled && self.active.mode >= CYCLIC_POSITION;
        let position = self.counts(shaft.angle);
        let bits = [(9, true), (4, true), (11, self.is_limited), (12, follows), (13, self.error == FOLLOWING_ERROR)];
        let status = bits.iter().filter(|(_, set)| *set).fold(self.power.status(), |word, (bit, _)| word | 1 << bit);
        let per_mille = (shaft.torque / self.sheet.rated_torque / PER_MILLE).round() as i64;
        objects.set(0x6041, 0, i64::from(status));
        objects.set(0x603F, 0, i64::from(self.error));
        objects.set(0x1001, 0, i64::from(self.error != 0));
        objects.set(0x6061, 0, self.active.mode);
        // The counter has 32 bits and wraps.
        objects.set(0x6064, 0, i64::from(position as i32));
        objects.set(0x606C, 0, self.counts(shaft.velocity));
        objects.set(0x6077, 0, per_mille);
        objects.set(0x6078, 0, per_mille);
        let error = if self.active.mode == CYCLIC_POSITION { self.active.position - position } else { 0 };
        objects.set(0x60F4, 0, error);
    }
}
