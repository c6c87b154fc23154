//! What can be asked of a bench that runs, and what it answers: the one language of terminal, scripts and browser.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use stickslip_core::render::Law;

pub use super::again::ReplayProgress;
pub use super::at_rest::MeasuredAtRest;
pub use super::curve::{CurveName, FittedCurve, FittedParameter, MeasuredCurve, MeasuredPoint};
pub use super::form::{Choice, Item, ItemKind, PlanForm};
pub use super::implementation::{
    BlockSize, BuildError, BuildProgress, BuildStage, DiagramPage, Flow, FlowBlock, FlowGroup, FlowPage, FlowWire,
    LateCycle, Target, TargetFile, TimeBin, TimedPart, Timing, Wished,
};
pub use super::losses::Loss;
pub use super::machine::{Factor, Machine, Part, PartKind};
pub use super::preload::AdvisedPreload;
pub use super::rendered::{KeyEstimate, Picture, RenderedFriction};
use crate::Error;
use crate::bench::remote::Counts;
use crate::catalogue::{Run, Value};
use crate::design::{self, CHATTER_LIMIT, Margin};
use crate::parameters::{Difference, Entry};
pub use crate::run::{Happened, Simulated, Trace};
use crate::workflow::sketch::{Drawn, Sketch};

/// A question or an order. In JSON an object with the key `call`: `{"call": "set", "values": {"bench.law.kind":
/// "bristle"}}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "call", rename_all = "snake_case", deny_unknown_fields)]
pub enum Call {
    /// How the bench is.
    Status {},
    /// Switch on and search the index; the axis then has torque and rests near its zero.
    Home {},
    /// Torque, under control; the zero is known.
    Start {},
    /// Be ready again without homing, where the zero is still known.
    Arm {},
    /// To rest by the brake, then no more torque.
    Stop {},
    /// Switch off: no torque at once, what moves comes to rest by its friction.
    Off {},
    /// The fault is seen.
    Acknowledge {},
    /// End the motion or the measurement that runs: the set-point comes to rest under control.
    Halt {},
    /// Follow a reference from where the axis is.
    Move {
        /// What to follow: `sine`, `steps`, `point-to-point`, …
        reference: String,
        /// Its values by name, SI units; those that are not given have their defaults.
        #[serde(default)]
        values: BTreeMap<String, f64>,
        /// Whether the load motor renders the desired friction meanwhile.
        #[serde(default)]
        render: bool,
    },
    /// Break something of the virtual machine on purpose, until the bench is started anew.
    Inject {
        /// What, and how much: `encoder-stuck`, `counts-lost=0.02`.
        fault: String,
    },
    /// Press the linings of the friction wheel on, 0 … 1; on hardware: they are pressed on so far.
    Preload {
        /// How far.
        preload: f64,
    },
    /// Run a measurement; its results are written into the project.
    Measure {
        /// What to measure.
        what: Quantity,
        /// Values of its plan, as in a file.
        #[serde(default)]
        plan: BTreeMap<String, String>,
        /// Of the friction: while the load motor renders the desired one.
        #[serde(default)]
        render: bool,
    },
    /// Change parameters, all of them with the same cycle: dotted paths, values as in a file.
    Set {
        /// Value by path.
        values: BTreeMap<String, String>,
    },
    /// The parameters before the last change.
    Undo {},
    /// The parameters before the last undo.
    Redo {},
    /// The parameters that the run began with.
    Reset {},
    /// Save the parameters in force under a name.
    Save {
        /// Letters, digits, `-` and `_`.
        name: String,
    },
    /// Put the parameters of a name in force.
    Load {
        /// As it was saved.
        name: String,
    },
    /// The names under which parameters are saved.
    Sets {},
    /// The parameters in force, as a file.
    Parameters {},
    /// What is in force and not as it was when the run began.
    Differences {},
    /// Each parameter in force, with what is known of it.
    Items {},
    /// What would be another with these values; nothing is put in force.
    Preview {
        /// Value by path, as in `set`.
        values: BTreeMap<String, String>,
    },
    /// The machine, for a picture of it.
    Machine {},
    /// What runs, as a signal-flow diagram of its blocks.
    Flow {},
    /// A page of the diagram of the software in force: picture, code and size.
    DiagramPage {
        /// Its file, as `flow` names it.
        page: String,
    },
    /// How long cycles take, and why some took too long.
    Timing {},
    /// The program that runs, and what the system granted it.
    Target {},
    /// Compile the software in force as C, and put it to its self-test, beside the loop.
    Build {},
    /// How far that is, or what came of it.
    Built {},
    /// End a build that is under way.
    EndBuild {},
    /// A plan of a measurement, and how long it takes; nothing is begun.
    Plan {
        /// What would be measured.
        what: Quantity,
        /// The thorough plan instead of the default.
        #[serde(default)]
        thorough: bool,
        /// Values that are not as there.
        #[serde(default)]
        plan: BTreeMap<String, String>,
    },
    /// A friction curve with its fit.
    Curve {
        /// Number of its run; `null`: the one that is being measured, or was last.
        #[serde(default)]
        run: Option<u64>,
    },
    /// The runs that have a friction curve.
    Curves {},
    /// A friction as it was rendered: key numbers and figures.
    Rendered {
        /// Number of its run; `null`: the one that is being measured, or was last.
        #[serde(default)]
        run: Option<u64>,
    },
    /// A measurement of breakaway or presliding: what was found, with figures.
    AtRest {
        /// Which.
        what: Quantity,
        /// Number of its run; `null`: the one that is being measured, or was last.
        #[serde(default)]
        run: Option<u64>,
    },
    /// Which preload of the friction wheel the desired friction needs with these parameters, and why.
    AdvisePreload {
        /// Value by path, as in `set`.
        #[serde(default)]
        values: BTreeMap<String, String>,
    },
    /// The newest cycles that were lost and deadlines that were missed.
    Losses {},
    /// Write the report of the experiment: own, desired and rendered friction that were measured last.
    SaveReport {},
    /// Draw a desired friction; nothing is put in force.
    Sketch(Sketch),
    /// How far the rendering law would be from chatter with these parameters; nothing is put in force.
    Margin {
        /// Value by path, as in `set`.
        #[serde(default)]
        values: BTreeMap<String, String>,
    },
    /// Name, unit and meaning of each signal.
    Signals {},
    /// Capture signals around a trigger; the answer has its number.
    Capture {
        /// Names of the signals.
        signals: Vec<String>,
        /// When: `immediate`, `setpoint.velocity rises through 0.1`, …
        trigger: String,
        /// Time before the trigger [s].
        before: f64,
        /// Time after it [s].
        after: f64,
        /// Of so many ticks one is kept, at least 1.
        #[serde(default = "one")]
        decimation: u64,
    },
    /// What a capture has, if it is complete; it then ends.
    Fetch {
        /// Its number.
        capture: u64,
    },
    /// Stream signals live, thinned out so that no spike is lost; the answer has the stream's number.
    Stream {
        /// Names of the signals.
        signals: Vec<String>,
        /// From point to point [s], a tick at least.
        every: f64,
    },
    /// The points of a stream that have come since the last time.
    Points {
        /// The stream's number.
        capture: u64,
    },
    /// Stream every cycle of up to 64 signals; only over the WebSocket, whose binary messages have them.
    Samples {
        /// Names of the signals, each once.
        signals: Vec<String>,
    },
    /// What happened lately: faults, changes of parameters, what began and ended.
    Marks {},
    /// End a capture or a stream.
    Drop {
        /// Its number.
        capture: u64,
    },
    /// Be the operator, whoever is now.
    Operate {},
    /// Record every cycle from the next one on, under a name of its own in the project's runs.
    Record {
        /// Letters, digits, `-` and `_`.
        name: String,
    },
    /// End the recording; what was recorded is a run of the catalogue.
    EndRecord {},
    /// The runs of the catalogue that a query finds, the newest first.
    Runs {
        /// Words, `law:bristle`, `M_S>0.2`, `-tag:bad`; empty for all.
        #[serde(default)]
        query: String,
        /// At most so many.
        #[serde(default = "fifty")]
        limit: u64,
    },
    /// A run with its parameters and results.
    Run {
        /// Its number.
        number: i64,
    },
    /// Replay a recorded run beside what the bench does; how far that is, or what it found.
    Replay {
        /// Its number.
        number: i64,
    },
    /// End the replay that is under way.
    EndReplay {},
    /// Run a recorded run again on the virtual bench, with other parameters; nothing is put in force.
    Simulate {
        /// Its number.
        number: i64,
        /// Value by path, as in `set`; what of the machine is another as well.
        #[serde(default)]
        values: BTreeMap<String, String>,
        /// Names of the signals that are told.
        signals: Vec<String>,
        /// So much of the run, from its begin on [s]; at most 120.
        length: f64,
        /// Parts of the time in a trace; at most 4000.
        parts: u64,
    },
    /// What happened in a recorded run: changes, faults, losses.
    Story {
        /// Its number.
        number: i64,
    },
    /// Give a run another name.
    RenameRun {
        /// Its number.
        number: i64,
        /// In words.
        name: String,
    },
    /// Add tags to a run and take others away.
    TagRun {
        /// Its number.
        number: i64,
        /// Words.
        #[serde(default)]
        add: Vec<String>,
        /// Words.
        #[serde(default)]
        remove: Vec<String>,
    },
    /// Write a note to a run.
    NoteRun {
        /// Its number.
        number: i64,
        /// Empty to take it away.
        note: String,
    },
    /// Move a run into the bin, where it lies for 30 days.
    DeleteRun {
        /// Its number.
        number: i64,
    },
    /// Bring a run back from the bin.
    RestoreRun {
        /// Its number.
        number: i64,
    },
    /// Ask whoever operates for the operator's place.
    Ask {},
    /// Give it to whoever asked, or not now.
    HandOver {
        /// Whether it is given.
        grant: bool,
    },
}

