//! `stickslip status`: the status of the running bench.

use std::io::Write;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use clap::Args;
use stickslip::Watch;
use stickslip::bench::remote::Counts;
use stickslip::live::protocol::{CurrentTask, LoadedStatus, Recorded, Status, XcpStatus};

use crate::failure::Failure;
use crate::serve::Client;

/// Bench and form of the status.
#[derive(Args)]
pub(crate) struct StatusCommand {
    /// Project folder of the running bench.
    #[arg(long, value_name = "DIR", default_value = super::PROJECT)]
    project: PathBuf,
    /// Print a line repeatedly, until Ctrl-C.
    #[arg(long, short)]
    watch: bool,
    /// Interval between lines with --watch [s].
    #[arg(long, value_name = "S", default_value_t = 0.5, requires = "watch")]
    every: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl StatusCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: impl FnOnce() -> Watch) -> Result<(), Failure> {
        let client = Client::of(&self.project)?;
        if !self.watch {
            return self.print(&client.status()?, out);
        }
        let watch = watch();
        while watch.check().is_ok() {
            self.print(&client.status()?, out)?;
            out.flush()?;
            thread::sleep(Duration::try_from_secs_f64(self.every).unwrap_or(Duration::from_secs(1)));
        }
        Ok(())
    }

    fn print(&self, status: &Status, out: &mut dyn Write) -> Result<(), Failure> {
        let text = match (self.json, self.watch) {
            (true, _) => serde_json::to_string(status).unwrap_or_default(),
            (false, true) => line(status),
            (false, false) => page(status),
        };
        Ok(writeln!(out, "{}", text.trim_end())?)
    }
}

/// The running task and its progress, if known.
fn progress(doing: &CurrentTask) -> String {
    let percent = if doing.fraction > 0.0 { format!(", {:.0} %", 100.0 * doing.fraction) } else { String::new() };
    format!("{}: {}{percent}", doing.what, doing.stage)
}

/// An address for XCP masters.
fn tool(door: &XcpStatus) -> String {
    let master = door.master.as_deref().unwrap_or("no master");
    let measuring = if door.measuring { ", measuring" } else { "" };
    format!("{} {}: {master}{measuring}, {} rows lost", door.transport, door.address, door.lost)
}

/// Length, size and lost cycles of a recording.
pub(super) fn amount(recorded: &Recorded) -> String {
    let Recorded { length, bytes, lost, .. } = recorded;
    format!("{length:.1} s, {:.1} MB, {lost} cycles lost", *bytes as f64 / 1e6)
}

/// The status in one line.
pub(super) fn line(status: &Status) -> String {
    let doing = status.doing.as_ref().map_or(String::new(), |doing| format!("  {}", progress(doing)));
    format!(
        "{:8} {:9.2} s {:9.4} rad {:9.3} rad/s  drive {:7.3} N·m  load {:7.3} N·m  missed {} lost {}{doing}",
        status.state,
        status.cycle as f64 / status.rate,
        status.angle,
        status.velocity,
        status.drive_torque,
        status.load_torque,
        status.clock.held,
        status.clock.lost
    )
}

