//! Measurements on the virtual bench: plans, results and files.

pub mod breakaway;
mod friction;
mod learning;
mod presliding;
mod response;
mod tracking;

use std::path::Path;

use stickslip_core::fields::Fields;

use super::write_columns;
use crate::home;
use stickslip_base::figure::Figure;
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Provenance, Report, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, Watch, parameters};
use stickslip_bench::tap::Tap;
use stickslip_bench::{Bench, ClockedBench, TimingReport, VirtualBench};
use stickslip_design::check_delays;

/// Column of a data table: preload of the friction wheel.
pub(super) const PRELOAD: &str = "preload";

/// The preload in every row, so that a table alone identifies its friction.
pub(super) fn with_preload(mut columns: Vec<Column>, preload: f64) -> Vec<Column> {
    let rows = columns.first().map_or(0, |column| column.values.len());
    columns.push(Column { name: PRELOAD.into(), unit: "1".into(), values: vec![preload; rows] });
    columns
}

/// A plan of a measurement.
pub trait Plan: Fields<f64> + Default + Copy {
    /// Its name, for example `friction`.
    const KIND: &'static str;
    /// Its result.
    type Outcome: Outcome;

    /// A longer, more precise plan than the default.
    fn thorough() -> Self;

    /// Bench time on this bench [s], without homing.
    fn duration(&self, preset: &Preset<f64>) -> f64;

    /// Short description.
    fn about(&self) -> String;

    /// Runs it on a homed, running bench.
    ///
    /// # Errors
    /// Those of the experiment; a cancelled run returns its data so far.
    fn run(&self, bench: &mut dyn Bench, watch: &Watch) -> Result<Self::Outcome, Error>;
}

/// Result of an experiment, for reports and files.
pub trait Outcome {
    /// Name of its table of data, without ending.
    const DATA: &'static str;

    /// Whether the plan was completed.
    fn complete(&self) -> bool;

    /// Bench time [s].
    fn duration(&self) -> f64;

    /// Warnings for the report, each with a remedy.
    fn warnings(&self) -> Vec<String>;

    /// The numbers.
    fn table(&self) -> Table;

    /// The figure and its caption.
    fn figure(&self) -> (Figure, String);

    /// Further figures of the report.
    fn further(&self) -> Vec<(Figure, String)> {
        Vec::new()
    }

    /// The numbers for scripts, and a row for each single value.
    fn add_to(&self, summary: &mut Summary);

    /// The data.
    fn columns(&self) -> Vec<Column>;
}

/// A completed experiment, with preset, seed and plan to repeat it.
#[derive(Clone, Debug)]
pub struct Measurement<P: Plan> {
    /// The bench.
    pub preset: Preset<f64>,
    /// Seed of its noise, for a virtual bench in this process.
    pub seed: Option<u64>,
    /// The plan.
    pub plan: P,
    /// Its result.
    pub outcome: P::Outcome,
    /// Timing report of a run in real time.
    pub clocked: Option<TimingReport>,
    /// Why the plan was not completed, for another reason than a cancellation.
    pub stopped: Option<String>,
}

/// Switches a virtual bench on and measures as [`measure_on`]; `tap` gets every cycle.
///
/// # Errors
/// As [`measure_on`]; errors of the bench's design.
pub fn measure<P: Plan>(
    plan: P,
    preset: &Preset<f64>,
    preload: Option<f64>,
    seed: u64,
    tap: Option<Tap>,
    watch: &Watch,
) -> Result<Measurement<P>, Error> {
    let mut bench = VirtualBench::new(preset, seed)?;
    tap.into_iter().for_each(|tap| bench.tap(tap));
    let measured = measure_on(plan, preset, &mut bench, preload, watch)?;
    Ok(Measurement { seed: Some(seed), ..measured })
}

