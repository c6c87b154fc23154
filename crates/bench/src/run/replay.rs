//! A recorded run once more: the same inputs, the same changes, and every bit compared.
//!
//! The software is given what the record says that it read and was asked for. Where the machine was the virtual one in
//! the same process, it is simulated again from its seed, under the recorded voltages, and what it delivers is compared
//! as well. So a first difference is where it came from: the machine, or the block of the software whose output it is.

use crate::BenchError;
use std::fmt;
use std::iter::Peekable;

use stickslip_core::cycle::{Change, Parameters, Software, Voltages};
use stickslip_core::tick::Measurement;

use super::Record;
use super::numbers::Restore;
use super::signals::{Signals, channels};
use crate::faults::Faults;
use crate::io::Io;
use crate::keyframe::keep;
use crate::tap::{Changed, What};
use crate::{Faulty, InProcess};
use stickslip_base::{Error, Preset, Watch};

/// What a replay found.
#[derive(Clone, Debug, PartialEq)]
pub struct Replayed {
    /// Cycles that were replayed.
    pub cycles: u64,
    /// Cycles of the record.
    pub of: u64,
    /// Whether the machine was simulated again as well.
    pub machine: bool,
    /// Where the first difference is.
    pub first: Option<Difference>,
    /// Cycles that the record lacks behind the last one that was replayed.
    pub lost: u64,
}

impl Replayed {
    /// Whether the whole record was replayed and every bit is the same.
    pub fn identical(&self) -> bool {
        self.first.is_none() && self.cycles == self.of
    }
}

/// In a sentence.
impl fmt::Display for Replayed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whom = if self.machine { "software and machine" } else { "software" };
        match &self.first {
            Some(first) => write!(
                f,
                "The first difference is in cycle {}, of the {}: {} was {:e}, now it is {:e}.",
                first.cycle, first.block, first.signal, first.recorded, first.replayed
            ),
            None if self.lost > 0 => write!(
                f,
                "{} of {} cycles replayed, {whom} to the bit; then {} cycles are not in the record.",
                self.cycles, self.of, self.lost
            ),
            None => write!(f, "{} cycles replayed, {whom}: every bit is the same.", self.cycles),
        }
    }
}

/// A value that is not the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The cycle.
    pub cycle: u64,
    /// Whose output it is.
    pub block: &'static str,
    /// The signal.
    pub signal: String,
    /// As recorded.
    pub recorded: f64,
    /// As computed now.
    pub replayed: f64,
}

/// Whose output a signal is, in the order in which a cycle computes them.
const BLOCKS: [(&str, &str); 17] = [
    ("measurement.count", "machine"),
    ("measurement.index", "machine"),
    ("measurement.latch", "machine"),
    ("measurement.tacho_voltage", "machine"),
    ("measurement.accelerometer_voltage", "machine"),
    ("measurement.current_voltage", "machine"),
    ("software.measured_angle", "decoder"),
    ("software.index_angle", "decoder"),
    ("software.index", "decoder"),
    ("software.measured_motor_velocity", "scaling"),
    ("software.measured_load_torque", "scaling"),
    ("software.estimated_velocity", "velocity observer"),
    ("software.acceleration_offset", "velocity observer"),
    ("software.commanded_torque", "position controller"),
    ("software.servo_voltage", "position controller"),
    ("software.difference_torque", "rendering law"),
    ("software.amplifier_voltage", "current control"),
];

/// Replays a record.
///
/// # Errors
/// [`Error::Cancelled`]; what the virtual machine of the record refuses.
pub fn replay(record: &Record, watch: &Watch) -> Result<Replayed, Error> {
    replayed(record, record.cycles.iter().map(|cycle| Ok(*cycle)), record.cycles.len() as u64, watch)
}

