//! `stickslip bench`: control of the running bench.

use std::io::Write;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use clap::{Args, Subcommand, ValueEnum};
use stickslip::Watch;
use stickslip::live::protocol::{Answer, Call, Quantity};

use super::status::{amount, line};
use crate::failure::Failure;
use crate::serve::{Client, unexpected};
use crate::source::Setting;

/// Action of the running bench.
#[derive(Args)]
pub(crate) struct BenchCommand {
    /// Project folder of the running bench.
    #[arg(long, value_name = "DIR", default_value = super::PROJECT, global = true)]
    project: PathBuf,
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Switch on and search the index; returns when the axis is homed.
    #[command(after_help = "Example: stickslip bench home")]
    Home,
    /// Enable torque under control; the zero must be known.
    #[command(after_help = "Example: stickslip bench start")]
    Start,
    /// Become ready again without homing; the zero must still be known.
    #[command(after_help = "Example: stickslip bench arm")]
    Arm,
    /// Brake to rest by the safety supervision, then disable torque.
    #[command(after_help = "Example: stickslip bench stop")]
    Stop,
    /// Switch off: disable torque at once.
    #[command(after_help = "Example: stickslip bench off")]
    Off,
    /// Acknowledge the fault.
    #[command(after_help = "Example: stickslip bench acknowledge")]
    Acknowledge,
    /// End the running motion or measurement: the set-point comes to rest under control.
    #[command(after_help = "Example: stickslip bench halt")]
    Halt,
    /// Follow a reference from the present position, until its end or `halt`.
    #[command(after_help = "Example: stickslip bench move sine --set amplitude=0.5 --set frequency=1 --render")]
    Move {
        /// Reference: sine, steps, ramp, chirp, multisine, point-to-point, …
        reference: String,
        /// A value of the reference; may be given several times.
        #[arg(long, value_name = "NAME=VALUE")]
        set: Vec<Setting>,
        /// Render the desired friction with the load motor.
        #[arg(long)]
        render: bool,
    },
    /// Set the preload of the friction wheel's linings, 0 … 1.
    #[command(after_help = "Example: stickslip bench preload 0.3")]
    Preload {
        /// Preload: 0 released, 1 fully pressed.
        preload: f64,
    },
    /// Inject a fault into the virtual machine, until restart.
    #[command(after_help = "Example: stickslip bench inject accelerometer-jump=0.01")]
    Inject {
        /// Fault and its size: encoder-stuck, counts-lost=0.02, power-loss, …; the guide lists them under safety.
        fault: String,
    },
    /// Measure; returns when the results are available.
    #[command(after_help = "Example: stickslip bench measure friction --set speeds=4 --set slowest=5\n\
                            Example: stickslip bench measure friction --render --set speeds=4 --set slowest=5")]
    Measure {
        /// Quantity to measure.
        quantity: MeasuredQuantity,
        /// A value of the plan; may be given several times.
        #[arg(long, value_name = "NAME=VALUE")]
        set: Vec<Setting>,
        /// Measure while the load motor renders the desired friction.
        #[arg(long)]
        render: bool,
    },
    /// Write the report of the last measurement: own, desired and rendered friction.
    #[command(after_help = "Example: stickslip bench report")]
    Report,
    /// Record every cycle from now on into a new run, which can be replayed.
    #[command(after_help = "Example: stickslip bench record grease\n\
                            Example: stickslip bench record --stop")]
    Record {
        /// Name of the run: letters, digits, - and _.
        #[arg(default_value = "recording", conflicts_with = "stop")]
        name: String,
        /// End the recording.
        #[arg(long)]
        stop: bool,
    },
    /// List the signals that can be captured.
    #[command(after_help = "Example: stickslip bench signals")]
    Signals,
    /// Reopen the file of `serve --controller`, `--friction` or `--law`, with its present content: its state is reset, its
    /// parameters keep their values.
    #[command(after_help = "Example: stickslip bench open-again")]
    OpenAgain,
    /// Become the operator, in place of the present one.
    #[command(after_help = "Example: stickslip bench operate")]
    Operate,
}

#[derive(Clone, Copy, ValueEnum)]
enum MeasuredQuantity {
    /// The friction curve.
    Friction,
    /// The breakaway torque.
    Breakaway,
    /// Stiffness and damping of the bristles.
    Presliding,
}

