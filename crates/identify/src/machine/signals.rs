//! The columns of a recording as signals of the axis: SI units, on the load's side, on an even grid, and checked.

use crate::IdentifyError;
use std::f64::consts::TAU;
use std::ops::Range;

use super::{Channel, Controller, Machine, Place, understood};
use stickslip_base::Error;
use stickslip_base::quantity::{Estimate, number};
use stickslip_base::units::Dimension::{Angle, AngularVelocity, Counts, Length, Velocity};
use stickslip_base::units::{Dimension, measure, si_factor, unfit};
use stickslip_recording::Recording;

/// Signals of a recording, in SI units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signals {
    /// Sampling period [s].
    pub period: f64,
    /// Measured position [m or rad].
    pub position: Vec<f64>,
    /// Measured velocity [m/s or rad/s].
    pub velocity: Option<Vec<f64>>,
    /// Reference position [m or rad].
    pub reference: Option<Vec<f64>>,
    /// Command of the controller, in its SI unit.
    pub command: Vec<f64>,
    /// Known signal added to it.
    pub injected: Option<Vec<f64>>,
    /// Limits of what the recording determines; whole sentences.
    pub notes: Vec<String>,
    /// What was done to the recording; whole sentences with lines of the file.
    pub findings: Vec<String>,
    /// The command as recorded, where it was held over several rows and `command` is interpolated.
    pub held: Option<Vec<f64>>,
    /// The whole recording, for a figure.
    pub recorded: Recorded,
}

/// A recording as understood: corrected, and before the rows were left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recorded {
    /// Time of each row [s].
    pub time: Vec<f64>,
    /// Position [m or rad].
    pub position: Vec<f64>,
    /// Command, in its SI unit.
    pub command: Vec<f64>,
    /// Rows that were left out.
    pub left_out: Vec<Range<usize>>,
    /// Rows that were corrected.
    pub corrected: Vec<Range<usize>>,
}

/// Share of a command at its extremes above which a limit is suspected, and above which the recording is refused.
const SATURATED: [f64; 2] = [0.01, 0.2];
/// Number of equal samples in a row that indicate a limit instead of a turning point.
const FLAT: usize = 10;

impl Signals {
    /// Input of the drive: command and injected signal.
    pub fn drive_input(&self) -> Vec<f64> {
        match &self.injected {
            Some(injected) => self.command.iter().zip(injected).map(|(u, w)| u + w).collect(),
            None => self.command.clone(),
        }
    }
}

impl Machine {
    /// The signals of a recording, in SI units, on the grid of the sampling period: understood, as far as that is
    /// certain, with what was done in [`Signals::findings`].
    ///
    /// # Errors
    /// A missing column, a bad cell, a unit that does not match, implausible stamps or positions, another period than
    /// the machine's, a signal that never changes, positions in counts with a unit of length, or a command at its limit.
    pub fn signals(&self, recording: &Recording) -> Result<Signals, Error> {
        understood::Reading::of(self, recording)?.signals()
    }

    /// A position of the load, measured at either side of the gear, as it was recorded.
    pub(super) fn position(&self, channel: &Channel, recording: &Recording) -> Result<Vec<f64>, Error> {
        let factor = self.position_factor(channel, recording)?;
        Ok(recording.column(&channel.name)?.values.iter().map(|v| v * factor).collect())
    }

    /// Position of the load per unit of a column [m or rad].
    pub(super) fn position_factor(&self, channel: &Channel, recording: &Recording) -> Result<f64, Error> {
        let place = place(channel, recording);
        let unit = unit(channel, recording)?;
        let fits: &[Dimension] = match (self.axis.position(), self.screw_lead) {
            (Length, Some(_)) => &[Length, Angle, Counts],
            (Length, None) => &[Length, Counts],
            _ => &[Angle, Counts],
        };
        let (dimension, factor) =
            measure(&unit).filter(|(d, _)| fits.contains(d)).ok_or_else(|| unfit(&unit, fits, &place))?;
        Ok(match (dimension, channel.counts_per_rev, self.encoder_grid) {
            (Counts, Some(counts), _) => self.turning(TAU / counts, channel.at),
            (Counts, None, Some(grid)) => grid,
            (Counts, None, None) => {
                let fault = "is in counts of unknown size";
                let remedy = "State counts_per_rev for the column, or encoder_grid for the machine.";
                return Err(recording.doubtful(&channel.name, fault, remedy));
            }
            (Angle, ..) => self.turning(factor, channel.at),
            _ => factor,
        })
    }

    /// A turn in the unit of a column, where that is an angle or in counts of a known number.
    pub(super) fn turn(channel: &Channel, recording: &Recording) -> Result<Option<f64>, Error> {
        Ok(match measure(&unit(channel, recording)?) {
            Some((Angle, factor)) => Some(TAU / factor),
            Some((Counts, _)) => channel.counts_per_rev,
            _ => None,
        })
    }

    /// Velocity of the load per unit of a column [m/s or rad/s].
    pub(super) fn velocity_factor(&self, channel: &Channel, recording: &Recording) -> Result<f64, Error> {
        let unit = unit(channel, recording)?;
        let fits: &[Dimension] = match (self.axis.position(), self.screw_lead) {
            (Length, Some(_)) => &[Velocity, AngularVelocity],
            (Length, None) => &[Velocity],
            _ => &[AngularVelocity],
        };
        let dimension_and_factor = measure(&unit).filter(|(d, _)| fits.contains(d));
        let (dimension, factor) = dimension_and_factor.ok_or_else(|| unfit(&unit, fits, &place(channel, recording)))?;
        Ok(if dimension == AngularVelocity { self.turning(factor, channel.at) } else { factor })
    }

