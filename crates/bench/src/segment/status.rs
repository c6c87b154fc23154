//! Status of a segment, as viewers and scripts read it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use stickslip_base::Summary;
use stickslip_rt::Quantiles;

use super::words::{ABSENT, NO_ANSWER, al_state, al_status_code, error_code};
use super::{FrameRecord, SegmentDevice};
use crate::bins::{self, TimeBin};

/// State of a fieldbus segment. Times in seconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SegmentStatus {
    /// Its devices, in their order.
    pub devices: Vec<DeviceStatus>,
    /// Working counter of the last frame that returned.
    pub counter: u16,
    /// Expected working counter.
    pub expected: u16,
    /// Number of frames with process data.
    pub frames: u64,
    /// Of these, frames that did not return in time.
    pub lost: u64,
    /// Of these, frames with another working counter than expected.
    pub wrong: u64,
    /// Place of the frames relative to the middle between two pulses of SYNC0, since the start.
    pub offset: FrameOffset,
    /// The same in the last second.
    pub last_second: FrameOffset,
    /// Distance from that middle: median, 99th and 99.9th percentile, largest; at most half a period.
    pub distance: [f64; 4],
    /// Time from sending to receiving a frame, likewise.
    pub round_trip: [f64; 4],
    /// Histogram of the distance.
    #[serde(default)]
    pub distance_bins: Vec<TimeBin>,
    /// Histogram of the time from sending to receiving.
    #[serde(default)]
    pub round_trip_bins: Vec<TimeBin>,
}

/// Places of frames in the cycle of SYNC0; positive: after the middle between two pulses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrameOffset {
    /// Smallest.
    pub minimum: f64,
    /// Largest.
    pub maximum: f64,
    /// Root of the mean square.
    pub rms: f64,
}

/// State of a device.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DeviceStatus {
    /// Position in the segment, from 0.
    pub position: u16,
    /// Name.
    pub name: String,
    /// Role in the bench: `motor`, `load`, `accelerometer`; otherwise empty.
    pub role: String,
    /// AL state: `OP`, `SAFE-OP`, `PRE-OP`, `INIT`, `no answer`.
    pub al_state: String,
    /// State of a drive.
    pub drive: Option<DriveStatus>,
    /// Its fault: error code and AL status code, with their meaning.
    pub fault: Option<String>,
}

/// State of a drive after CiA 402.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DriveStatus {
    /// State in words: `operation enabled`.
    pub state: String,
    /// Statusword (0x6041).
    pub statusword: u16,
    /// Error code (0x603F); 0: none.
    pub error: u16,
}

/// Smallest, largest and mean square of places [ns].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spread {
    count: u64,
    minimum: i32,
    maximum: i32,
    squares: f64,
}

impl Spread {
    pub(super) fn add(&mut self, offset: i32) {
        (self.minimum, self.maximum) = match self.count {
            0 => (offset, offset),
            _ => (self.minimum.min(offset), self.maximum.max(offset)),
        };
        self.count += 1;
        self.squares += f64::from(offset).powi(2);
    }

    pub(super) fn summary(&self) -> FrameOffset {
        FrameOffset {
            minimum: f64::from(self.minimum) * 1e-9,
            maximum: f64::from(self.maximum) * 1e-9,
            rms: (self.squares / self.count.max(1) as f64).sqrt() * 1e-9,
        }
    }
}

/// Median, 99th and 99.9th percentile, largest [s].
pub(super) fn seconds(quantiles: Quantiles) -> [f64; 4] {
    let Quantiles { p50, p99, p999, max, .. } = quantiles;
    [p50, p99, p999, max].map(|time| time as f64 * 1e-9)
}

impl SegmentDevice {
    pub(super) fn status(&self, position: usize, last: &FrameRecord) -> DeviceStatus {
        let drive = ["motor", "load"].iter().position(|role| *role == self.role).map(|at| last.drives[at]);
        let error = drive.map_or(0, |drive| drive.error);
        let code = last.left.filter(|(left, _)| usize::from(*left) == position).map_or(0, |(_, code)| code);
        let al_state = al_state(last.states.get(position).copied().unwrap_or(0));
        let faults = [
            (error > 0).then(|| error_code(error)),
            (code > 0).then(|| al_status_code(code)),
            (al_state == NO_ANSWER).then(|| ABSENT.into()),
        ];
        let fault = faults.into_iter().flatten().collect::<Vec<_>>().join("; ");
        DeviceStatus {
            position: position as u16,
            name: self.name.clone(),
            role: self.role.into(),
            al_state: al_state.into(),
            drive: drive.map(|drive| DriveStatus {
                state: drive.state.into(),
                statusword: drive.statusword,
                error: drive.error,
            }),
            fault: Some(fault).filter(|fault| !fault.is_empty()),
        }
    }
}

impl SegmentStatus {
    /// Adds the state under its stable names; a row for each device.
    pub fn add_to(&self, summary: &mut Summary) {
        summary
            .result("segment.frames", self.frames as f64, "1")
            .result("segment.lost", self.lost as f64, "1")
            .result("segment.wrong_counter", self.wrong as f64, "1")
            .result("segment.counter", self.counter.into(), "1")
            .result("segment.expected_counter", self.expected.into(), "1");
        for (name, offset) in [("offset", self.offset), ("offset_last_second", self.last_second)] {
            let FrameOffset { minimum, maximum, rms } = offset;
            for (part, value) in [("minimum", minimum), ("maximum", maximum), ("rms", rms)] {
                summary.result(&format!("segment.{name}.{part}"), value, "s");
            }
        }
        for device in &self.devices {
            let drive = |value: fn(&DriveStatus) -> Value| device.drive.as_ref().map_or(Value::Null, value);
            summary.row([
                ("position", device.position.into()),
                ("name", device.name.as_str().into()),
                ("role", device.role.as_str().into()),
                ("al_state", device.al_state.as_str().into()),
                ("state", drive(|drive| drive.state.as_str().into())),
                ("statusword", drive(|drive| drive.statusword.into())),
                ("error", drive(|drive| drive.error.into())),
                ("fault", device.fault.clone().into()),
            ]);
        }
    }

    /// Lines for a terminal: the frames, then each device.
    pub fn lines(&self) -> Vec<String> {
        let micros = |time: f64| format!("{:.1}", 1e6 * time);
        let FrameOffset { minimum, maximum, rms } = self.last_second;
        let mut lines = vec![
            format!(
                "working counter {} of {}; {} of {} frames lost, {} with another counter",
                self.counter, self.expected, self.lost, self.frames, self.wrong
            ),
            format!(
                "frames {} … {} µs from the middle between two pulses of SYNC0 in the last second, rms {} µs",
                micros(minimum),
                micros(maximum),
                micros(rms)
            ),
        ];
        for (what, bins) in [("distance from that middle", &self.distance_bins), ("round trip", &self.round_trip_bins)]
        {
            lines.extend((!bins.is_empty()).then(|| format!("frames by {what}: {}", bins::line(bins))));
        }
        lines.extend(self.devices.iter().map(|device| {
            let DeviceStatus { position, name, role, al_state, drive, fault } = device;
            let role = if role.is_empty() { String::new() } else { format!(" ({role})") };
            let drive = drive.as_ref().map_or(String::new(), |d| format!(", {} (0x{:04X})", d.state, d.statusword));
            let fault = fault.as_ref().map_or(String::new(), |fault| format!(": {fault}"));
            format!("{position} {name}{role}: {al_state}{drive}{fault}")
        }));
        lines
    }
}
