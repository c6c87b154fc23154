//! Stribeck curves through measured friction curves, and the parameters that the data do not determine.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use stickslip_core::friction::Stribeck;

use super::draw::{curve, friction, torque};
use super::measure::PRELOAD;
use super::write_columns;
use crate::{Addition, FrictionCurve, Goal, next_speeds};
use stickslip_base::figure::{Axis as FigureAxis, Figure, Role, Series};
use stickslip_base::quantity::{Estimate, NORMAL95, number, rough};
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, output, parameters};
use stickslip_fit::uncertainty::JointDistribution;
use stickslip_fit::{CurvePoint, PARAMETERS, Side, StribeckDrop, StribeckFit, StribeckPlan, fit_stribeck};
use stickslip_identify::curve_file::{CurveColumns, CurveFile, curves};
use stickslip_identify::machine::Axis;
use stickslip_recording::Recording;

/// Plateaus that the advice adds.
const MORE: usize = 4;

/// The fits of a file of friction curves.
#[derive(Clone, Debug)]
pub struct FrictionFits {
    /// The file.
    pub file: PathBuf,
    /// Rotary (rad/s, N m) or linear (m/s, N).
    pub axis: Axis,
    /// Preload of the friction wheel, if the file states it.
    pub preload: Option<f64>,
    /// One fit for each curve, or for each direction of each curve.
    pub fits: Vec<Fitted>,
}

/// One fit.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Curve and direction; empty if there is only one of both.
    pub name: String,
    /// The fitted points.
    pub points: Vec<CurvePoint>,
    /// The side of the points that is fitted.
    pub side: Side,
    /// Whether the file has their standard errors.
    pub weighted: bool,
    /// The curve.
    pub fit: StribeckFit,
}

/// Fits the curves of a file or of a measurement's folder: both directions as one curve, or each direction as a curve
/// of its own.
///
/// # Errors
/// Errors of [`curves`]; too few points.
pub fn fit_file(path: &Path, columns: &CurveColumns, each_direction: bool) -> Result<FrictionFits, Error> {
    let file = if path.is_dir() { path.join("curve.csv") } else { path.to_owned() };
    let table = Recording::read(&file)?;
    let CurveFile { axis, weighted, curves } = curves(&table, columns)?;
    let preload = table.column(PRELOAD).ok().and_then(|column| column.values.first().copied());
    let sides: &[(Side, &str)] = if each_direction {
        &[(Side::Positive, "positive"), (Side::Negative, "negative")]
    } else {
        &[(Side::Both, "")]
    };
    let mut fits = Vec::new();
    for curve in curves {
        for &(side, direction) in sides {
            let name =
                [curve.name.as_str(), direction].iter().filter(|word| !word.is_empty()).copied().collect::<Vec<_>>();
            fits.push(Fitted::of(name.join(" "), &curve.points, side, weighted)?);
        }
    }
    Ok(FrictionFits { file, axis, preload, fits })
}

impl Fitted {
    /// Fits the points on a side. `weighted`: their standard errors are absolute, from a measurement; otherwise only
    /// their ratios are used and the scatter determines the scale.
    ///
    /// # Errors
    /// An invalid point; too few points.
    pub fn of(name: String, points: &[CurvePoint], side: Side, weighted: bool) -> Result<Self, Error> {
        let plan = if weighted {
            FrictionCurve::FIT
        } else {
            StribeckPlan { huber: FrictionCurve::FIT.huber, ..StribeckPlan::default() }
        };
        let counts = |point: &&CurvePoint| match side {
            Side::Positive => point.velocity > 0.0,
            Side::Negative => point.velocity < 0.0,
            Side::Both => true,
        };
        let points: Vec<CurvePoint> = points.iter().filter(counts).copied().collect();
        let plan = StribeckPlan { side, ..plan };
        let fit = fit_stribeck(&points, &plan)?.or_coulomb(&points, &plan)?;
        Ok(Fitted { name, points, side, weighted, fit })
    }

