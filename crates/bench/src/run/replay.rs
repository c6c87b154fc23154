//! Replay of a recorded run: the same inputs, the same changes, and a comparison of every bit.
//!
//! The software receives the recorded readings and commands. A virtual machine of the same process is simulated again
//! from its seed with the recorded voltages, and its readings are compared as well. The first difference therefore
//! identifies its source: the machine, or the block of the software with this output.

use crate::BenchError;
use std::fmt;
use std::iter::Peekable;

use stickslip_core::tick::Measurement;
use stickslip_software::cycle::{Change, Parameters, Software, Voltages};

use super::Record;
use super::numbers::Restore;
use super::signals::{Signals, channels};
use crate::faults::Faults;
use crate::io::Io;
use crate::keyframe::keep;
use crate::tap::{ChangeKind, Changed};
use crate::{Faulty, InProcess};
use stickslip_base::{Error, Preset, Watch};

/// Result of a replay.
#[derive(Clone, Debug, PartialEq)]
pub struct Replayed {
    /// Replayed cycles.
    pub cycles: u64,
    /// Cycles of the record.
    pub of: u64,
    /// Whether the machine was also simulated.
    pub machine: bool,
    /// The first difference.
    pub first: Option<Difference>,
    /// Cycles missing in the record after the last replayed one.
    pub lost: u64,
}

impl Replayed {
    /// Whether the whole record was replayed without a difference.
    pub fn identical(&self) -> bool {
        self.first.is_none() && self.cycles == self.of
    }
}

/// Summary in one sentence.
impl fmt::Display for Replayed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = if self.machine { "software and machine" } else { "software" };
        match &self.first {
            Some(first) => write!(
                f,
                "The first difference is in cycle {}, of the {}: {} was {:e}, now it is {:e}.",
                first.cycle, first.block, first.signal, first.recorded, first.replayed
            ),
            None if self.lost > 0 => write!(
                f,
                "{} of {} cycles replayed, {parts} identical; the following {} cycles are missing in the record.",
                self.cycles, self.of, self.lost
            ),
            None => write!(f, "{} cycles replayed, {parts}: every bit is the same.", self.cycles),
        }
    }
}

/// A different value.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Number of the cycle.
    pub cycle: u64,
    /// Block with this output.
    pub block: &'static str,
    /// Signal.
    pub signal: String,
    /// As recorded.
    pub recorded: f64,
    /// As computed now.
    pub replayed: f64,
}

/// Blocks of the signals, in the order of computation.
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
/// [`Error::Cancelled`]; errors of the virtual machine of the record.
pub fn replay(record: &Record, watch: &Watch) -> Result<Replayed, Error> {
    replayed(record, record.cycles.iter().map(|cycle| Ok(*cycle)), record.cycles.len() as u64, watch)
}

/// The same for `of` cycles from an iterator.
pub(super) fn replayed(
    record: &Record,
    cycles: impl Iterator<Item = Result<(u64, Signals<f64>), Error>>,
    of: u64,
    watch: &Watch,
) -> Result<Replayed, Error> {
    let mut bench = ReplayedBench::of(record, record.seed)?;
    let mut result = Replayed { cycles: 0, of, machine: bench.machine.is_some(), first: None, lost: 0 };
    for (k, cycle) in cycles.enumerate() {
        let (cycle, signals) = cycle?;
        if k.is_multiple_of(4096) {
            watch.stage("replay", k as f64 / of as f64)?;
        }
        result.lost = bench.lost(cycle);
        if result.lost > 0 {
            return Ok(result);
        }
        let now = bench.bound(cycle, &signals)?;
        result.first = difference(cycle, &signals, &now);
        if result.first.is_some() {
            return Ok(result);
        }
        result.cycles += 1;
    }
    Ok(result)
}

/// Software and machine of a replay.
pub(super) struct ReplayedBench<'a> {
    software: Software,
    machine: Option<(Faulty<InProcess>, Measurement<f64>)>,
    /// For another machine: effects of its injected faults on the software.
    faults: Faults,
    changes: Peekable<std::vec::IntoIter<&'a Changed>>,
    lost: Peekable<std::slice::Iter<'a, (u64, u64)>>,
}

impl<'a> ReplayedBench<'a> {
    /// At the start of the record; with a virtual machine if there is a seed.
    pub(super) fn of(record: &'a Record, seed: Option<u64>) -> Result<Self, Error> {
        let mut software = Software::new(record.initial, record.tick_time());
        let mut machine = match seed {
            Some(seed) => Some(faulty(&record.preset, seed)?),
            None => None,
        };
        let mut faults = Faults::new(record.preset.model.encoder, record.tick_time());
        if let Some(state) = &record.state {
            restore_state(state, &mut software, &mut machine)?;
            faults = machine.as_ref().map_or(faults, |(machine, _)| machine.faults().clone());
        }
        // The sources of changes report independently: changes are sorted by cycle. Within a cycle those of the machine
        // are first.
        let mut changes: Vec<&Changed> = record.changes.iter().collect();
        changes.sort_by_key(|changed| {
            (changed.cycle, !matches!(changed.what, ChangeKind::Software(Change::MachineFailed(_), _)))
        });
        let changes = changes.into_iter().peekable();
        Ok(ReplayedBench { software, machine, faults, changes, lost: record.lost.iter().peekable() })
    }

    /// Replaces the active parameters.
    pub(super) fn adopt(&mut self, other: impl FnOnce(&Parameters<f64>) -> Parameters<f64>) {
        let parameters = other(self.software.parameters());
        // Parameters are accepted in every state.
        let _ = self.software.change(&Change::Parameters(parameters));
    }

    /// Number of cycles missing directly before this one.
    pub(super) fn lost(&mut self, cycle: u64) -> u64 {
        self.lost.next_if(|(behind, _)| *behind <= cycle).map_or(0, |(_, lost)| *lost)
    }

    /// A cycle with the recorded readings; the result has the readings of a simulated machine.
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

    /// A cycle with these readings; also returns the readings of a simulated machine.
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
            // A refused change is refused again.
            ChangeKind::Software(change, _) => drop(software.change(change)),
            ChangeKind::Preload(preload) => {
                if let Some(machine) = &mut machine {
                    machine.set_preload(*preload)?;
                }
            }
            ChangeKind::Fault(injection) => {
                faults.inject(*injection)?;
                if let Some(machine) = &mut machine {
                    machine.inject(*injection)?;
                }
            }
        }
    }
    Ok(())
}

/// Restores the initial state of a record.
fn restore_state(
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

/// The first different value of a cycle, in the order of computation.
fn difference(cycle: u64, recorded: &Signals<f64>, replayed: &Signals<f64>) -> Option<Difference> {
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
    let (recorded, replayed) = (recorded.row(), replayed.row());
    if recorded.iter().zip(&replayed).all(|(a, b)| same(*a, *b)) {
        return None;
    }
    let names = channels();
    let order = |name: &str| BLOCKS.iter().position(|(signal, _)| *signal == name).unwrap_or(BLOCKS.len());
    let mut different: Vec<usize> = (0..names.len()).filter(|&k| !same(recorded[k], replayed[k])).collect();
    different.sort_by_key(|&k| order(&names[k].path));
    different.first().map(|&k| {
        let signal = names[k].path.clone();
        let block = BLOCKS.get(order(&signal)).map_or("supervision", |(_, block)| block);
        Difference { cycle, block, signal, recorded: recorded[k], replayed: replayed[k] }
    })
}
