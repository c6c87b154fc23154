//! Units of the variables of an FMU, as factors to the SI.

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

/// What a signal is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Time,
    Angle,
    Velocity,
    Acceleration,
    Torque,
}

impl Quantity {
    /// Its SI unit, and what it is in words.
    pub(super) fn words(self) -> (&'static str, &'static str) {
        match self {
            Quantity::Time => ("s", "a time"),
            Quantity::Angle => ("rad", "an angle"),
            Quantity::Velocity => ("rad/s", "an angular velocity"),
            Quantity::Acceleration => ("rad/s^2", "an angular acceleration"),
            Quantity::Torque => ("N m", "a torque"),
        }
    }

    /// Exponents of its SI unit over [`BASES`], and whether it is counted in radians, which many tools leave out.
    fn exponents(self) -> ([i32; 8], bool) {
        match self {
            Quantity::Time => ([0, 0, 1, 0, 0, 0, 0, 0], false),
            Quantity::Angle => ([0, 0, 0, 0, 0, 0, 0, 1], true),
            Quantity::Velocity => ([0, 0, -1, 0, 0, 0, 0, 1], true),
            Quantity::Acceleration => ([0, 0, -2, 0, 0, 0, 0, 1], true),
            Quantity::Torque => ([1, 2, -2, 0, 0, 0, 0, 0], false),
        }
    }

    /// Factor and offset of a unit that is called so and has this definition, if it is one of this quantity.
    pub(super) fn convert(self, name: &str, defined: Option<Unit>) -> Option<(f64, f64)> {
        let Unit { exponents, factor, offset } = defined.or_else(|| known(name))?;
        let (wanted, radians) = self.exponents();
        let mut without = wanted;
        without[7] = 0;
        // Cycles per second or radians per second: nobody knows.
        let told = !(name == "Hz" && exponents[7] == 0);
        let fits = exponents == wanted || (radians && told && exponents == without);
        (fits && factor.is_finite() && factor != 0.0 && offset.is_finite()).then_some((factor, offset))
    }
}

/// Units by their names, for tools that do not define what they name.
fn known(name: &str) -> Option<Unit> {
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
    fn a_definition_counts_before_a_name_and_exponents_tell_what_fits() {
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
