//! A recording as understood: stamps, rows in which the drive moves the axis, and plausible columns.
//!
//! The checks are those of [`stickslip_recording::understand`]; here they meet the roles of the columns. The order
//! matters: rows by time and by `enabled` first, since positions and commands outside are not judged.

use std::ops::Range;

use super::signals::{Recorded, Signals, factor, values};
use super::{Channel, Machine};
use crate::IdentifyError;
use stickslip_base::Error;
use stickslip_base::quantity::{Estimate, number};
use stickslip_base::units::Dimension::Time;
use stickslip_recording::understand::hold::Hold;
use stickslip_recording::understand::order::lag_of_reference;
use stickslip_recording::understand::position::{Continued, Position, unwrap_like};
use stickslip_recording::understand::{Finding, clock, drive, register};
use stickslip_recording::{Recording, resample};

/// Lines of a file that are listed for one finding.
const LISTED: usize = 5;

/// A recording on its way to signals.
pub(super) struct Reading<'a> {
    machine: &'a Machine,
    /// The whole recording.
    whole: &'a Recording,
    /// The rows in use.
    rows: Range<usize>,
    /// Time of all rows [s]; none where the sampling period is stated only.
    time: Option<Vec<f64>>,
    /// Whether samples are interpolated.
    uneven: bool,
    findings: Vec<String>,
    notes: Vec<String>,
    corrected: Vec<Range<usize>>,
}

/// Columns in SI units, of the rows in use.
struct Columns {
    position: Vec<f64>,
    motor: Option<Vec<f64>>,
    velocity: Option<Vec<f64>>,
    reference: Option<Vec<f64>>,
    command: Vec<f64>,
    held: Option<Vec<f64>>,
    injected: Option<Vec<f64>>,
}

impl<'a> Reading<'a> {
    /// Time and rows of a recording.
    pub(super) fn of(machine: &'a Machine, whole: &'a Recording) -> Result<Self, Error> {
        let mut reading = Reading {
            machine,
            whole,
            rows: 0..whole.rows(),
            time: None,
            uneven: machine.resample,
            findings: whole.notes().to_vec(),
            notes: Vec::new(),
            corrected: Vec::new(),
        };
        if !machine.guessed.is_empty() {
            let names = machine.guessed.join(", ");
            reading.findings.push(format!(
                "Guessed by machine init and not checked: {names}. Remove the checked names from `guessed` in the machine file."
            ));
        }
        reading.stamps()?;
        reading.enabled()?;
        Ok(reading)
    }

    fn stamps(&mut self) -> Result<(), Error> {
        let Some(channel) = &self.machine.columns.time else { return Ok(()) };
        let seconds = factor(channel, self.whole, Time)?;
        let ticks = &self.whole.column(&channel.name)?.values;
        let clock = clock::understand(ticks, seconds).map_err(|refusal| self.whole.refuse(&channel.name, &refusal))?;
        self.rows = clock.rows;
        self.uneven |= clock.lost;
        self.list(&channel.name, clock.findings, 0);
        self.time = Some(clock.time);
        Ok(())
    }

    fn enabled(&mut self) -> Result<(), Error> {
        let Some(channel) = &self.machine.columns.enabled else { return Ok(()) };
        let flags = &self.whole.column(&channel.name)?.values[self.rows.clone()];
        let (range, finding) = drive::enabled(flags);
        let Some(range) = range else {
            let remedy = "Check the column: rows with a value above 0.5 are used.";
            return Err(self.whole.doubtful(&channel.name, "is never 1", remedy));
        };
        self.list(&channel.name, finding, self.rows.start);
        self.rows = self.rows.start + range.start..self.rows.start + range.end;
        Ok(())
    }

    /// Takes findings about a column, whose first row is `start`, with their lines in the file.
    fn list(&mut self, column: &str, findings: impl IntoIterator<Item = Finding>, start: usize) {
        for Finding { text, rows } in findings {
            let rows: Vec<_> = rows.into_iter().map(|range| range.start + start..range.end + start).collect();
            let line = |range: &Range<usize>| {
                let [first, last] = [range.start, range.end - 1].map(|row| self.whole.line(row));
                if first == last { first.to_string() } else { format!("{first}–{last}") }
            };
            let mut lines: Vec<String> = rows.iter().take(LISTED).map(line).collect();
            if rows.len() > LISTED {
                lines.push(format!("… ({} places)", rows.len()));
            }
            let place = if lines.is_empty() { String::new() } else { format!(", lines {}", lines.join(", ")) };
            self.findings.push(format!("Column `{column}`{place}: {text}"));
            self.corrected.extend(rows);
        }
    }