fn fifty() -> u64 {
    50
}

fn one() -> u64 {
    1
}

impl Call {
    /// Whether only the operator may ask for it.
    pub fn changes(&self) -> bool {
        !matches!(
            self,
            Call::Status {}
                | Call::Sets {}
                | Call::Parameters {}
                | Call::Differences {}
                | Call::Items {}
                | Call::Preview { .. }
                | Call::Machine {}
                | Call::Flow {}
                | Call::DiagramPage { .. }
                | Call::Timing {}
                | Call::Target {}
                | Call::Built {}
                | Call::Plan { .. }
                | Call::Curve { .. }
                | Call::Curves {}
                | Call::Rendered { .. }
                | Call::AtRest { .. }
                | Call::AdvisePreload { .. }
                | Call::Losses {}
                | Call::Ask {}
                | Call::Sketch(_)
                | Call::Margin { .. }
                | Call::Signals {}
                | Call::Capture { .. }
                | Call::Fetch { .. }
                | Call::Stream { .. }
                | Call::Points { .. }
                | Call::Samples { .. }
                | Call::Marks {}
                | Call::Drop { .. }
                | Call::Runs { .. }
                | Call::Run { .. }
                | Call::Replay { .. }
                | Call::EndReplay {}
                | Call::Story { .. }
                | Call::Simulate { .. }
                // Whoever sees danger may stop.
                | Call::Stop {}
                | Call::Halt {}
                | Call::Operate {}
        )
    }
}

