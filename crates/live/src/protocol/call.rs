//! What can be asked.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Alignment, LoopDraft};
use stickslip_experiment::workflow::sketch::Sketch;

/// A question or an order. In JSON an object with the key `call`: `{"call": "set", "values": {"bench.law.kind":
/// "bristle"}}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[schemars(tag = "call")]
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
    /// The loaded file again, as it is now: it begins at rest, with the values of before.
    OpenAgain {},
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
    /// A position controller as it would be with a draft's values: its loop on the machine as believed, the load sliding
    /// and stuck. Nothing is put in force.
    Loop(LoopDraft),
    /// Whether a draft of a position controller would hunt at a set-point that rests.
    Hunting {
        /// The draft.
        #[serde(default)]
        draft: LoopDraft,
        /// On the desired friction, which the load motor renders, instead of the machine's own.
        #[serde(default)]
        desired: bool,
    },
    /// Tune a draft of a position controller as every controller is tuned, beside the loop; nothing is put in force.
    Tune(LoopDraft),
    /// How far the tuning is that was begun last, or what it found.
    Tuned {},
    /// End the tuning, for whoever began it.
    EndTuning {},
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
    /// A signal of recorded runs over time, laid over each other.
    Courses {
        /// Their numbers; at most six.
        numbers: Vec<i64>,
        /// Name of the signal.
        signal: String,
        /// How they are laid.
        align: Alignment,
        /// Only what then lies from here [s] …
        #[serde(default)]
        from: Option<f64>,
        /// … to here [s].
        #[serde(default)]
        to: Option<f64>,
        /// Parts of the time in a course; at most 4000.
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
                | Call::Loop(_)
                | Call::Hunting { .. }
                | Call::Tune(_)
                | Call::Tuned {}
                | Call::EndTuning {}
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
                | Call::Courses { .. }
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
