//! A measured friction curve as a file: one row for each constant speed, instead of one row for each sample.
//!
//! Any table that [`Recording`] reads. Columns are found by name (`velocity`, `omega`, `torque`, `tau_median`, …) or
//! named; a standard error weights the points. A standard *deviation* is ignored: it is the scatter of the samples, not
//! the error of their mean, and consecutive samples are correlated.

use std::path::Path;

use crate::machine::Axis;
use stickslip_base::Error;
use stickslip_base::units::{Dimension, measure, unfit};
use stickslip_fit::{CurvePoint, check_points};
use stickslip_recording::{Column, Recording};

/// Names of columns, instead of automatic detection.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CurveColumns {
    /// Velocity, of either sign.
    pub velocity: Option<String>,
    /// Friction torque or force, of the velocity's sign.
    pub torque: Option<String>,
    /// Standard error of the torque.
    pub standard_error: Option<String>,
    /// Number of the curve, for several curves in one file.
    pub group: Option<String>,
}

/// The curves of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveFile {
    /// Rotary: rad/s and N m; linear: m/s and N.
    pub axis: Axis,
    /// Whether standard errors were stated; without them all points have the same weight, and only ratios of errors are
    /// meaningful.
    pub weighted: bool,
    /// One for each group, in order of appearance.
    pub curves: Vec<Curve>,
}

/// One friction curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Column and number of its group; empty where the file has none.
    pub name: String,
    /// In the order of the file.
    pub points: Vec<CurvePoint>,
}

const VELOCITY: &[&str] = &["velocity", "speed", "omega", "v", "w", "rpm", "drehzahl", "geschwindigkeit"];
const TORQUE: &[&str] = &["torque", "friction", "tau", "force", "moment", "f", "m", "drehmoment", "reibung", "kraft"];
/// Names that mean a force: without a unit the axis is linear.
const FORCE: &[&str] = &["force", "f", "kraft"];
const STANDARD_ERROR: &[&str] = &["standard_error", "stderr", "se", "sem", "torque_se", "standardfehler"];
const GROUP: &[&str] = &["joint", "group", "axis", "series", "curve", "achse"];

/// Reads friction curves.
///
/// # Errors
/// An invalid table, missing velocity or torque, a non-finite value in them; units that do not match; a standard error
/// that is not positive.
pub fn read_curves(path: &Path, columns: &CurveColumns) -> Result<CurveFile, Error> {
    curves(&Recording::read(path)?, columns)
}

/// From a table that has been read.
///
/// # Errors
/// As [`read_curves`].
pub fn curves(table: &Recording, columns: &CurveColumns) -> Result<CurveFile, Error> {
    // A column named by the user must exist, and so must velocity and torque; others are optional.
    let optional = |choice: &Option<String>, words: &[&str]| match choice {
        Some(name) => table.column(name).map(Some),
        None => detect(table, words).map(|column| table.column(&column.name)).transpose(),
    };
    let needed = |choice: &Option<String>, words: &[&str]| {
        optional(choice, words)?.map_or_else(|| table.column(words[0]), Ok::<_, Error>)
    };
    let velocity = needed(&columns.velocity, VELOCITY)?;
    let torque = needed(&columns.torque, TORQUE)?;
    let standard_error = optional(&columns.standard_error, STANDARD_ERROR)?;
    let group = optional(&columns.group, GROUP)?;

    let (axis, speed) = speed(velocity, torque, table)?;
    let friction = if axis == Axis::Linear { Dimension::Force } else { Dimension::Torque };
    let scale = factor(torque, friction, table)?;
    let error_scale = standard_error.map(|c| if c.unit.is_some() { factor(c, friction, table) } else { Ok(scale) });
    let error_scale = error_scale.transpose()?.unwrap_or(1.0);
    let mut curves: Vec<Curve> = Vec::new();
    let mut points = Vec::new();
    for row in 0..table.rows() {
        let name = group.map_or(String::new(), |column| format!("{} {}", column.name, column.values[row]));
        let standard_error = standard_error.map_or(1.0, |column| column.values[row] * error_scale);
        if standard_error <= 0.0 {
            let remedy = "Remove the column, or state an error for each point.";
            return Err(Error::CurvePoint { index: row, field: "standard_error", value: standard_error, remedy });
        }
        let point =
            CurvePoint { velocity: velocity.values[row] * speed, torque: torque.values[row] * scale, standard_error };
        points.push(point);
        match curves.iter_mut().find(|curve| curve.name == name) {
            Some(curve) => curve.points.push(point),
            None => curves.push(Curve { name, points: vec![point] }),
        }
    }
    // Before the points are separated by curve and direction: the index is that of the row.
    check_points(&points)?;
    Ok(CurveFile { axis, weighted: standard_error.is_some(), curves })
}