/// What can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// The friction curve.
    Friction,
    /// The breakaway torque.
    Breakaway,
    /// The bristles.
    Presliding,
}

/// An answer. In JSON an object with the key `answer`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "answer", rename_all = "snake_case")]
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
    AtRest(Box<MeasuredAtRest>),
    /// A preload of the friction wheel.
    AdvisedPreload(AdvisedPreload),
    /// What was lost.
    Losses {
        /// Cycles that recorders and viewers did not get, the newest last.
        lost: Vec<Loss>,
        /// Deadlines that were missed, the newest last.
        overruns: Vec<Loss>,
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
    Margin(ToChatter),
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
    /// What happened in a run.
    Story {
        /// In its order.
        happened: Vec<Happened>,
    },
}

/// How far a rendering law is from chatter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ToChatter {
    /// Whether the bench would take it.
    pub stable: bool,
    /// In a sentence: how far, or why not and what would do.
    pub sentence: String,
    /// Stiffness of the desired bristles up to which it does not chatter [N m/rad]; `null`: no limit was found, or it is
    /// not stable.
    pub stiffness_limit: Option<f64>,
    /// Stiffness of the desired bristles [N m/rad]; `null` where the law renders none.
    pub stiffness: Option<f64>,
    /// Factor of the law's torque up to which the loop is stable; `null`: any that was tried.
    pub gain_margin: Option<f64>,
    /// Additional delay up to which it is [s]; `null`: any that was tried.
    pub delay_margin: Option<f64>,
    /// Change of the load torque from millisecond to millisecond that is to be expected [N m RMS].
    pub chatter: f64,
    /// From which on it is chatter [N m RMS].
    pub chatter_limit: f64,
    /// What of the way to the nearest limit is left, 0 … 1; `null` where it is not known.
    pub left: Option<f64>,
    /// Below this share caution is due.
    pub caution: f64,
    /// The nearest limit: `chatter`, `stiffness`.
    pub nearest: String,
}