    /// Plateaus that narrow the interval of the least certain parameter most: its index and the plateaus.
    pub fn advice(&self) -> (usize, Addition) {
        if self.fit.is_coulomb() {
            // More of the same speeds do not show a drop; the finding names the slower ones.
            return (0, Addition { speeds: Vec::new(), shrinks_to: [1.0; 4] });
        }
        let width = |i: usize| (self.fit.ci95[i][1] - self.fit.ci95[i][0]) / self.fit.parameters[i];
        let worst = (0..4).max_by(|a, b| width(*a).total_cmp(&width(*b))).unwrap_or(0);
        let mut errors: Vec<f64> = self.points.iter().map(|point| point.standard_error).collect();
        errors.sort_by(f64::total_cmp);
        let typical = if self.weighted { errors[errors.len() / 2] } else { self.fit.rms };
        let error = libm::hypot(typical, self.fit.lack_of_fit);
        (worst, next_speeds(&self.fit, self.fit.speeds, error, MORE, Goal::Parameter(worst)))
    }

    /// Velocity, torque, standard error, fitted torque and half-width of its 95 % band at each point.
    fn rows(&self) -> impl Iterator<Item = [f64; 5]> + '_ {
        let law = self.fit.curve();
        self.points.iter().map(move |point| {
            let CurvePoint { velocity, torque, standard_error } = *point;
            let error = if self.weighted { standard_error } else { f64::NAN };
            [velocity, torque, error, law.torque(velocity), self.fit.band95(velocity.abs())]
        })
    }
}

impl FrictionFits {
    /// SI units of torque and of speed.
    fn units(&self) -> [&'static str; 2] {
        if self.axis == Axis::Linear { ["N", "m/s"] } else { ["N m", "rad/s"] }
    }

    /// Text on a rotary axis, adapted to this axis.
    fn words(&self, text: &str) -> String {
        if self.axis == Axis::Rotary {
            return text.into();
        }
        let words = [
            ("torque M", "force F"),
            ("torque", "force"),
            ("Ω_Strib", "v_Strib"),
            ("N m s/rad", "N s/m"),
            ("rad/s", "m/s"),
            ("N m", "N"),
        ];
        words.iter().fold(text.to_owned(), |text, (rotary, linear)| text.replace(rotary, linear))
    }

