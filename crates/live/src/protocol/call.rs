//! Calls of clients.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Alignment, LoopDraft, TrialSignal};
use stickslip_experiment::workflow::sketch::Sketch;

/// A call. In JSON an object with the key `call`: `{"call": "set", "values": {"bench.law.kind": "bristle"}}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[schemars(tag = "call")]
pub enum Call {
    /// Read the status of the bench.
    Status {},
    /// Switch on and search the index; the axis then has torque and rests near its zero.
    Home {},
    /// Enable torque and position control; requires homing.
    Start {},
    /// Become ready again without homing, if the axis is still homed.
    Arm {},
    /// Brake to rest, then disable the torque.
    Stop {},
    /// Disable the torque immediately; the axis comes to rest by its friction.
    Off {},
    /// End the program; the axis must be without torque.
    Close {},
    /// Acknowledge the fault.
    Acknowledge {},
    /// Acknowledge the fault and take the way back that its remedy names: arm, home, or open the external file again.
    Recover {},
    /// End the running motion or measurement: the set-point comes to rest under control.
    Halt {},
    /// Follow a reference from the present position of the axis.
    Move {
        /// Kind of reference: `sine`, `steps`, `point-to-point`, …
        reference: String,
        /// Its values by name, SI units; default: those of the reference.
        #[serde(default)]
        values: BTreeMap<String, f64>,
        /// Whether the load motor renders the desired friction during the motion.
        #[serde(default)]
        render: bool,
    },
    /// Move at a constant speed while the call is repeated, at least every 0.3 s; then the axis comes to rest.
    Jog {
        /// Velocity of the screw [rad/s]; 0 releases the button.
        velocity: f64,
        /// Number of the press of the button, another one for each press.
        press: u64,
        /// Whether the load motor renders the desired friction during the motion.
        #[serde(default)]
        render: bool,
    },
    /// Move to a position and stay there.
    GoTo {
        /// Angle of the screw from its zero [rad].
        position: f64,
        /// Largest speed [rad/s]; default: a fifth of the limit of the axis.
        #[serde(default)]
        speed: Option<f64>,
        /// Whether the load motor renders the desired friction during the motion.
        #[serde(default)]
        render: bool,
    },
    /// List the manoeuvres and controllers that can be tried, and the limits of motions.
    TrialChoices {},
    /// Let the active controller follow a motion several times; the scores and the samples become a run.
    Trial {
        /// A manoeuvre of `trial_choices`; ignored with a file.
        #[serde(default)]
        motion: String,
        /// Positions over time instead of a manoeuvre.
        #[serde(default)]
        file: Option<TrialFile>,
        /// Number of repetitions, 1 to 20.
        #[serde(default = "one")]
        repetitions: u64,
        /// Whether the load motor renders the desired friction.
        #[serde(default)]
        render: bool,
    },
    /// List the trials of the project, the newest first.
    Trials {
        /// Maximum number of listed trials.
        #[serde(default = "fifty")]
        limit: u64,
    },
    /// Read one or two trials for a picture: curves, difference, scores.
    TrialPair {
        /// Number of trial A.
        a: u64,
        /// Number of trial B.
        #[serde(default)]
        b: Option<u64>,
        /// The signal.
        #[serde(default)]
        signal: TrialSignal,
        /// The repetition, from 1.
        #[serde(default = "one")]
        repetition: u64,
        /// Start of the shown range [s].
        #[serde(default)]
        from: Option<f64>,
        /// End of the shown range [s].
        #[serde(default)]
        to: Option<f64>,
        /// Number of intervals of a curve; at most 4000.
        parts: u64,
    },
    /// Compare controllers on the same friction: each follows the manoeuvres, and the benchmark ranks them. The active
    /// controller is restored at the end.
    Compare {
        /// `active`, or controllers of `trial_choices`; at least two. The first is the reference.
        controllers: Vec<String>,
        /// Manoeuvres of `trial_choices`.
        manoeuvres: Vec<String>,
        /// Number of repetitions, 2 to 20.
        repetitions: u64,
        /// Whether the load motor renders the desired friction.
        #[serde(default)]
        render: bool,
    },
    /// Read a comparison of controllers.
    Comparison {
        /// Number of its run; default: the running or last one.
        #[serde(default)]
        run: Option<u64>,
    },
    /// Inject a fault into the virtual machine; it stays until restart.
    Inject {
        /// Name and value of the fault: `encoder-stuck`, `counts-lost=0.02`.
        fault: String,
    },
    /// Set the preload of the friction wheel; on physical hardware, enter the preload that was set by hand.
    Preload {
        /// Preload, 0 (released) … 1.
        preload: f64,
    },
    /// Run a measurement; its results are written into the project.
    Measure {
        /// The measured quantity.
        what: Quantity,
        /// Values of its plan, as in a file.
        #[serde(default)]
        plan: BTreeMap<String, String>,
        /// Measure the friction while the load motor renders the desired one.
        #[serde(default)]
        render: bool,
    },
    /// Change parameters, all in the same cycle: dotted paths, values as in a file.
    Set {
        /// Value by path.
        values: BTreeMap<String, String>,
    },
    /// Undo the last change of parameters.
    Undo {},
    /// Redo the last undone change of parameters.
    Redo {},
    /// Restore the parameters of the start of the run.
    Reset {},
    /// Open the loaded file again in its present version: it starts at rest and keeps its parameter values.
    OpenAgain {},
    /// Save the active parameters under a name.
    Save {
        /// Letters, digits, `-` and `_`.
        name: String,
    },
    /// Activate a saved set of parameters.
    Load {
        /// Its name.
        name: String,
    },
    /// List the names of the saved sets of parameters.
    Sets {},
    /// List the differences that a saved set of parameters would make; the bench is unchanged.
    PreviewSet {
        /// Its name.
        name: String,
    },
    /// Read the state of the target before the start of the program, with the differences from the active one.
    EarlierState {},
    /// Restore this state: all of its values or none.
    RestoreState {},
    /// Discard this state; the project preserves it in `state/target-before.json`.
    DiscardState {},
    /// Store the layout of the operator's scope in the project; other clients' layouts are ignored.
    KeepLayout {
        /// The layout, at most 64 kB.
        layout: String,
    },
    /// Read the stored layout of the scope; empty if there is none.
    Layout {},
    /// Read the active parameters as a file.
    Parameters {},
    /// List the active parameters that differ from those of the start of the run.
    Differences {},
    /// Read all active parameters with their descriptions. With values, those that they would give: a kind has its own
    /// parameters.
    Items {
        /// Value by path, as in `set`.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        values: BTreeMap<String, String>,
    },
    /// List the differences that some values would make; the bench is unchanged.
    Preview {
        /// Value by path, as in `set`.
        values: BTreeMap<String, String>,
    },
    /// Read the machine's parts and units, for a picture.
    Machine {},
    /// Read the signal-flow diagram of the running software.
    Flow {},
    /// Read a page of the diagram of the active software: picture, code and size.
    DiagramPage {
        /// Its file, as listed by `flow`.
        page: String,
    },
    /// Read the execution times of the cycles and the causes of overruns.
    Timing {},
    /// Read version and set-up of the running program.
    Target {},
    /// Compile the active software as C and run its self-test; the loop continues.
    Build {},
    /// Read progress or result of the build.
    Built {},
    /// Cancel the running build.
    EndBuild {},
    /// Read the plan of a measurement and its duration; nothing is started.
    Plan {
        /// The measured quantity.
        what: Quantity,
        /// The thorough plan instead of the default.
        #[serde(default)]
        thorough: bool,
        /// Values that differ from this plan.
        #[serde(default)]
        plan: BTreeMap<String, String>,
    },
    /// Read a friction curve with its fit.
    Curve {
        /// Number of its run; default: the running or last measurement.
        #[serde(default)]
        run: Option<u64>,
    },
    /// List the runs with a friction curve.
    Curves {},
    /// List the frictions of the library.
    Frictions {
        /// Scales their torques to this breakaway torque [N m]; default: as identified.
        #[serde(default)]
        breakaway: Option<f64>,
    },
    /// Read a measured rendered friction: key numbers and figures.
    Rendered {
        /// Number of its run; default: the running or last measurement.
        #[serde(default)]
        run: Option<u64>,
    },
    /// Read a measurement of breakaway or presliding: results and figures.
    AtRest {
        /// The measured quantity.
        what: Quantity,
        /// Number of its run; default: the running or last measurement.
        #[serde(default)]
        run: Option<u64>,
    },
    /// Compute the preload of the friction wheel that the desired friction requires, with the reason.
    AdvisePreload {
        /// Value by path, as in `set`.
        #[serde(default)]
        values: BTreeMap<String, String>,
    },
    /// List the newest lost cycles and missed deadlines.
    Losses {},
    /// Write the report of the experiment: the last measured own, desired and rendered friction.
    SaveReport {},
    /// Sketch a desired friction; the bench is unchanged.
    Sketch(Sketch),
    /// Compute the margin of the rendering law against chatter with some values; the bench is unchanged.
    Margin {
        /// Value by path, as in `set`.
        #[serde(default)]
        values: BTreeMap<String, String>,
    },
    /// Compute the position loop of a draft on the identified model, with the load sliding and stuck. The bench is unchanged.
    Loop(LoopDraft),
    /// Predict whether a draft of a position controller hunts at a constant set-point.
    Hunting {
        /// The draft.
        #[serde(default)]
        draft: LoopDraft,
        /// Use the desired friction, which the load motor renders, instead of the machine's own.
        #[serde(default)]
        desired: bool,
    },
    /// Tune a draft of a position controller within the robustness limits, in the background; the bench is unchanged.
    Tune(LoopDraft),
    /// Read progress or result of the last tuning.
    Tuned {},
    /// Cancel the tuning; only for the client that started it.
    EndTuning {},
    /// List name, unit and meaning of all signals.
    Signals {},
    /// Capture signals around a trigger; the answer has the number of the capture.
    Capture {
        /// Names of the signals.
        signals: Vec<String>,
        /// Trigger condition: `immediate`, `setpoint.velocity rises through 0.1`, …
        trigger: String,
        /// Time before the trigger [s].
        before: f64,
        /// Time after the trigger [s].
        after: f64,
        /// Decimation: every n-th tick is kept, at least 1.
        #[serde(default = "one")]
        decimation: u64,
    },
    /// Read a complete capture; this ends it.
    Fetch {
        /// Its number.
        capture: u64,
    },
    /// Stream signals as extremes of time windows, which keep every spike; the answer has the number of the stream.
    Stream {
        /// Names of the signals.
        signals: Vec<String>,
        /// Time from point to point [s], at least one tick.
        every: f64,
    },
    /// Read the points of a stream since the last call.
    Points {
        /// The stream's number.
        capture: u64,
    },
    /// Read extremes of signals from the history of the bench, in blocks of cycles.
    Past {
        /// Names of the signals.
        signals: Vec<String>,
        /// The first cycle.
        from: u64,
        /// The cycle after the last one.
        to: u64,
        /// Largest number of blocks; at most 4096.
        points: u64,
    },
    /// Stream every cycle of up to 64 signals; only over the WebSocket, in binary messages.
    Samples {
        /// Names of the signals, each once.
        signals: Vec<String>,
    },
    /// List the latest events: faults, changes of parameters, start and end of motions and measurements.
    Marks {},
    /// End a capture or a stream.
    Drop {
        /// Its number.
        capture: u64,
    },
    /// Become the operator, even if another client is.
    Operate {},
    /// Record every cycle from the next one on into a new run of the project.
    Record {
        /// Letters, digits, `-` and `_`.
        name: String,
    },
    /// End the recording and enter it into the catalogue.
    EndRecord {},
    /// List the runs of the catalogue that match a query, the newest first.
    Runs {
        /// Words, `law:bristle`, `M_S>0.2`, `-tag:bad`; empty for all.
        #[serde(default)]
        query: String,
        /// Maximum number of listed runs.
        #[serde(default = "fifty")]
        limit: u64,
    },
    /// Read size and limit of the records of measurements.
    Records {},
    /// Read a run with its parameters and results.
    Run {
        /// Its number.
        number: i64,
    },
    /// Replay a recorded run in the background; the answer is the progress or the result.
    Replay {
        /// Its number.
        number: i64,
    },
    /// Cancel the running replay.
    EndReplay {},
    /// Simulate a recorded run on the virtual bench with other parameters; the bench is unchanged.
    Simulate {
        /// Its number.
        number: i64,
        /// Value by path, as in `set`; also parameters of the machine.
        #[serde(default)]
        values: BTreeMap<String, String>,
        /// Names of the signals to return.
        signals: Vec<String>,
        /// Simulated time from the start of the run [s]; at most 120.
        length: f64,
        /// Number of points in a trace; at most 4000.
        parts: u64,
    },
    /// Read a signal of several recorded runs over time, overlaid.
    Courses {
        /// Their numbers; at most six.
        numbers: Vec<i64>,
        /// Name of the signal.
        signal: String,
        /// Alignment of their times.
        align: Alignment,
        /// Start of the shown range, in aligned time [s].
        #[serde(default)]
        from: Option<f64>,
        /// End of the shown range [s].
        #[serde(default)]
        to: Option<f64>,
        /// Number of points in a course; at most 4000.
        parts: u64,
    },
    /// List the events of a recorded run: changes, faults, losses.
    Story {
        /// Its number.
        number: i64,
    },
    /// Rename a run.
    RenameRun {
        /// Its number.
        number: i64,
        /// The new name.
        name: String,
    },
    /// Add and remove tags of a run.
    TagRun {
        /// Its number.
        number: i64,
        /// Tags to add.
        #[serde(default)]
        add: Vec<String>,
        /// Tags to remove.
        #[serde(default)]
        remove: Vec<String>,
    },
    /// Write a note to a run.
    NoteRun {
        /// Its number.
        number: i64,
        /// The note; empty: removed.
        note: String,
    },
    /// Move a run into the bin; it is deleted after 30 days.
    DeleteRun {
        /// Its number.
        number: i64,
    },
    /// Restore a run from the bin.
    RestoreRun {
        /// Its number.
        number: i64,
    },
    /// Request to become the operator.
    Ask {},
    /// Answer a request to become the operator.
    HandOver {
        /// Whether the request is granted.
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
    /// Whether only the operator may make this call.
    pub fn changes(&self) -> bool {
        !matches!(
            self,
            Call::Status {}
                | Call::Sets {}
                | Call::PreviewSet { .. }
                | Call::Parameters {}
                | Call::Differences {}
                | Call::Frictions { .. }
                | Call::Items { .. }
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
                | Call::TrialChoices {}
                | Call::Trials { .. }
                | Call::TrialPair { .. }
                | Call::Comparison { .. }
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
                | Call::Past { .. }
                | Call::Samples { .. }
                | Call::Marks {}
                | Call::Drop { .. }
                | Call::Runs { .. }
                | Call::Run { .. }
                | Call::Records {}
                | Call::EarlierState {}
                | Call::Layout {}
                | Call::KeepLayout { .. }
                | Call::Replay { .. }
                | Call::EndReplay {}
                | Call::Story { .. }
                | Call::Courses { .. }
                | Call::Simulate { .. }
                // Every client may stop the axis.
                | Call::Stop {}
                | Call::Halt {}
                | Call::Operate {}
        )
    }
}

/// A table of positions over time: two columns, time [s] and position in rad, mm, µm or m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrialFile {
    /// Its name.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// A quantity to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// The friction curve.
    Friction,
    /// The breakaway torque.
    Breakaway,
    /// Stiffness and damping of the bristles.
    Presliding,
}
