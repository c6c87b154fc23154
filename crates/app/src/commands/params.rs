//! `stickslip params`: parameters of presets, files and the running bench.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use stickslip::live::protocol::{Answer, Call, Changed};
use stickslip::output;
use stickslip::parameters::presets::{self, Source};
use stickslip::parameters::{self, Difference, Entry};

use crate::failure::Failure;
use crate::serve::{Client, unexpected};

/// Content of a parameter file.
pub(crate) type Preset = stickslip::Preset<f64>;

/// Parameters of presets, files and the running bench.
#[derive(Args)]
pub(crate) struct ParamsCommand {
    /// Project folder of the running bench, for the source `live`.
    #[arg(long, value_name = "DIR", default_value = super::PROJECT, global = true)]
    project: PathBuf,
    #[command(subcommand)]
    action: Action,
}

/// Actions on parameters. A SOURCE is the name of a preset, the path of a file, or `live`: the active parameters of the
/// running bench.
#[derive(Subcommand)]
enum Action {
    /// List the presets, or all values of one.
    #[command(after_help = "Example: stickslip params list clm-bench")]
    List {
        /// Preset or file.
        source: Option<String>,
    },
    /// Describe a parameter: symbol, unit, range, default.
    #[command(after_help = "Example: stickslip params describe plant.drive")]
    Describe {
        /// Dotted path of a parameter or group [default: all].
        #[arg(default_value = "")]
        path: String,
    },
    /// Check files: names, types, ranges, conditions between parameters. All errors are reported together.
    #[command(after_help = "Example: stickslip params check my-bench.toml")]
    Check {
        /// Presets or files.
        #[arg(required = true)]
        sources: Vec<String>,
    },
    /// Show the values that differ.
    #[command(after_help = "Example: stickslip params diff clm-bench my-bench.toml")]
    Diff {
        /// First preset or file.
        before: String,
        /// Second preset or file.
        after: String,
    },
    /// Change one value and print the file, with its comments and layout; for `live`: activate it on the running bench.
    #[command(
        after_help = "Example: stickslip params set clm-bench plant.drive.motor_inertia 4.2e-4 --out my-bench.toml\n\
                      Example: stickslip params set live bench.controller.position_gain 12"
    )]
    Set {
        /// Preset, file or `live`.
        source: String,
        /// Dotted path of the parameter.
        path: String,
        /// Value as written in a file, in SI units.
        #[arg(allow_hyphen_values = true)]
        value: String,
        /// File to write instead of printing; may be the same file.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Undo the last change on the running bench.
    #[command(after_help = "Example: stickslip params undo")]
    Undo,
    /// Redo the last undone change on the running bench.
    #[command(after_help = "Example: stickslip params redo")]
    Redo,
    /// Restore the start parameters of the running bench.
    #[command(after_help = "Example: stickslip params reset")]
    Reset,
    /// Save the active parameters of the running bench under a name.
    #[command(after_help = "Example: stickslip params save stiff")]
    Save {
        /// Name: letters, digits, `-` and `_`.
        name: String,
    },
    /// Activate saved parameters on the running bench, or list the saved names.
    #[command(after_help = "Example: stickslip params load stiff")]
    Load {
        /// Name of the saved parameters [default: list all].
        name: Option<String>,
    },
    /// Print a complete file with all parameters; units, ranges and meanings are comments.
    #[command(after_help = "Example: stickslip params write clm-bench > my-bench.toml")]
    Write {
        /// Preset or file [default: the defaults of all parameters].
        source: Option<String>,
    },
}

