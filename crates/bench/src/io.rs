//! What lies between the software of the bench and its machine: voltages out, readings in.

use crate::BenchError;
use std::sync::Arc;

use stickslip_core::cycle::{Software, Voltages};
use stickslip_core::snapshot::StateVisitor;
use stickslip_core::tick::Measurement;

use super::Injection;
use super::remote::{LinkFault, Traffic};
use stickslip_base::Error;

/// A machine behind converters and counters: here, in another process, or of steel.
pub trait Io {
    /// One tick under these voltages: the readings at its end.
    ///
    /// # Errors
    /// What happened to the link; once it failed it stays so.
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault>;

    /// By the clock: begins a tick under these voltages. The readings at its end where they are known at once; else
    /// [`finish`](Io::finish) gives them when the tick has ended. Ticks have numbers; one that is left out has passed.
    ///
    /// # Errors
    /// As [`exchange`](Io::exchange): it ends the bench.
    fn start(&mut self, _tick: u64, voltages: Voltages<f64>) -> Result<Option<Measurement<f64>>, LinkFault> {
        self.exchange(voltages).map(Some)
    }

    /// By the clock, at the begin of a tick: the readings at the end of the one that was started last.
    fn finish(&mut self) -> Arrival {
        Arrival::Missing
    }

    /// What happened on the link to it, where there is one.
    fn traffic(&self) -> Option<Arc<Traffic>> {
        None
    }

    /// Whether the machine stands still where nobody exchanges with it: a virtual one does.
    fn waits(&self) -> bool {
        false
    }

    /// Presses the friction wheel's linings on, 0 … 1: the operator's work.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] beyond 0 … 1; [`Error::BenchFault`] where the link failed.
    fn set_preload(&mut self, preload: f64) -> Result<(), Error>;

    /// How far they are pressed on.
    fn preload(&self) -> f64;

    /// Injects a fault, where [`Faulty`](super::Faulty) is between.
    ///
    /// # Errors
    /// [`BenchError::Injection`] where it is not, or has no room.
    fn inject(&mut self, injection: Injection) -> Result<(), Error> {
        let remedy = "This bench has no faults on purpose: its machine is not wrapped for them.".into();
        Err(BenchError::Injection { fault: injection.to_string(), remedy }.into())
    }

    /// Walks what a virtual machine of this process remembers; one elsewhere remembers it itself.
    fn keep(&mut self, _: &mut dyn StateVisitor) {}

    /// What befalls the software besides, behind an exchange: faults on purpose alone do it.
    fn disturb(&mut self, _: &mut Software) {}
}

/// What came of a tick by the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Arrival {
    /// The readings at its end.
    Readings(Measurement<f64>),
    /// None came in time.
    Missing,
    /// The machine does not know this bench any more.
    Restarted,
}

/// Whether linings can be pressed on so far.
///
/// # Errors
/// [`Error::OutOfRange`] beyond 0 … 1.
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