/// Measures as [`measure_on`] on a bench in real time, and ends it. After missed deadlines the same seed, if there is
/// one, does not give the same numbers.
///
/// # Errors
/// As [`measure`]; [`Error::BenchFault`] if deadlines cannot be met.
pub fn measure_in_real_time<P: Plan>(
    plan: P,
    preset: &Preset<f64>,
    mut bench: ClockedBench,
    preload: Option<f64>,
    seed: Option<u64>,
    watch: &Watch,
) -> Result<Measurement<P>, Error> {
    let measured = measure_on(plan, preset, &mut bench, preload, watch)?;
    Ok(Measurement { seed, clocked: bench.stop(), ..measured })
}

/// Homes a bench, sets the preload, and runs a plan; `preset` is that of the report.
///
/// # Errors
/// [`Error::Cancelled`] without any data; [`Error::BenchFault`]; [`Error::OutOfRange`] for a preload beyond
/// 0 … 1.
pub fn measure_on<P: Plan>(
    plan: P,
    preset: &Preset<f64>,
    bench: &mut dyn Bench,
    preload: Option<f64>,
    watch: &Watch,
) -> Result<Measurement<P>, Error> {
    check_delays(bench.model(), bench.settings())?;
    home(bench, watch)?;
    if let Some(preload) = preload {
        bench.set_preload(preload)?;
    }
    measure_homed(plan, preset, bench, watch)
}

/// Runs a plan on a homed, running bench; `preset` is that of the report.
///
/// # Errors
/// As [`measure_on`].
pub fn measure_homed<P: Plan>(
    plan: P,
    preset: &Preset<f64>,
    bench: &mut dyn Bench,
    watch: &Watch,
) -> Result<Measurement<P>, Error> {
    let outcome = plan.run(bench, watch)?;
    let mut preset = *preset;
    preset.plant.wheel.preload = bench.preload();
    Ok(Measurement { preset, seed: None, plan, outcome, clocked: None, stopped: None })
}

impl<P: Plan> Measurement<P> {
    /// Preload of the friction wheel.
    pub fn preload(&self) -> f64 {
        self.preset.plant.wheel.preload
    }

    /// The numbers, under their stable names; `measure.complete` is 0 if the run was cancelled.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new(&format!("measure {}", P::KIND));
        summary
            .result("measure.complete", f64::from(u8::from(self.outcome.complete())), "1")
            .result("measure.duration", self.outcome.duration(), "s")
            .result("measure.preload", self.preload(), "1");
        self.outcome.add_to(&mut summary);
        self.clocked.iter().for_each(|clocked| clocked.add_to(&mut summary));
        summary
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance::new(command, self.seed, parameters::write_commented(&self.preset));
        let mut title = self.plan.about();
        if !self.outcome.complete() {
            title += " (incomplete)";
        }
        let ended = match &self.stopped {
            Some(cause) => format!("Stopped: {cause} Results measured until then. "),
            None if self.outcome.complete() => String::new(),
            None => "Cancelled: results measured until then. ".into(),
        };
        let duration = Estimate::new(self.outcome.duration(), "s");
        let (figure, caption) = self.outcome.figure();
        let report = Report::new(title, provenance)
            .summary(format!("{ended}{duration} of bench time, friction wheel at preload {}.", self.preload()))
            .table(self.outcome.table())
            .figure(figure, caption);
        let further = self.outcome.further().into_iter();
        let report = further.fold(report, |report, (figure, caption)| report.figure(figure, caption));
        let report = match &self.clocked {
            Some(clocked) => report
                .table(clocked.table().caption("Lateness and duration of the ticks."))
                .table(clocked.histogram_table().caption("Number of ticks and frames by their times.")),
            None => report,
        };
        let warnings = self.warnings();
        if warnings.is_empty() { report } else { report.heading("Notes").list(warnings) }
    }

    /// Warnings for the report, each with a remedy.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.outcome.warnings();
        warnings.extend(self.clocked.iter().flat_map(TimingReport::warnings));
        warnings
    }

    /// Writes data, figure, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        let mut summary = self.summary();
        let columns = with_preload(self.outcome.columns(), self.preload());
        write_columns(&mut summary, P::Outcome::DATA, &columns, directory)?;
        let (name, (figure, _)) = (format!("{}.svg", P::Outcome::DATA), self.outcome.figure());
        self.report(command).write_all(summary, [(name.as_str(), &figure)], directory)
    }
}