/// The column whose whole name, or else its first word, is one of these; earlier words have priority.
fn detect<'a>(table: &'a Recording, words: &[&str]) -> Option<&'a Column> {
    let whole = |column: &Column| column.name.to_lowercase();
    let first = |column: &Column| {
        let name = whole(column);
        name.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default().to_owned()
    };
    let deviation = |column: &Column| whole(column).split('_').any(|word| ["std", "sd", "n"].contains(&word));
    let by = |name: &dyn Fn(&Column) -> String| {
        let of = |word: &&str| table.columns().iter().find(|c| name(c) == **word && !deviation(c));
        words.iter().find_map(of)
    };
    by(&whole).or_else(|| by(&first))
}

/// Whether a column's first word is one of these.
fn starts_with_word(column: &Column, words: &[&str]) -> bool {
    let name = column.name.to_lowercase();
    words.contains(&name.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default())
}

/// Kind of axis by the units or, without any, by the names of the columns; and SI units in one of the velocity's.
fn speed(velocity: &Column, torque: &Column, table: &Recording) -> Result<(Axis, f64), Error> {
    let force = torque.unit.as_deref().and_then(measure).is_some_and(|(d, _)| d == Dimension::Force);
    let force = force || torque.unit.is_none() && starts_with_word(torque, FORCE);
    let Some(unit) = velocity.unit.as_deref() else {
        return Ok((if force { Axis::Linear } else { Axis::Rotary }, 1.0));
    };
    match measure(unit) {
        Some((Dimension::Velocity, factor)) => Ok((Axis::Linear, factor)),
        Some((Dimension::AngularVelocity, factor)) => Ok((Axis::Rotary, factor)),
        _ => Err(unfit(unit, &[Dimension::Velocity, Dimension::AngularVelocity], &place(velocity, table))),
    }
}

fn factor(column: &Column, dimension: Dimension, table: &Recording) -> Result<f64, Error> {
    let unit = column.unit.as_deref().unwrap_or(dimension.si_unit());
    stickslip_base::units::si_factor(unit, dimension, &place(column, table))
}