    /// The signals.
    pub(super) fn signals(mut self) -> Result<Signals, Error> {
        let (machine, recording) = (self.machine, self.whole.rows_of(self.rows.clone()));
        machine.check_counts(&recording)?;
        let mut columns = self.columns(&recording)?;
        let (clear, findings) = drive::contradictions(&columns.position, &columns.command, machine.vertical);
        self.list(&machine.columns.command.name, findings, self.rows.start);
        let (position, command) = (columns.position.clone(), columns.command.clone());
        columns.cut(&clear);
        let used = self.rows.start + clear.start..self.rows.start + clear.end;
        let recording = self.whole.rows_of(used.clone());
        let recorded = self.recorded(position, command, &used)?;
        if let Some(time) = self.time.take() {
            let time = &time[used];
            self.check_period(time, &recording)?;
            if self.uneven {
                columns.resample(time, machine.sampling_period);
            }
        }
        if let Some(motor) = &columns.motor {
            self.notes.push(machine.twist(motor, &columns.position));
        }
        let roles = &machine.columns;
        for (channel, values) in [(&roles.position, &columns.position), (&roles.command, &columns.command)] {
            if values.iter().all(|v| *v == values[0]) {
                let remedy = "Check the column: the axis must be driven and move.";
                return Err(recording.doubtful(&channel.name, "never changes", remedy));
            }
        }
        self.check_order(&columns, &recording)?;
        self.notes.extend(machine.saturation(&columns.command, &recording)?);
        let Columns { position, velocity, reference, command, held, injected, .. } = columns;
        Ok(Signals {
            period: machine.sampling_period,
            position,
            velocity,
            reference,
            command,
            injected,
            held,
            notes: self.notes,
            findings: self.findings,
            recorded,
        })
    }

    /// All columns in SI units, plausible.
    fn columns(&mut self, recording: &Recording) -> Result<Columns, Error> {
        let machine = self.machine;
        let roles = &machine.columns;
        let position = self.position(&roles.position, recording)?;
        let motor = roles.motor_position.as_ref().map(|channel| self.position(channel, recording)).transpose()?;
        let reference = roles.reference.as_ref().map(|channel| self.reference(channel, recording, &position));
        let reference = reference.transpose()?;
        let velocity = roles.velocity.as_ref().map(|channel| {
            let scale = machine.velocity_factor(channel, recording)?;
            let values = self.register(channel, recording)?;
            Ok::<_, Error>(values.into_iter().map(|v| v * scale).collect())
        });
        let [command, injected] = [Some(&roles.command), roles.injected.as_ref()].map(|channel| {
            let channel = channel?;
            Some(factor(channel, recording, machine.drive.command).and_then(|scale| {
                let values = self.register(channel, recording)?;
                Ok(values.into_iter().map(|v| v * scale).collect::<Vec<f64>>())
            }))
        });
        let command = command.transpose()?.unwrap_or_default();
        let held = self.release(&roles.command.name, &command);
        Ok(Columns {
            position: position.0,
            motor: motor.map(|(values, _)| values),
            velocity: velocity.transpose()?,
            reference,
            command: held.clone().unwrap_or_else(|| command.clone()),
            held: held.map(|_| command),
            injected: injected.transpose()?,
        })
    }

    /// A measured position, and the modulus over which it was continued, both in SI units.
    fn position(&mut self, channel: &Channel, recording: &Recording) -> Result<(Vec<f64>, Option<f64>), Error> {
        let scale = self.machine.position_factor(channel, recording)?;
        let values = &recording.column(&channel.name)?.values;
        let position = Position { values, wraps: channel.wraps, turn: Machine::turn(channel, recording)? };
        let Continued { values, modulus, findings } =
            position.understand().map_err(|refusal| recording.refuse(&channel.name, &refusal))?;
        self.list(&channel.name, findings, self.rows.start);
        let released = self.release(&channel.name, &values).unwrap_or(values);
        Ok((released.into_iter().map(|v| v * scale).collect(), modulus.map(|modulus| modulus * scale)))
    }

    fn reference(
        &self,
        channel: &Channel,
        recording: &Recording,
        (position, modulus): &(Vec<f64>, Option<f64>),
    ) -> Result<Vec<f64>, Error> {
        let mut values = self.machine.position(channel, recording)?;
        if let Some(modulus) = modulus {
            unwrap_like(&mut values, *modulus, position[0]);
        }
        Ok(values)
    }

