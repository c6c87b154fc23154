//! `stickslip capture`: signals of the running bench around a trigger.

use std::io::Write;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use clap::Args;
use stickslip::Watch;
use stickslip::live::capture_report::Capture;
use stickslip::live::protocol::{Answer, Call};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::serve::{Client, unexpected};
use crate::source;

/// Signals and trigger of the capture.
#[derive(Args)]
pub(crate) struct CaptureCommand {
    /// Project folder of the running bench.
    #[arg(long, value_name = "DIR", default_value = super::PROJECT)]
    project: PathBuf,
    /// Name of a signal; may be given several times, or several names with commas. `stickslip bench signals` lists them.
    #[arg(long = "signal", short, value_name = "NAME", value_delimiter = ',', required = true)]
    signals: Vec<String>,
    /// Condition of the trigger: "S rises through X", "S leaves A..B", "S becomes N" and so on.
    #[arg(long, short, value_name = "SENTENCE", default_value = "immediate")]
    trigger: String,
    /// Time before the trigger [s].
    #[arg(long, value_name = "S", default_value_t = 0.1)]
    before: f64,
    /// Time after the trigger [s].
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    after: f64,
    /// Decimation: one of N ticks is captured.
    #[arg(long, value_name = "N", default_value_t = 1)]
    decimation: u64,
    /// Folder for data, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/capture")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

impl CaptureCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let client = Client::of(&self.project)?;
        let Answer::Signals { signals: descriptions, .. } = client.call(&Call::Signals {})? else {
            return Err(Failure::Served("the bench returns no list of signals".into()));
        };
        let call = Call::Capture {
            signals: self.signals,
            trigger: self.trigger.clone(),
            before: self.before,
            after: self.after,
            decimation: self.decimation,
        };
        let number = match client.call(&call)? {
            Answer::Capture { capture, .. } => capture,
            other => return Err(unexpected(&other)),
        };
        let captured = loop {
            match client.call(&Call::Fetch { capture: number })? {
                Answer::Captured(captured) => break *captured,
                Answer::Capture { stage, .. } => {
                    if let Err(cancelled) = watch.stage(&stage, 0.0) {
                        client.call(&Call::Drop { capture: number })?;
                        return Err(cancelled.into());
                    }
                }
                other => return Err(unexpected(&other)),
            }
            thread::sleep(Duration::from_millis(50));
        };
        let parameters = match client.call(&Call::Parameters {})? {
            Answer::Text { text } => text,
            other => return Err(unexpected(&other)),
        };
        let capture = Capture { captured, signals: descriptions, trigger: self.trigger, parameters };
        let summary = capture.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            for line in capture.table().lines() {
                writeln!(out, "  {line}")?;
            }
            for warning in capture.warnings() {
                writeln!(out, "Note: {warning}")?;
            }
            Ok(writeln!(out, "Data and report: {}", self.out.join("report.html").display())?)
        })
    }
}