impl ParamsCommand {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let read = |source: &str| Ok::<_, Failure>(self.find(source)?.read::<Preset>()?);
        match &self.action {
            Action::List { source: None } => {
                for (name, about) in presets::list() {
                    writeln!(out, "{name:12} {about}")?;
                }
            }
            Action::List { source: Some(source) } => {
                for entry in parameters::flatten(&read(source)?) {
                    writeln!(out, "{} = {entry}", entry.path)?;
                }
            }
            Action::Describe { path } => {
                for description in parameters::describe::<Preset>(path)? {
                    write!(out, "{description}")?;
                }
            }
            Action::Check { sources } => check(sources, out)?,
            Action::Diff { before, after } => {
                for difference in parameters::diff(&read(before)?, &read(after)?) {
                    show(&difference, out)?;
                }
            }
            Action::Set { source, path, value, out: None } if source == LIVE => {
                let values = BTreeMap::from([(path.clone(), value.clone())]);
                self.activate(&Call::Set { values }, out)?;
            }
            Action::Set { source, path, value, out: file } => {
                let source = self.find(source)?;
                let text = parameters::set::<Preset>(&source.text, &source.file, path, value)?;
                match file {
                    Some(file) => output::write(file, text)?,
                    None => out.write_all(text.as_bytes())?,
                }
            }
            Action::Undo => self.activate(&Call::Undo {}, out)?,
            Action::Redo => self.activate(&Call::Redo {}, out)?,
            Action::Reset => self.activate(&Call::Reset {}, out)?,
            Action::Load { name: Some(name) } => self.activate(&Call::Load { name: name.clone() }, out)?,
            Action::Load { name: None } => match Client::of(&self.project)?.call(&Call::Sets {})? {
                Answer::Names { names } => names.iter().try_for_each(|name| writeln!(out, "{name}"))?,
                other => return Err(unexpected(&other)),
            },
            Action::Save { name } => match Client::of(&self.project)?.call(&Call::Save { name: name.clone() })? {
                Answer::Done {} => writeln!(out, "Saved as {name}.")?,
                other => return Err(unexpected(&other)),
            },
            Action::Write { source } => {
                let preset = source.as_ref().map_or(Ok(Preset::default()), |source| read(source))?;
                out.write_all(parameters::write_commented(&preset).as_bytes())?;
            }
        }
        Ok(())
    }

    /// The file of a source.
    fn find(&self, source: &str) -> Result<Source, Failure> {
        if source != LIVE {
            return Ok(presets::find(source)?);
        }
        match Client::of(&self.project)?.call(&Call::Parameters {})? {
            Answer::Text { text } => Ok(Source { file: LIVE.into(), text }),
            other => Err(unexpected(&other)),
        }
    }

    /// Activates parameters on the running bench and prints the differences.
    fn activate(&self, call: &Call, out: &mut dyn Write) -> Result<(), Failure> {
        match Client::of(&self.project)?.call(call)? {
            Answer::Entered { cycle, differences, margin } => {
                let text = |value: Option<String>| value.unwrap_or_else(|| "none".into());
                for Changed { path, before, after } in differences {
                    writeln!(out, "{path}: {} → {}", text(before), text(after))?;
                }
                writeln!(out, "Active from cycle {cycle}.")?;
                if let Some(margin) = margin {
                    writeln!(out, "Margin of the rendering law: {margin}.")?;
                }
                Ok(())
            }
            other => Err(unexpected(&other)),
        }
    }
}

/// Source name of the active parameters of the running bench.
const LIVE: &str = "live";

fn read(source: &str) -> Result<Preset, stickslip::Error> {
    presets::find(source)?.read()
}

fn check(sources: &[String], out: &mut dyn Write) -> Result<(), Failure> {
    let mut errors = Vec::new();
    for source in sources {
        match read(source) {
            Ok(preset) => {
                let count = parameters::flatten(&preset).len();
                writeln!(out, "{source}: {count} values, all in order")?;
            }
            Err(error) => errors.push(error),
        }
    }
    if errors.is_empty() { Ok(()) } else { Err(Failure::Several(errors)) }
}

fn show(difference: &Difference, out: &mut dyn Write) -> std::io::Result<()> {
    let text = |entry: &Option<Entry>| entry.as_ref().map_or("none".into(), Entry::to_string);
    writeln!(out, "{}: {} → {}", difference.path, text(&difference.before), text(&difference.after))
}
