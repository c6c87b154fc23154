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
    /// Does it: results to `out`, progress to `watch`.
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let _ = watch; // None of these takes long enough to be watched.
        match self {
            Command::Params(command) => command.run(out),
        }
    }
}
