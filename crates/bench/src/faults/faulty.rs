//! A machine with injected faults of its readings, amplifiers and clock.

use crate::BenchError;
use stickslip_core::snapshot::{StateVisitor, choice, count, fields, flag};
use stickslip_core::tick::{Decoder, Measurement};
use stickslip_software::cycle::{Software, Voltages};

use super::{Injection, Kind};
use crate::io::Io;
use crate::remote::LinkFault;
use crate::{InProcess, LockstepBench};
use stickslip_base::{Error, Preset};

/// Maximum number of injected faults: they are injected inside the deadline, without allocation.
const ROOM: usize = 16;

/// The injected faults. Separate from a machine, for replays of a run with another machine.
#[derive(Clone, Debug)]
pub(crate) struct Faults {
    injected: Vec<Injected>,
    /// Decoder of the counter.
    decoder: Decoder<f64>,
    tick_time: f64,
    /// Ticks of the machine since the start.
    tick: u64,
    /// Disturbances of the software after this tick.
    missed: u64,
    controller_nan: bool,
}

#[derive(Clone, Copy, Debug)]
struct Injected {
    injection: Injection,
    /// Set in its first tick: the written voltages, and the readings of the previous tick.
    start: Option<(Voltages<f64>, Measurement<f64>)>,
    /// Unwrapped counts of the healthy counter since then; its last counts.
    counts: f64,
    last: f64,
}

impl Injected {
    fn keep(&mut self, keep: &mut dyn StateVisitor) {
        let Injected { injection: Injection { kind, value, at }, start, counts, last } = self;
        let place = Kind::all().position(|other| other == *kind).unwrap_or(0);
        let place = choice(keep, place, Kind::all().count());
        *kind = Kind::all().nth(place).unwrap_or(*kind);
        let mut active = start.is_some();
        let (mut voltages, mut before) = start.unwrap_or_default();
        flag(keep, &mut active);
        fields(keep, &mut voltages);
        fields(keep, &mut before);
        *start = active.then_some((voltages, before));
        [value, at, counts, last].into_iter().for_each(|number| keep.number(number));
    }
}

impl Faults {
    pub(crate) fn new(decoder: Decoder<f64>, tick_time: f64) -> Self {
        let injected = Vec::with_capacity(ROOM);
        Faults { injected, decoder, tick_time, tick: 0, missed: 0, controller_nan: false }
    }

    pub(crate) fn inject(&mut self, injection: Injection) -> Result<(), Error> {
        if self.injected.len() == ROOM {
            let remedy = format!("The maximum of {ROOM} is reached: restart the bench.");
            return Err(BenchError::Injection { fault: injection.to_string(), remedy }.into());
        }
        self.injected.push(Injected { injection, start: None, counts: 0.0, last: 0.0 });
        Ok(())
    }

    /// Starts a tick: voltages of the amplifiers, and number of following ticks without the software.
    pub(crate) fn begin(&mut self, mut voltages: Voltages<f64>, before: &Measurement<f64>) -> (Voltages<f64>, u64) {
        let now = self.tick;
        let mut alone = 0;
        for fault in &mut self.injected {
            let Injection { kind, value, at } = fault.injection;
            // The nearest tick.
            if (now as f64) < (at / self.tick_time).round() {
                continue;
            }
            let first = fault.start.is_none();
            let (kept, _) = *fault.start.get_or_insert((voltages, *before));
            if first {
                (fault.counts, fault.last) = (before.count, before.count);
            }
            match kind {
                Kind::ServoSaturated => voltages.servo_voltage = voltages.servo_voltage.clamp(-value, value),
                Kind::ServoFrozen => voltages.servo_voltage = kept.servo_voltage,
                Kind::LoadFrozen => voltages.amplifier_voltage = kept.amplifier_voltage,
                Kind::PowerLoss => voltages = Voltages::default(),
                Kind::ControllerNan => self.controller_nan |= first,
                Kind::TicksMissed if first => alone += value as u64,
                _ => {}
            }
        }
        self.tick += 1 + alone;
        self.missed = alone;
        (voltages, alone)
    }

