//! Addresses of the values of a running bench, and their description in ASAP2 1.61 for measurement and calibration tools.

pub mod a2l;
pub mod ascii;
mod layout;

pub use layout::{Cell, Content, EPK, Layout, MEASUREMENTS, PARAMETERS, Parameter, SIZE};

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