    /// The parameters of a fit: key, name and value.
    pub fn parameters<'a>(&'a self, fitted: &'a Fitted) -> impl Iterator<Item = (&'static str, String, Estimate)> + 'a {
        let keys = PARAMETERS.iter().map(|(key, ..)| *key);
        keys.zip(fitted.fit.lines()).map(|(key, (name, estimate))| {
            let unit = self.words(&estimate.unit);
            (key, self.words(name), Estimate { unit, ..estimate })
        })
    }

    /// Parameters that the data do not determine, and the measurements that determine them.
    pub fn advice(&self, fitted: &Fitted) -> Vec<String> {
        let speed_unit = self.units()[1];
        let mut advice = Vec::new();
        if let StribeckDrop::Identified { drop, ci95: [low, high] } = fitted.fit.drop {
            let drop = Estimate::new(drop, self.units()[0]).with_half_width(0.5 * (high - low));
            advice.push(format!("Friction falls by {drop} from rest to sliding (Stribeck effect)."));
        }
        advice.extend(fitted.fit.findings().iter().map(|finding| self.words(&finding.to_string())));
        if !fitted.fit.outliers.is_empty() {
            let velocity = |index: &usize| {
                let velocity = fitted.points[*index].velocity;
                format!("{}{}", if velocity < 0.0 { "−" } else { "" }, rough(velocity.abs()))
            };
            let at: Vec<String> = fitted.fit.outliers.iter().map(velocity).collect();
            advice.push(format!(
                "Points far from the curve have little weight: at {} {speed_unit}. Repeat them.",
                at.join(", ")
            ));
        }
        let (worst, addition) = fitted.advice();
        if !addition.speeds.is_empty() {
            let mut speeds = addition.speeds.clone();
            speeds.sort_by(f64::total_cmp);
            let mut plateaus: Vec<(String, usize)> = Vec::new();
            for speed in speeds.iter().map(|speed| rough(*speed)) {
                match plateaus.last_mut().filter(|(last, _)| *last == speed) {
                    Some((_, count)) => *count += 1,
                    None => plateaus.push((speed, 1)),
                }
            }
            let at: Vec<String> = plateaus.iter().map(|(speed, count)| format!("{count} at {speed}")).collect();
            advice.push(format!(
                "The {} is least certain. More plateaus, {} {speed_unit}, narrow its interval by {} %.",
                self.words(PARAMETERS[worst].1),
                at.join(", "),
                number(100.0 * (1.0 - addition.shrinks_to[worst]), 0)
            ));
        }
        advice
    }

    /// Reason for a missing parameter fragment: the bench has one rotary curve for both directions.
    fn no_fragment(&self) -> Option<&'static str> {
        match self.fits.as_slice() {
            _ if self.axis == Axis::Linear => Some("a parameter file requires a rotary axis, and this axis is linear"),
            [one] if !one.fit.is_coulomb() && (0..4).any(|parameter| !one.fit.knows(parameter)) => {
                Some("the points do not determine all four parameters; the notes name the missing measurements")
            }
            [one] if one.side == Side::Both => None,
            _ => Some("a parameter file has one curve for both directions, and there are several fits"),
        }
    }

    /// `fit.toml`: the own friction as a part of a parameter file, with its [`uncertainty`](stickslip_fit::uncertainty).
    ///
    /// # Errors
    /// [`Error::Parameters`] if a fitted value is outside a parameter's range.
    pub fn fragment(&self) -> Result<Result<String, &'static str>, Error> {
        if let Some(reason) = self.no_fragment() {
            return Ok(Err(reason));
        }
        let one = &self.fits[0];
        let mut text = format!(
            "# Own friction of {}.\n# A part of a parameter file: omitted parameters have their defaults.\n",
            self.file.display()
        );
        if let Some(preload) = self.preload {
            write!(text, "\n[plant.wheel]\npreload = {preload:?} # friction wheel during the measurement\n")
                .expect("writing to a string cannot fail");
        }
        text += "\n[model.own]\n";
        for ((key, ..), (value, (_, estimate))) in PARAMETERS.iter().zip(one.fit.parameters.iter().zip(one.fit.lines()))
        {
            writeln!(text, "{key} = {value:?} # {estimate}").expect("writing to a string cannot fail");
        }
        if one.fit.is_coulomb() {
            text += "# No Stribeck drop in this data: breakaway torque equal to the kinetic torque, Stribeck velocity without effect.\n";
        } else {
            text += &JointDistribution::of_fit(&one.fit, "model.own").to_toml();
        }
        parameters::read::<Preset<f64>>(&text, "fit.toml")?;
        Ok(Ok(text))
    }

    /// The numbers, under their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("fit");
        let unit = self.units()[0];
        for fitted in &self.fits {
            let key = match fitted.name.as_str() {
                "" => "fit".to_owned(),
                name => format!("fit.{}", name.replace(' ', "_")),
            };
            for ((name, _, estimate), ci95) in self.parameters(fitted).zip(fitted.fit.ci95) {
                summary.with_interval(&format!("{key}.{name}"), estimate.value, ci95, &estimate.unit);
            }
            summary
                .result(&format!("{key}.points"), fitted.points.len() as f64, "1")
                .result(&format!("{key}.rms"), fitted.fit.rms, unit)
                .result(&format!("{key}.lack_of_fit"), fitted.fit.lack_of_fit, unit);
            for [velocity, torque, standard_error, fit, band] in fitted.rows() {
                summary.row([
                    ("fit", fitted.name.as_str().into()),
                    ("velocity", velocity.into()),
                    ("torque", torque.into()),
                    ("standard_error", standard_error.into()),
                    ("fitted", fit.into()),
                    ("band95", band.into()),
                ]);
            }
        }
        summary
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let own = self.fragment().ok().and_then(Result::ok).unwrap_or_default();
        let points: usize = self.fits.iter().map(|fitted| fitted.points.len()).sum();
        let mut report = Report::new("Friction curve and its fit", Provenance::new(command, None, own))
            .summary(format!("{points} points of {}, fitted by the Stribeck curve.", self.file.display()));
        for fitted in &self.fits {
            if self.fits.len() > 1 {
                report = report.heading(&fitted.name);
            }
            let table = Table::new(["parameter", "fitted"]).caption("The parameters with their 95\u{a0}% intervals.");
            let table = self
                .parameters(fitted)
                .fold(table, |table, (_, name, estimate)| table.row([name.into(), Cell::Estimate(estimate)]));
            let [(fit, caption), (residuals, about)] = self.figures(fitted);
            report = report.table(table).figure(fit, caption).figure(residuals, about).list(self.advice(fitted));
        }
        report
    }

    /// The fit with its points, and the residuals.
    fn figures(&self, fitted: &Fitted) -> [(Figure, String); 2] {
        let [unit, speed_unit] = self.units();
        let speed = || FigureAxis::new(if speed_unit == "m/s" { "speed v" } else { "speed Ω" }, speed_unit).stretched();
        let law: Stribeck<f64> = fitted.fit.curve();
        let here = |velocity: f64| match fitted.side {
            Side::Positive => velocity > 0.0,
            Side::Negative => velocity < 0.0,
            Side::Both => true,
        };
        let line = || curve(&law, fitted.fit.speeds[1]).filter(|(velocity, _)| velocity.is_nan() || here(*velocity));
        let band = line().map(|(velocity, torque)| {
            let half_width = fitted.fit.band95(velocity.abs());
            (velocity, torque - half_width, torque + half_width)
        });
        let with_bar = |value: fn([f64; 5]) -> f64| {
            // NaN has no bar.
            fitted.rows().map(move |row| (row[0], value(row), NORMAL95 * row[2])).collect::<Vec<_>>()
        };
        let figure = friction("Friction curve and its fit")
            .x(speed())
            .y(FigureAxis::new(self.words("friction torque"), unit))
            .series(Series::band(Role::Fitted, "95 %", band))
            .series(Series::line(Role::Fitted, "fit", line()))
            .series(Series::bars(Role::Measured, "measured", with_bar(|[_, torque, ..]| torque)));
        let caption = format!(
            "Points, fitted Stribeck curve with residual {} rms, and its 95\u{a0}% band.",
            self.words(&torque(fitted.fit.rms))
        );
        let residuals = Figure::new("Residuals of the fit")
            .x(speed())
            .y(FigureAxis::new("measured − fitted", unit))
            .series(Series::bars(Role::Measured, "residuals", with_bar(|[_, torque, _, fit, _]| torque - fit)));
        let about = format!(
            "Residuals with the 95\u{a0}% intervals of their points. Probability of their runs of one sign by chance: {}.",
            number(fitted.fit.runs_probability, 2)
        );
        [(figure, caption), (residuals, about)]
    }

    /// Writes `fit.toml` if there is one, the points with their fit, report and summary. Returns the summary, and the
    /// reason for a missing `fit.toml`.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses; [`Error::Parameters`] as [`fragment`](Self::fragment).
    pub fn write(&self, directory: &Path, command: &str) -> Result<(Summary, Option<&'static str>), Error> {
        output::create_folder(directory)?;
        let mut summary = self.summary();
        let missing = match self.fragment()? {
            Ok(text) => {
                output::write(&directory.join("fit.toml"), text)?;
                summary.file("fit.toml");
                None
            }
            Err(reason) => Some(reason),
        };
        let [unit, speed] = self.units();
        let names =
            [("velocity", speed), ("torque", unit), ("standard_error", unit), ("fitted", unit), ("band95", unit)];
        let rows: Vec<[f64; 5]> = self.fits.iter().flat_map(Fitted::rows).collect();
        let column = |(index, (name, unit)): (usize, (&str, &str))| Column {
            name: name.into(),
            unit: unit.into(),
            values: rows.iter().map(|row| row[index]).collect(),
        };
        let columns: Vec<Column> = names.into_iter().enumerate().map(column).collect();
        write_columns(&mut summary, "fitted", &columns, directory)?;
        Ok((self.report(command).write_all(summary, [], directory)?, missing))
    }
}
