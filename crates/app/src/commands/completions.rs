//! `stickslip completions`: scripts that complete the command line in a shell.

use std::io::Write;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::Cli;
use crate::failure::Failure;

/// The shell for the completions.
#[derive(Args)]
pub(crate) struct Completions {
    /// Shell; write the output to a file where the shell looks for completions.
    shell: Shell,
}

impl Completions {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "stickslip", &mut text);
        Ok(out.write_all(&text)?)
    }
}
