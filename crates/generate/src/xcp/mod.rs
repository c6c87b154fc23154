//! Addresses of the values of a running bench, their description in ASAP2 1.61 for measurement and calibration tools, and
//! the protocol of a slave of ASAM MCD-1 XCP 1.4.

pub mod a2l;
pub mod ascii;
pub mod frame;
mod layout;
mod lists;
pub mod packet;
mod pages;
mod sampler;
mod slave;

pub use layout::{Cell, Content, EPK, Layout, MEASUREMENTS, PARAMETERS, Parameter, SIZE};

pub use sampler::Sampler;
pub use slave::Slave;

use stickslip_base::Error;
use stickslip_base::parameters::Entry;
use stickslip_recording::capture::Tap;

/// Largest command and its response [bytes].
pub const MAX_CTO: usize = 248;
/// Largest packet of measurements [bytes]: with its frame it fits a datagram on Ethernet, by IPv4 or IPv6.
pub const MAX_DTO: usize = 1440;
/// The version of the protocol, as stated by `GET_VERSION` and the description.
pub const VERSION: [u8; 2] = [1, 4];
/// Name of the only event, one per cycle.
pub const EVENT_NAME: &str = "cycle";

/// The time between two cycles as a number of units, 10⁻⁹ s × 10^unit.
pub fn cycle_time(rate: f64) -> (u8, u8) {
    let units = (0..10u8).map(|unit| (1e9 / rate / 10f64.powi(i32::from(unit)), unit));
    let fitting: Vec<(f64, u8)> = units.filter(|(count, _)| (0.5..255.5).contains(count)).collect();
    // The finest unit that fits; rounded if no unit gives a whole number.
    fitting.first().map_or((0, 0), |(count, unit)| (count.round() as u8, *unit))
}

/// The bench of a slave.
pub trait Bench {
    /// Notes activity of the master.
    fn note_activity(&self);
    /// Notes that the master has disconnected.
    fn left(&self);
    /// The newest cycle: its number and its signals.
    fn newest(&self) -> (u64, Vec<f64>);
    /// The active parameters.
    fn in_force(&self) -> Vec<Entry>;
    /// The parameters at the start of the run.
    fn reference(&self) -> Vec<Entry>;
    /// Passes rows to a sampler, from the next cycle on.
    ///
    /// # Errors
    /// The sampler needs unknown signals.
    fn attach(&self, sampler: Sampler) -> Result<Tap<Sampler>, Error>;
    /// Detaches a sampler.
    fn detach(&self, tap: Tap<Sampler>);
    /// Changes parameters, all in one cycle; may take seconds.
    ///
    /// # Errors
    /// The values are invalid or refused.
    fn change(&self, change: &Change) -> Result<(), Error>;
}

/// A change of parameters.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// These values: paths and values as in a file.
    Set(Vec<(String, String)>),
    /// The values at the start of the run.
    Reset,
}
