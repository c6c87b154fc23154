//! Answers of the bench.

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
    /// Done or started; the status shows the progress.
    Done {},
    /// Status of the bench.
    Status(Box<Status>),
    /// Parameters became active.
    Entered {
        /// First cycle with the new values.
        cycle: u64,
        /// The changed values.
        differences: Vec<Changed>,
        /// Margin of the rendering law against chatter, in words; `null` if the law did not change.
        margin: Option<String>,
    },
    /// Differences between two sets of parameters.
    Differences {
        /// The differing values.
        differences: Vec<Changed>,
    },
    /// Parameters with their descriptions.
    Items {
        /// In the order of declaration.
        items: Vec<Item>,
    },
    /// The machine.
    Machine(Box<Machine>),
    /// The running software as signal-flow diagram.
    Flow(Box<Flow>),
    /// A page of the diagram.
    DiagramPage(Box<DiagramPage>),
    /// Execution times of the cycles.
    Timing(Box<Timing>),
    /// The running program.
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
    /// The friction library.
    Frictions {
        /// Frictions identified on physical machines.
        frictions: Vec<LibraryFriction>,
    },
    /// A measured rendered friction.
    Rendered(Box<RenderedFriction>),
    /// A measurement at rest.
    AtRest(Box<BreakawayMeasurement>),
    /// What can be tried.
    TrialChoices(Box<TrialChoices>),
    /// The trials of the project.
    Trials {
        /// The newest first.
        trials: Vec<TrialRow>,
        /// Number of all trials.
        of: u64,
    },
    /// One or two trials.
    TrialPair(Box<TrialPair>),
    /// A comparison of controllers.
    Comparison(Box<Comparison>),
    /// A preload of the friction wheel.
    AdvisedPreload(AdvisedPreload),
    /// Lost and missed cycles.
    Losses {
        /// Cycles that recorders and viewers did not receive, the newest last.
        lost: Vec<Loss>,
        /// Missed cycles: a deadline was missed, or the virtual machine waited for a command; the newest last.
        held: Vec<Loss>,
    },
    /// A written report.
    Report {
        /// Its number: the page is at `/report/NUMBER`.
        run: u64,
        /// Its folder.
        folder: String,
    },
    /// A sketch of a desired friction.
    Drawn(Box<Drawn>),
    /// Margin of the rendering law against chatter.
    Margin(ChatterMargin),
    /// A position controller on the identified model.
    Loop(Box<LoopView>),
    /// Prediction of hunting.
    Hunting(Box<HuntingView>),
    /// A tuning.
    Tuned(TuneProgress),
    /// A text.
    Text {
        /// The text.
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
        /// Signals that the scope shows first, one list for each pane.
        panes: Vec<Vec<String>>,
    },
    /// A capture that is not complete yet, or a stream.
    Capture {
        /// Its number.
        capture: u64,
        /// `filling`, `armed`, `delayed`, `triggered`; of a stream `streaming`.
        stage: String,
    },
    /// A complete capture.
    Captured(Box<Captured>),
    /// Points of a stream, oldest first.
    Points {
        /// The points.
        points: Vec<Point>,
    },
    /// A part of the history.
    Past(Box<Past>),
    /// A stream of every cycle has started.
    Samples {
        /// Its number.
        capture: u64,
    },
    /// The latest events.
    Marks {
        /// The newest last.
        marks: Vec<Mark>,
    },
    /// State of the target before the start of the program.
    EarlierState(Box<EarlierState>),
    /// Records of measurements.
    Records(Records),
    /// Runs of the catalogue.
    Runs {
        /// The newest first.
        runs: Vec<Run>,
        /// Number of all runs that match the query.
        of: u64,
        /// Terms of the query that were ignored, and damaged entries.
        hints: Vec<String>,
    },
    /// A run of the catalogue.
    Run {
        /// As in a list.
        run: Box<Run>,
        /// Its parameters and results.
        values: Vec<Value>,
        /// File formats to which its record can be exported: `/run/NUMBER/run.mf4?as=parquet`.
        leaves_as: Vec<String>,
    },
    /// A replay.
    Replay(ReplayProgress),
    /// A recorded run and its simulation.
    Simulated {
        /// The traces.
        simulated: Box<Simulated>,
        /// The changed parameters.
        differences: Vec<Changed>,
    },
    /// A signal of runs over time.
    Courses {
        /// In the order of the request.
        courses: Vec<OverlaidRun>,
    },
    /// Events of a run.
    Story {
        /// In order of time.
        happened: Vec<RunEvent>,
    },
}

/// A signal of one of several overlaid runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OverlaidRun {
    /// Number of the run.
    pub number: i64,
    /// Offset to add to its time [s]; `null` if it cannot be aligned.
    pub shift: Option<f64>,
    /// The signal over the time of its own run.
    pub course: Option<Course>,
    /// Why there is no signal.
    pub trouble: Option<String>,
}

/// A changed value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Changed {
    /// Its dotted path.
    pub path: String,
    /// Value before, with its unit.
    pub before: Option<String>,
    /// Value after, with its unit.
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
    /// Its label.
    pub label: String,
    /// Symbol in equations; may be empty.
    pub symbol: String,
    /// SI unit.
    pub unit: String,
    /// Unit as printed; empty for a pure number.
    pub printed_unit: String,
    /// Description.
    pub help: String,
    /// Names of its values, from 0 on; empty for a measured quantity.
    pub values: Vec<String>,
}

/// A point of a stream: smallest and largest sample of its window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Point {
    /// First cycle.
    pub from: u64,
    /// Last cycle.
    pub to: u64,
    /// Missing cycles since the previous point: lost, or in points that were not read in time.
    pub missing: u64,
    /// Smallest value of each signal; `null` if not finite.
    pub min: Vec<Option<f64>>,
    /// Largest value of each signal; `null` if not finite.
    pub max: Vec<Option<f64>>,
    /// Last value of each signal; `null` if not finite.
    pub last: Vec<Option<f64>>,
    /// Whether the window contains a NaN, for each signal.
    pub nan: Vec<bool>,
}

/// A complete capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Captured {
    /// Names of the columns.
    pub signals: Vec<String>,
    /// Number of the cycle of each row.
    pub cycles: Vec<u64>,
    /// Time of each row, 0 at the trigger [s].
    pub times: Vec<f64>,
    /// Values of each signal in each row; `null` if not finite.
    pub columns: Vec<Vec<Option<f64>>>,
    /// Index of the trigger's row.
    pub trigger: usize,
    /// Lost cycles.
    pub lost: u64,
    /// Requested ticks before the trigger that were not yet available.
    pub missing: u64,
}