/// A fifth of the way: by choice, as room for what the model of the bench is off.
const CAUTION: f64 = 0.2;

impl ToChatter {
    pub(super) fn of(law: &Law<f64>, margin: Result<Margin, Error>) -> Result<Self, Error> {
        let stable = margin.is_ok();
        let sentence = margin.as_ref().map_or_else(ToString::to_string, ToString::to_string);
        let known = match margin {
            Ok(margin) => margin,
            // No limit is known where the loop grows by itself.
            Err(Error::Chatters { predicted_chatter, cause, .. }) => {
                Margin { stiffness_limit: None, gain_margin: None, delay_margin: None, predicted_chatter, cause }
            }
            Err(other) => return Err(other),
        };
        let stiffness = design::desired_stiffness(law);
        let uses = [
            ("chatter", Some(known.predicted_chatter / CHATTER_LIMIT)),
            ("stiffness", stiffness.zip(known.stiffness_limit).map(|(stiffness, limit)| stiffness / limit)),
        ];
        let uses =
            uses.into_iter().filter_map(|(name, used)| used.filter(|used| used.is_finite()).map(|used| (name, used)));
        let nearest = uses.max_by(|a, b| a.1.total_cmp(&b.1));
        Ok(ToChatter {
            left: nearest.map(|(_, used)| (1.0 - used).max(0.0)),
            caution: CAUTION,
            nearest: nearest.map_or("", |(name, _)| name).into(),
            stable,
            sentence,
            stiffness_limit: known.stiffness_limit,
            stiffness,
            gain_margin: known.gain_margin,
            delay_margin: known.delay_margin,
            chatter: known.predicted_chatter,
            chatter_limit: CHATTER_LIMIT,
        })
    }
}

