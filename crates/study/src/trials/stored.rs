//! A finished trial, as `trial.svg`, `trial.parquet`, report and summary.

use std::path::Path;

use super::figures::figures;
use super::score::{SCORES, Score};
use stickslip_base::figure::panels;
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, output, parameters};
use stickslip_experiment::trial::{Repetition, Trial, TrialMotion};
use stickslip_recording::table::write_parquet;

/// Name of the table of all samples.
pub(super) const DATA: &str = "trial.parquet";
/// Name of the picture: position, deviation and torque over time.
const FIGURE: &str = "trial.svg";

/// A finished trial with everything that its report states.
#[derive(Clone, Debug)]
pub struct TrialRun {
    /// Parameters of the bench.
    pub preset: Preset<f64>,
    /// The motion.
    pub motion: TrialMotion,
    /// The controller with compensation and hold, in words.
    pub controller: String,
    /// The friction, in words.
    pub friction: String,
    /// Whether the load motor rendered the desired friction.
    pub render: bool,
    /// Preload of the friction wheel.
    pub preload: f64,
    /// The result.
    pub trial: Trial,
}

impl TrialRun {
    /// The numbers, under their stable names; `trial.complete` is 0 if the run was cancelled.
    pub fn summary(&self) -> Summary {
        let Trial { repetitions, complete, duration } = &self.trial;
        let mut summary = Summary::new("trial");
        summary
            .result("trial.complete", f64::from(u8::from(*complete)), "1")
            .result("trial.repetitions", repetitions.len() as f64, "1")
            .result("trial.rendered", f64::from(u8::from(self.render)), "1")
            .result("measure.preload", self.preload, "1")
            .result("measure.duration", *duration, "s");
        for score in &SCORES {
            if let Some((value, _)) = score.over(repetitions) {
                summary.result(&format!("trial.{}", score.name), value, score.unit);
            }
        }
        for (index, repetition) in repetitions.iter().enumerate() {
            let number = |score: &Score| (score.name, score.value(repetition).into());
            let head = [("repetition", (index + 1).into()), ("motion", self.motion.name().into())];
            summary.row(head.into_iter().chain(SCORES.iter().map(number)).collect::<Vec<_>>());
        }
        summary
    }

    /// The numbers as a table.
    fn table(&self) -> Table {
        let row = |table: Table, score: &Score| match score.over(&self.trial.repetitions) {
            Some((value, half)) => {
                let estimate = Estimate::new(value, score.unit);
                let estimate = half.map_or(estimate.clone(), |half| estimate.with_half_width(half));
                table.row([Cell::Text(score.title.into()), Cell::Estimate(estimate)])
            }
            None => table,
        };
        SCORES.iter().fold(Table::new(["score", "value"]), row)
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance::new(command, None, parameters::write_commented(&self.preset));
        let count = self.trial.repetitions.len();
        let incomplete = if self.trial.complete { "" } else { " (incomplete)" };
        let repeated =
            if count == 1 { "once".into() } else { format!("{count} times, with 95 % intervals of the mean") };
        let report = Report::new(format!("{}{incomplete}", self.motion.title()), provenance)
            .summary(format!("{} on {}, {repeated}.", self.controller, self.friction))
            .table(self.table());
        figures(&self.trial.repetitions)
            .into_iter()
            .fold(report, |report, (figure, caption)| report.figure(figure, caption))
    }

    /// All samples.
    fn columns(&self) -> Vec<Column> {
        let names = [
            ("repetition", "1"),
            ("time", "s"),
            ("setpoint", "rad"),
            ("deviation", "rad"),
            ("velocity", "rad/s"),
            ("commanded_torque", "N m"),
        ];
        let mut columns = names.map(|(name, unit)| Column { name: name.into(), unit: unit.into(), values: Vec::new() });
        for (index, Repetition { setpoint, course, .. }) in self.trial.repetitions.iter().enumerate() {
            for (k, setpoint) in setpoint.iter().enumerate() {
                let time = k as f64 * course.period;
                let row =
                    [(index + 1) as f64, time, *setpoint, course.deviation[k], course.velocity[k], course.torque[k]];
                columns.iter_mut().zip(row).for_each(|(column, value)| column.values.push(value));
            }
        }
        columns.to_vec()
    }

    /// Writes data, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        let mut summary = self.summary();
        let title = format!("{}: {} on {}", self.motion.title(), self.controller, self.friction);
        output::write(
            &directory.join(FIGURE),
            panels(&title, &figures(&self.trial.repetitions).map(|(figure, _)| figure)),
        )?;
        summary.file(FIGURE);
        write_parquet(&directory.join(DATA), &self.columns())?;
        summary.file(DATA);
        self.report(command).write_all(summary, [], directory)
    }
}
