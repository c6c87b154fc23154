//! Events of a recorded run as text, also from records of other versions.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_software::cycle::Change;
use stickslip_software::supervise::{Fault, Request};

use super::change::parse;
use super::recorder::{BEGIN, CHANGED, LOST};
use crate::tap::ChangeKind;
use stickslip_base::Error;
use stickslip_recording::mdf::{Event, Opened};

/// An event of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RunEvent {
    /// Number of the cycle.
    pub cycle: u64,
    /// Time of the cycle [s].
    pub time: f64,
    /// In a few words.
    pub what: String,
    /// Details: changed values, reason of a refusal.
    pub details: Vec<String>,
    /// Whether it is a fault, a refusal or a loss.
    pub trouble: bool,
}

/// Events of the run of a file, in order.
///
/// # Errors
/// An unreadable file.
pub fn story(path: &Path) -> Result<Vec<RunEvent>, Error> {
    let file = Opened::open(path)?;
    let head = file.head();
    let mut events: Vec<_> = head.events.iter().map(|(time, event)| run_event(*time, event)).collect();
    // The sources of changes report independently.
    events.sort_by_key(|event| event.cycle);
    Ok(events)
}

fn run_event(time: f64, event: &Event) -> RunEvent {
    let mut lines = event.comment.lines();
    let first = lines.next().unwrap_or_default();
    let mut details: Vec<_> = lines.map(str::to_owned).collect();
    let [_, refused] = CHANGED;
    let mut trouble = event.name == refused;
    let what = match event.name.as_str() {
        BEGIN => "Begin".into(),
        LOST => {
            trouble = true;
            format!("{first} cycles are missing")
        }
        name if CHANGED.contains(&name) => match parse(first) {
            Some(what) => {
                trouble |= matches!(
                    what,
                    ChangeKind::Fault(_) | ChangeKind::Software(Change::HomingFailed(_) | Change::MachineFailed(_), _)
                );
                changed(&what)
            }
            None => {
                // A record of another version.
                details.insert(0, first.to_owned());
                "Change".into()
            }
        },
        name => {
            trouble = true;
            details.insert(0, first.to_owned());
            let mut letters = name.chars();
            letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
        }
    };
    let what = if event.name == refused { format!("{what}, refused") } else { what };
    RunEvent { cycle: event.cycle, time, what, details, trouble }
}

fn changed(what: &ChangeKind) -> String {
    match what {
        ChangeKind::Preload(preload) => format!("Preload of the friction wheel: {preload}"),
        ChangeKind::Fault(injection) => format!("Injected: {injection}"),
        ChangeKind::Software(change, _) => match change {
            Change::Request(Request::Home) => "Home".into(),
            Change::Request(Request::Arm) => "Arm".into(),
            Change::Request(Request::Start) => "Torque on".into(),
            Change::Request(Request::Stop) => "Stop".into(),
            Change::Request(Request::Off) => "Off".into(),
            Change::Request(Request::Acknowledge) => "Fault acknowledged".into(),
            Change::Homed(index) => format!("Homed, index at {index:.4} rad"),
            Change::HomingFailed(fault) => format!("Homing failed: {fault}"),
            Change::MachineFailed(fault) => Fault::Machine(*fault).to_string(),
            Change::ForeignFailed(role, fault) => Fault::External(*role, *fault).to_string(),
            Change::Parameters(_) => "Parameters".into(),
        },
    }
}
