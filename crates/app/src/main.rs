//! `stickslip`, the friction bench in a terminal.
//!
//! Results go to stdout, progress and messages to stderr.
#![forbid(unsafe_code)]

mod commands;
mod failure;
mod output_options;
mod progress;
mod serve;
mod source;

use std::io::{self, BufWriter, Write};
use std::process::ExitCode;

use clap::Parser;

use crate::commands::Command;
use crate::failure::Failure;
use crate::output_options::OutputOptions;

/// Friction bench: measure, fit, design, render, measure again, rank, report.
#[derive(Parser)]
#[command(
    name = "stickslip",
    version,
    after_help = "Default: demo, then serve.\n\n\
                  Exit codes: 0 success; 1 failure, with the reason on stderr; 2 invalid command line; \
                  130 cancelled by Ctrl-C, partial results are kept.\n\n\
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
        // `stickslip … | head` closes the pipe early.
        Err(failure) if failure.is_closed_pipe() => ExitCode::SUCCESS,
        Err(failure) => {
            for line in failure.to_string().lines() {
                // Ignored: stderr may be closed as well.
                let _ = writeln!(io::stderr(), "error: {line}");
            }
            ExitCode::from(failure.code())
        }
    }
}

/// Runs the command and flushes its output.
fn run(cli: Cli) -> Result<(), Failure> {
    let mut out = BufWriter::new(io::stdout().lock());
    match cli.command {
        Some(command) => command.run(&mut out, progress::watch)?,
        None => commands::start(&mut out, &progress::watch(OutputOptions::default()))?,
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
