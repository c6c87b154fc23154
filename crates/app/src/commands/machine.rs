//! `stickslip machine`: files that describe a machine.

use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use stickslip::machine::guess::{self, Draft};
use stickslip::recording::Recording;
use stickslip::{Error, output, shell};

use crate::failure::Failure;

/// Actions on machine files.
#[derive(Subcommand)]
pub(crate) enum Machine {
    /// Write a machine file for a recording: meaning and unit of the columns, gain of the drive.
    #[command(
        after_help = "Enter accepts the default of a question. Questions whose answer the recording does not determine \
                      have none. Answers by name are stable for scripts; from a pipe, the others are read line by line.\n\n\
                      Example: stickslip machine init axis.csv --yes --answer name=slide --answer axis=linear --out slide.toml"
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
    /// Accept all defaults; a question without a default is then an error.
    #[arg(long)]
    yes: bool,
    /// Answer a question by its name, for example gain="36 N/V"; may be repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = named_answer)]
    answer: Vec<(String, String)>,
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
        let (text, machine) = draft.toml(&file)?;
        output::write(&file, text)?;
        let known = |finding: &&String| !recording.notes().contains(*finding);
        for finding in machine.signals(&recording)?.findings.iter().filter(known) {
            writeln!(out, "{}", finding.replace('\u{a0}', " "))?;
        }
        writeln!(out, "Written: {}. Look through it, then:", file.display())?;
        let (recording, machine) = (shell::path(&self.recording), shell::path(&file));
        Ok(writeln!(out, "  stickslip identify {recording} --machine {machine}")?)
    }

    /// Answers all questions: by name, on the terminal, from a pipe, or with the defaults.
    fn answer_questions(&self, draft: &mut Draft<'_>, out: &mut dyn Write) -> Result<(), Failure> {
        let terminal = io::stdin().is_terminal();
        let mut answers = io::stdin().lock().lines();
        let mut used = Vec::new();
        while let Some(question) = draft.next() {
            let default = question.guess.as_ref().map_or(String::new(), |guess| format!(" [{guess}]"));
            write!(out, "{}{default}: ", question.text)?;
            out.flush()?;
            let named = self.answer.iter().find(|(name, _)| name == question.name).map(|(_, answer)| answer.clone());
            let asked = named.is_none() && !self.yes;
            let unreadable = |source| Error::file(Path::new("standard input"), "read", source);
            let line = match named {
                Some(answer) => {
                    used.push(question.name);
                    Some(answer)
                }
                None if self.yes => Some(String::new()),
                None => answers.next().transpose().map_err(unreadable)?,
            };
            let Some(line) = line else {
                let remedy = format!(
                    "Give one answer a line, an empty line for the default, or name it: --answer {}=….",
                    question.name
                );
                let (question, answer) = (question.text, "the end of the input".into());
                return Err(Error::Answer { question, answer, remedy }.into());
            };
            if !(asked && terminal) {
                writeln!(out, "{line}")?;
            }
            match draft.answer(&question, &line) {
                Err(error) if terminal && asked => writeln!(out, "{error}")?,
                result => result?,
            }
        }
        match self.answer.iter().find(|(name, _)| !used.contains(&name.as_str())) {
            None => Ok(()),
            Some((name, answer)) => {
                let remedy = "The other answers leave no question of this name. Remove it, or correct them.".into();
                Err(Error::Answer { question: name.clone(), answer: answer.clone(), remedy }.into())
            }
        }
    }
}

/// `NAME=VALUE` with the name of a question.
fn named_answer(text: &str) -> Result<(String, String), String> {
    let known = || guess::names().collect::<Vec<_>>().join(", ");
    let Some((name, value)) = text.split_once('=') else { return Err(format!("write NAME=VALUE; names: {}", known())) };
    match guess::names().any(|known| known == name) {
        true => Ok((name.to_owned(), value.to_owned())),
        false => Err(format!("unknown question \"{name}\"; names: {}", known())),
    }
}
