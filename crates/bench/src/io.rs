//! Interface between the software of the bench and its machine: voltages out, readings in.

use crate::BenchError;
use std::sync::Arc;
use std::sync::atomic::AtomicI64;

use stickslip_core::snapshot::StateVisitor;
use stickslip_core::tick::Measurement;
use stickslip_software::cycle::{Software, Voltages};
use stickslip_software::supervise::MachineFault;

use super::Injection;
use super::remote::{LinkFault, Traffic};
use super::segment::Segment;
use stickslip_base::{Error, Preset};

/// A machine behind converters and counters: in this process, in another process, or physical.
pub trait Io {
    /// One tick under these voltages: the readings at its end.
    ///
    /// # Errors
    /// A fault of the link; it is permanent.
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault>;

    /// In real time: starts a tick with these voltages. Returns the readings at its end if available at once; otherwise
    /// [`finish`](Io::finish) returns them after the tick. Ticks are numbered; skipped numbers have passed.
    ///
    /// # Errors
    /// As [`exchange`](Io::exchange): it ends the bench.
    fn start(&mut self, _tick: u64, voltages: Voltages<f64>) -> Result<Option<Measurement<f64>>, LinkFault> {
        self.exchange(voltages).map(Some)
    }

    /// In real time, at the end of a tick: the voltages that [`start`](Io::start) gets next. A machine whose frames take
    /// time sends them now, and not then.
    fn announce(&mut self, _voltages: Voltages<f64>) {}

    /// In real time, at the start of a tick: the readings at the end of the last started tick.
    fn finish(&mut self) -> Arrival {
        Arrival::Missing
    }

    /// In real time, before [`start`](Io::start): whether the drives are to be on. Returns false while they switch on;
    /// commands wait meanwhile.
    fn switch(&mut self, _on: bool) -> bool {
        true
    }

    /// Shift of the ticks that the machine asks for [ns], to follow its clock.
    fn tick_shift(&self) -> Option<Arc<AtomicI64>> {
        None
    }

    /// Traffic on the link to the machine, if there is one.
    fn traffic(&self) -> Option<Arc<Traffic>> {
        None
    }

    /// State of the segment of a fieldbus, if the machine is on one.
    fn segment(&self) -> Option<Arc<Segment>> {
        None
    }

    /// Whether the machine pauses between exchanges, as a virtual machine does.
    fn waits(&self) -> bool {
        false
    }

    /// Sets the preload of the friction wheel, 0 … 1; on hardware the operator sets it.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] outside 0 … 1; [`Error::BenchFault`] if the link failed.
    fn set_preload(&mut self, preload: f64) -> Result<(), Error>;

    /// Preload of the friction wheel, 0 … 1.
    fn preload(&self) -> f64;

    /// Injects a fault if the machine is [`Faulty`](super::Faulty).
    ///
    /// # Errors
    /// [`BenchError::Injection`] if it is not, or its list is full.
    fn inject(&mut self, injection: Injection) -> Result<(), Error> {
        let remedy = "This bench does not support injected faults.".into();
        Err(BenchError::Injection { fault: injection.to_string(), remedy }.into())
    }

    /// Visits the state of a virtual machine in this process; without effect for other machines.
    fn keep(&mut self, _: &mut dyn StateVisitor) {}

    /// Disturbs the software after an exchange; used by injected faults only.
    fn disturb(&mut self, _: &mut Software) {}
}

/// Result of a tick in real time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Arrival {
    /// The readings at the end of the tick.
    Readings(Measurement<f64>),
    /// No readings in time.
    Missing,
    /// The machine has restarted and does not know this bench.
    Restarted,
    /// A device of the machine failed: the bench stops. A wrong working counter is a missing reading first.
    Failed(MachineFault),
}

/// Opens a machine on a fieldbus: parameters, and the address without its scheme. Returns the readings at rest.
pub type OpenFieldbus = fn(&Preset<f64>, &str) -> Result<(Box<dyn Io + Send>, Measurement<f64>), Error>;

impl Io for Box<dyn Io + Send> {
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        (**self).exchange(voltages)
    }

    fn start(&mut self, tick: u64, voltages: Voltages<f64>) -> Result<Option<Measurement<f64>>, LinkFault> {
        (**self).start(tick, voltages)
    }

    fn announce(&mut self, voltages: Voltages<f64>) {
        (**self).announce(voltages);
    }

    fn finish(&mut self) -> Arrival {
        (**self).finish()
    }

    fn switch(&mut self, on: bool) -> bool {
        (**self).switch(on)
    }

    fn tick_shift(&self) -> Option<Arc<AtomicI64>> {
        (**self).tick_shift()
    }

    fn traffic(&self) -> Option<Arc<Traffic>> {
        (**self).traffic()
    }

    fn segment(&self) -> Option<Arc<Segment>> {
        (**self).segment()
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        (**self).set_preload(preload)
    }

    fn preload(&self) -> f64 {
        (**self).preload()
    }

    fn waits(&self) -> bool {
        (**self).waits()
    }

    fn inject(&mut self, injection: Injection) -> Result<(), Error> {
        (**self).inject(injection)
    }

    fn keep(&mut self, visitor: &mut dyn StateVisitor) {
        (**self).keep(visitor);
    }

    fn disturb(&mut self, software: &mut Software) {
        (**self).disturb(software);
    }
}

/// Checks a preload.
///
/// # Errors
/// [`Error::OutOfRange`] outside 0 … 1.
pub fn check_preload(preload: f64) -> Result<(), Error> {
    if (0.0..=1.0).contains(&preload) {
        return Ok(());
    }
    Err(Error::OutOfRange {
        name: "the preload of the friction wheel",
        value: preload,
        unit: "1",
        minimum: 0.0,
        maximum: 1.0,
        remedy: "0 releases the linings, 1 presses them on fully.",
    })
}
