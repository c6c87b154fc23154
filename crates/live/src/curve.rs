//! Friction curves for a picture: the running measurement and earlier runs, each with its fit.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::catalogue;
use super::measurements::Measurements;
use stickslip_base::Error;
use stickslip_base::figure::{Role, Series};
use stickslip_base::quantity::NORMAL95;
use stickslip_experiment::workflow;
use stickslip_experiment::workflow::draw::grid;
use stickslip_experiment::workflow::fit::fit_file;
use stickslip_experiment::workflow::render::{RENDERED, Rendering};
use stickslip_experiment::{FrictionCurve, Plateau};
use stickslip_fit::{CurvePoint, PARAMETERS, StribeckFit};
use stickslip_identify::curve_file::{CurveColumns, read_curves};

/// A friction curve, complete or during its measurement.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeasuredCurve {
    /// Number of the run; `null` during the measurement and if there is none.
    pub run: Option<u64>,
    /// Whether the measurement is running.
    pub measuring: bool,
    /// Whether the load motor rendered the desired friction.
    pub rendered: bool,
    /// The points used by the fit.
    pub points: Vec<MeasuredPoint>,
    /// Noisy samples, velocity [rad/s] and torque [N m] of each part; empty for an earlier run.
    pub course: Vec<[f64; 2]>,
    /// The Stribeck curve through the points.
    pub fit: Option<FittedCurve>,
    /// Why there is no fit, and which points are not used, each with a remedy.
    pub notes: Vec<String>,
}

/// A point of a friction curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeasuredPoint {
    /// Velocity [rad/s].
    pub velocity: f64,
    /// Torque, with the sign of the velocity [N m].
    pub torque: f64,
    /// Half the width of its 95 % interval [N m].
    pub half_width: f64,
    /// Measured minus fitted torque [N m]; `null` without a fit.
    pub residual: Option<f64>,
}

/// A Stribeck curve through measured points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FittedCurve {
    /// Velocities of the line, rising; `null` is the gap at standstill [rad/s].
    pub velocity: Vec<Option<f64>>,
    /// Torques of the line [N m].
    pub torque: Vec<Option<f64>>,
    /// Half the width of its 95 % band [N m].
    pub band: Vec<Option<f64>>,
    /// Its parameters.
    pub parameters: Vec<FittedParameter>,
    /// RMS of the residuals [N m].
    pub rms: f64,
    /// RMS of the residuals as a share of the breakaway torque; `null` if that is 0.
    pub misfit: Option<f64>,
    /// Parameters that the data do not determine, and the measurements that would.
    pub findings: Vec<String>,
    /// Values to adopt it as own friction, by path, as for `set`; empty if a parameter is unknown.
    pub own: BTreeMap<String, String>,
}

/// A parameter of a fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FittedParameter {
    /// Key in files.
    pub key: String,
    /// Name.
    pub name: String,
    /// Symbol in equations.
    pub symbol: String,
    /// Value as printed; `unknown` if the data do not determine it.
    pub value: String,
    /// Half the width of its 95 % interval as printed, without the sign.
    pub half_width: String,
    /// The unit of both, with its prefix.
    pub unit: String,
    /// Whether the data determine it.
    pub known: bool,
}

/// A run with a friction curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurveName {
    /// Its number.
    pub run: u64,
    /// Name of its folder.
    pub name: String,
    /// Whether the load motor rendered the desired friction.
    pub rendered: bool,
}

/// The running or last measurement of a friction curve.
#[derive(Clone, Debug, Default)]
pub(super) struct CurveProgress {
    /// Number of its folder.
    pub(super) run: u64,
    /// Whether the measurement is running.
    pub(super) measuring: bool,
    /// The rendering during the measurement, if any.
    pub(super) planned: Option<Box<Rendering>>,
    pub(super) plateaus: Vec<Plateau>,
    /// Number and plateaus of the last measured own friction.
    own: (u64, Vec<Plateau>),
}

impl CurveProgress {
    /// Starts another measurement; the last measured own friction is kept.
    pub(super) fn begin(&mut self, run: u64, planned: Option<Box<Rendering>>) {
        let before = std::mem::take(self);
        let own = if before.planned.is_none() { (before.run, before.plateaus) } else { before.own };
        *self = CurveProgress { run, measuring: true, planned, plateaus: Vec::new(), own };
    }

    /// The plateaus of a run measured since the start of the bench.
    fn of(&self, run: u64) -> Option<FrictionCurve> {
        match run {
            run if run == self.run => Some(of(self.plateaus.clone())),
            run if run == self.own.0 => Some(of(self.own.1.clone())),
            _ => None,
        }
    }
}

