//! A machine whose readings, amplifiers and clock do what a fault makes of them.

use crate::BenchError;
use stickslip_core::cycle::{Software, Voltages};
use stickslip_core::snapshot::{StateVisitor, choice, count, fields, flag};
use stickslip_core::tick::{Decoder, Measurement};

use super::{Injection, Kind};
use crate::io::Io;
use crate::remote::LinkFault;
use crate::{InProcess, LockstepBench};
use stickslip_base::{Error, Preset};

/// As many as there may be: they are injected within the deadline, which allocates nothing.
const ROOM: usize = 16;

/// What was injected, tick after tick. Apart from a machine, for a replay whose machine was elsewhere.
#[derive(Clone, Debug)]
pub(crate) struct Faults {
    injected: Vec<Injected>,
    /// Of the counter.
    decoder: Decoder<f64>,
    tick_time: f64,
    /// Ticks of the machine since the start.
    tick: u64,
    /// What the software suffers behind this tick.
    missed: u64,
    spoilt: bool,
}

#[derive(Clone, Copy, Debug)]
struct Injected {
    injection: Injection,
    /// From its first tick on: what was written, and what was read in the tick before.
    begun: Option<(Voltages<f64>, Measurement<f64>)>,
    /// Counts of the healthy counter since then, over all wraps; the last ones that it gave.
    counts: f64,
    last: f64,
}

impl Injected {
    fn keep(&mut self, keep: &mut dyn StateVisitor) {
        let Injected { injection: Injection { kind, value, at }, begun, counts, last } = self;
        let place = Kind::all().position(|known| known == *kind).unwrap_or(0);
        let place = choice(keep, place, Kind::all().count());
        *kind = Kind::all().nth(place).unwrap_or(*kind);
        let mut has_begun = begun.is_some();
        let (mut voltages, mut before) = begun.unwrap_or_default();
        flag(keep, &mut has_begun);
        fields(keep, &mut voltages);
        fields(keep, &mut before);
        *begun = has_begun.then_some((voltages, before));
        [value, at, counts, last].into_iter().for_each(|number| keep.number(number));
    }
}

impl Faults {
    pub(crate) fn new(decoder: Decoder<f64>, tick_time: f64) -> Self {
        let injected = Vec::with_capacity(ROOM);
        Faults { injected, decoder, tick_time, tick: 0, missed: 0, spoilt: false }
    }

    pub(crate) fn inject(&mut self, injection: Injection) -> Result<(), Error> {
        if self.injected.len() == ROOM {
            let remedy = format!("There are {ROOM} already: start anew.");
            return Err(BenchError::Injection { fault: injection.to_string(), remedy }.into());
        }
        self.injected.push(Injected { injection, begun: None, counts: 0.0, last: 0.0 });
        Ok(())
    }

    /// Begins a tick: what the amplifiers get, and the ticks that the machine goes on alone behind it.
    pub(crate) fn begin(&mut self, mut voltages: Voltages<f64>, before: &Measurement<f64>) -> (Voltages<f64>, u64) {
        let now = self.tick;
        let mut alone = 0;
        for fault in &mut self.injected {
            let Injection { kind, value, at } = fault.injection;
            // The tick whose instant is nearest.
            if (now as f64) < (at / self.tick_time).round() {
                continue;
            }
            let first = fault.begun.is_none();
            let (kept, _) = *fault.begun.get_or_insert((voltages, *before));
            if first {
                (fault.counts, fault.last) = (before.count, before.count);
            }
            match kind {
                Kind::ServoSaturated => voltages.servo_voltage = voltages.servo_voltage.clamp(-value, value),
                Kind::ServoFrozen => voltages.servo_voltage = kept.servo_voltage,
                Kind::LoadFrozen => voltages.amplifier_voltage = kept.amplifier_voltage,
                Kind::PowerLoss => voltages = Voltages::default(),
                Kind::ControllerNan => self.spoilt |= first,
                Kind::TicksMissed if first => alone += value as u64,
                _ => {}
            }
        }
        self.tick += 1 + alone;
        self.missed = alone;
        (voltages, alone)
    }

    /// Ends a tick: what the software reads.
    fn end(&mut self, mut readings: Measurement<f64>) -> Measurement<f64> {
        let range = self.decoder.counter_range;
        let shortest = |difference: f64| difference - range * (difference / range).round();
        let healthy = readings;
        for fault in &mut self.injected {
            let Some((_, before)) = fault.begun else { continue };
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
        let Faults { injected, decoder, tick_time: _, tick, missed, spoilt } = self;
        let many = choice(keep, injected.len(), ROOM + 1);
        let nothing = Injected { injection: Injection::new(Kind::PowerLoss, 0.0), begun: None, counts: 0.0, last: 0.0 };
        // There is room: nothing is allocated.
        injected.resize(many, nothing);
        injected.iter_mut().for_each(|fault| fault.keep(keep));
        fields(keep, decoder);
        count(keep, tick);
        count(keep, missed);
        flag(keep, spoilt);
    }

    /// What befalls the software besides, behind a tick.
    pub(crate) fn disturb(&mut self, software: &mut Software) {
        (0..std::mem::take(&mut self.missed)).for_each(|_| software.miss());
        if std::mem::take(&mut self.spoilt) {
            software.spoil_controller();
        }
    }
}

/// A machine with faults on purpose.
#[derive(Clone, Debug)]
pub struct Faulty<M> {
    machine: M,
    faults: Faults,
    /// As the machine gave them.
    readings: Measurement<f64>,
}

impl<M: Io> Faulty<M> {
    /// Nothing is wrong yet with a machine at rest that gave these readings, whose counter is this.
    pub fn new(machine: M, readings: Measurement<f64>, decoder: Decoder<f64>, tick_time: f64) -> Self {
        Faulty { machine, faults: Faults::new(decoder, tick_time), readings }
    }

    /// What is wrong with it.
    pub(crate) fn faults(&self) -> &Faults {
        &self.faults
    }

    /// What the machine gave last, before the faults.
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

/// The virtual machine with faults on purpose, behind the software of the bench.
pub type FaultyBench = LockstepBench<Faulty<InProcess>>;

impl FaultyBench {
    /// The bench of a preset, switched on and at rest; nothing is wrong yet.
    ///
    /// # Errors
    /// As [`VirtualBench::new`](crate::VirtualBench::new).
    pub fn new(preset: &Preset<f64>, seed: u64) -> Result<Self, Error> {
        let (machine, readings) = InProcess::new(preset, seed)?;
        let machine = Faulty::new(machine, readings, preset.model.encoder, preset.bench.tick_time());
        Self::over(&preset.model, &preset.bench, machine, readings)
    }

    /// What the machine gave last, before the faults. Nothing that measures may ask for it.
    pub fn undisturbed(&self) -> &Measurement<f64> {
        self.machine.undisturbed()
    }
}
