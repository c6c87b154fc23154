//! One file a command.

mod identify;
mod params;

use std::io::Write;

use clap::Subcommand;
use stickslip::Watch;

use crate::failure::Failure;

/// What the program can do.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Inertia and friction of an axis from a recording of it.
    #[command(
        after_help = "Example: stickslip identify data/emps/emps.csv.gz --machine data/emps/emps-machine.toml --out emps"
    )]
    Identify(identify::Identify),
    /// Look at, check, compare and change parameter files.
    #[command(subcommand, after_help = "Example: stickslip params list")]
    Params(params::Params),
}

impl Command {
    /// Does it: results to `out`, progress to `watch`.
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        match self {
            Command::Identify(command) => command.run(out, watch),
            Command::Params(command) => command.run(out),
        }
    }
}
