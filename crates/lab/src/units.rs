//! Units at the door: files say millimetres, degrees and millivolts; inside everything is SI.

use serde::Deserialize;

use crate::Error;

/// A number with its unit, as in a file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// The number.
    pub value: f64,
    /// Its unit.
    pub unit: String,
}

/// What a number measures; named by its SI unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// s
    Time,
    /// m
    Length,
    /// rad
    Angle,
    /// m/s
    Velocity,
    /// rad/s
    AngularVelocity,
    /// V
    Voltage,
    /// N/V
    ForceGain,
    /// N m/V
    TorqueGain,
}

use Dimension::{Angle, AngularVelocity, ForceGain, Length, TorqueGain, Velocity, Voltage};

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const TURN: f64 = std::f64::consts::TAU;

/// Unit, what it measures, how many SI units it is. The SI unit of a dimension comes first.
const UNITS: &[(&str, Dimension, f64)] = &[
    ("s", Dimension::Time, 1.0),
    ("ms", Dimension::Time, 1e-3),
    ("us", Dimension::Time, 1e-6),
    ("µs", Dimension::Time, 1e-6),
    ("m", Length, 1.0),
    ("mm", Length, 1e-3),
    ("um", Length, 1e-6),
    ("µm", Length, 1e-6),
    ("nm", Length, 1e-9),
    ("rad", Angle, 1.0),
    ("mrad", Angle, 1e-3),
    ("deg", Angle, DEGREE),
    ("°", Angle, DEGREE),
    ("rev", Angle, TURN),
    ("m/s", Velocity, 1.0),
    ("mm/s", Velocity, 1e-3),
    ("rad/s", AngularVelocity, 1.0),
    ("deg/s", AngularVelocity, DEGREE),
    ("rpm", AngularVelocity, TURN / 60.0),
    ("V", Voltage, 1.0),
    ("mV", Voltage, 1e-3),
    ("N/V", ForceGain, 1.0),
    ("N m/V", TorqueGain, 1.0),
    ("mN m/V", TorqueGain, 1e-3),
];

/// SI units in one `unit`.
///
/// # Errors
/// A unit that is unknown or measures something else; `place` says whose it is.
pub fn si_factor(unit: &str, dimension: Dimension, place: &str) -> Result<f64, Error> {
    let found = UNITS.iter().find(|(name, measures, _)| *name == unit && *measures == dimension);
    found.map(|(_, _, factor)| *factor).ok_or_else(|| Error::Unit {
        place: place.to_owned(),
        unit: unit.to_owned(),
        known: UNITS
            .iter()
            .filter(|(_, d, _)| *d == dimension)
            .map(|(name, _, _)| *name)
            .collect::<Vec<_>>()
            .join(", "),
    })
}

impl Quantity {
    /// The number in SI units.
    ///
    /// # Errors
    /// As [`si_factor`].
    pub fn si(&self, dimension: Dimension, place: &str) -> Result<f64, Error> {
        Ok(self.value * si_factor(&self.unit, dimension, place)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_a_turn_in_every_unit() {
        for (value, unit, dimension, si) in [
            (360.0, "deg", Angle, TURN),
            (1.0, "rev", Angle, TURN),
            (60.0, "rpm", AngularVelocity, TURN),
            (2.5, "mm", Length, 2.5e-3),
            (250.0, "mV", Voltage, 0.25),
        ] {
            let quantity = Quantity { value, unit: unit.to_owned() };
            assert!((quantity.si(dimension, "here").unwrap() - si).abs() < 1e-15 * si.abs() * 4.0, "{unit}");
        }
    }

    #[test]
    fn a_unit_of_something_else_is_refused_with_what_would_do() {
        let error = si_factor("V", Length, "machine.toml: columns.position").unwrap_err().to_string();
        assert!(error.contains("machine.toml: columns.position") && error.contains("m, mm"), "{error}");
    }
}
