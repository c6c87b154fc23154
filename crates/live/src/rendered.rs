//! Rendered friction: measured under the law, with the figures of the paper, and the report of the experiment.

use std::collections::BTreeMap;
use std::time::SystemTime;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::axis::Job;
use super::curve::of;
use super::measurements::Measurements;
use super::protocol::Answer;
use super::{Live, LiveError, Shared, form};
use crate::catalogue::RunOrigin;
use stickslip_base::Error;
use stickslip_base::figure::Figure;
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Provenance, Report, Section};
use stickslip_bench::external::Role;
use stickslip_bench::tuning::selector;
use stickslip_experiment::FrictionPlan;
use stickslip_experiment::workflow::experiment::Experiment;
use stickslip_experiment::workflow::judged::Verdict;
use stickslip_experiment::workflow::render::Rendering;

/// A measured rendered friction, complete or during its measurement.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RenderedFriction {
    /// Number of the run; `null` during the measurement and if there is none.
    pub run: Option<u64>,
    /// Whether the measurement is running.
    pub measuring: bool,
    /// Whether the desired friction was rendered; `null` without a measurement.
    pub outcome: Option<Verdict>,
    /// The outcome with its reasons, in sentences.
    pub verdict: String,
    /// The key numbers.
    pub keys: Vec<KeyEstimate>,
    /// Own and desired friction, desired and rendered friction, load torque, sweep through standstill: figures 12, 13
    /// and 14 of the paper, and a detail of 14.
    pub figures: Vec<Picture>,
}

/// A number with its uncertainty, as printed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct KeyEstimate {
    /// Name.
    pub name: String,
    /// The value, or `unknown`.
    pub value: String,
    /// Half the width of its 95 % interval, without the sign; empty if there is none.
    pub half_width: String,
    /// The unit of both, with its prefix.
    pub unit: String,
}

impl KeyEstimate {
    pub(super) fn of(name: &str, number: &Estimate) -> Self {
        let written = number.written();
        let (value, half_width, unit) = (written.value, written.half_width, written.unit);
        KeyEstimate { name: name.into(), value, half_width, unit }
    }
}

/// A figure with its caption.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Picture {
    /// The figure.
    pub figure: Figure,
    /// The caption.
    pub caption: String,
}

impl RenderedFriction {
    fn of(report: &Report) -> Self {
        let picture = |section: &Section| match section {
            Section::Figure { figure, caption } => {
                Some(Picture { figure: (**figure).clone(), caption: caption.clone() })
            }
            _ => None,
        };
        RenderedFriction {
            run: None,
            measuring: false,
            outcome: Verdict::of_text(report.summary_text()),
            verdict: report.summary_text().into(),
            keys: report.keys().map(|(name, number)| KeyEstimate::of(name, number)).collect(),
            figures: report.sections().iter().filter_map(picture).collect(),
        }
    }
}

impl Measurements {
    /// The rendered friction of a run; default: the running or last measurement.
    pub(super) fn rendered(&self, run: Option<u64>) -> Result<RenderedFriction, Error> {
        let current = self.current_curve();
        if let (None, true, Some(planned)) = (run, current.measuring, current.planned) {
            let so_far = Rendering { curve: of(current.plateaus), ..*planned };
            let report = Report::new("", Provenance::new("", None, ""));
            let shown = RenderedFriction::of(&so_far.add_to_report(report, self.own_friction().as_ref()));
            return Ok(RenderedFriction { measuring: true, ..shown });
        }
        let names = self.curves();
        let name = match run {
            None => match names.iter().find(|name| name.rendered) {
                Some(name) => name,
                None => return Ok(RenderedFriction::default()),
            },
            Some(run) => names.iter().find(|name| name.rendered && name.run == run).ok_or_else(|| Error::Unknown {
                what: "run with rendered friction",
                name: run.to_string(),
                remedy: "The call `curves` lists them.".into(),
            })?,
        };
        let report = Report::read(&self.folder.join(&name.name))?;
        Ok(RenderedFriction { run: Some(name.run), ..RenderedFriction::of(&report) })
    }
}

impl Live {
    /// Measures the rendered friction; a friction that cannot be rendered is refused before the axis moves.
    pub(super) fn measure_rendered(&self, values: &BTreeMap<String, String>) -> Result<Answer, Error> {
        let plan = form::with_values(&FrictionPlan::default(), values)?;
        let tuning = self.shared.parameters.tuning();
        if let Some(role @ (Role::Friction | Role::Law)) = tuning.acting() {
            return Err(LiveError::RendersItself { role, selector: selector(role) }.into());
        }
        let preset = *tuning.preset();
        let (planned, _) = Rendering::planned(&plan, &preset.bench.desired, &preset.model, &preset.bench)?;
        let own = self.shared.measurements.own_friction();
        let (number, folder) = self.shared.runs.folder("render")?;
        self.begin("measure friction", Job::measure_rendered(planned, preset, own, number, folder))
    }

    /// Writes the report of own, desired and rendered friction into a new run.
    pub(super) fn save_report(&self) -> Result<Answer, Error> {
        let begun = SystemTime::now();
        let Shared { measurements, parameters, runs, .. } = &*self.shared;
        let names = measurements.curves();
        let newest = |rendered: bool| {
            let name = names.iter().find(|name| name.rendered == rendered);
            name.map(|name| measurements.folder.join(&name.name))
        };
        let experiment = Experiment::read(newest(false).as_deref(), newest(true).as_deref(), parameters.preset())?;
        let (run, folder) = runs.folder("report")?;
        experiment.write(&folder, "stickslip serve, save report")?;
        let number = i64::try_from(run).ok();
        runs.enter(RunOrigin { number, ..RunOrigin::now(&folder, begun, Some(parameters.file())) });
        Ok(Answer::Report { run, folder: folder.display().to_string() })
    }
}
