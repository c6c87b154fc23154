//! `stickslip params`: parameter files at the command line.

use std::io::Write;
use std::path::PathBuf;

use clap::Subcommand;
use stickslip::output;
use stickslip::parameters::{self, Difference, Entry, presets};

use crate::failure::Failure;

/// What a parameter file describes.
pub(crate) type Preset = stickslip::Preset<f64>;

/// What can be done with parameter files. A SOURCE is the name of a preset or the path of a file.
#[derive(Subcommand)]
pub(crate) enum Params {
    /// List the presets, or all values of one.
    #[command(after_help = "Example: stickslip params list clm-bench")]
    List {
        /// Preset or file.
        source: Option<String>,
    },
    /// Say what a parameter is: symbol, unit, range, default.
    #[command(after_help = "Example: stickslip params describe plant.drive")]
    Describe {
        /// Dotted path of a parameter or group; all without it.
        #[arg(default_value = "")]
        path: String,
    },
    /// Check files: names, types, ranges, laws between parameters. All problems are reported at once.
    #[command(after_help = "Example: stickslip params check my-bench.toml")]
    Check {
        /// Presets or files.
        #[arg(required = true)]
        sources: Vec<String>,
    },
    /// Show the values that are not the same.
    #[command(after_help = "Example: stickslip params diff clm-bench my-bench.toml")]
    Diff {
        /// Preset or file.
        before: String,
        /// Preset or file.
        after: String,
    },
    /// Print a file with one value changed; comments and layout stay.
    #[command(
        after_help = "Example: stickslip params set clm-bench plant.drive.motor_inertia 4.2e-4 --out my-bench.toml"
    )]
    Set {
        /// Preset or file.
        source: String,
        /// Dotted path of the parameter.
        path: String,
        /// As in a file, in SI units.
        #[arg(allow_hyphen_values = true)]
        value: String,
        /// Write it here instead of printing it; may be the same file.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Print a complete file: every parameter, its unit, range and meaning as comments.
    #[command(after_help = "Example: stickslip params write clm-bench > my-bench.toml")]
    Write {
        /// Preset or file; defaults only without it.
        source: Option<String>,
    },
}

impl Params {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        match self {
            Params::List { source: None } => {
                for (name, about) in presets::list() {
                    writeln!(out, "{name:12} {about}")?;
                }
            }
            Params::List { source: Some(source) } => {
                for entry in parameters::flatten(&read(&source)?) {
                    writeln!(out, "{} = {entry}", entry.path)?;
                }
            }
            Params::Describe { path } => {
                for description in parameters::describe::<Preset>(&path)? {
                    write!(out, "{description}")?;
                }
            }
            Params::Check { sources } => check(&sources, out)?,
            Params::Diff { before, after } => {
                for difference in parameters::diff(&read(&before)?, &read(&after)?) {
                    show(&difference, out)?;
                }
            }
            Params::Set { source, path, value, out: file } => {
                let source = presets::find(&source)?;
                let text = parameters::set::<Preset>(&source.text, &source.file, &path, &value)?;
                match file {
                    Some(file) => output::write(&file, text)?,
                    None => out.write_all(text.as_bytes())?,
                }
            }
            Params::Write { source } => {
                let preset = source.map_or(Ok(Preset::default()), |source| read(&source))?;
                out.write_all(parameters::write_commented(&preset).as_bytes())?;
            }
        }
        Ok(())
    }
}

fn read(source: &str) -> Result<Preset, stickslip::Error> {
    presets::find(source)?.read()
}

fn check(sources: &[String], out: &mut dyn Write) -> Result<(), Failure> {
    let mut wrong = Vec::new();
    for source in sources {
        match read(source) {
            Ok(preset) => {
                let count = parameters::flatten(&preset).len();
                writeln!(out, "{source}: {count} values, all in order")?;
            }
            Err(error) => wrong.push(error),
        }
    }
    if wrong.is_empty() { Ok(()) } else { Err(Failure::Several(wrong)) }
}

fn show(difference: &Difference, out: &mut dyn Write) -> std::io::Result<()> {
    let text = |entry: &Option<Entry>| entry.as_ref().map_or("none".into(), Entry::to_string);
    writeln!(out, "{}: {} → {}", difference.path, text(&difference.before), text(&difference.after))
}