impl BenchCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: impl FnOnce() -> Watch) -> Result<(), Failure> {
        let client = Client::of(&self.project)?;
        match self.action {
            Action::Home => make_and_wait(&client, &Call::Home {}, out, &watch()),
            Action::Measure { quantity, set, render } => {
                let what = match quantity {
                    MeasuredQuantity::Friction => Quantity::Friction,
                    MeasuredQuantity::Breakaway => Quantity::Breakaway,
                    MeasuredQuantity::Presliding => Quantity::Presliding,
                };
                let plan = set.into_iter().map(|setting| (setting.path, setting.value)).collect();
                make_and_wait(&client, &Call::Measure { what, plan, render }, out, &watch())
            }
            Action::Move { reference, set, render } => {
                let number = |setting: Setting| match setting.value.parse() {
                    Ok(number) => Ok((setting.path, number)),
                    Err(_) => Err(Failure::Served(format!("{} = {} is not a number.", setting.path, setting.value))),
                };
                let values = set.into_iter().map(number).collect::<Result<_, _>>()?;
                make_and_print_status(&client, &Call::Move { reference, values, render }, out)
            }
            Action::Signals => match client.call(&Call::Signals {})? {
                Answer::Signals { signals, .. } => {
                    for signal in signals {
                        let head = format!("{} [{}]", signal.name, signal.unit);
                        writeln!(out, "{head:45} {:8} {}", signal.symbol, signal.help)?;
                    }
                    Ok(())
                }
                other => Err(unexpected(&other)),
            },
            Action::Report => match client.call(&Call::SaveReport {})? {
                Answer::Report { folder, .. } => Ok(writeln!(out, "Report with figures: {folder}/report.html")?),
                other => Err(unexpected(&other)),
            },
            Action::Record { stop: true, .. } => {
                let before = client.status()?;
                make(&client, &Call::EndRecord {})?;
                let file = before.recording.unwrap_or_default();
                let length = before.recorded.map_or(String::new(), |recorded| format!(": {}", amount(&recorded)));
                Ok(writeln!(out, "Recorded into {file}{length}")?)
            }
            Action::Record { name, .. } => {
                make(&client, &Call::Record { name })?;
                let file = client.status()?.recording.unwrap_or_default();
                Ok(writeln!(out, "Recording into {file}; `stickslip bench record --stop` ends it.")?)
            }
            Action::Preload { preload } => make_and_wait(&client, &Call::Preload { preload }, out, &watch()),
            Action::Inject { fault } => make_and_print_status(&client, &Call::Inject { fault }, out),
            Action::Start => make_and_print_status(&client, &Call::Start {}, out),
            Action::Arm => make_and_print_status(&client, &Call::Arm {}, out),
            Action::Stop => make_and_print_status(&client, &Call::Stop {}, out),
            Action::Off => make_and_print_status(&client, &Call::Off {}, out),
            Action::Acknowledge => make_and_print_status(&client, &Call::Acknowledge {}, out),
            Action::Halt => {
                make(&client, &Call::Halt {})?;
                // The axis comes to rest first.
                while client.status()?.doing.is_some() {
                    thread::sleep(POLL_INTERVAL);
                }
                Ok(writeln!(out, "{}", line(&client.status()?))?)
            }
            Action::OpenAgain => make_and_print_status(&client, &Call::OpenAgain {}, out),
            Action::Operate => make_and_print_status(&client, &Call::Operate {}, out),
        }
    }
}

/// Makes a call without results.
fn make(client: &Client, call: &Call) -> Result<(), Failure> {
    match client.call(call)? {
        Answer::Done {} => Ok(()),
        other => Err(unexpected(&other)),
    }
}

/// Makes a call and prints the status afterwards.
fn make_and_print_status(client: &Client, call: &Call, out: &mut dyn Write) -> Result<(), Failure> {
    make(client, call)?;
    // The published status follows the bench with a delay.
    thread::sleep(POLL_INTERVAL);
    Ok(writeln!(out, "{}", line(&client.status()?))?)
}

/// Interval between two requests of the status.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Makes a call and waits for its end; Ctrl-C halts it.
fn make_and_wait(client: &Client, call: &Call, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
    make(client, call)?;
    let mut halted = false;
    loop {
        let status = client.status()?;
        match status.doing {
            Some(doing) if !halted => {
                let name = format!("{}: {}", doing.what, doing.stage);
                if watch.stage(&name, doing.fraction).is_err() {
                    make(client, &Call::Halt {})?;
                    halted = true;
                }
            }
            Some(_) => {}
            None => {
                let Some(last) = status.last else { return Ok(()) };
                return match (last.error, last.folder) {
                    (Some(_), _) if halted => Err(stickslip::Error::Cancelled.into()),
                    (Some(error), _) => Err(Failure::Served(error)),
                    (None, Some(folder)) => Ok(writeln!(out, "Data and report: {folder}/report.html")?),
                    (None, None) => Ok(writeln!(out, "{}", line(&client.status()?))?),
                };
            }
        }
        thread::sleep(POLL_INTERVAL);
    }
}
