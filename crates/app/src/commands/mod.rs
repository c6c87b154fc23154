//! One file a command.

mod params;

use std::io::Write;

use clap::Subcommand;
use stickslip::Watch;

use crate::failure::Failure;

/// What the program can do.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Look at, check, compare and change parameter files.
    #[command(subcommand, after_help = "Example: stickslip params list")]
    Params(params::Params),
}

impl Command {
    /// Does it, with results to `out`. A command that takes long calls `watch` first: from then on the first Ctrl-C
    /// asks it to stop, and does not end the program.
    pub(crate) fn run(self, out: &mut dyn Write, watch: impl FnOnce() -> Watch) -> Result<(), Failure> {
        let _ = watch; // None of these takes long.
        match self {
            Command::Params(command) => command.run(out),
        }
    }
}
