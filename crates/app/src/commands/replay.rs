//! `stickslip replay`: replay of a recorded run, compared bit by bit.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use stickslip::run::Stored;
use stickslip::{Summary, Watch};

use crate::failure::Failure;
use crate::output_options::OutputOptions;

/// Run to replay.
#[derive(Args)]
pub(crate) struct ReplayCommand {
    /// The run's file, the folder with its run.mf4, or its number in the catalogue.
    run: PathBuf,
    /// Folder for summary.json [default: no file].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

impl ReplayCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let path = super::export::file(&self.run)?;
        let replayed = Stored::open(&path)?.replay(watch)?;
        let mut summary = Summary::new("replay");
        summary
            .result("replay.identical", f64::from(u8::from(replayed.identical())), "1")
            .result("replay.cycles", replayed.cycles as f64, "1")
            .result("replay.recorded", replayed.of as f64, "1")
            .result("replay.machine", f64::from(u8::from(replayed.machine)), "1")
            .result("replay.lost", replayed.lost as f64, "1");
        if let Some(first) = &replayed.first {
            summary.result("replay.first.cycle", first.cycle as f64, "1");
            summary.row([
                ("block", first.block.into()),
                ("signal", first.signal.clone().into()),
                ("recorded", first.recorded.into()),
                ("replayed", first.replayed.into()),
            ]);
        }
        if let Some(folder) = &self.out {
            stickslip::output::create_folder(folder)?;
            summary.write(folder)?;
        }
        self.shown.show(out, &summary, |out| Ok(writeln!(out, "{replayed}")?))?;
        if replayed.identical() { Ok(()) } else { Err(Failure::Served("the replay differs from the recording".into())) }
    }
}
