//! Options of the output of a command: text, the summary for scripts, or nothing.

use std::io::Write;

use clap::Args;
use stickslip::Summary;

use crate::failure::Failure;

/// Options of the output.
#[derive(Args, Clone, Copy, Default)]
pub(crate) struct OutputOptions {
    /// Print summary.json instead of text.
    #[arg(long, conflicts_with = "quiet")]
    pub(crate) json: bool,
    /// Suppress all output except errors.
    #[arg(long, short)]
    pub(crate) quiet: bool,
    /// Print progress on stderr also if it is not a terminal: a line for each 10 %.
    #[arg(long, conflicts_with = "quiet")]
    pub(crate) progress: bool,
}

impl OutputOptions {
    /// Prints the results: the summary, nothing, or the output of `text`.
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

    /// Prints a line before the results, unless the output is JSON or suppressed.
    pub(crate) fn print_line(self, out: &mut dyn Write, text: &str) -> Result<(), Failure> {
        if !self.json && !self.quiet {
            writeln!(out, "{text}")?;
            out.flush()?;
        }
        Ok(())
    }
}