/// The status in several lines.
fn page(status: &Status) -> String {
    let micros = |times: [f64; 4]| {
        let [p50, p99, p999, longest] = times.map(|time| 1e6 * time);
        format!("{p50:.1} / {p99:.1} / {p999:.1} / {longest:.1} µs (p50, p99, p99.9, longest)")
    };
    let mut lines = vec![
        ("bench", format!("{} at {} Hz", status.preset, status.rate)),
        ("state", status.reason.as_ref().map_or(status.state.clone(), |reason| format!("{}: {reason}", status.state))),
        ("time", format!("{:.2} s, cycle {}", status.cycle as f64 / status.rate, status.cycle)),
        ("axis", format!("{:.4} rad, {:.3} rad/s", status.angle, status.velocity)),
        (
            "torque",
            format!(
                "drive {:.3} N·m, load {:.3} N·m{}",
                status.drive_torque,
                status.load_torque,
                if status.render { ", rendering" } else { "" }
            ),
        ),
        ("linings", format!("preload {}", status.preload)),
    ];
    if let Some(doing) = &status.doing {
        lines.push(("running", progress(doing)));
    }
    if let Some(last) = &status.last {
        let result = match (&last.error, &last.folder) {
            (Some(error), _) => format!(": {error}"),
            (None, Some(folder)) => format!(": results in {folder}"),
            (None, None) => ": done".into(),
        };
        lines.push(("last", format!("{}{result}", last.what)));
    }
    let history = match (status.undo, status.redo) {
        (true, true) => ", undo and redo possible",
        (true, false) => ", undo possible",
        (false, true) => ", redo possible",
        (false, false) => "",
    };
    lines.push(("changed", format!("{} parameters since the start{history}", status.changed)));
    lines.push(("operator", status.operator.clone().unwrap_or_else(|| "none".into())));
    if let Some(recording) = &status.recording {
        let length = status.recorded.map_or(String::new(), |recorded| format!(", {}", amount(&recorded)));
        lines.push(("recording", format!("{recording}{length}")));
    }
    if let Some(reason) = &status.not_entered {
        lines.push(("catalogue", format!("the last run is not in the catalogue: {reason}")));
    }
    lines.extend(status.xcp.iter().map(|door| ("xcp", tool(door))));
    if let Some(link) = status.link {
        let Counts { answered, missing, late, doubled, garbled, begun } = link;
        let ticks = format!("{answered} ticks answered, {missing} missing; {late} answers late, {doubled} doubled");
        lines.push(("link", format!("{ticks}, {garbled} garbled; started {begun} times")));
    }
    let segment = status.segment.iter().flat_map(|segment| segment.lines());
    lines.extend(segment.map(|line| ("segment", line)));
    if let Some(loaded) = &status.loaded {
        let LoadedStatus { role, name, kind, file, hash, failed, calls, call, budget, over_budget, .. } = loaded;
        let failure = if *failed { ", failed: correct it, then run `stickslip bench open-again`" } else { "" };
        lines.push((role, format!("{name}, {kind}, {file}, SHA-256 {hash:.12}{failure}")));
        if *calls > 0 {
            lines.push((
                "call time",
                format!("{}; {over_budget} of {calls} over {:.0} µs", micros(*call), 1e6 * budget),
            ));
        }
        lines.extend(loaded.response.map(|times| ("response", format!("{}; {} late", micros(times), loaded.late))));
    }
    lines.push(("lateness", micros(status.clock.lateness)));
    lines.push(("cycle", micros(status.clock.cycle)));
    lines.push(("missed", format!("{} cycles; {} samples lost", status.clock.held, status.clock.lost)));
    lines.iter().map(|(name, text)| format!("{name:10} {text}\n")).collect()
}

#[cfg(test)]
mod tests {
    use stickslip::bench::segment::SegmentStatus;
    use stickslip::live::protocol::Ended;

    use super::*;

    #[test]
    fn a_status_has_the_running_task_and_the_reason_of_the_last_end() {
        let mut status = Status { state: "running".into(), rate: 4000.0, cycle: 10_000, ..Status::default() };
        assert!(line(&status).starts_with("running       2.50 s"));
        status.doing = Some(CurrentTask { what: "sine".into(), stage: "moving".into(), fraction: 0.5 });
        status.last = Some(Ended { what: "home".into(), error: Some("no index".into()), folder: None });
        status.reason = Some("too fast".into());
        let door = |transport: &str, master: Option<&str>| XcpStatus {
            transport: transport.into(),
            address: "127.0.0.1:5555".into(),
            master: master.map(Into::into),
            measuring: master.is_some(),
            lost: 3,
        };
        status.xcp = vec![door("udp", Some("127.0.0.1:40000")), door("tcp", None)];
        status.link = Some(Counts { missing: 3, begun: 2, ..Counts::default() });
        status.segment =
            Some(SegmentStatus { counter: 6, expected: 7, lost: 2, frames: 9, ..SegmentStatus::default() });
        status.recording = Some("run.mf4".into());
        status.recorded = Some(Recorded { from: 4000, length: 2.55, bytes: 1_234_567, lost: 3 });
        status.not_entered = Some("the disk is full".into());
        let page = page(&status);
        for part in [
            "run.mf4, 2.5 s, 1.2 MB, 3 cycles lost",
            "is not in the catalogue: the disk is full",
            "udp 127.0.0.1:5555: 127.0.0.1:40000, measuring, 3 rows lost",
            "tcp 127.0.0.1:5555: no master, 3 rows",
            "0 ticks answered, 3 missing",
            "started 2 times",
            "working counter 6 of 7; 2 of 9 frames lost",
            "running: too fast",
            "sine: moving, 50 %",
            "home: no index",
            "0 cycles; 0 samples lost",
            "operator   none",
        ] {
            assert!(page.contains(part), "{part} in {page}");
        }
        assert!(line(&status).ends_with("sine: moving, 50 %"));
    }
}
