//! A bench in real time with all clients: it is recorded, four viewers stream 64 signals, an XCP master measures 20 in
//! every cycle, one client captures, one tunes, and the axis follows a sine under the rendering law.

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

/// Number of viewers, and of signals each.
pub(crate) const VIEWERS: usize = 4;
pub(crate) const SIGNALS: usize = 16;
/// Time between points [s], and between polls of a viewer.
const EVERY: f64 = 0.02;
const LOOK: Duration = Duration::from_millis(50);
/// Time between captures, and between changes of a parameter.
const TUNED: Duration = Duration::from_secs(2);

/// All clients of a bench.
pub(crate) struct Crowd {
    live: Arc<Live>,
    leave: Arc<AtomicBool>,
    viewers: Vec<JoinHandle<Result<Received, Error>>>,
    tuner: JoinHandle<Result<Tuned, Error>>,
    xcp: Xcp,
    master: JoinHandle<std::io::Result<Measured>>,
}

/// Cycles received by a viewer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Received {
    /// Cycles in points, and missing cycles reported by points.
    pub(crate) cycles: u64,
    pub(crate) missing: u64,
    /// The first cycle of the first point, and the last one of the last.
    pub(crate) from: u64,
    pub(crate) to: u64,
}

/// Counts of the tuning client.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tuned {
    /// Changes of a parameter, captures, and cycles missing in captures.
    pub(crate) changes: u64,
    pub(crate) captures: u64,
    pub(crate) lost: u64,
}

/// Results of all clients.
pub(crate) struct Results {
    pub(crate) received: Vec<Received>,
    pub(crate) tuned: Tuned,
    pub(crate) measured: Measured,
    pub(crate) clocked: TimingReport,
}

impl Crowd {
    /// Switches a bench on, homes it, and starts all clients.
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
        let door = xcp.doors.udp.expect("the UDP door was requested");
        let leaves = leave.clone();
        let master = thread::spawn(move || master::Master::measure(door, rate)?.follow(&leaves));
        Ok(Crowd { live, leave, viewers, tuner, xcp, master })
    }

    /// Status of the bench.
    pub(crate) fn status(&self) -> Result<Status, Error> {
        status(&self.live)
    }

    /// Stops all clients and the bench.
    pub(crate) fn leave(self) -> Result<Results, Error> {
        self.leave.store(true, Ordering::Relaxed);
        let received = self.viewers.into_iter().map(|viewer| viewer.join().expect("a viewer does not panic"));
        let received = received.collect::<Result<_, _>>()?;
        let tuned = self.tuner.join().expect("the tuning client does not panic")?;
        let measured = self.master.join().expect("a master does not panic").map_err(xcp_failed)?;
        self.xcp.stop();
        let live = Arc::into_inner(self.live).expect("all clients have stopped");
        let gone = || Error::BenchFault { cycle: 0, reason: "the real-time loop had ended by itself".into() };
        Ok(Results { received, tuned, measured, clocked: live.stop().ok_or_else(gone)? })
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

/// Streams until the end.
fn view(live: &Live, viewer: usize, leave: &AtomicBool) -> Result<Received, Error> {
    let name = format!("viewer {viewer}");
    // Each viewer has other signals, all signals in turn.
    let signals = channels().into_iter().map(|entry| entry.path).cycle().skip(viewer * SIGNALS).take(SIGNALS).collect();
    let Answer::Capture { capture, .. } = live.call(&name, Call::Stream { signals, every: EVERY })? else {
        unreachable!("a stream has a number")
    };
    let mut received = Received::default();
    loop {
        let last = leave.load(Ordering::Relaxed);
        if let Answer::Points { points } = live.call(&name, Call::Points { capture })? {
            for point in points {
                if received.cycles == 0 {
                    received.from = point.from;
                }
                received = Received { missing: received.missing + point.missing, to: point.to, ..received };
                received.cycles += point.to - point.from + 1;
            }
        }
        if last {
            return Ok(received);
        }
        thread::sleep(LOOK);
    }
}

/// Changes a parameter, reverts it, and captures the effect.
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