/// The same for a record whose cycles come one after the other, so many.
pub(super) fn replayed(
    record: &Record,
    cycles: impl Iterator<Item = Result<(u64, Signals<f64>), Error>>,
    of: u64,
    watch: &Watch,
) -> Result<Replayed, Error> {
    let mut again = Again::of(record, record.seed)?;
    let mut result = Replayed { cycles: 0, of, machine: again.machine.is_some(), first: None, lost: 0 };
    for (k, cycle) in cycles.enumerate() {
        let (cycle, signals) = cycle?;
        if k.is_multiple_of(4096) {
            watch.stage("replay", k as f64 / of as f64)?;
        }
        result.lost = again.lost(cycle);
        if result.lost > 0 {
            return Ok(result);
        }
        let now = again.bound(cycle, &signals)?;
        result.first = difference(cycle, &signals, &now);
        if result.first.is_some() {
            return Ok(result);
        }
        result.cycles += 1;
    }
    Ok(result)
}

/// Software and machine of a record, once more.
pub(super) struct Again<'a> {
    software: Software,
    machine: Option<(Faulty<InProcess>, Measurement<f64>)>,
    /// Of a machine elsewhere: what its faults did to the software.
    faults: Faults,
    changes: Peekable<std::vec::IntoIter<&'a Changed>>,
    lost: Peekable<std::slice::Iter<'a, (u64, u64)>>,
}

impl<'a> Again<'a> {
    /// At the begin of the record; with a virtual machine where there is a seed for it.
    pub(super) fn of(record: &'a Record, seed: Option<u64>) -> Result<Self, Error> {
        let mut software = Software::new(record.initial, record.tick_time());
        let mut machine = match seed {
            Some(seed) => Some(faulty(&record.preset, seed)?),
            None => None,
        };
        let mut faults = Faults::new(record.preset.model.encoder, record.tick_time());
        if let Some(state) = &record.state {
            put_back(state, &mut software, &mut machine)?;
            faults = machine.as_ref().map_or(faults, |(machine, _)| machine.faults().clone());
        }
        // Those who change something tell it each for himself: the order is that of the cycles. Within one the machine
        // comes first.
        let mut changes: Vec<&Changed> = record.changes.iter().collect();
        changes.sort_by_key(|changed| {
            (changed.cycle, !matches!(changed.what, What::Software(Change::MachineFailed(_), _)))
        });
        let changes = changes.into_iter().peekable();
        Ok(Again { software, machine, faults, changes, lost: record.lost.iter().peekable() })
    }

    /// Makes other parameters of those in force.
    pub(super) fn adopt(&mut self, other: impl FnOnce(&Parameters<f64>) -> Parameters<f64>) {
        let parameters = other(self.software.parameters());
        // None of its states refuses parameters.
        let _ = self.software.change(&Change::Parameters(parameters));
    }

    /// Cycles that are missing right before this one.
    pub(super) fn lost(&mut self, cycle: u64) -> u64 {
        self.lost.next_if(|(behind, _)| *behind <= cycle).map_or(0, |(_, lost)| *lost)
    }

    /// A cycle with the readings of the record; those of a simulated machine are what it delivers now.
    fn bound(&mut self, cycle: u64, recorded: &Signals<f64>) -> Result<Signals<f64>, Error> {
        let (mut now, readings) = self.cycle(cycle, recorded, recorded.measurement)?;
        if let Some(readings) = readings {
            now.measurement = readings;
        }
        Ok(now)
    }

    /// A cycle with the readings of the simulated machine.
    pub(super) fn free(&mut self, cycle: u64, recorded: &Signals<f64>) -> Result<Signals<f64>, Error> {
        let readings = self.machine.as_ref().map_or(recorded.measurement, |(_, readings)| *readings);
        Ok(self.cycle(cycle, recorded, readings)?.0)
    }

