//! Validation of an identified model on another recording.

use crate::IdentifyError;
use std::path::Path;

use super::axis::{AxisModel, ClosedLoop, Loop, Prediction};
use super::motion::{Motion, force_error};
use super::results::unit;
use super::{IdentifiedModel, limits, recorded};
use crate::machine::{Axis, Machine, Signals};
use stickslip_base::figure::{Axis as FigureAxis, Figure, Role, Series};
use stickslip_base::quantity::{Estimate, tied};
use stickslip_base::report::{Provenance, Report};
use stickslip_base::{Error, Summary, Watch};
use stickslip_recording::Recording;

/// Errors of a model on a recording that was not used for its identification.
#[derive(Clone, Debug, PartialEq)]
pub struct Validation {
    /// Kind of axis, which determines the units.
    pub axis: Axis,
    /// The recording in SI units.
    pub signals: Signals,
    /// Its motion.
    pub motion: Motion,
    /// The model.
    pub model: AxisModel<f64>,
    /// Simulated closed loop and its error; none where the controller is unknown.
    pub closed_loop: Option<(ClosedLoop<f64>, Prediction)>,
    /// ‖F − F̂‖/‖F‖ of the force that the model gives the recorded motion.
    pub torque_error: f64,
    /// SI unit of the command.
    pub command_unit: &'static str,
}

/// Simulates the closed loop of a model along a recording, with its reference and its injected signal; where the
/// controller is unknown, predicts the force from the recorded motion.
///
/// # Errors
/// A recording that does not match the machine file or is too short, a model of the other kind of axis;
/// [`Error::Cancelled`].
pub fn validate(
    recording: &Recording,
    identified: &IdentifiedModel,
    machine: &Machine,
    watch: &Watch,
) -> Result<Validation, Error> {
    watch.stage("simulate", 0.0)?;
    if identified.axis != machine.axis {
        let message =
            format!("the axis of the model is {:?}, that of the machine {:?}.", identified.axis, machine.axis);
        return Err(IdentifyError::MachineFile { path: "model".into(), message: message.to_lowercase() }.into());
    }
    let signals = machine.signals(recording)?;
    let motion = Motion::of(&signals, machine)?;
    let (samples, recipe) = (motion.samples(), &machine.recipe);
    let needed = recipe.skip + 30 * recipe.decimation;
    if samples < needed {
        let remedy = "Record longer.";
        return Err(Error::TooFew { what: "samples in the recording", found: samples, needed, remedy });
    }
    let model = identified.model;
    let closed_loop = match Loop::of(&signals, &motion, machine) {
        None => None,
        Some(around) => {
            let run = around.simulate(&model, 2..samples, watch)?;
            let prediction = around.compare(&run, recipe.skip.saturating_sub(2));
            Some((run, prediction))
        }
    };
    let torque_error = force_error(&model, &motion, recipe.skip..samples, recipe.decimation)?;
    let command_unit = machine.drive.command.si_unit();
    Ok(Validation { axis: machine.axis, signals, motion, model, closed_loop, torque_error, command_unit })
}