impl Measurements {
    /// The runs with a friction curve, the newest first.
    pub(super) fn curves(&self) -> Vec<CurveName> {
        let mut names: Vec<_> = std::fs::read_dir(&self.folder)
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| entry.path().join("curve.csv").exists())
            .filter_map(|entry| {
                let name = entry.file_name().into_string().ok()?;
                let rendered = entry.path().join(format!("{RENDERED}.csv")).exists();
                Some(CurveName { run: number(&name)?, name, rendered })
            })
            .collect();
        names.sort_by_key(|name| std::cmp::Reverse(name.run));
        names
    }

    /// The curve of a run; default: the running measurement, or the last own friction.
    pub(super) fn curve(&self, run: Option<u64>) -> Result<MeasuredCurve, Error> {
        let current = self.current_curve();
        if run.is_none() && current.measuring {
            return Ok(MeasuredCurve { rendered: current.planned.is_some(), ..running_curve(current.plateaus) });
        }
        let names = self.curves();
        let name = match run {
            None => match names.iter().find(|name| !name.rendered) {
                Some(name) => name,
                None => return Ok(MeasuredCurve::default()),
            },
            Some(run) => names.iter().find(|name| name.run == run).ok_or_else(|| Error::Unknown {
                what: "run with a friction curve",
                name: run.to_string(),
                remedy: "The call `curves` lists them.".into(),
            })?,
        };
        let mut curve = of_folder(&self.folder.join(&name.name))?;
        (curve.run, curve.rendered) = (Some(name.run), name.rendered);
        curve.notes.extend(catalogue::incomplete(&self.folder.join(&name.name)));
        if let Some(measured) = current.of(name.run) {
            curve.course = course(&measured);
            curve.notes.extend(workflow::measure::Outcome::warnings(&measured));
        }
        Ok(curve)
    }

    /// The noisy samples of the last measured own friction; its points, if it was measured before the start of the bench.
    pub(super) fn own_friction(&self) -> Option<Series> {
        let name = self.curves().into_iter().find(|name| !name.rendered)?;
        if let Some(curve) = self.current_curve().of(name.run) {
            return Some(workflow::draw::measured(&curve));
        }
        let curve = of_folder(&self.folder.join(&name.name)).ok()?;
        let points = curve.points.iter().map(|point| (point.velocity, point.torque));
        Some(Series::points(Role::Measured, "measured", points))
    }
}

/// The number in the name of a run's folder.
pub(super) fn number(name: &str) -> Option<u64> {
    name.split_once('-')?.0.parse().ok()
}

pub(super) fn of(plateaus: Vec<Plateau>) -> FrictionCurve {
    FrictionCurve { plateaus, ripple: 0.0, duration: 0.0, complete: false }
}

fn course(curve: &FrictionCurve) -> Vec<[f64; 2]> {
    workflow::draw::points(curve).map(|(velocity, torque)| [velocity, torque]).collect()
}

fn running_curve(plateaus: Vec<Plateau>) -> MeasuredCurve {
    let curve = of(plateaus);
    let (points, course) = (curve.points(), course(&curve));
    let fit = curve.fit().ok();
    let notes = workflow::measure::Outcome::warnings(&curve);
    MeasuredCurve {
        run: None,
        measuring: true,
        rendered: false,
        points: shown_points(&points, fit.as_ref()),
        course,
        fit: fit.map(|fit| FittedCurve::of(&fit, Vec::new())),
        notes,
    }
}

/// The curve in the folder of a run, with its fit as by `stickslip fit`.
fn of_folder(folder: &Path) -> Result<MeasuredCurve, Error> {
    let fits = match fit_file(folder, &CurveColumns::default(), false) {
        Ok(fits) => fits,
        // Too few points for a fit: reported in a note.
        Err(error @ Error::TooFew { .. }) => {
            let file = folder.join(format!("{}.csv", <FrictionCurve as workflow::measure::Outcome>::DATA));
            let curves = read_curves(&file, &CurveColumns::default())?.curves;
            let points = curves.first().map_or_else(Vec::new, |curve| shown_points(&curve.points, None));
            return Ok(MeasuredCurve { points, notes: vec![error.to_string()], ..MeasuredCurve::default() });
        }
        Err(error) => return Err(error),
    };
    let Some(one) = fits.fits.first() else { return Ok(MeasuredCurve::default()) };
    Ok(MeasuredCurve {
        points: shown_points(&one.points, Some(&one.fit)),
        fit: Some(FittedCurve::of(&one.fit, fits.advice(one))),
        ..MeasuredCurve::default()
    })
}

fn shown_points(points: &[CurvePoint], fit: Option<&StribeckFit>) -> Vec<MeasuredPoint> {
    let curve = fit.map(StribeckFit::curve);
    let shown = |point: &CurvePoint| MeasuredPoint {
        velocity: point.velocity,
        torque: point.torque,
        half_width: NORMAL95 * point.standard_error,
        residual: curve.as_ref().map(|curve| point.torque - curve.torque(point.velocity)),
    };
    points.iter().map(shown).collect()
}

impl FittedCurve {
    fn of(fit: &StribeckFit, findings: Vec<String>) -> Self {
        let law = fit.curve();
        let velocity: Vec<f64> = grid(fit.speeds[1]).collect();
        let column = |value: &dyn Fn(f64) -> f64| {
            let at = |velocity: &f64| Some(value(*velocity)).filter(|value| value.is_finite());
            velocity.iter().map(at).collect::<Vec<_>>()
        };
        let parameters =
            PARAMETERS.iter().zip(fit.lines()).enumerate().map(|(index, ((key, ..), (name, estimate)))| {
                let written = estimate.written();
                let (name, symbol) = name.rsplit_once(' ').unwrap_or((name, ""));
                FittedParameter {
                    key: (*key).into(),
                    name: name.into(),
                    symbol: symbol.into(),
                    value: written.value,
                    half_width: written.half_width,
                    unit: written.unit,
                    known: fit.knows(index),
                }
            });
        let complete = (0..PARAMETERS.len()).all(|index| fit.knows(index));
        let own = PARAMETERS.iter().zip(fit.parameters).filter(|_| complete);
        let breakaway = law.breakaway_torque;
        FittedCurve {
            torque: column(&|velocity| law.torque(velocity)),
            band: column(&|velocity| fit.band95(velocity.abs())),
            velocity: column(&|velocity| velocity),
            parameters: parameters.collect(),
            rms: fit.rms,
            misfit: (breakaway > 0.0).then(|| fit.rms / breakaway),
            findings,
            own: own.map(|((key, ..), value)| (format!("model.own.{key}"), format!("{value:?}"))).collect(),
        }
    }
}
