//! Units of the variables of an FMU, as factors to SI units.

/// Base units in the order of the exponents, as the attributes of `BaseUnit` are called.
pub(super) const BASES: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

/// A unit: value in the SI = factor · value + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unit {
    /// Over [`BASES`].
    pub(super) exponents: [i32; 8],
    pub(super) factor: f64,
    pub(super) offset: f64,
}

/// Physical quantity of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Time,
    Angle,
    Velocity,
    Acceleration,
    Torque,
}

impl Quantity {
    /// SI unit, and name of the quantity.
    pub(super) fn words(self) -> (&'static str, &'static str) {
        match self {
            Quantity::Time => ("s", "a time"),
            Quantity::Angle => ("rad", "an angle"),
            Quantity::Velocity => ("rad/s", "an angular velocity"),
            Quantity::Acceleration => ("rad/s^2", "an angular acceleration"),
            Quantity::Torque => ("N m", "a torque"),
        }
    }

    /// Exponents of its SI unit over [`BASES`], and whether it contains radians, which many tools omit.
    fn exponents(self) -> ([i32; 8], bool) {
        match self {
            Quantity::Time => ([0, 0, 1, 0, 0, 0, 0, 0], false),
            Quantity::Angle => ([0, 0, 0, 0, 0, 0, 0, 1], true),
            Quantity::Velocity => ([0, 0, -1, 0, 0, 0, 0, 1], true),
            Quantity::Acceleration => ([0, 0, -2, 0, 0, 0, 0, 1], true),
            Quantity::Torque => ([1, 2, -2, 0, 0, 0, 0, 0], false),
        }
    }

    /// Factor and offset of a unit with this name and definition, if it is a unit of this quantity.
    pub(super) fn convert(self, name: &str, defined: Option<Unit>) -> Option<(f64, f64)> {
        let Unit { exponents, factor, offset } = defined.or_else(|| by_name(name))?;
        let (expected, radians) = self.exponents();
        let mut without = expected;
        without[7] = 0;
        // Ambiguous: cycles per second or radians per second.
        let unambiguous = !(name == "Hz" && exponents[7] == 0);
        let fits = exponents == expected || (radians && unambiguous && exponents == without);
        (fits && factor.is_finite() && factor != 0.0 && offset.is_finite()).then_some((factor, offset))
    }
}

/// Units by their names, for tools that do not define them.
fn by_name(name: &str) -> Option<Unit> {
    use std::f64::consts::{PI, TAU};
    let of = |quantity: Quantity, factor| Some(Unit { exponents: quantity.exponents().0, factor, offset: 0.0 });
    match name {
        "s" => of(Quantity::Time, 1.0),
        "ms" => of(Quantity::Time, 1e-3),
        "rad" => of(Quantity::Angle, 1.0),
        "deg" | "°" => of(Quantity::Angle, PI / 180.0),
        "rev" => of(Quantity::Angle, TAU),
        "rad/s" => of(Quantity::Velocity, 1.0),
        "deg/s" | "°/s" => of(Quantity::Velocity, PI / 180.0),
        "rev/s" => of(Quantity::Velocity, TAU),
        "rpm" | "rev/min" | "r/min" | "1/min" => of(Quantity::Velocity, TAU / 60.0),
        "rad/s2" | "rad/s^2" | "rad/s²" => of(Quantity::Acceleration, 1.0),
        "deg/s2" | "deg/s^2" | "°/s²" => of(Quantity::Acceleration, PI / 180.0),
        "N.m" | "N m" | "N*m" | "N·m" | "Nm" => of(Quantity::Torque, 1.0),
        "mN.m" | "mN m" | "mN*m" | "mN·m" | "mNm" => of(Quantity::Torque, 1e-3),
        "kN.m" | "kN m" | "kN*m" | "kN·m" | "kNm" => of(Quantity::Torque, 1e3),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_definition_precedes_a_name_and_exponents_must_fit() {
        let unit = |exponents, factor| Some(Unit { exponents, factor, offset: 0.0 });
        let per_second = [0, 0, -1, 0, 0, 0, 0, 0];
        assert_eq!(Quantity::Velocity.convert("rpm", unit(per_second, 0.5)), Some((0.5, 0.0)));
        assert_eq!(Quantity::Velocity.convert("1/s", unit(per_second, 1.0)), Some((1.0, 0.0)));
        assert_eq!(Quantity::Velocity.convert("Hz", unit(per_second, 1.0)), None);
        assert_eq!(Quantity::Angle.convert("deg", None), Some((std::f64::consts::PI / 180.0, 0.0)));
        assert_eq!(Quantity::Angle.convert("rpm", None), None);
        assert_eq!(Quantity::Angle.convert("m", unit([0, 1, 0, 0, 0, 0, 0, 0], 1.0)), None);
        assert_eq!(Quantity::Torque.convert("mN.m", None), Some((1e-3, 0.0)));
        assert_eq!(Quantity::Torque.convert("N.m/rad", unit([1, 2, -2, 0, 0, 0, 0, -1], 1.0)), None);
        for factor in [0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Quantity::Torque.convert("lbf.in", unit([1, 2, -2, 0, 0, 0, 0, 0], factor)), None);
        }
        assert_eq!(Quantity::Torque.convert("lbf.in", None), None);
    }
}
