//! `stickslip generate`: code and diagrams of the blocks of the bench.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use stickslip::generate::{self, Precision};

use crate::failure::Failure;
use crate::shown::Shown;
use crate::source::{self, Setting};

/// Into what to turn a block.
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct Generate {
    /// Name all blocks.
    #[arg(long)]
    list: bool,
    #[command(subcommand)]
    target: Option<Target>,
}

/// What can be made of a block.
#[derive(Subcommand)]
enum Target {
    /// C99 with the bits of the program: header, source, self-test, example, page, diagram.
    #[command(after_help = "Example: stickslip generate c velocity_observer --out observer\n\
                            Example: stickslip generate c tick --preset clm-soft --single --prefix axis")]
    C(CCommand),
}

/// Which block, with which numbers.
#[derive(Args)]
struct CCommand {
    /// The block; `stickslip generate --list` names them.
    name: String,
    /// Where numbers and choices come from: a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Change a value of the preset.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Compute in `float` instead of `double`.
    #[arg(long)]
    single: bool,
    /// What types and functions begin with; the block's name without it.
    #[arg(long, value_name = "WORD")]
    prefix: Option<String>,
    /// Folder for the files and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/generate")]
    out: PathBuf,
    #[command(flatten)]
    shown: Shown,
}

impl Generate {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        if self.list {
            for entry in generate::blocks() {
                writeln!(out, "{:24} {}", entry.name, entry.about)?;
            }
        }
        match self.target {
            Some(Target::C(command)) => command.run(out),
            None => Ok(()),
        }
    }
}

impl CCommand {
    fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let preset = source::preset(&self.preset, settings)?;
        let precision = if self.single { Precision::Single } else { Precision::Double };
        let generated = generate::generate(&self.name, &preset, precision, self.prefix.as_deref())?;
        let summary = generated.write(&self.out)?;
        self.shown.show(out, &summary, |out| {
            for (name, text) in &generated.files {
                writeln!(out, "{:>7} lines  {}", text.lines().count(), self.out.join(name).display())?;
            }
            Ok(writeln!(out, "How to call and to compile it: {}", self.out.join("README.md").display())?)
        })
    }
}
