//! Units of files, such as millimetres, degrees, per cent and millivolts; all internal values are SI.

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

/// Quantity of a number, with its SI unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// s
    Time,
    /// m
    Length,
    /// rad
    Angle,
    /// Increments of an encoder; their size depends on the machine.
    Counts,
    /// m/s
    Velocity,
    /// rad/s
    AngularVelocity,
    /// V
    Voltage,
    /// A
    Current,
    /// N
    Force,
    /// N m
    Torque,
    /// 1: a share of something rated.
    Share,
    /// kg
    Mass,
    /// kg m²
    Inertia,
    /// N/V
    ForcePerVoltage,
    /// N m/V
    TorquePerVoltage,
    /// N/A
    ForcePerCurrent,
    /// N m/A
    TorquePerCurrent,
}

use Dimension::{
    Angle, AngularVelocity, Counts, Current, Force, ForcePerCurrent, ForcePerVoltage, Inertia, Length, Mass, Share,
    Time, Torque, TorquePerCurrent, TorquePerVoltage, Velocity, Voltage,
};

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const TURN: f64 = std::f64::consts::TAU;

/// Unit, quantity, factor to the SI unit. The SI unit of a dimension comes first. Spellings that differ only in dots,
/// spaces and the letter µ are one: see [`plain`].
const UNITS: &[(&str, Dimension, f64)] = &[
    ("s", Time, 1.0),
    ("ms", Time, 1e-3),
    ("us", Time, 1e-6),
    ("ns", Time, 1e-9),
    ("100 ns", Time, 1e-7),
    ("sec", Time, 1.0),
    ("min", Time, 60.0),
    ("d", Time, 86_400.0),
    ("m", Length, 1.0),
    ("cm", Length, 1e-2),
    ("mm", Length, 1e-3),
    ("um", Length, 1e-6),
    ("nm", Length, 1e-9),
    ("rad", Angle, 1.0),
    ("mrad", Angle, 1e-3),
    ("deg", Angle, DEGREE),
    ("°", Angle, DEGREE),
    ("rev", Angle, TURN),
    ("turns", Angle, TURN),
    ("counts", Counts, 1.0),
    ("count", Counts, 1.0),
    ("cts", Counts, 1.0),
    ("inc", Counts, 1.0),
    ("m/s", Velocity, 1.0),
    ("mm/s", Velocity, 1e-3),
    ("um/s", Velocity, 1e-6),
    ("m/min", Velocity, 1.0 / 60.0),
    ("mm/min", Velocity, 1e-3 / 60.0),
    ("rad/s", AngularVelocity, 1.0),
    ("mrad/s", AngularVelocity, 1e-3),
    ("deg/s", AngularVelocity, DEGREE),
    ("°/s", AngularVelocity, DEGREE),
    ("rev/s", AngularVelocity, TURN),
    ("rpm", AngularVelocity, TURN / 60.0),
    ("1/min", AngularVelocity, TURN / 60.0),
    ("rev/min", AngularVelocity, TURN / 60.0),
    ("V", Voltage, 1.0),
    ("mV", Voltage, 1e-3),
    ("A", Current, 1.0),
    ("mA", Current, 1e-3),
    ("N", Force, 1.0),
    ("kN", Force, 1e3),
    ("N m", Torque, 1.0),
    ("mN m", Torque, 1e-3),
    ("uN m", Torque, 1e-6),
    ("N cm", Torque, 1e-2),
    ("kN m", Torque, 1e3),
    ("1", Share, 1.0),
    ("%", Share, 1e-2),
    ("‰", Share, 1e-3),
    ("kg", Mass, 1.0),
    ("g", Mass, 1e-3),
    ("t", Mass, 1e3),
    ("kg m^2", Inertia, 1.0),
    ("kg cm^2", Inertia, 1e-4),
    ("g cm^2", Inertia, 1e-7),
    ("N/V", ForcePerVoltage, 1.0),
    ("N m/V", TorquePerVoltage, 1.0),
    ("mN m/V", TorquePerVoltage, 1e-3),
    ("N/A", ForcePerCurrent, 1.0),
    ("N m/A", TorquePerCurrent, 1.0),
    ("mN m/A", TorquePerCurrent, 1e-3),
];

