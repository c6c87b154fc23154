//! `stickslip bench`: orders to the bench that is served.

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

/// What the bench shall do.
#[derive(Args)]
pub(crate) struct BenchCommand {
    /// Folder of the served bench's project.
    #[arg(long, value_name = "DIR", default_value = super::PROJECT, global = true)]
    project: PathBuf,
    #[command(subcommand)]
    order: Order,
}

#[derive(Subcommand)]
enum Order {
    /// Switch on and search the index; ends when the axis is homed.
    #[command(after_help = "Example: stickslip bench home")]
    Home,
    /// Torque, under control, where the zero is known.
    #[command(after_help = "Example: stickslip bench start")]
    Start,
    /// Be ready again without homing, where the zero is still known.
    #[command(after_help = "Example: stickslip bench arm")]
    Arm,
    /// To rest by the brake of supervision, then no more torque.
    #[command(after_help = "Example: stickslip bench stop")]
    Stop,
    /// Switch off: no torque at once.
    #[command(after_help = "Example: stickslip bench off")]
    Off,
    /// The fault is seen.
    #[command(after_help = "Example: stickslip bench acknowledge")]
    Acknowledge,
    /// End the motion or measurement that runs: the set-point comes to rest under control.
    #[command(after_help = "Example: stickslip bench halt")]
    Halt,
    /// Follow a reference from where the axis is, until it ends or `halt`.
    #[command(after_help = "Example: stickslip bench move sine --set amplitude=0.5 --set frequency=1 --render")]
    Move {
        /// sine, steps, ramp, chirp, multisine, point-to-point, …
        reference: String,
        /// A value of the reference; may be given several times.
        #[arg(long, value_name = "NAME=VALUE")]
        set: Vec<Setting>,
        /// Let the load motor render the desired friction.
        #[arg(long)]
        render: bool,
    },
    /// Press the linings of the friction wheel on, 0 … 1.
    #[command(after_help = "Example: stickslip bench preload 0.3")]
    Preload {
        /// How far.
        preload: f64,
    },
    /// Break something of the virtual machine on purpose, until the bench is started anew.
    #[command(after_help = "Example: stickslip bench inject accelerometer-jump=0.01")]
    Inject {
        /// What, and how much: encoder-stuck, counts-lost=0.02, power-loss, … as the guide's page on safety lists them.
        fault: String,
    },
    /// Measure; ends when the results are there.
    #[command(after_help = "Example: stickslip bench measure friction --set speeds=4 --set slowest=5\n\
                            Example: stickslip bench measure friction --render --set speeds=4 --set slowest=5")]
    Measure {
        /// What.
        what: What,
        /// A value of the plan; may be given several times.
        #[arg(long, value_name = "NAME=VALUE")]
        set: Vec<Setting>,
        /// While the load motor renders the desired friction.
        #[arg(long)]
        render: bool,
    },
    /// Write the report of what was measured last: own, desired and rendered friction.
    #[command(after_help = "Example: stickslip bench report")]
    Report,
    /// Record every cycle from now on, into a run of its own, whatever the bench does; replayable from there.
    #[command(after_help = "Example: stickslip bench record grease\n\
                            Example: stickslip bench record --stop")]
    Record {
        /// What to call it: letters, digits, - and _.
        #[arg(default_value = "recording", conflicts_with = "stop")]
        name: String,
        /// End the recording.
        #[arg(long)]
        stop: bool,
    },
    /// List the signals that can be captured.
    #[command(after_help = "Example: stickslip bench signals")]
    Signals,
    /// Open the file of `serve --controller`, `--friction` or `--law` again, as it is now: it begins at rest, with the values
    /// of before.
    #[command(after_help = "Example: stickslip bench open-again")]
    OpenAgain,
    /// Be the operator, whoever is now.
    #[command(after_help = "Example: stickslip bench operate")]
    Operate,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    /// The friction curve.
    Friction,
    /// The breakaway torque.
    Breakaway,
    /// The bristles.
    Presliding,
}

