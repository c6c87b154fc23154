//! Status of the running bench.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::FaultStatus;
use stickslip_bench::remote::Counts;
use stickslip_bench::segment::SegmentStatus;

/// Status of the running bench.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Status {
    /// Name of the preset.
    pub preset: String,
    /// `off`, `homing`, `ready`, `running`, `stopping`, `fault`, or `ended` after the end of the loop.
    pub state: String,
    /// Reason of a fault or of the end.
    pub reason: Option<String>,
    /// The fault with its remedy.
    #[serde(default)]
    pub fault: Option<FaultStatus>,
    /// Number of the newest cycle.
    pub cycle: u64,
    /// Tick rate [Hz].
    pub rate: f64,
    /// Screw angle [rad].
    pub angle: f64,
    /// Estimated velocity [rad/s].
    pub velocity: f64,
    /// Torque of the drive motor [N m].
    pub drive_torque: f64,
    /// Torque of the load motor, against positive motion [N m].
    pub load_torque: f64,
    /// Whether the load motor renders the desired friction.
    pub render: bool,
    /// Preload of the friction wheel, 0 … 1.
    pub preload: f64,
    /// The running motion or measurement; `null`: none.
    pub doing: Option<CurrentTask>,
    /// End of the last motion or measurement.
    pub last: Option<Ended>,
    /// Number of parameters that differ from those at the start of the run.
    pub changed: usize,
    /// Whether a change can be undone.
    pub undo: bool,
    /// Whether a change can be redone.
    pub redo: bool,
    /// The operator: the client that may change the bench.
    pub operator: Option<String>,
    /// The client that requests to become the operator.
    #[serde(default)]
    pub asks: Option<String>,
    /// The loaded external controller, friction or law.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loaded: Option<LoadedStatus>,
    /// Timing of the real-time loop.
    pub clock: ClockStatus,
    /// Counters of the link to the machine, if it is in another process.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<Counts>,
    /// State of the segment, if the machine is on a fieldbus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segment: Option<SegmentStatus>,
    /// The recorded file, or why the recording broke off.
    pub recording: Option<String>,
    /// Amount of recorded data, also of a recording that broke off.
    #[serde(default)]
    pub recorded: Option<Recorded>,
    /// Amount of recorded data of the running measurement; `null` if it is not recorded.
    #[serde(default)]
    pub measurement_record: Option<Recorded>,
    /// Why the last run is not in the catalogue.
    #[serde(default)]
    pub not_entered: Option<String>,
    /// Why the state of the target or the record of the last measurement is not saved, or not read.
    #[serde(default)]
    pub not_saved: Option<String>,
    /// Number of values that differ in the state before the start of the program; `null`: nothing to restore.
    #[serde(default)]
    pub earlier: Option<usize>,
    /// Addresses for measurement and calibration tools.
    #[serde(default)]
    pub xcp: Vec<XcpStatus>,
    /// Number of marks since the start.
    #[serde(default)]
    pub marks: u64,
}

/// An event in a cycle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Mark {
    /// Number of the cycle; for an event outside the loop, the newest cycle at that time.
    pub cycle: u64,
    /// Kind of the event.
    pub kind: MarkKind,
    /// Description.
    pub text: String,
}

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MarkKind {
    /// A fault.
    Fault,
    /// Parameters became active.
    Change,
    /// A motion or a measurement began.
    Begin,
    /// A motion or a measurement ended.
    End,
}

/// Amount of recorded data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Recorded {
    /// The first cycle.
    pub from: u64,
    /// Length [s].
    pub length: f64,
    /// Size of the file [bytes].
    pub bytes: u64,
    /// Cycles that are missing in the file.
    pub lost: u64,
}

/// An XCP address of the bench.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct XcpStatus {
    /// `udp` or `tcp`.
    pub transport: String,
    /// IP address and port.
    pub address: String,
    /// The address of the connected master.
    pub master: Option<String>,
    /// Whether the master measures.
    pub measuring: bool,
    /// Rows of measurements lost since the start.
    pub lost: u64,
}

/// A controller, friction or law loaded from a file. Times in seconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoadedStatus {
    /// Its role in the loop: `controller`, `friction`, `law`.
    pub role: String,
    /// The parameter that selects it.
    pub selector: String,
    /// Its name, from its description.
    pub name: String,
    /// Its kind: `C library`, `FMU 2.0`.
    pub kind: String,
    /// Its file.
    pub file: String,
    /// SHA-256 of the opened file, in hexadecimal digits.
    pub hash: String,
    /// Whether it has failed: no torque until it is opened again.
    pub failed: bool,
    /// Number of calls.
    pub calls: u64,
    /// Duration of a call: median, 99th and 99.9th percentile, longest.
    pub call: [f64; 4],
    /// Time from request to response, likewise; `null` if it runs inside the bench's process.
    pub response: Option<[f64; 4]>,
    /// Allowed duration of a call.
    pub budget: f64,
    /// Number of calls that took longer.
    pub over_budget: u64,
    /// Number of late torques; the previous torque was held.
    pub late: u64,
}

/// A running motion or measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurrentTask {
    /// Its name: `sine`, `measure friction`.
    pub what: String,
    /// The current stage.
    pub stage: String,
    /// Completed share of the stage, 0 … 1.
    pub fraction: f64,
}

/// End of a motion or measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ended {
    /// Its name: `sine`, `measure friction`.
    pub what: String,
    /// Reason, if it failed or was cancelled.
    pub error: Option<String>,
    /// Folder of its results.
    pub folder: Option<String>,
}

/// Timing of the real-time loop. Times in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClockStatus {
    /// From the deadline to the start of a cycle: median, 99th and 99.9th percentile, longest.
    pub lateness: [f64; 4],
    /// Duration of a cycle, likewise.
    pub cycle: [f64; 4],
    /// Median duration of a cycle as a share of the tick.
    #[serde(default)]
    pub load: f64,
    /// Missed cycles: a deadline was missed, or the virtual machine waited for a command.
    pub held: u64,
    /// Cycles lost on the way to recorders and viewers: their buffer was full.
    pub lost: u64,
}
