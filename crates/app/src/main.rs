//! `stickslip`, the friction bench in a terminal.
//!
//! Results go to stdout, progress and messages to stderr.
#![forbid(unsafe_code)]

mod commands;
mod failure;
mod progress;
mod serve;
mod shown;
mod source;

use std::io::{self, BufWriter, Write};
use std::process::ExitCode;

use clap::Parser;

use crate::commands::Command;
use crate::failure::Failure;
use crate::shown::Shown;

/// The friction bench: measure, fit, design, render, re-measure, rank, report.
#[derive(Parser)]
#[command(
    name = "stickslip",
    version,
    after_help = "Without a command: demo, and then serve.\n\n\
                  Exit code: 0 done; 1 failed, the message says why; 2 the command line was not understood; \
                  130 cancelled by Ctrl-C, with results so far kept where there are any.\n\n\
                  Example: stickslip demo --out results --seed 7"
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

fn main() -> ExitCode {
    let result = run(Cli::parse());
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // `stickslip … | head` has read all it wanted.
        Err(failure) if failure.is_closed_pipe() => ExitCode::SUCCESS,
        Err(failure) => {
            for line in failure.to_string().lines() {
                // Nobody is left to tell if stderr is closed as well.
                let _ = writeln!(io::stderr(), "error: {line}");
            }
            ExitCode::from(failure.code())
        }
    }
}

/// Runs the command; all that it prints is out when this returns.
fn run(cli: Cli) -> Result<(), Failure> {
    let mut out = BufWriter::new(io::stdout().lock());
    match cli.command {
        Some(command) => command.run(&mut out, progress::watch)?,
        None => commands::start(&mut out, &progress::watch(Shown::default()))?,
    }
    Ok(out.flush()?)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    fn visit(command: &clap::Command, check: &mut impl FnMut(&clap::Command)) {
        check(command);
        command.get_subcommands().for_each(|command| visit(command, check));
    }

    #[test]
    fn every_command_shows_an_example() {
        Cli::command().debug_assert();
        let mut count = 0;
        visit(&Cli::command(), &mut |command| {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains("Example: stickslip"), "{}", command.get_name());
            count += 1;
        });
        assert!(count > 5);
    }
}
