//! Calibration: the bench identifies its parameters and writes the updated preset.

use std::path::Path;

use super::draw::{Captioned, curve, friction, plateaus};
use super::write_columns;
use crate::calibrate::{Calibration, CalibrationPlan, Identified, Trace, calibratable, calibrate};
use crate::home;
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::{Estimate, number};
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, Watch, output, parameters};
use stickslip_bench::remote::{Address, RemoteBench};
use stickslip_bench::{Bench, ClockedBench, VirtualBench};
use stickslip_design::check_delays;

/// Name of the calibrated preset's file, an argument of `--preset`.
pub const CALIBRATED: &str = "calibrated.toml";

/// A calibration, with preset and seed to repeat it.
#[derive(Clone, Debug)]
pub struct CalibrationRun {
    /// The preset before the calibration.
    pub preset: Preset<f64>,
    /// Seed of the virtual machine's noise; `None` for a remote machine.
    pub seed: Option<u64>,
    /// Result.
    pub calibration: Calibration,
}

/// Switches a virtual bench on, homes and calibrates it.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_run(
    plan: &CalibrationPlan<f64>,
    preset: &Preset<f64>,
    seed: u64,
    watch: &Watch,
) -> Result<CalibrationRun, Error> {
    let mut bench = VirtualBench::new(preset, seed)?;
    let calibration = calibrated(plan, &mut bench, watch)?;
    Ok(CalibrationRun { preset: *preset, seed: Some(seed), calibration })
}

/// The same with the machine served at an address; only model and settings of the preset are used.
///
/// # Errors
/// As [`calibrate`]; [`Error::BenchFault`] if the machine does not answer.
pub fn calibrate_remote(
    plan: &CalibrationPlan<f64>,
    preset: &Preset<f64>,
    address: Address,
    watch: &Watch,
) -> Result<CalibrationRun, Error> {
    let mut bench = RemoteBench::connect(preset, &address)?;
    let calibration = calibrated(plan, &mut bench, watch)?;
    Ok(CalibrationRun { preset: *preset, seed: None, calibration })
}

/// The same on a bench in real time.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_in_real_time(
    plan: &CalibrationPlan<f64>,
    preset: &Preset<f64>,
    mut bench: ClockedBench,
    watch: &Watch,
) -> Result<CalibrationRun, Error> {
    let calibration = calibrated(plan, &mut bench, watch)?;
    Ok(CalibrationRun { preset: *preset, seed: None, calibration })
}

