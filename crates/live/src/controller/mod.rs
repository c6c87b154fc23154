//! Design of a position controller on the identified model. The bench is unchanged.
//!
//! A draft is the active set of parameters with some values changed ([`LoopDraft`]). [`LoopView`] shows its fields, its
//! poles, and its open and closed loop with the load sliding and stuck. The prediction of hunting ([`HuntingView`]) takes
//! longer and is a separate call; tuning ([`TuneProgress`]) takes seconds and runs in the background.

mod hunting;
mod poles;
mod setpoint;
mod tuning;
mod view;

use std::collections::BTreeMap;
use std::sync::Mutex;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use hunting::HuntingView;
pub use poles::{DampingRay, LoopPole, PoleDrag, PoleGrip};
pub use tuning::TuneProgress;
pub use view::{CornerView, LoopAt, LoopLimits, LoopMark, LoopNumber, LoopVerdict, LoopView};

use super::lock;
use super::protocol::{Answer, Item};
use stickslip_base::parameters::{self, Entry, Value, diff};
use stickslip_base::{ControllerChoice, Error, Preset};
use stickslip_bench::tuning::Tuning;
use stickslip_design::within;
use stickslip_experiment::workflow::position_loop::{LoopRun, as_cascade, as_pid, as_predictive, as_state_feedback};
use tuning::Tuner;

/// Path of the position controller's parameters.
const CONTROLLER: &str = "bench.controller";
/// Range of the sliding speed [rad/s].
const SPEEDS: (f64, f64) = (0.05, 1000.0);

/// A draft of a position controller.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoopDraft {
    /// Values that differ from the active ones, by path, as in `set`.
    #[serde(default)]
    pub values: BTreeMap<String, String>,
    /// Converts the controller to this kind, or uses the defaults of this kind.
    #[serde(default)]
    pub kind: Option<DraftKind>,
    /// Speed at which the load slides [rad/s]; default: 10.
    #[serde(default)]
    pub speed: Option<f64>,
    /// Dragged position of the pair of poles; a controller without specified poles becomes a state feedback with them.
    #[serde(default)]
    pub drag: Option<PoleDrag>,
    /// Largest overshoot of a set-point step, as a share: lowers the set-point weight; a cascade becomes a PID controller.
    #[serde(default)]
    pub overshoot: Option<f64>,
    /// Whether the corners of the machine's uncertainty are checked as well; takes several times as long.
    #[serde(default)]
    pub thorough: bool,
}

/// Kind of controller of a draft.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DraftKind {
    /// P control of the position around PI control of the velocity; any other kind is replaced by the default cascade.
    Cascade,
    /// PID control of the position, converted from the cascade.
    Pid,
    /// Feedback of all states of the drive; the feedback of a predictive controller is kept, any other kind is replaced by
    /// the default.
    StateFeedback,
    /// Predictive control: the state feedback within limits.
    Predictive,
}

/// A draft applied to the active parameters.
struct AppliedDraft {
    in_force: Preset<f64>,
    preset: Preset<f64>,
    speed: f64,
}

impl LoopDraft {
    /// The speed at which the load slides [rad/s].
    fn speed(&self) -> Result<f64, Error> {
        let speed = self.speed.unwrap_or(10.0);
        let remedy = "Use a typical speed of the axis.";
        within("the speed at which the load slides", speed, "rad/s", SPEEDS, remedy)?;
        Ok(speed)
    }
}

impl AppliedDraft {
    fn new(tuning: &Tuning, draft: &LoopDraft) -> Result<Self, Error> {
        let changed: Vec<_> = draft.values.clone().into_iter().collect();
        let (speed, mut preset) = (draft.speed()?, tuning.preset_with(&changed)?);
        let controller = &mut preset.bench.controller;
        match draft.kind {
            Some(DraftKind::Cascade) => *controller = as_cascade(controller),
            Some(DraftKind::Pid) => *controller = as_pid(controller),
            Some(DraftKind::StateFeedback) => *controller = as_state_feedback(controller),
            Some(DraftKind::Predictive) => *controller = as_predictive(controller),
            None => {}
        }
        if let Some(drag) = &draft.drag {
            poles::drag_poles(&mut preset.bench.controller, drag)?;
        }
        if let Some(most) = draft.overshoot {
            setpoint::limit_overshoot(&mut preset, speed, most)?;
        }
        Ok(AppliedDraft { in_force: *tuning.preset(), preset, speed })
    }

    /// Values that differ from the active ones, by path.
    fn values(&self) -> BTreeMap<String, String> {
        changes(&self.in_force, &self.preset)
    }

    /// The fields of the controller.
    fn items(&self) -> Vec<Item> {
        let mut items = Item::all(&self.preset);
        items.retain(|item| parameters::within(&item.path, CONTROLLER));
        items
    }
}

/// The design of a position controller.
#[derive(Default)]
pub(super) struct ControllerDesign {
    /// The running or last tuning.
    tuner: Mutex<Tuner>,
}

impl ControllerDesign {
    /// The loop of a draft.
    pub(super) fn draft(&self, tuning: &Tuning, draft: &LoopDraft) -> Result<Answer, Error> {
        let applied = AppliedDraft::new(tuning, draft)?;
        let judge = if draft.thorough { LoopRun::new } else { LoopRun::glance };
        let run = judge(&applied.preset, applied.speed)?;
        Ok(Answer::Loop(Box::new(LoopView::of(&run, applied.values(), applied.items(), draft.thorough)?)))
    }

    /// Prediction of hunting for a draft, with the own friction or the desired one.
    pub(super) fn hunting(&self, tuning: &Tuning, draft: &LoopDraft, desired: bool) -> Result<Answer, Error> {
        let applied = AppliedDraft::new(tuning, draft)?;
        Ok(Answer::Hunting(Box::new(HuntingView::of(&applied.preset, desired)?)))
    }

    /// Starts to tune a draft.
    pub(super) fn begin(&self, client: &str, tuning: &Tuning, draft: &LoopDraft) -> Result<Answer, Error> {
        let applied = AppliedDraft::new(tuning, draft)?;
        let mut tuner = lock(&self.tuner);
        tuner.begin(client, applied.in_force, applied.preset, applied.speed)?;
        Ok(Answer::Tuned(tuner.progress()))
    }

    /// Progress of the last tuning.
    pub(super) fn tuned(&self) -> Answer {
        Answer::Tuned(lock(&self.tuner).progress())
    }

    /// Ends a tuning that this client began.
    pub(super) fn end(&self, client: &str) -> Result<Answer, Error> {
        lock(&self.tuner).end(client).map(|()| Answer::Done {})
    }

    /// Ends a tuning of any client.
    pub(super) fn cancel(&self) {
        lock(&self.tuner).cancel();
    }
}

/// The values that change one set of parameters into the other, by path, as in a file.
fn changes(from: &Preset<f64>, to: &Preset<f64>) -> BTreeMap<String, String> {
    let written = |Entry { path, field, value }: Entry| {
        let value = match value {
            Value::Number(value) => parameters::number::toml(value, field),
            Value::Variant(name) => name.to_owned(),
        };
        (path, value)
    };
    diff(from, to).into_iter().filter_map(|difference| difference.after.map(written)).collect()
}

/// The name of a controller's kind, as in a file.
fn kind_of(controller: &ControllerChoice<f64>) -> &'static str {
    match controller {
        ControllerChoice::Cascade(_) => "cascade",
        ControllerChoice::Pid(_) => "pid",
        ControllerChoice::StateFeedback(_) => "state-feedback",
        ControllerChoice::Predictive(_) => "predictive",
        ControllerChoice::Linear(_) => "linear",
    }
}