impl BenchCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: impl FnOnce() -> Watch) -> Result<(), Failure> {
        let client = Client::of(&self.project)?;
        match self.order {
            Order::Home => follow(&client, &Call::Home {}, out, &watch()),
            Order::Measure { what, set, render } => {
                let what = match what {
                    What::Friction => Quantity::Friction,
                    What::Breakaway => Quantity::Breakaway,
                    What::Presliding => Quantity::Presliding,
                };
                let plan = set.into_iter().map(|setting| (setting.path, setting.value)).collect();
                follow(&client, &Call::Measure { what, plan, render }, out, &watch())
            }
            Order::Move { reference, set, render } => {
                let number = |setting: Setting| match setting.value.parse() {
                    Ok(number) => Ok((setting.path, number)),
                    Err(_) => Err(Failure::Served(format!("{}={} is no number.", setting.path, setting.value))),
                };
                let values = set.into_iter().map(number).collect::<Result<_, _>>()?;
                tell(&client, &Call::Move { reference, values, render }, out)
            }
            Order::Signals => match client.call(&Call::Signals {})? {
                Answer::Signals { signals, .. } => {
                    for signal in signals {
                        let head = format!("{} [{}]", signal.name, signal.unit);
                        writeln!(out, "{head:45} {:8} {}", signal.symbol, signal.help)?;
                    }
                    Ok(())
                }
                other => Err(unexpected(&other)),
            },
            Order::Report => match client.call(&Call::SaveReport {})? {
                Answer::Report { folder, .. } => Ok(writeln!(out, "Report with figures: {folder}/report.html")?),
                other => Err(unexpected(&other)),
            },
            Order::Record { stop: true, .. } => {
                let before = client.status()?;
                done(&client, &Call::EndRecord {})?;
                let file = before.recording.unwrap_or_default();
                let much = before.recorded.map_or(String::new(), |recorded| format!(": {}", amount(&recorded)));
                Ok(writeln!(out, "Recorded into {file}{much}")?)
            }
            Order::Record { name, .. } => {
                done(&client, &Call::Record { name })?;
                let file = client.status()?.recording.unwrap_or_default();
                Ok(writeln!(out, "Recording into {file}; `stickslip bench record --stop` ends it.")?)
            }
            Order::Preload { preload } => follow(&client, &Call::Preload { preload }, out, &watch()),
            Order::Inject { fault } => tell(&client, &Call::Inject { fault }, out),
            Order::Start => tell(&client, &Call::Start {}, out),
            Order::Arm => tell(&client, &Call::Arm {}, out),
            Order::Stop => tell(&client, &Call::Stop {}, out),
            Order::Off => tell(&client, &Call::Off {}, out),
            Order::Acknowledge => tell(&client, &Call::Acknowledge {}, out),
            Order::Halt => {
                done(&client, &Call::Halt {})?;
                // It comes to rest first.
                while client.status()?.doing.is_some() {
                    thread::sleep(LOOK);
                }
                Ok(writeln!(out, "{}", line(&client.status()?))?)
            }
            Order::OpenAgain => tell(&client, &Call::OpenAgain {}, out),
            Order::Operate => tell(&client, &Call::Operate {}, out),
        }
    }
}

fn done(client: &Client, call: &Call) -> Result<(), Failure> {
    match client.call(call)? {
        Answer::Done {} => Ok(()),
        other => Err(unexpected(&other)),
    }
}

/// Orders something, and says how the bench is then.
fn tell(client: &Client, call: &Call, out: &mut dyn Write) -> Result<(), Failure> {
    done(client, call)?;
    // What is told is a look behind what is.
    thread::sleep(LOOK);
    Ok(writeln!(out, "{}", line(&client.status()?))?)
}

/// From look to look.
const LOOK: Duration = Duration::from_millis(50);

/// Orders something and waits for its end; Ctrl-C ends it.
fn follow(client: &Client, call: &Call, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
    done(client, call)?;
    let mut halted = false;
    loop {
        let status = client.status()?;
        match status.doing {
            Some(doing) if !halted => {
                let name = format!("{}: {}", doing.what, doing.stage);
                if watch.stage(&name, doing.fraction).is_err() {
                    done(client, &Call::Halt {})?;
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
        thread::sleep(LOOK);
    }
}