fn calibrated(plan: &CalibrationPlan<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<Calibration, Error> {
    calibratable(bench.model())?;
    check_delays(bench.model(), bench.settings())?;
    home(bench, watch)?;
    calibrate(plan, bench, watch)
}

impl CalibrationRun {
    /// The preset with the calibrated model.
    pub fn calibrated(&self) -> Preset<f64> {
        Preset { model: self.calibration.model, ..self.preset }
    }

    /// The numbers, under their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("calibrate");
        for Identified { key, unit, value, ci95, .. } in &self.calibration.values {
            summary.with_interval(&format!("calibrate.{key}"), *value, *ci95, unit);
        }
        for Trace { channel, unit, rms, .. } in &self.calibration.traces {
            let name = channel.split(' ').next().unwrap_or(channel);
            summary.result(&format!("calibrate.residual.{name}"), *rms, unit);
        }
        summary
            .result("calibrate.tacho_ripple_order", self.calibration.tacho_ripple_order as f64, "1")
            .result("calibrate.not_identifiable", self.unknown() as f64, "1")
            .result("calibrate.bench_time", self.calibration.duration, "s");
        summary
    }

    fn unknown(&self) -> usize {
        self.calibration.values.iter().filter(|number| !number.is_determined()).count()
    }

    /// Calibrated numbers and those of the data sheet.
    pub fn table(&self) -> Table {
        let head = Table::new(["number", "calibrated", "by the data sheet"]);
        self.calibration.values.iter().fold(head, |table, identified| {
            let stated = if identified.believed.is_finite() {
                Cell::Estimate(Estimate::new(identified.believed, identified.unit))
            } else {
                "not stated".into()
            };
            let found = if identified.standard_uncertainty.is_finite() {
                Cell::Estimate(identified.estimate())
            } else {
                "not identifiable".into()
            };
            table.row([identified.words.into(), found, stated])
        })
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance::new(command, self.seed, parameters::write_commented(&self.preset));
        let calibration = &self.calibration;
        let identified = calibration.values.len() - self.unknown();
        let report = Report::new("Calibration of the bench", provenance).summary(format!(
            "The bench identified {identified} of its parameters in {} s by its own experiments, with 95\u{a0}% \
             intervals.",
            number(calibration.duration, 0)
        ));
        let keys = ["torque_per_volt", "load_inertia", "coupling_stiffness"].into_iter();
        let report = keys
            .filter_map(|key| calibration.value(key))
            .fold(report, |report, number| report.key(number.words, number.estimate()))
            .table(self.table().caption(format!(
                "Identified numbers with their 95\u{a0}% intervals, and those of the data sheet. The scale of all torques is \
                 that of {}.",
                if self.preset.bench.torque_amplifier > 0.5 {
                    "the torque constant of the load motor in the data sheet"
                } else {
                    "the current sensor, by the load motor's back-EMF"
                }
            )))
            .list(calibration.warnings.clone());
        self.figures().into_iter().fold(report, |report, (_, figure, caption)| report.figure(figure, caption))
    }

    /// Measured and predicted motion, and the friction.
    fn figures(&self) -> Vec<Captioned> {
        let files = [
            ("tacho", "tacho.svg"),
            ("accelerometer", "accelerometer.svg"),
            ("current of the load motor", "current.svg"),
        ];
        let trace = |channel| self.calibration.traces.iter().find(|trace| trace.channel == channel);
        let traces = files.into_iter().filter_map(|(channel, name)| Some((name, trace(channel)?)));
        let figure = |(name, trace): (&'static str, &Trace)| {
            let points = |column: usize| trace.points.iter().map(move |point| (point[0], point[column]));
            let figure = Figure::new(format!("Measured and predicted: {}", trace.channel))
                .x(Axis::new("time", "s"))
                .y(Axis::new(trace.channel, trace.unit))
                .series(Series::points(Role::Measured, "measured", points(1)))
                .series(Series::line(Role::Fitted, "predicted", points(2)));
            let residual = Estimate::new(trace.rms, trace.unit);
            let caption = format!(
                "Both motors excited at speed, a part of the run: simulated from the commands alone. Residual over \
                 the whole run {residual} rms."
            );
            (name, figure, caption)
        };
        let calibration = &self.calibration;
        let fastest = calibration.own.speeds[1];
        let own = friction("Own friction")
            .series(Series::line(Role::Fitted, "fit", curve(&calibration.model.own, fastest)))
            .series(plateaus(Role::Measured, &calibration.curve));
        let caption = "Friction at constant speeds in torques of the servo's data sheet, and its Stribeck curve in \
                       calibrated ones.";
        traces.map(figure).chain([("friction.svg", own, caption.into())]).collect()
    }

    /// Writes the calibrated preset, figures, data, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        let mut summary = self.summary();
        output::write(&directory.join(CALIBRATED), parameters::write_commented(&self.calibrated()))?;
        summary.file(CALIBRATED);
        for (name, figure, _) in self.figures() {
            output::write(&directory.join(name), figure.svg())?;
            summary.file(name);
        }
        write_columns(&mut summary, "traces", &self.columns(), directory)?;
        self.report(command).write_all(summary, [], directory)
    }

    fn columns(&self) -> Vec<Column> {
        let traces = &self.calibration.traces;
        let column = |name: String, unit: &str, values: Vec<f64>| Column { name, unit: unit.into(), values };
        let values = |trace: &Trace, index: usize| trace.points.iter().map(|point| point[index]).collect();
        let time = traces.first().map(|trace| column("time".into(), "s", values(trace, 0)));
        let both = traces.iter().flat_map(|trace| {
            let name = trace.channel.split(' ').next().unwrap_or(trace.channel);
            [("measured", 1), ("predicted", 2)]
                .map(|(source, index)| column(format!("{source}_{name}"), trace.unit, values(trace, index)))
        });
        time.into_iter().chain(both).collect()
    }
}
