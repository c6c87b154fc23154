//! How a bench is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use stickslip_bench::remote::Counts;

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
    pub doing: Option<CurrentTask>,
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
    /// What was loaded from a file, where something was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loaded: Option<LoadedStatus>,
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

/// A controller, a friction or a law that was loaded from a file. Times in seconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoadedStatus {
    /// What it is in the loop: `controller`, `friction`, `law`.
    pub role: String,
    /// The parameter that says whether it is in the loop.
    pub selector: String,
    /// What it calls itself.
    pub name: String,
    /// What it is: `C library`, `FMU 2.0`.
    pub kind: String,
    /// Its file.
    pub file: String,
    /// SHA-256 of what was opened, in hexadecimal digits.
    pub hash: String,
    /// Whether it has failed: it gives no torque until it is opened again.
    pub failed: bool,
    /// How often it was called.
    pub calls: u64,
    /// How long a call took: median, 99th and 99.9th percentile, longest.
    pub call: [f64; 4],
    /// From its question until its answer was there, likewise, where it runs in a process of its own.
    pub response: Option<[f64; 4]>,
    /// How long a call may take.
    pub budget: f64,
    /// How many took longer.
    pub over_budget: u64,
    /// How many torques were not there when they were due: the last one was held meanwhile.
    pub late: u64,
}

/// What runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurrentTask {
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
    /// Cycles that were held: a deadline was missed, or a virtual machine waited for a command.
    pub held: u64,
    /// Cycles that found no room on their way to recorders and viewers.
    pub lost: u64,
}