/// How the bench is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Status {
    /// The preset it runs with.
    pub preset: String,
    /// `off`, `homing`, `ready`, `running`, `stopping`, `fault`, or `ended` once the loop does not run any more.
    pub state: String,
    /// Why, where it is a fault or has ended.
    pub reason: Option<String>,
    /// Number of the newest cycle.
    pub cycle: u64,
    /// Ticks in a second [Hz].
    pub rate: f64,
    /// Screw angle [rad].
    pub angle: f64,
    /// Estimated velocity [rad/s].
    pub velocity: f64,
    /// Torque of the drive motor [N m].
    pub drive_torque: f64,
    /// Torque of the load motor, against positive motion [N m].
    pub load_torque: f64,
    /// Whether the load motor renders.
    pub render: bool,
    /// How far the linings are pressed on, 0 … 1.
    pub preload: f64,
    /// What runs: nothing, a motion, a measurement.
    pub doing: Option<Doing>,
    /// How what ran last has ended.
    pub last: Option<Ended>,
    /// Parameters that are not as they were when the run began.
    pub changed: usize,
    /// Whether there is something to undo.
    pub undo: bool,
    /// Whether there is something to redo.
    pub redo: bool,
    /// Who may change something.
    pub operator: Option<String>,
    /// Who asks the operator for his place.
    #[serde(default)]
    pub asks: Option<String>,
    /// How the clock is kept.
    pub clock: ClockStatus,
    /// What happened on the link to the machine, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<Counts>,
    /// The file that the run is recorded into.
    pub recording: Option<String>,
    /// How much is in it, or was where it could not go on.
    #[serde(default)]
    pub recorded: Option<Recorded>,
    /// Why the run that ended last is not in the catalogue.
    #[serde(default)]
    pub not_entered: Option<String>,
    /// Where it is open to measurement and calibration tools.
    #[serde(default)]
    pub xcp: Vec<XcpStatus>,
    /// How many marks there have been since the start.
    #[serde(default)]
    pub marks: u64,
}

/// Something that happened in a cycle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Mark {
    /// In which; where it is no cycle's own doing, in the newest at that time.
    pub cycle: u64,
    /// What kind of thing.
    pub kind: MarkKind,
    /// In words.
    pub text: String,
}

/// What kind of thing happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MarkKind {
    /// A fault.
    Fault,
    /// Parameters came into force.
    Change,
    /// A motion or a measurement began.
    Begin,
    /// It ended.
    End,
}

/// How much was recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Recorded {
    /// The first cycle of it.
    pub from: u64,
    /// Length [s].
    pub length: f64,
    /// Size of the file [bytes].
    pub bytes: u64,
    /// Cycles that are not in it.
    pub lost: u64,
}

/// An address at which the bench speaks XCP.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct XcpStatus {
    /// `udp` or `tcp`.
    pub transport: String,
    /// Its address.
    pub address: String,
    /// The address of the master that is connected.
    pub master: Option<String>,
    /// Whether it measures.
    pub measuring: bool,
    /// Rows that its measurements have lost since the start.
    pub lost: u64,
}

/// What runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Doing {
    /// What it is: `sine`, `measure friction`.
    pub what: String,
    /// How far it is, in words.
    pub stage: String,
    /// The part of the stage that is done, 0 … 1.
    pub fraction: f64,
}

/// How something ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ended {
    /// What it was.
    pub what: String,
    /// Why, where it failed or was cancelled.
    pub error: Option<String>,
    /// Where its results are.
    pub folder: Option<String>,
}

/// How the clock is kept. Times in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClockStatus {
    /// From the deadline to the begin of a cycle: median, 99th and 99.9th percentile, longest.
    pub lateness: [f64; 4],
    /// A whole cycle, likewise.
    pub cycle: [f64; 4],
    /// Share of a tick that a cycle takes: median.
    #[serde(default)]
    pub load: f64,
    /// Cycles whose deadline was missed.
    pub held: u64,
    /// Cycles that found no room on their way to recorders and viewers.
    pub lost: u64,
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
    pub(super) fn all(differences: &[Difference]) -> Vec<Changed> {
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
