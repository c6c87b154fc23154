//! A position controller while it is being designed: what a draft of it would do on the machine as believed. Nothing is put
//! in force.
//!
//! A draft is the set in force with some values changed ([`LoopDraft`]). [`LoopView`] is all that is to be seen of it: its
//! fields, its poles, its loop opened and closed, the load sliding and stuck. Whether it hunts ([`HuntingView`]) takes
//! longer and is asked apart; what the fair tuning makes of it ([`TuneProgress`]) takes seconds and runs beside the bench.

mod hunting;
mod poles;
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

/// Where the position controller stands among the parameters.
const CONTROLLER: &str = "bench.controller";
/// Speeds at which a load can be said to slide [rad/s].
const SPEEDS: (f64, f64) = (0.05, 1000.0);

/// A position controller that is being designed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoopDraft {
    /// What is not as in force: value by path, as in `set`.
    #[serde(default)]
    pub values: BTreeMap<String, String>,
    /// The controller as the other kind that it is, or that kind's defaults.
    #[serde(default)]
    pub kind: Option<DraftKind>,
    /// Speed at which the load slides [rad/s]; 10 where it is not given.
    #[serde(default)]
    pub speed: Option<f64>,
    /// A hand on the wanted pair of poles.
    #[serde(default)]
    pub drag: Option<PoleDrag>,
    /// Whether the corners of what may be wrong with the machine are judged as well: several times the time.
    #[serde(default)]
    pub thorough: bool,
}

/// What a draft can be made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DraftKind {
    /// P control of the position around PI control of the velocity; the defaults of one, unless it is one.
    Cascade,
    /// One PID controller of the position; of a cascade the one that it is.
    Pid,
    /// Feedback of all states of the drive; the defaults of one, unless it is one.
    StateFeedback,
    /// A state feedback within limits; of a state feedback the one that it is.
    Predictive,
}

/// A draft that has been read.
struct Drafted {
    in_force: Preset<f64>,
    preset: Preset<f64>,
    speed: f64,
}

impl LoopDraft {
    /// The speed at which the load slides [rad/s].
    fn speed(&self) -> Result<f64, Error> {
        let speed = self.speed.unwrap_or(10.0);
        let remedy = "Take one of the speeds of the work that the axis shall do.";
        within("the speed at which the load slides", speed, "rad/s", SPEEDS, remedy)?;
        Ok(speed)
    }
}

impl Drafted {
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
            poles::dragged(&mut preset.bench.controller, drag)?;
        }
        Ok(Drafted { in_force: *tuning.preset(), preset, speed })
    }

    /// What is not as in force, by path.
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
    /// The tuning that runs, or ran last.
    tuner: Mutex<Tuner>,
}

impl ControllerDesign {
    /// The loop of a draft.
    pub(super) fn draft(&self, tuning: &Tuning, draft: &LoopDraft) -> Result<Answer, Error> {
        let drafted = Drafted::new(tuning, draft)?;
        let judge = if draft.thorough { LoopRun::new } else { LoopRun::glance };
        let run = judge(&drafted.preset, drafted.speed)?;
        Ok(Answer::Loop(Box::new(LoopView::of(&run, drafted.values(), drafted.items(), draft.thorough)?)))
    }

    /// Whether a draft hunts on the own friction, or on the desired one.
    pub(super) fn hunting(&self, tuning: &Tuning, draft: &LoopDraft, desired: bool) -> Result<Answer, Error> {
        let drafted = Drafted::new(tuning, draft)?;
        Ok(Answer::Hunting(Box::new(HuntingView::of(&drafted.preset, desired)?)))
    }

    /// Begins to tune a draft.
    pub(super) fn begin(&self, client: &str, tuning: &Tuning, draft: &LoopDraft) -> Result<Answer, Error> {
        let drafted = Drafted::new(tuning, draft)?;
        let mut tuner = lock(&self.tuner);
        tuner.begin(client, drafted.in_force, drafted.preset, drafted.speed)?;
        Ok(Answer::Tuned(tuner.seen()))
    }

    /// How far the last tuning is.
    pub(super) fn tuned(&self) -> Answer {
        Answer::Tuned(lock(&self.tuner).seen())
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

/// The values that make one set of parameters of the other, by path, as in a file.
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
