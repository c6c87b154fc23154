//! A bench by the clock with everything attached: it is recorded, four viewers stream 64 signals, a master of XCP measures
//! 20 in every cycle, somebody captures, somebody tunes, and the axis follows a sine under the rendering law.

#[path = "master.rs"]
mod master;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use stickslip::bench::{ThreadSettings, TimingReport};
use stickslip::live::protocol::{Answer, Call, Status};
use stickslip::live::{Live, Start};
use stickslip::parameters::presets;
use stickslip::run::channels;
use stickslip::xcp::a2l::Doors;
use stickslip::xcp::ethernet::{PATIENCE, Xcp};
use stickslip::{Error, Preset, parameters};

pub(crate) use master::Measured;

/// Who streams, and how many signals each.
pub(crate) const VIEWERS: usize = 4;
pub(crate) const SIGNALS: usize = 16;
/// From point to point [s], and from look to look of a viewer.
const EVERY: f64 = 0.02;
const LOOK: Duration = Duration::from_millis(50);
/// From capture to capture, and from change to change of a parameter.
const TUNED: Duration = Duration::from_secs(2);

/// Everybody at a bench.
pub(crate) struct Crowd {
    live: Arc<Live>,
    leave: Arc<AtomicBool>,
    viewers: Vec<JoinHandle<Result<Seen, Error>>>,
    tuner: JoinHandle<Result<Tuned, Error>>,
    xcp: Xcp,
    master: JoinHandle<std::io::Result<Measured>>,
}

/// What a viewer saw.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Seen {
    /// Cycles that were in a point, and those that a point says are in none.
    pub(crate) cycles: u64,
    pub(crate) missing: u64,
    /// The first cycle of the first point, and the last one of the last.
    pub(crate) from: u64,
    pub(crate) to: u64,
}

/// What the one who tunes and captures did.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tuned {
    /// Changes of a parameter, captures, and cycles that these lack.
    pub(crate) changes: u64,
    pub(crate) captures: u64,
    pub(crate) lost: u64,
}

/// What all of them say at the end.
pub(crate) struct Left {
    pub(crate) seen: Vec<Seen>,
    pub(crate) tuned: Tuned,
    pub(crate) measured: Measured,
    pub(crate) clocked: TimingReport,
}

impl Crowd {
    /// Switches a bench on and homes it; all come.
    pub(crate) fn gather(
        preset: &str,
        rate: f64,
        thread_settings: ThreadSettings,
        project: &Path,
        file: PathBuf,
    ) -> Result<Self, Error> {
        let mut source = presets::find(preset)?;
        // A desired friction that can be rendered at each rate, 1 kHz as well.
        let values = [
            ("bench.tick_rate", &*rate.to_string()),
            ("bench.law.kind", "bristle"),
            ("bench.desired.kinetic_torque", "0.16"),
        ];
        for (path, value) in values {
            source.text = parameters::set::<Preset<f64>>(&source.text, preset, path, value)?;
        }
        let live = Live::start(Start { thread_settings, record: Some(file), ..Start::new(source, project) })?;
        let live = Arc::new(live);
        live.call(TUNER, Call::Home {})?;
        while status(&live)?.doing.is_some() {
            thread::sleep(LOOK);
        }
        let values = BTreeMap::from([("amplitude".to_owned(), 0.5), ("frequency".to_owned(), 1.0)]);
        live.call(TUNER, Call::Move { reference: "sine".into(), values, render: true })?;
        let leave = Arc::new(AtomicBool::new(false));
        let viewers = (0..VIEWERS).map(|viewer| {
            let (live, leave) = (live.clone(), leave.clone());
            thread::spawn(move || view(&live, viewer, &leave))
        });
        let viewers = viewers.collect();
        let (tuned, leaves) = (live.clone(), leave.clone());
        let tuner = thread::spawn(move || tune(&tuned, &leaves));
        let xcp = Xcp::open(&live, Doors { udp: Some(([127, 0, 0, 1], 0).into()), tcp: None }, PATIENCE)
            .map_err(xcp_failed)?;
        let door = xcp.doors.udp.expect("it was asked for");
        let leaves = leave.clone();
        let master = thread::spawn(move || master::Master::measure(door, rate)?.follow(&leaves));
        Ok(Crowd { live, leave, viewers, tuner, xcp, master })
    }

