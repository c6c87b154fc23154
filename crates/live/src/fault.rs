//! The fault of the bench with its remedy, and the way back.

use std::thread;
use std::time::{Duration, Instant};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_software::supervise::{Concern, Fault, Recovery, Request};

use super::axis::Job;
use super::protocol::Answer;
use super::{Live, LiveError};
use stickslip_base::Error;

/// Longest time in which a motion ends after a fault, and the interval of the checks.
const PATIENCE: Duration = Duration::from_secs(3);
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// A fault with its remedy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultStatus {
    /// Name of its kind: `following-error`.
    pub code: String,
    /// The first cycle with it.
    pub cycle: u64,
    /// The cause, with the measured values.
    pub cause: String,
    /// What to check or to change.
    pub remedy: String,
    /// The way back, as the call `recover` takes it.
    pub recovery: FaultRecovery,
    /// Where to change what the remedy names; `null` if it is not a setting.
    pub look: Option<Look>,
    /// Number of the run with the signals around it; `null` until it is saved.
    pub capture: Option<i64>,
}

/// The way back after a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultRecovery {
    /// Acknowledge the fault; the torque stays off.
    Acknowledge,
    /// Acknowledge and arm: the axis is still homed.
    Arm,
    /// Acknowledge and home.
    Home,
    /// Acknowledge and open the external file again.
    Reopen,
}

/// A place in the page.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Look {
    /// Its name.
    pub name: String,
    /// Address of a window, or path of a group of parameters.
    pub path: String,
}

impl FaultStatus {
    /// A fault since a cycle. Without a known zero the axis is homed where arming would be refused.
    pub(super) fn new(fault: &Fault, cycle: u64, zero_known: bool) -> Self {
        let remedy = fault.remedy();
        let recovery = match remedy.recovery {
            Recovery::Acknowledge => FaultRecovery::Acknowledge,
            Recovery::Arm if zero_known => FaultRecovery::Arm,
            Recovery::Arm | Recovery::Home => FaultRecovery::Home,
            Recovery::Reopen => FaultRecovery::Reopen,
        };
        FaultStatus {
            code: remedy.code.into(),
            cycle,
            cause: fault.cause().to_string(),
            remedy: remedy.text.into(),
            recovery,
            look: look(remedy.concern),
            capture: None,
        }
    }
}

/// The place where a part of the bench is set.
fn look(concern: Concern) -> Option<Look> {
    let (name, path) = match concern {
        Concern::Controller => ("Controller Design", "/controller"),
        Concern::Rendering => ("Friction Design", "/design"),
        Concern::Limits => ("Limits", "bench.safety"),
        Concern::Timing => ("Cycle time", "/implementation"),
        Concern::Blocks | Concern::External(_) => ("Implementation", "/implementation"),
        // Cables, amplifiers and machines are not settings.
        Concern::Sensors | Concern::Motors | Concern::Machine => return None,
    };
    Some(Look { name: name.into(), path: path.into() })
}

impl Live {
    /// Acknowledges the fault and takes the way back that its remedy names.
    pub(super) fn recover(&self) -> Result<Answer, Error> {
        let motion = &self.shared.motion;
        // A motion ends by the fault, a moment later.
        motion.halt();
        let begun = Instant::now();
        while motion.status().0.is_some() && begun.elapsed() < PATIENCE {
            thread::sleep(POLL_INTERVAL);
        }
        let fault = self.shared.acquisition.newest().fault;
        let fault = fault.ok_or(LiveError::NothingToEnd { what: "fault" })?;
        motion.request(Request::Acknowledge)?;
        match fault.recovery {
            FaultRecovery::Acknowledge => Ok(Answer::Done {}),
            FaultRecovery::Arm => motion.request(Request::Arm),
            FaultRecovery::Home => self.begin("home", Job::home()),
            FaultRecovery::Reopen => {
                self.open_again()?;
                // Refused if the axis was not homed before the fault: it is off then.
                let _ = motion.request(Request::Arm);
                Ok(Answer::Done {})
            }
        }
    }
}