    /// Ends a tick: readings of the software.
    fn end(&mut self, mut readings: Measurement<f64>) -> Measurement<f64> {
        let range = self.decoder.counter_range;
        let shortest = |difference: f64| difference - range * (difference / range).round();
        let healthy = readings;
        for fault in &mut self.injected {
            let Some((_, before)) = fault.start else { continue };
            fault.counts += shortest(healthy.count - fault.last);
            fault.last = healthy.count;
            let value = fault.injection.value;
            match fault.injection.kind {
                Kind::EncoderStuck => {
                    (readings.count, readings.index, readings.latch) = (before.count, 0.0, before.latch);
                }
                Kind::CountsLost => {
                    let kept = |counts: f64| (before.count + (1.0 - value) * (counts - before.count)).floor();
                    let latched = fault.counts - shortest(healthy.count - healthy.latch);
                    readings.count = kept(fault.counts).rem_euclid(range);
                    readings.latch = kept(latched).rem_euclid(range);
                }
                Kind::EncoderWrap => {
                    readings.count = readings.count.rem_euclid(value);
                    readings.latch = readings.latch.rem_euclid(value);
                }
                Kind::IndexMissing => readings.index = 0.0,
                Kind::EncoderNan => readings.count = f64::NAN,
                Kind::TachoDead => readings.tacho_voltage = 0.0,
                Kind::TachoNan => readings.tacho_voltage = f64::NAN,
                Kind::AccelerometerJump => readings.accelerometer_voltage += value,
                Kind::AccelerometerDead => readings.accelerometer_voltage = 0.0,
                Kind::CurrentSign => readings.current_voltage = -readings.current_voltage,
                _ => {}
            }
        }
        readings
    }

    fn keep(&mut self, keep: &mut dyn StateVisitor) {
        let Faults { injected, decoder, tick_time: _, tick, missed, controller_nan } = self;
        let many = choice(keep, injected.len(), ROOM + 1);
        let nothing = Injected { injection: Injection::new(Kind::PowerLoss, 0.0), start: None, counts: 0.0, last: 0.0 };
        // Within the capacity: no allocation.
        injected.resize(many, nothing);
        injected.iter_mut().for_each(|fault| fault.keep(keep));
        fields(keep, decoder);
        count(keep, tick);
        count(keep, missed);
        flag(keep, controller_nan);
    }

    /// Disturbs the software after a tick.
    pub(crate) fn disturb(&mut self, software: &mut Software) {
        (0..std::mem::take(&mut self.missed)).for_each(|_| software.miss());
        if std::mem::take(&mut self.controller_nan) {
            software.spoil_controller();
        }
    }
}

/// A machine with injected faults.
#[derive(Clone, Debug)]
pub struct Faulty<M> {
    machine: M,
    faults: Faults,
    /// Readings without the faults.
    readings: Measurement<f64>,
}

impl<M: Io> Faulty<M> {
    /// Without faults yet, for a machine at rest with these readings and this counter.
    pub fn new(machine: M, readings: Measurement<f64>, decoder: Decoder<f64>, tick_time: f64) -> Self {
        Faulty { machine, faults: Faults::new(decoder, tick_time), readings }
    }

    /// The injected faults.
    pub(crate) fn faults(&self) -> &Faults {
        &self.faults
    }

    /// Last readings of the machine, without the faults.
    pub fn undisturbed(&self) -> &Measurement<f64> {
        &self.readings
    }
}

impl<M: Io> Io for Faulty<M> {
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        let (voltages, alone) = self.faults.begin(voltages, &self.readings);
        let mut index = 0.0_f64;
        for _ in 0..=alone {
            self.readings = self.machine.exchange(voltages)?;
            index = index.max(self.readings.index);
        }
        self.readings.index = index;
        Ok(self.faults.end(self.readings))
    }

    fn waits(&self) -> bool {
        self.machine.waits()
    }

    fn keep(&mut self, keep: &mut dyn StateVisitor) {
        let Faulty { machine, faults, readings } = self;
        machine.keep(keep);
        faults.keep(keep);
        fields(keep, readings);
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        self.machine.set_preload(preload)
    }

    fn preload(&self) -> f64 {
        self.machine.preload()
    }

    fn inject(&mut self, injection: Injection) -> Result<(), Error> {
        self.faults.inject(injection)
    }

    fn disturb(&mut self, software: &mut Software) {
        self.faults.disturb(software);
    }
}

/// The virtual machine with injected faults, with the software of the bench.
pub type FaultyBench = LockstepBench<Faulty<InProcess>>;

impl FaultyBench {
    /// The bench of a preset, switched on and at rest, without faults yet.
    ///
    /// # Errors
    /// As [`VirtualBench::new`](crate::VirtualBench::new).
    pub fn new(preset: &Preset<f64>, seed: u64) -> Result<Self, Error> {
        let (machine, readings) = InProcess::new(preset, seed)?;
        let machine = Faulty::new(machine, readings, preset.model.encoder, preset.bench.tick_time());
        Self::over(&preset.model, &preset.bench, machine, readings)
    }

    /// Last readings of the machine, without the faults. Measurements must not use them.
    pub fn undisturbed(&self) -> &Measurement<f64> {
        self.machine.undisturbed()
    }
}