    /// How the bench is.
    pub(crate) fn status(&self) -> Result<Status, Error> {
        status(&self.live)
    }

    /// All leave, the bench ends.
    pub(crate) fn leave(self) -> Result<Left, Error> {
        self.leave.store(true, Ordering::Relaxed);
        let seen = self.viewers.into_iter().map(|viewer| viewer.join().expect("a viewer does not panic"));
        let seen = seen.collect::<Result<_, _>>()?;
        let tuned = self.tuner.join().expect("who tunes does not panic")?;
        let measured = self.master.join().expect("a master does not panic").map_err(xcp_failed)?;
        self.xcp.stop();
        let live = Arc::into_inner(self.live).expect("all have left");
        let gone = || Error::BenchFault { cycle: 0, reason: "the real-time loop had ended by itself".into() };
        Ok(Left { seen, tuned, measured, clocked: live.stop().ok_or_else(gone)? })
    }
}

fn xcp_failed(error: std::io::Error) -> Error {
    Error::BenchFault { cycle: 0, reason: format!("XCP: {error}") }
}

const TUNER: &str = "tuner";

fn status(live: &Live) -> Result<Status, Error> {
    match live.call("looks", Call::Status {})? {
        Answer::Status(status) => Ok(*status),
        other => unreachable!("{other:?}"),
    }
}

/// Streams until all leave.
fn view(live: &Live, viewer: usize, leave: &AtomicBool) -> Result<Seen, Error> {
    let name = format!("viewer {viewer}");
    // Each others, all of them in turn.
    let signals = channels().into_iter().map(|entry| entry.path).cycle().skip(viewer * SIGNALS).take(SIGNALS).collect();
    let Answer::Capture { capture, .. } = live.call(&name, Call::Stream { signals, every: EVERY })? else {
        unreachable!("a stream has a number")
    };
    let mut seen = Seen::default();
    loop {
        let last = leave.load(Ordering::Relaxed);
        if let Answer::Points { points } = live.call(&name, Call::Points { capture })? {
            for point in points {
                if seen.cycles == 0 {
                    seen.from = point.from;
                }
                seen = Seen { missing: seen.missing + point.missing, to: point.to, ..seen };
                seen.cycles += point.to - point.from + 1;
            }
        }
        if last {
            return Ok(seen);
        }
        thread::sleep(LOOK);
    }
}

/// Changes a parameter, takes that back, and captures what happens.
fn tune(live: &Live, leave: &AtomicBool) -> Result<Tuned, Error> {
    let mut tuned = Tuned::default();
    while !leave.load(Ordering::Relaxed) {
        let capture = Call::Capture {
            signals: vec!["software.estimated_velocity".into(), "software.difference_torque".into()],
            trigger: "setpoint.velocity rises through 0".into(),
            before: 0.2,
            after: 0.5,
            decimation: 1,
        };
        let Answer::Capture { capture, .. } = live.call(TUNER, capture)? else {
            unreachable!("a capture has a number")
        };
        let values = BTreeMap::from([("bench.controller.position_gain".to_owned(), "12".to_owned())]);
        live.call(TUNER, Call::Set { values })?;
        for _ in 0..TUNED.as_millis() / LOOK.as_millis() {
            if !leave.load(Ordering::Relaxed) {
                thread::sleep(LOOK);
            }
        }
        live.call(TUNER, Call::Undo {})?;
        tuned.changes += 2;
        match live.call(TUNER, Call::Fetch { capture })? {
            Answer::Captured(captured) => {
                tuned.captures += 1;
                tuned.lost += captured.lost;
            }
            // A busy machine, or the end.
            _ => drop(live.call(TUNER, Call::Drop { capture })?),
        }
    }
    Ok(tuned)
}
