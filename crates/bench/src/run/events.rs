//! What happened in a recorded run, for people: it is read from records of other versions as well.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_core::cycle::Change;
use stickslip_core::supervise::{Fault, Request};

use super::change::parse;
use super::recorder::{BEGIN, CHANGED, LOST};
use crate::tap::What;
use stickslip_base::Error;
use stickslip_recording::mdf::{Event, Opened};

/// Something that happened in a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RunEvent {
    /// With this cycle.
    pub cycle: u64,
    /// Time of the cycle [s].
    pub time: f64,
    /// In a few words.
    pub what: String,
    /// More of it: what became another, why it was refused.
    pub details: Vec<String>,
    /// Whether it is a fault, a refusal or a loss.
    pub trouble: bool,
}

/// What happened in the run of a file, in its order.
///
/// # Errors
/// A file that cannot be read.
pub fn story(path: &Path) -> Result<Vec<RunEvent>, Error> {
    let file = Opened::open(path)?;
    let head = file.head();
    let mut happened: Vec<_> = head.events.iter().map(|(time, event)| told(*time, event)).collect();
    // Those who change something tell it each for himself.
    happened.sort_by_key(|one| one.cycle);
    Ok(happened)
}

fn told(time: f64, event: &Event) -> RunEvent {
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
                    What::Fault(_) | What::Software(Change::HomingFailed(_) | Change::MachineFailed(_), _)
                );
                changed(&what)
            }
            None => {
                // Of another version.
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

fn changed(what: &What) -> String {
    match what {
        What::Preload(preload) => format!("Friction wheel pressed on: {preload}"),
        What::Fault(injection) => format!("Injected: {injection}"),
        What::Software(change, _) => match change {
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