fn place(column: &Column, table: &Recording) -> String {
    format!("{}: column `{}`", table.path().display(), column.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_fit::{Side, StribeckDrop, StribeckPlan, fit_stribeck};

    fn data(name: &str) -> CurveFile {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data").join(name);
        read_curves(&path, &CurveColumns::default()).unwrap()
    }

    fn parse(text: &str) -> Result<CurveFile, Error> {
        curves(&Recording::parse(Path::new("curve.csv"), text.as_bytes()).unwrap(), &CurveColumns::default())
    }

    #[test]
    fn joint_1_drops_at_an_uncertain_velocity_and_joint_2_does_not_drop() {
        let file = data("direct_drive_joint/friction_curve.csv");
        assert!(file.axis == Axis::Rotary && !file.weighted);
        let [one, two] = &file.curves[..] else { panic!("{} curves", file.curves.len()) };
        assert_eq!((one.name.as_str(), two.name.as_str(), one.points.len()), ("joint 1", "joint 2", 40));
        let fit = |curve: &Curve, side| {
            fit_stribeck(&curve.points, &StribeckPlan { side, ..StribeckPlan::default() }).unwrap()
        };
        // The data's README gives these, ± one standard deviation: half of it is a fair distance for another search.
        for (curve, side, published) in [
            (one, Side::Positive, [(15.3, 1.2), (12.56, 0.36), (0.009, 0.008), (3.35, 0.45)]),
            (two, Side::Positive, [(1.45, 0.07), (1.94, 0.09), (0.054, 0.030), (0.15, 0.09)]),
            (two, Side::Negative, [(1.26, 0.07), (1.74, 0.11), (0.074, 0.045), (0.06, 0.11)]),
        ] {
            let fit = fit(curve, side);
            for (ours, (theirs, deviation)) in fit.parameters.iter().zip(published) {
                assert!((ours - theirs).abs() < 0.5 * deviation, "{} {side:?}: {:?}", curve.name, fit.parameters);
            }
        }
        let positive = fit(one, Side::Positive);
        // 20 points, of which the fast ones scatter by 3 N m: without a drop the probability of this one is 0.016.
        match positive.drop {
            StribeckDrop::Identified { drop, .. } => assert!((2.0..4.0).contains(&drop)),
            other => panic!("{other}"),
        }
        let [low, high] = positive.ci95[2];
        assert!(high > 5.0 * low, "interval of the Stribeck velocity: {low} … {high}");
        for side in [Side::Positive, Side::Negative] {
            assert!(matches!(fit(two, side).drop, StribeckDrop::Absent { .. }), "{:?}", fit(two, side).drop);
        }
    }

    #[test]
    fn the_binned_curve_of_a_recording_is_found_by_its_names() {
        let file = data("emps/friction_curve.csv");
        assert!(file.axis == Axis::Linear, "F_median is a force");
        assert!(file.curves.len() == 1 && file.curves[0].name.is_empty() && file.curves[0].points.len() > 20);
        assert!(file.curves[0].points.iter().all(|p| p.standard_error == 1.0));
    }

    #[test]
    fn parameters_that_a_curve_does_not_determine_are_unknown() {
        let points = &data("emps/friction_curve.csv").curves[0].points;
        let fit = fit_stribeck(points, &StribeckPlan { side: Side::Positive, ..StribeckPlan::default() }).unwrap();
        // It rises degressively up to its end: level and slope of its fast branch are not determined separately.
        assert!(fit.knows(0) && !fit.knows(1) && !fit.knows(3), "{:?}", fit.ci95);
        let lines: Vec<String> = fit.lines().map(|(_, estimate)| estimate.to_string()).collect();
        assert!(lines[0].contains('±') && lines[1] == "unknown" && lines[3] == "unknown", "{lines:?}");
    }

    #[test]
    fn units_determine_the_kind_of_axis() {
        let linear = parse("speed [mm/s],friction [N],standard_error\n10,20,0.5\n-10,-21,0.5\n").unwrap();
        assert!(linear.axis == Axis::Linear && linear.weighted);
        assert_eq!(linear.curves[0].points[1], CurvePoint { velocity: -0.01, torque: -21.0, standard_error: 0.5 });
        let rotary = parse("n [rpm];M [mNm]\n60;20\n");
        assert!(
            matches!(
                rotary.as_ref().err().and_then(|error| error.of()),
                Some(stickslip_recording::RecordingError::MissingColumn { .. })
            ),
            "n counts samples: {rotary:?}"
        );
        let rotary = parse("Drehzahl [1/min];M [mNm];se [mNm]\n60;20,5;1\n").unwrap();
        let point = rotary.curves[0].points[0];
        assert!((point.velocity - std::f64::consts::TAU).abs() < 1e-12 && rotary.axis == Axis::Rotary);
        assert!((point.torque - 0.0205).abs() < 1e-15 && (point.standard_error - 1e-3).abs() < 1e-15);
    }

    #[test]
    fn an_invalid_curve_is_refused_with_its_place() {
        for (text, expected) in [
            ("omega,x\n1,2\n", "unknown column `torque`. Columns: omega, x."),
            ("omega [rad/s],torque [N]\n1,2\n", "curve.csv: column `torque`: unit \"N\""),
            ("omega [kg],torque\n1,2\n", "curve.csv: column `omega`: unit \"kg\""),
            ("omega,torque,se\n1,2,0\n", "point 1 of the friction curve: standard_error = 0"),
            ("omega,torque\n1,x\n", "curve.csv:2: column `torque`"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
