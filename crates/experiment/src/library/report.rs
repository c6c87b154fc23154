//! Figures and report of an entry of the library.

use std::path::Path;

use stickslip_core::fields::{Field, Fields as _, Walk};
use stickslip_core::friction::{Friction, Model};

use super::{Entry, Identified};
use crate::workflow::draw::{Captioned, friction, grid};
use crate::workflow::sketch::presliding;
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::parameters::{self, Value, flatten};
use stickslip_base::quantity::{Estimate, NORMAL95, tied};
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::{Error, Summary, output};

/// Range of a curve without a stated speed, in Stribeck velocities.
const SETTLED: f64 = 20.0;
/// Way of a presliding loop, in deflections at breakaway.
const WAY: f64 = 1.5;

/// Adds an amount to one number.
struct Nudge {
    index: usize,
    by: f64,
}

impl Walk<f64> for Nudge {
    fn number(&mut self, _: &'static Field, value: &mut f64) {
        if self.index == 0 {
            *value += self.by;
        }
        self.index = self.index.wrapping_sub(1);
    }
}

impl Entry {
    /// Friction torque at a constant velocity [N m] and its standard deviation by the deviations that the source states
    /// for the parameters, taken as independent.
    pub fn torque(&self, velocity: f64) -> (f64, f64) {
        let at = |identified: &Identified<f64>| identified.friction.steady_torque(velocity, 0.0, 0.0);
        let middle = at(&self.identified);
        let numbers = flatten(&self.identified).into_iter().filter(|entry| matches!(entry.value, Value::Number(_)));
        let squares = numbers.enumerate().filter_map(|(index, entry)| {
            let by = *self.about.deviations.get(&entry.path)?;
            let mut nudged = self.identified;
            nudged.contents(&mut Nudge { index, by });
            Some((at(&nudged) - middle).powi(2))
        });
        (middle, libm::sqrt(squares.sum()))
    }

    /// All numbers, with their 95 % intervals where the source states deviations.
    pub fn table(&self) -> Table {
        flatten(&self.identified).into_iter().fold(Table::new(["parameter", "value"]), |table, entry| {
            let value = match entry.value {
                Value::Variant(name) => Cell::from(name),
                Value::Number(0.0) if entry.path.starts_with("range.") => Cell::from("unknown"),
                Value::Number(value) => {
                    let estimate = Estimate::new(value, entry.field.unit);
                    Cell::Estimate(match self.about.deviations.get(&entry.path) {
                        Some(deviation) => estimate.with_half_width(NORMAL95 * deviation),
                        None => estimate,
                    })
                }
            };
            table.row([entry.path.into(), value])
        })
    }

    /// Limits of the model, missing information of the source, and the recommended step.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks: Vec<String> = self.limits().into_iter().map(String::from).collect();
        remarks.extend(self.about.lacks.iter().cloned());
        let range = &self.identified.range;
        remarks.push(if range.fastest > 0.0 {
            let [slowest, fastest] = [range.slowest, range.fastest].map(|speed| tied(&Estimate::new(speed, "rad/s")));
            format!("Identified from {slowest} to {fastest}; extrapolated outside.")
        } else {
            "The speed range of the identification is unknown.".into()
        });
        if let Some(step) = self.recommended_step() {
            let step = tied(&Estimate::new(step, "s"));
            let inertia = tied(&Estimate::new(range.inertia, "kg m^2"));
            remarks.push(format!("Recommended step on {inertia}: {step}, a tenth of the largest stable step."));
        }
        remarks
    }

    /// All figures with file name and caption.
    fn figures(&self) -> Vec<Captioned> {
        let Identified { friction: shown, range } = &self.identified;
        let stribeck = self.sliding().map_or(1.0, |sliding| sliding.stribeck_velocity);
        let fastest = if range.fastest > 0.0 { range.fastest } else { SETTLED * stribeck };
        let curve = || grid(fastest).map(|velocity| (velocity, self.torque(velocity)));
        let line = curve().map(|(velocity, (torque, _))| (velocity, torque));
        let band =
            curve().map(|(v, (torque, deviation))| (v, torque - NORMAL95 * deviation, torque + NORMAL95 * deviation));
        let mut sliding = friction("Friction at constant speed");
        if !self.about.deviations.is_empty() {
            sliding = sliding.series(Series::band(Role::Own, "95 %", band));
        }
        let sliding = sliding.series(Series::line(Role::Own, self.name.clone(), line));
        let caption = if self.about.deviations.is_empty() {
            "Friction measured at constant speed. The source states no uncertainty."
        } else {
            "Friction measured at constant speed. The band contains the standard deviations that the source states, \
             taken as independent."
        };
        let mut figures = vec![("curve.svg", sliding, caption.to_string())];
        if let Some(way) = breakaway_way(shown) {
            let felt = presliding(shown, WAY * way);
            let points = felt.angle.iter().zip(&felt.torque).map(|(angle, torque)| (1e3 * angle, *torque));
            let loops = Figure::new("Presliding loop")
                .x(Axis::new("angle φ", "mrad"))
                .y(Axis::new("friction torque", "N m"))
                .series(Series::line(Role::Own, self.name.clone(), points));
            let caption = "Slow motion from rest to 1.5 times the deflection at breakaway, back and forth.";
            figures.push(("presliding.svg", loops, caption.into()));
        }
        figures
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance::new(command, None, parameters::write_commented(&self.identified));
        let about = &self.about;
        let report = Report::new(about.title.clone(), provenance)
            .summary(format!("{}. Licence: {}.", about.source, about.licence))
            .list(self.remarks());
        let report =
            self.figures().into_iter().fold(report, |report, (_, figure, caption)| report.figure(figure, caption));
        report.table(self.table().caption("All numbers, with 95 % intervals where the source states a deviation."))
    }

    /// The numbers, under their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("friction");
        if let Some(sliding) = self.sliding() {
            summary
                .result("friction.breakaway_torque", sliding.breakaway_torque, "N m")
                .result("friction.kinetic_torque", sliding.kinetic_torque, "N m")
                .result("friction.stribeck_velocity", sliding.stribeck_velocity, "rad/s")
                .result("friction.viscous_friction", sliding.viscous_friction, "N m s/rad");
        }
        if let Some(step) = self.recommended_step() {
            summary.result("friction.recommended_step", step, "s");
        }
        summary
    }

    /// Writes figures, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        let mut summary = self.summary();
        for (name, figure, _) in self.figures() {
            output::write(&directory.join(name), figure.svg())?;
            summary.file(name);
        }
        self.report(command).write_all(summary, [], directory)
    }
}

/// Deflection of the bristles at breakaway [rad]; `None` without any.
fn breakaway_way(friction: &Friction<f64>) -> Option<f64> {
    match friction.model {
        Model::Nothing | Model::Static(_) => None,
        Model::Dahl(model) => Some(model.kinetic_torque / model.bristle_stiffness),
        Model::Lugre(model) => Some(model.sliding.breakaway_torque / model.bristle_stiffness),
        Model::ElastoPlastic(model) => Some(model.lugre.sliding.breakaway_torque / model.lugre.bristle_stiffness),
        Model::MaxwellSlip(model) => {
            let elements = model.shares().into_iter().zip(model.stiffnesses());
            let ways = elements.map(|(share, stiffness)| share * model.sliding.breakaway_torque / stiffness);
            Some(ways.fold(0.0, f64::max))
        }
    }
}
