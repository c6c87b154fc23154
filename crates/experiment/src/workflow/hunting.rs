//! Predicted hunting of a controller on the modelled axis: amplitude and interval, in numbers and figures.

use std::path::Path;

use super::draw::{Captioned, torque};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::{Estimate, tied};
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::{Error, Preset, Summary, Watch, output, parameters};
use stickslip_design::{HuntingPlan, HuntingPrediction, predict_hunting};

/// Largest number of points of a curve.
const POINTS: usize = 4000;

/// A prediction for the controller of a preset.
#[derive(Clone, Debug)]
pub struct HuntingRun {
    /// The bench, with the examined friction as the own friction of its model.
    pub preset: Preset<f64>,
    /// The prediction.
    pub prediction: HuntingPrediction,
    plan: HuntingPlan,
}

impl HuntingRun {
    /// Predicts for the controller, compensation and hold of a preset, on the friction of its model.
    ///
    /// # Errors
    /// As [`predict_hunting`].
    pub fn new(preset: &Preset<f64>, plan: &HuntingPlan, watch: &Watch) -> Result<Self, Error> {
        let prediction = predict_hunting(&preset.model, &preset.bench, plan, watch)?;
        Ok(HuntingRun { preset: *preset, prediction, plan: *plan })
    }

    /// Remarks for the report.
    pub fn remarks(&self) -> Vec<String> {
        let HuntingPrediction { hunting, described, count, .. } = &self.prediction;
        let mut remarks = vec![match hunting {
            Some(hunting) => format!(
                "Hunting predicted: ±{} about the set-point, a slip every {}.",
                tied(&Estimate::new(hunting.amplitude, "rad")),
                tied(&Estimate::new(hunting.interval, "s"))
            ),
            None => format!(
                "No hunting predicted: after {} the motion is at most {} counts of {}, or too slow to be observed in {}.",
                tied(&Estimate::new(self.plan.from, "s")),
                self.plan.counts,
                tied(&Estimate::new(*count, "rad")),
                tied(&Estimate::new(self.plan.duration, "s"))
            ),
        }];
        let oscillates = described.iter().find(|it| it.radius >= 1.0);
        remarks.push(match oscillates {
            Some(at) => format!(
                "The describing function also predicts an oscillation, at {}: the loop is unstable for some damping.",
                tied(&Estimate::new(at.amplitude, "rad/s"))
            ),
            None => {
                "The describing function predicts no hunting, as for every loop that is stable for any damping: it \
                     is not a reliable predictor."
                    .into()
            }
        });
        remarks
    }

    /// The numbers.
    pub fn table(&self) -> Table {
        let cell = |value: Option<f64>, unit: &'static str| {
            value.map_or_else(|| Cell::from("none"), |value| Cell::Estimate(Estimate::new(value, unit)))
        };
        let of = |take: fn(&stickslip_design::Hunting) -> f64| self.prediction.hunting.as_ref().map(take);
        let radius = self.prediction.described.iter().map(|it| it.radius).fold(0.0, f64::max);
        Table::new(["number", "value"])
            .row(["amplitude".into(), cell(of(|it| it.amplitude), "rad")])
            .row(["interval between slips".into(), cell(of(|it| it.interval), "s")])
            .row(["simulated slips".into(), cell(of(|it| it.slips as f64), "1")])
            .row(["describing function: largest pole".into(), cell(Some(radius), "1")])
    }

    /// The numbers, under their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("hunting");
        let hunting = self.prediction.hunting;
        summary.result("hunting.predicted", f64::from(u8::from(hunting.is_some())), "1");
        if let Some(hunting) = hunting {
            summary.result("hunting.amplitude", hunting.amplitude, "rad").result(
                "hunting.interval",
                hunting.interval,
                "s",
            );
        }
        let radius = self.prediction.described.iter().map(|it| it.radius).fold(0.0, f64::max);
        summary.result("hunting.describing_function.largest_pole", radius, "1");
        for (before, after) in &self.prediction.map {
            let Some(after) = after else { continue };
            summary.row([
                ("kind", "map".into()),
                ("deviation", (*before).into()),
                ("next_deviation", after.deviation.into()),
                ("time", after.time.into()),
            ]);
        }
        summary
    }

    /// All figures with file name and caption.
    fn figures(&self) -> Vec<Captioned> {
        let HuntingPrediction { deviations, period, map, described, count, .. } = &self.prediction;
        let stride = deviations.len().div_ceil(POINTS).max(1);
        let course = deviations.iter().enumerate().step_by(stride).map(|(k, e)| (k as f64 * period, 1e3 * e));
        let course = Figure::new("Deviation at a constant set-point")
            .x(Axis::new("time", "s"))
            .y(Axis::new("deviation", "mrad"))
            .series(Series::line(Role::Trace(0), "predicted", course));
        let counts = 1e3 * count;
        let ends = map.iter().filter_map(|(before, after)| Some((1e3 * before, 1e3 * after.as_ref()?.deviation)));
        let far = map.last().map_or(1.0, |(before, _)| 1e3 * before);
        let events = Figure::new("From standstill to standstill")
            .x(Axis::new("deviation at a standstill", "mrad").stretched())
            .y(Axis::new("at the next standstill", "mrad"))
            .series(Series::line(Role::Trace(0), "map", ends.collect::<Vec<_>>()))
            .series(Series::line(Role::Reference, "equal on the other side", [(counts, -counts), (far, -far)]));
        let radii = described.iter().map(|it| (it.amplitude, it.radius));
        let first = described.first().map_or(0.0, |it| it.amplitude);
        let last = described.last().map_or(1.0, |it| it.amplitude);
        let describing = Figure::new("Describing function")
            .x(Axis::new("amplitude of the velocity", "rad/s").stretched())
            .y(Axis::new("largest pole", "1"))
            .series(Series::line(Role::Trace(0), "with the equivalent damping", radii))
            .series(Series::line(Role::Reference, "limit of stability", [(first, 1.0), (last, 1.0)]));
        let breakaway = torque(self.preset.model.own.breakaway_torque);
        vec![
            (
                "course.svg",
                course,
                format!(
                    "The modelled drive with a breakaway torque of {breakaway} under this controller, without noise and \
                     counts."
                ),
            ),
            (
                "map.svg",
                events,
                "Where the map is nearer to 0 than the line, a deviation decreases from slip to slip; where both meet, \
                 the drive hunts with that deviation."
                    .into(),
            ),
            (
                "describing.svg",
                describing,
                "Friction as the equivalent damping of a sine: below 1 everywhere no limit cycle is predicted, even if the \
                 drive hunts in simulation."
                    .into(),
            ),
        ]
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance::new(command, None, parameters::write_commented(&self.preset));
        let report = Report::new("Hunting", provenance).summary(self.remarks().join(" ")).table(self.table());
        self.figures().into_iter().fold(report, |report, (_, figure, caption)| report.figure(figure, caption))
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
