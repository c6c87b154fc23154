//! `stickslip machine`: files that describe a machine.

use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use stickslip::machine::guess::Draft;
use stickslip::recording::Recording;
use stickslip::{Error, output};

use crate::failure::Failure;

/// Actions on machine files.
#[derive(Subcommand)]
pub(crate) enum Machine {
    /// Write a machine file for a recording: meaning and unit of the columns, gain of the drive.
    #[command(
        after_help = "Each question has a default; Enter accepts it. From a pipe, answers are read line by line.\n\n\
                      Example: stickslip machine init axis.csv --out my-axis.toml"
    )]
    Init(Init),
}

/// Recording and machine file.
#[derive(Args)]
pub(crate) struct Init {
    /// Recording: CSV, MAT, Parquet or MDF 4.
    recording: PathBuf,
    /// File to write [default: NAME-machine.toml in the folder of the recording].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Group (raster) of a recording with several [default: the fastest one]. The machine file keeps it.
    #[arg(long, value_name = "NAME")]
    group: Option<String>,
    /// Accept all defaults.
    #[arg(long)]
    yes: bool,
    /// Replace the file if it exists.
    #[arg(long)]
    force: bool,
}

impl Machine {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let Machine::Init(init) = self;
        init.run(out)
    }
}

impl Init {
    fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let file = self.out.clone().unwrap_or_else(|| {
            let name = self.recording.file_name().unwrap_or_default().to_string_lossy();
            let stem = name.split('.').next().filter(|stem| !stem.is_empty()).unwrap_or("axis").to_owned();
            self.recording.with_file_name(format!("{stem}-machine.toml"))
        });
        if file.exists() && !self.force {
            return Err(Error::Exists { path: file }.into());
        }
        let recording = Recording::read_group(&self.recording, self.group.as_deref())?;
        let columns: Vec<_> = recording.columns().iter().map(|c| c.name.as_str()).collect();
        writeln!(out, "{} rows, columns: {}", recording.rows(), columns.join(", "))?;
        for note in recording.notes() {
            writeln!(out, "  {note}")?;
        }
        let mut draft = Draft::new(&recording).with_group(self.group.clone());
        self.answer_questions(&mut draft, out)?;
        let (text, _) = draft.toml(&file)?;
        output::write(&file, text)?;
        writeln!(out, "Written: {}. Look through it, then:", file.display())?;
        Ok(writeln!(out, "  stickslip identify {} --machine {}", self.recording.display(), file.display())?)
    }

    /// Answers all questions: on the terminal, from a pipe, or with the defaults.
    fn answer_questions(&self, draft: &mut Draft<'_>, out: &mut dyn Write) -> Result<(), Failure> {
        let terminal = io::stdin().is_terminal();
        let mut answers = io::stdin().lock().lines();
        while let Some(question) = draft.next() {
            write!(out, "{} [{}]: ", question.text, question.guess)?;
            out.flush()?;
            let unreadable = |source| Error::file(Path::new("standard input"), "read", source);
            let line = if self.yes { Some(String::new()) } else { answers.next().transpose().map_err(unreadable)? };
            let Some(line) = line else {
                let remedy =
                    "Give one answer a line, an empty line for the default, or accept all defaults with --yes.";
                let (question, answer) = (question.text, "the end of the input".into());
                return Err(Error::Answer { question, answer, remedy: remedy.into() }.into());
            };
            if self.yes || !terminal {
                writeln!(out, "{line}")?;
            }
            match draft.answer(&question, &line) {
                Err(error) if terminal && !self.yes => writeln!(out, "{error}")?,
                result => result?,
            }
        }
        Ok(())
    }
}
