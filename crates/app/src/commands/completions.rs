//! `stickslip completions`: what a shell needs to complete the command line.

use std::io::Write;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::Cli;
use crate::failure::Failure;

/// For which shell.
#[derive(Args)]
pub(crate) struct Completions {
    /// The shell; put what is printed where it looks for completions.
    shell: Shell,
}

impl Completions {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "stickslip", &mut text);
        Ok(out.write_all(&text)?)
    }
}
