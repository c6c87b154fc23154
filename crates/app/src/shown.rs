//! How a command shows its results: text for people, the summary for scripts, or nothing.

use std::io::Write;

use clap::Args;
use stickslip::Summary;

use crate::failure::Failure;

/// The form of the output.
#[derive(Args, Clone, Copy, Default)]
pub(crate) struct Shown {
    /// Print summary.json instead of text.
    #[arg(long, conflicts_with = "quiet")]
    pub(crate) json: bool,
    /// Print neither results nor progress; files, errors and the exit code tell.
    #[arg(long, short)]
    pub(crate) quiet: bool,
    /// Show progress where it is no terminal that reads it, too: a line each tenth, on stderr.
    #[arg(long, conflicts_with = "quiet")]
    pub(crate) progress: bool,
}

impl Shown {
    /// Shows the results: `text` writes them for people.
    pub(crate) fn show(
        self,
        out: &mut dyn Write,
        summary: &Summary,
        text: impl FnOnce(&mut dyn Write) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        if self.json {
            return Ok(out.write_all(summary.to_json().as_bytes())?);
        }
        if self.quiet { Ok(()) } else { text(out) }
    }

    /// Says something before the results are there, to people alone.
    pub(crate) fn say(self, out: &mut dyn Write, text: &str) -> Result<(), Failure> {
        if !self.json && !self.quiet {
            writeln!(out, "{text}")?;
            out.flush()?;
        }
        Ok(())
    }
}
