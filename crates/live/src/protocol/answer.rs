//! What is answered.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::*;
use crate::catalogue::{Run, Value};
use stickslip_base::parameters::{Difference, Entry};
use stickslip_experiment::workflow::sketch::Drawn;

/// An answer. In JSON an object with the key `answer`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(tag = "answer")]
pub enum Answer {
    /// It is done, or begun: the status tells how far it is.
    Done {},
    /// How the bench is.
    Status(Box<Status>),
    /// Parameters came into force.
    Entered {
        /// With this cycle.
        cycle: u64,
        /// What became another.
        differences: Vec<Changed>,
        /// How far the rendering law is from chatter, in words, where it became another.
        margin: Option<String>,
    },
    /// What is not the same.
    Differences {
        /// Each value.
        differences: Vec<Changed>,
    },
    /// Parameters with what is known of them.
    Items {
        /// In the order of declaration.
        items: Vec<Item>,
    },
    /// The machine.
    Machine(Box<Machine>),
    /// What runs.
    Flow(Box<Flow>),
    /// A page of its diagram.
    DiagramPage(Box<DiagramPage>),
    /// How long cycles take.
    Timing(Box<Timing>),
    /// The program that runs.
    Target(Box<Target>),
    /// A build.
    Built(Box<BuildProgress>),
    /// A plan.
    Plan(Box<PlanForm>),
    /// A friction curve.
    Curve(Box<MeasuredCurve>),
    /// Runs that have one.
    Curves {
        /// The newest first.
        curves: Vec<CurveName>,
    },
    /// A friction as it was rendered.
    Rendered(Box<RenderedFriction>),
    /// A measurement at rest.
    AtRest(Box<BreakawayMeasurement>),
    /// A preload of the friction wheel.
    AdvisedPreload(AdvisedPreload),
    /// What was lost or held.
    Losses {
        /// Cycles that recorders and viewers did not get, the newest last.
        lost: Vec<Loss>,
        /// Cycles that were held: a deadline was missed, or a virtual machine waited for a command; the newest last.
        held: Vec<Loss>,
    },
    /// A report that was written.
    Report {
        /// Its number: the page is at `/report/NUMBER`.
        run: u64,
        /// Its folder.
        folder: String,
    },
    /// A sketch, drawn.
    Drawn(Box<Drawn>),
    /// How far the rendering law is from chatter.
    Margin(ChatterMargin),
    /// A position controller on the machine as believed.
    Loop(Box<LoopView>),
    /// Whether one hunts.
    Hunting(Box<HuntingView>),
    /// A tuning.
    Tuned(TuneProgress),
    /// A text.
    Text {
        /// As it is.
        text: String,
    },
    /// Names.
    Names {
        /// Sorted.
        names: Vec<String>,
    },
    /// The signals.
    Signals {
        /// In the order of a row.
        signals: Vec<Signal>,
        /// Names of those that are looked at first, together with which.
        panes: Vec<Vec<String>>,
    },
    /// A capture, not complete yet, or a stream.
    Capture {
        /// Its number.
        capture: u64,
        /// `filling`, `armed`, `delayed`, `triggered`; of a stream `streaming`.
        stage: String,
    },
    /// A capture that is complete.
    Captured(Box<Captured>),
    /// Points of a stream, oldest first.
    Points {
        /// Each.
        points: Vec<Point>,
    },
    /// A stream of every cycle has begun.
    Samples {
        /// Its number.
        capture: u64,
    },
    /// What happened lately.
    Marks {
        /// The newest last.
        marks: Vec<Mark>,
    },
    /// Runs of the catalogue.
    Runs {
        /// The newest first.
        runs: Vec<Run>,
        /// How many the query finds, these among them.
        of: u64,
        /// What of the query was not understood and left out.
        hints: Vec<String>,
    },
    /// A run of the catalogue.
    Run {
        /// As in a list.
        run: Box<Run>,
        /// Its parameters and results.
        values: Vec<Value>,
        /// The ends of the names as which its record leaves for other tools: `/run/NUMBER/run.mf4?as=parquet`.
        leaves_as: Vec<String>,
    },
    /// A replay.
    Replay(ReplayProgress),
    /// A run, as it was and as it would have been.
    Simulated {
        /// Its traces.
        simulated: Box<Simulated>,
        /// The parameters that are others.
        differences: Vec<Changed>,
    },
    /// A signal of runs over time.
    Courses {
        /// In the order in which they were asked for.
        courses: Vec<OverlaidRun>,
    },
    /// What happened in a run.
    Story {
        /// In its order.
        happened: Vec<RunEvent>,
    },
}

/// A run among others over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OverlaidRun {
    /// Its number.
    pub number: i64,
    /// What is added to its time [s]; `null` where it does not fit.
    pub shift: Option<f64>,
    /// Its course, in its own time.
    pub course: Option<Course>,
    /// Why there is none.
    pub trouble: Option<String>,
}

/// A value that is not the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Changed {
    /// Its dotted path.
    pub path: String,
    /// Before, with its unit.
    pub before: Option<String>,
    /// After, with its unit.
    pub after: Option<String>,
}

impl Changed {
    pub(crate) fn all(differences: &[Difference]) -> Vec<Changed> {
        let text = |entry: &Option<Entry>| entry.as_ref().map(Entry::to_string);
        let changed = |d: &Difference| Changed { path: d.path.clone(), before: text(&d.before), after: text(&d.after) };
        differences.iter().map(changed).collect()
    }
}

/// A signal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Signal {
    /// Its name.
    pub name: String,
    /// The same for people.
    pub label: String,
    /// As in an equation; may be empty.
    pub symbol: String,
    /// SI unit.
    pub unit: String,
    /// The same as printed; empty for a pure number.
    pub printed_unit: String,
    /// What it is.
    pub help: String,
    /// What each of its values is called, from 0 on; empty for what is measured.
    pub values: Vec<String>,
}

/// A window of a stream: all its samples lie between the least and the largest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Point {
    /// Its first cycle.
    pub from: u64,
    /// Its last cycle.
    pub to: u64,
    /// Cycles that are in no point, since the point before: lost, or in points that nobody took in time.
    pub missing: u64,
    /// Of each signal the least value; `null` where there is no number.
    pub min: Vec<Option<f64>>,
    /// Of each signal the largest.
    pub max: Vec<Option<f64>>,
    /// Of each signal the last.
    pub last: Vec<Option<f64>>,
    /// Of each signal whether there is among them what is no number.
    pub nan: Vec<bool>,
}

/// What was captured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Captured {
    /// Names of the columns.
    pub signals: Vec<String>,
    /// Number of the cycle of each row.
    pub cycles: Vec<u64>,
    /// Its time, 0 at the trigger [s].
    pub times: Vec<f64>,
    /// Of each signal its value in each row; `null` where it is no number.
    pub columns: Vec<Vec<Option<f64>>>,
    /// Index of the trigger's row.
    pub trigger: usize,
    /// Cycles that are lost.
    pub lost: u64,
    /// Ticks of history that were asked for but not there yet.
    pub missing: u64,
}