impl Validation {
    /// `prediction.*`, with the names of `stickslip identify`.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("validate");
        match &self.closed_loop {
            Some((_, prediction)) => {
                summary.result("prediction.voltage_error", prediction.voltage_error, "1");
                summary.result("prediction.position_rms", prediction.position_rms, unit(self.axis, "position"));
            }
            None => _ = summary.result("prediction.torque_error", self.torque_error, "1"),
        }
        for finding in &self.signals.findings {
            summary.note(finding.clone());
        }
        summary
    }

    /// The result in a sentence or two.
    pub fn verdict(&self) -> String {
        let Some((_, prediction)) = &self.closed_loop else {
            return format!(
                "The controller is not known, so no closed loop is simulated. For the recorded motion the model predicts \
                 the drive {} with an error of {}.",
                self.force(),
                limits::percent(self.torque_error)
            );
        };
        format!(
            "Simulated with the known controller{}, the model predicts the recorded command with an error of {} and the \
             position within {} rms.",
            if self.signals.injected.is_some() { " and the injected signal" } else { "" },
            limits::percent(prediction.voltage_error),
            tied(&Estimate::new(prediction.position_rms, unit(self.axis, "position"))),
        )
    }

    fn force(&self) -> &'static str {
        match self.axis {
            Axis::Linear => "force",
            Axis::Rotary => "torque",
        }
    }

    /// Figures over time, with file name and caption.
    pub fn figures(&self) -> Vec<(&'static str, Figure, String)> {
        let mut figures: Vec<_> = recorded::figures(&self.signals, self.axis, self.command_unit).into();
        figures.extend(self.comparisons());
        figures
    }

    /// Recording and prediction over time, and their difference.
    fn comparisons(&self) -> Vec<(&'static str, Figure, String)> {
        let period = self.signals.period;
        let time = |i: usize| i as f64 * period;
        let compared = |title: &str, quantity: &str, unit: &str, measured: &[f64], predicted: Vec<(usize, f64)>| {
            let error = predicted.iter().map(|(i, p)| (time(*i), measured[*i] - p)).collect::<Vec<_>>();
            let both = Figure::new(title)
                .x(FigureAxis::new("time", "s"))
                .y(FigureAxis::new(quantity, unit))
                .series(Series::points(
                    Role::Measured,
                    "measured",
                    measured.iter().enumerate().map(|(i, v)| (time(i), *v)),
                ))
                .series(Series::line(Role::Fitted, "predicted", predicted.iter().map(|(i, p)| (time(*i), *p))));
            let miss = Figure::new(format!("Error of the predicted {quantity}"))
                .x(FigureAxis::new("time", "s"))
                .y(FigureAxis::new(format!("error of the {quantity}"), unit))
                .series(Series::line(Role::Trace(0), "measured − predicted", error));
            [both, miss]
        };
        let Some((run, _)) = &self.closed_loop else {
            let (model, motion) = (&self.model, &self.motion);
            let force = |i: usize| model.inertia * motion.acceleration[i] + model.steady_force(motion.velocity[i]);
            let predicted = (0..motion.samples()).map(|i| (i, force(i))).collect();
            let name = self.force();
            let [both, miss] =
                compared("Balance of forces", name, unit(self.axis, "offset"), &motion.smooth_force, predicted);
            return vec![
                ("figure-force.svg", both, "The model uses only the recorded motion.".into()),
                ("figure-force-error.svg", miss, "Measured minus predicted.".into()),
            ];
        };
        let rows = |values: &[f64]| run.range.clone().zip(values.iter().copied()).collect::<Vec<_>>();
        let alone = match self.signals.injected {
            Some(_) => {
                "The simulated loop uses only the reference and the injected signal; the recorded command is not used."
            }
            None => "The simulated loop uses only the reference; the recorded command is not used.",
        };
        let (signals, length) = (&self.signals, unit(self.axis, "position"));
        let [command, command_error] =
            compared("Command of the controller", "command", self.command_unit, &signals.command, rows(&run.command));
        let [position, position_error] =
            compared("Position of the axis", "position", length, &signals.position, rows(&run.position));
        vec![
            ("figure-command.svg", command, alone.into()),
            ("figure-command-error.svg", command_error, "Measured minus predicted.".into()),
            ("figure-position.svg", position, alone.into()),
            ("figure-position-error.svg", position_error, "Measured minus predicted.".into()),
        ]
    }

    /// The report. `command` is the command line that makes it again.
    pub fn report(&self, machine: &Machine, recording: &Recording, command: &str) -> Report {
        let summary = self.summary();
        let file = recording.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
        let provenance = Provenance::new(command, None, machine.text.clone());
        let names = [
            ("error of the command", "prediction.voltage_error"),
            ("error of the position, rms", "prediction.position_rms"),
            ("error of the force", "prediction.torque_error"),
        ];
        let key = names.into_iter().filter_map(|(name, result)| {
            let estimate = summary.estimate(result)?;
            let share = estimate.unit == "1";
            Some((name, if share { Estimate::new(100.0 * estimate.value, "%") } else { estimate }))
        });
        let mut report = Report::new(format!("{}: the identified model on {file}", machine.name), provenance)
            .summary(self.verdict());
        for (name, number) in key {
            report = report.key(name, number);
        }
        for note in &self.signals.notes {
            report = report.paragraph(note.clone());
        }
        report = report.heading(recorded::DONE).list(recorded::done(&self.signals));
        self.figures().into_iter().fold(report, |report, (_, figure, caption)| report.figure(figure, caption))
    }

    /// Writes figures, `report.html` and `summary.json` into a folder. `command` is the command line that makes them
    /// again.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(
        &self,
        machine: &Machine,
        recording: &Recording,
        command: &str,
        directory: &Path,
    ) -> Result<Summary, Error> {
        let figures = self.figures();
        let named = figures.iter().map(|(name, figure, _)| (*name, figure));
        self.report(machine, recording, command).write_all(self.summary(), named, directory)
    }
}