/// The spelling of the table: `μm`, `Nm`, `N·m`, `kg*m²` and `[mm]` as others write them.
fn plain(unit: &str) -> String {
    let unit = unit.trim().trim_start_matches(['[', '(']).trim_end_matches([']', ')']);
    let mut text = String::new();
    for letter in unit.chars() {
        match letter {
            'µ' | 'μ' => text.push('u'),
            '·' | '⋅' | '*' | ' ' if text.ends_with(' ') => {}
            '·' | '⋅' | '*' => text.push(' '),
            '²' => text.push_str("^2"),
            'º' => text.push('°'),
            other => text.push(other),
        }
    }
    // A force times a length without a space: Nm, mNm, Ncm, and the same per volt or ampere.
    if let Some(place) = text.find("Nm").or_else(|| text.find("Ncm")) {
        text.insert(place + 1, ' ');
    }
    text
}

/// Quantity of a unit and its factor to the SI unit; `None` for an unknown unit.
pub fn measure(unit: &str) -> Option<(Dimension, f64)> {
    let unit = plain(unit);
    UNITS.iter().find(|(name, ..)| *name == unit).map(|(_, dimension, factor)| (*dimension, *factor))
}

/// SI units in one `unit`.
///
/// # Errors
/// A unit that is unknown or of another quantity; `place` is the place of the unit.
pub fn si_factor(unit: &str, dimension: Dimension, place: &str) -> Result<f64, Error> {
    let found = measure(unit).filter(|(measures, _)| *measures == dimension);
    found.map(|(_, factor)| factor).ok_or_else(|| unfit(unit, &[dimension], place))
}

/// The error of a unit of none of these quantities.
pub fn unfit(unit: &str, dimensions: &[Dimension], place: &str) -> Error {
    let fits = UNITS.iter().filter(|(_, measures, _)| dimensions.contains(measures)).map(|(name, ..)| *name);
    Error::Unit { place: place.to_owned(), unit: unit.to_owned(), known: fits.collect::<Vec<_>>().join(", ") }
}

impl Dimension {
    /// The SI unit.
    pub fn si_unit(self) -> &'static str {
        UNITS.iter().find(|(_, measures, _)| *measures == self).map_or("1", |(name, ..)| name)
    }
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
    fn units_have_their_factors() {
        for (value, unit, dimension, si) in [
            (360.0, "deg", Angle, TURN),
            (1.0, "rev", Angle, TURN),
            (60.0, "rpm", AngularVelocity, TURN),
            (2.5, "mm", Length, 2.5e-3),
            (250.0, "mV", Voltage, 0.25),
            (50.0, "%", Share, 0.5),
            (3.0, "kg cm^2", Inertia, 3e-4),
        ] {
            let quantity = Quantity { value, unit: unit.to_owned() };
            assert!((quantity.si(dimension, "here").unwrap() - si).abs() < 1e-15 * si.abs() * 4.0, "{unit}");
        }
    }

    #[test]
    fn one_unit_has_many_spellings() {
        for (spellings, si) in [
            (&["µm", "μm", "um", "[µm]", "(um)"][..], (Length, 1e-6)),
            (&["Nm", "N·m", "N m", "N*m", "N⋅m", "N · m"], (Torque, 1.0)),
            (&["mNm/A", "mN m/A", "mN·m/A"], (TorquePerCurrent, 1e-3)),
            (&["Ncm", "N cm"], (Torque, 1e-2)),
            (&["kg·m²", "kg m^2"], (Inertia, 1.0)),
            (&["°", "º", "deg"], (Angle, DEGREE)),
        ] {
            spellings.iter().for_each(|unit| assert_eq!(measure(unit), Some(si), "{unit}"));
        }
        // A nanometre is not a newton metre, and capital letters are significant.
        assert_eq!(measure("nm"), Some((Length, 1e-9)));
        for unknown in ["", "furlong", "MM", "S", "-"] {
            assert_eq!(measure(unknown), None, "{unknown}");
        }
    }

    #[test]
    fn the_first_unit_of_a_dimension_is_the_si_unit() {
        for (name, dimension, _) in UNITS {
            assert_eq!(measure(dimension.si_unit()), Some((*dimension, 1.0)), "{name}");
        }
    }

    #[test]
    fn a_unit_of_another_quantity_is_refused_with_the_valid_ones() {
        let error = si_factor("V", Length, "machine.toml: columns.position").unwrap_err().to_string();
        assert!(error.contains("machine.toml: columns.position") && error.contains("m, cm, mm"), "{error}");
    }
}