    /// A cycle with these readings, and those that a simulated machine had for it.
    fn cycle(
        &mut self,
        cycle: u64,
        recorded: &Signals<f64>,
        read: Measurement<f64>,
    ) -> Result<(Signals<f64>, Option<Measurement<f64>>), Error> {
        while self.software.cycle() < cycle {
            self.apply()?;
            self.software.miss();
        }
        self.apply()?;
        let acting = self.software.voltages();
        let frame = self.software.step(read, Some(recorded.command()));
        let readings = match &mut self.machine {
            Some((machine, readings)) => Some(std::mem::replace(readings, next(machine, acting)?)),
            None => None,
        };
        self.faults.begin(acting, &read);
        self.faults.disturb(&mut self.software);
        Ok((Signals::of(&frame), readings))
    }

    fn apply(&mut self) -> Result<(), Error> {
        let machine = self.machine.as_mut().map(|(machine, _)| machine);
        apply(&mut self.changes, &mut self.software, machine, &mut self.faults)
    }
}

/// Makes the changes before the next cycle.
fn apply<'a>(
    changes: &mut Peekable<impl Iterator<Item = &'a Changed>>,
    software: &mut Software,
    machine: Option<&mut Faulty<InProcess>>,
    faults: &mut Faults,
) -> Result<(), Error> {
    let mut machine = machine;
    while let Some(changed) = changes.next_if(|changed| changed.cycle <= software.cycle()) {
        match &changed.what {
            // What was refused then is refused again.
            What::Software(change, _) => drop(software.change(change)),
            What::Preload(preload) => {
                if let Some(machine) = &mut machine {
                    machine.set_preload(*preload)?;
                }
            }
            What::Fault(injection) => {
                faults.inject(*injection)?;
                if let Some(machine) = &mut machine {
                    machine.inject(*injection)?;
                }
            }
        }
    }
    Ok(())
}

/// The state of a record that does not begin with the first cycle.
fn put_back(
    state: &[f64],
    software: &mut Software,
    machine: &mut Option<(Faulty<InProcess>, Measurement<f64>)>,
) -> Result<(), Error> {
    let mut restore = Restore::new(state);
    let mut unread = Measurement::default();
    let (machine, readings) = match machine {
        Some((machine, readings)) => (Some(machine as &mut dyn Io), readings),
        None => (None, &mut unread),
    };
    keep(&mut restore, software, readings, machine);
    if restore.fits() { Ok(()) } else { Err(BenchError::RecordState.into()) }
}

fn faulty(preset: &Preset<f64>, seed: u64) -> Result<(Faulty<InProcess>, Measurement<f64>), Error> {
    let (machine, readings) = InProcess::new(preset, seed)?;
    Ok((Faulty::new(machine, readings, preset.model.encoder, preset.bench.tick_time()), readings))
}

fn next(machine: &mut Faulty<InProcess>, acting: Voltages<f64>) -> Result<Measurement<f64>, Error> {
    machine.exchange(acting).map_err(|fault| Error::BenchFault { cycle: 0, reason: fault.to_string() })
}

/// The first value of a cycle that is not the same, in the order in which it is computed.
fn difference(cycle: u64, recorded: &Signals<f64>, replayed: &Signals<f64>) -> Option<Difference> {
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
    let (recorded, replayed) = (recorded.row(), replayed.row());
    if recorded.iter().zip(&replayed).all(|(a, b)| same(*a, *b)) {
        return None;
    }
    let names = channels();
    let order = |name: &str| BLOCKS.iter().position(|(known, _)| *known == name).unwrap_or(BLOCKS.len());
    let mut apart: Vec<usize> = (0..names.len()).filter(|&k| !same(recorded[k], replayed[k])).collect();
    apart.sort_by_key(|&k| order(&names[k].path));
    apart.first().map(|&k| {
        let signal = names[k].path.clone();
        let block = BLOCKS.get(order(&signal)).map_or("supervision", |(_, block)| block);
        Difference { cycle, block, signal, recorded: recorded[k], replayed: replayed[k] }
    })
}