    /// From an angle of motor or screw to the position of the axis.
    fn turning(&self, angle: f64, at: Place) -> f64 {
        let angle = if at == Place::Motor { angle / self.gear_ratio } else { angle };
        match (self.axis.position(), self.screw_lead) {
            (Length, Some(lead)) => angle * lead / TAU,
            _ => angle,
        }
    }

    /// Whole numbers with a unit of length are unconverted counts.
    pub(super) fn check_counts(&self, recording: &Recording) -> Result<(), Error> {
        let channel = &self.columns.position;
        let column = recording.column(&channel.name)?;
        let unit = unit(channel, recording)?;
        let Some((Length | Angle, factor)) = measure(&unit) else { return Ok(()) };
        let is_stated = self.encoder_grid.is_some_and(|grid| (grid / factor - 1.0).abs() < 1e-9);
        let moves = column.values.windows(2).filter(|w| w[0] != w[1]).count();
        // Micrometres are often whole; a file of whole degrees with few steps may come from a coarse sensor.
        if is_stated || factor < 5e-4 || moves <= 20 || column.values.iter().any(|v| v.fract() != 0.0) {
            return Ok(());
        }
        let fault = format!("holds whole numbers only, but its unit is {unit}");
        let remedy = format!(
            "If these are counts of an encoder, write unit = \"counts\" and counts_per_rev; if the sensor steps by \
             whole {unit}, write encoder_grid = {{ value = 1.0, unit = \"{unit}\" }}."
        );
        Err(recording.doubtful(&channel.name, &fault, &remedy))
    }

    /// A note on a command at its extremes.
    pub(super) fn saturation(&self, command: &[f64], recording: &Recording) -> Result<Option<String>, Error> {
        let [low, high] = [f64::min, f64::max].map(|f: fn(f64, f64) -> f64| command.iter().copied().reduce(f));
        let extreme = |v: f64| v != 0.0 && (Some(v) == low || Some(v) == high);
        let flats = command.chunk_by(|a, b| a == b).filter(|run| run.len() >= FLAT && extreme(run[0]));
        let share = flats.map(<[f64]>::len).sum::<usize>() as f64 / command.len() as f64;
        // A staircase or a pseudo-random binary signal is intentionally at its extremes.
        let mut levels: Vec<u64> = command.iter().map(|v| v.to_bits()).collect();
        levels.sort_unstable();
        levels.dedup();
        if share < SATURATED[0] || levels.len() <= 10 {
            return Ok(None);
        }
        let percent = number(100.0 * share, 0);
        let has_limit = self.drive.limit.is_some() || matches!(self.controller, Controller::Cascade(_));
        if share > SATURATED[1] && !has_limit {
            let fault = format!("is at its largest or smallest value in {percent} % of the samples");
            let remedy = "The drive may have been saturated. Move more slowly, or, if the drive follows up to this value, \
                          state it as drive.limit.";
            return Err(recording.doubtful(&self.columns.command.name, &fault, remedy));
        }
        Ok(Some(format!(
            "Force where the command is at its limit, {percent} % of the samples: if the drive is saturated \
             there, inertia and friction come out too large. Accelerate less."
        )))
    }

    /// Difference of two encoders at both ends of the transmission.
    pub(super) fn twist(&self, motor: &[f64], load: &[f64]) -> String {
        let mut differences: Vec<f64> = motor.iter().zip(load).map(|(m, l)| m - l).collect();
        differences.sort_by(f64::total_cmp);
        let at = |share: f64| differences[((differences.len() - 1) as f64 * share) as usize];
        format!(
            "How motor and load move against each other: their encoders differ over a span of {} (99 % of the \
             samples), which is twist, backlash and error of the screw together; the load's is used. Press against a \
             stop with rising torque: backlash jumps, twist grows.",
            Estimate::new(at(0.995) - at(0.005), self.axis.position().si_unit())
        )
    }
}

fn place(channel: &Channel, recording: &Recording) -> String {
    format!("{}: column `{}`", recording.path().display(), channel.name)
}

/// The unit of a column, from the machine file or from the recording.
fn unit(channel: &Channel, recording: &Recording) -> Result<String, Error> {
    let column = recording.column(&channel.name)?;
    match (&channel.unit, &column.unit) {
        (Some(told), Some(header))
            if told != header && (measure(header).is_none() || measure(told) != measure(header)) =>
        {
            Err(IdentifyError::TwoUnits {
                place: place(channel, recording),
                told: told.clone(),
                header: header.clone(),
            }
            .into())
        }
        (Some(unit), _) | (None, Some(unit)) => Ok(unit.clone()),
        (None, None) => Ok(String::new()),
    }
}

/// SI value per unit of a column.
pub(super) fn factor(channel: &Channel, recording: &Recording, dimension: Dimension) -> Result<f64, Error> {
    si_factor(&unit(channel, recording)?, dimension, &place(channel, recording))
}

pub(super) fn values(channel: &Channel, recording: &Recording, dimension: Dimension) -> Result<Vec<f64>, Error> {
    let factor = factor(channel, recording, dimension)?;
    Ok(recording.column(&channel.name)?.values.iter().map(|v| v * factor).collect())
}