    /// A column with negative numbers, in its own unit.
    fn register(&mut self, channel: &Channel, recording: &Recording) -> Result<Vec<f64>, Error> {
        let mut values = recording.column(&channel.name)?.values.clone();
        let finding = register::signed(&mut values, channel.wraps);
        self.list(&channel.name, finding, self.rows.start);
        Ok(values)
    }

    /// A held channel between its new values.
    fn release(&mut self, column: &str, values: &[f64]) -> Option<Vec<f64>> {
        let hold = Hold::of(values)?;
        let delay = Estimate::new(hold.delay() * self.machine.sampling_period, "s");
        let text = format!(
            "A new value comes every {} rows only and is held, with a mean delay of {delay}: the rows between were \
             interpolated.",
            number(hold.rows, 1)
        );
        self.list(column, [Finding::everywhere(text)], 0);
        Some(hold.released(values))
    }

    /// The period of the stamps, and whether their steps may be used.
    fn check_period(&mut self, time: &[f64], recording: &Recording) -> Result<(), Error> {
        let spacing = if self.uneven { recording.order(time)? } else { recording.spacing(time)? };
        // Clocks differ by at most 100 ppm; 0.1 % is another sampling rate. A grid for interpolation may be rounded.
        let (found, expected) = (spacing.period, self.machine.sampling_period);
        if (found / expected - 1.0).abs() > if self.uneven { 0.2 } else { 1e-3 } {
            return Err(IdentifyError::OtherPeriod { path: recording.path().to_owned(), found, expected }.into());
        }
        if self.uneven {
            self.notes.push(format!(
                "Motion above about {}: time steps varied, up to {} of the usual one, and the samples were \
                 interpolated on an even grid. Record with a fixed period.",
                Estimate::new((0.125 / expected).round(), "Hz"),
                number(spacing.largest, 1),
            ));
        }
        Ok(())
    }

    /// Refuses a reference that follows the position: no axis moves before its set-point.
    fn check_order(&self, columns: &Columns, recording: &Recording) -> Result<(), Error> {
        let Some((reference, channel)) = columns.reference.as_ref().zip(self.machine.columns.reference.as_ref()) else {
            return Ok(());
        };
        let Some(rows) = lag_of_reference(reference, &columns.position) else { return Ok(()) };
        let lag = Estimate::new(rows as f64 * self.machine.sampling_period, "s");
        let position = &self.machine.columns.position.name;
        let fault = format!("comes {lag} after the position `{position}`, which should follow it");
        let remedy = "If the two columns are swapped, correct [columns]; if the reference is only recorded late, remove it \
                      there.";
        Err(recording.doubtful(&channel.name, &fault, remedy))
    }

    /// The whole recording for a figure: as understood where it was judged, as read elsewhere.
    fn recorded(&self, position: Vec<f64>, command: Vec<f64>, used: &Range<usize>) -> Result<Recorded, Error> {
        let (machine, rows) = (self.machine, self.whole.rows());
        let roles = &machine.columns;
        let time = self.time.clone();
        let is_within = |range: &Range<usize>| range.start >= used.start && range.end <= used.end;
        let mut recorded = Recorded {
            time: time.unwrap_or_else(|| (0..rows).map(|row| row as f64 * machine.sampling_period).collect()),
            position: machine.position(&roles.position, self.whole)?,
            command: values(&roles.command, self.whole, machine.drive.command)?,
            left_out: [0..used.start, used.end..rows].into_iter().filter(|range| !range.is_empty()).collect(),
            corrected: self.corrected.iter().filter(|range| is_within(range)).cloned().collect(),
        };
        recorded.position[self.rows.clone()].copy_from_slice(&position);
        recorded.command[self.rows.clone()].copy_from_slice(&command);
        Ok(recorded)
    }
}

impl Columns {
    fn each(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        let Columns { position, motor, velocity, reference, command, held, injected } = self;
        [position, command].into_iter().chain([motor, velocity, reference, held, injected].into_iter().flatten())
    }

    fn cut(&mut self, rows: &Range<usize>) {
        for values in self.each() {
            *values = values[rows.clone()].to_vec();
        }
    }

    fn resample(&mut self, time: &[f64], period: f64) {
        for values in self.each() {
            *values = resample(time, values, period);
        }
    }
}
