//! `stickslip params`: parameter files at the command line.

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

/// What a parameter file describes.
pub(crate) type Preset = stickslip::Preset<f64>;

/// Parameters: of presets and files, and of the bench that is served.
#[derive(Args)]
pub(crate) struct ParamsCommand {
    /// Folder of the served bench's project, for the source `live`.
    #[arg(long, value_name = "DIR", default_value = super::PROJECT, global = true)]
    project: PathBuf,
    #[command(subcommand)]
    what: Params,
}

/// What can be done. A SOURCE is the name of a preset, the path of a file, or `live`: what is in force on the bench that
/// is served.
#[derive(Subcommand)]
enum Params {
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
    /// Print a file with one value changed; comments and layout stay. Of `live`: put it in force.
    #[command(
        after_help = "Example: stickslip params set clm-bench plant.drive.motor_inertia 4.2e-4 --out my-bench.toml\n\
                      Example: stickslip params set live bench.controller.position_gain 12"
    )]
    Set {
        /// Preset, file or `live`.
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
    /// On the served bench: the parameters before the last change.
    #[command(after_help = "Example: stickslip params undo")]
    Undo,
    /// On the served bench: the parameters before the last undo.
    #[command(after_help = "Example: stickslip params redo")]
    Redo,
    /// On the served bench: the parameters that it began with.
    #[command(after_help = "Example: stickslip params reset")]
    Reset,
    /// On the served bench: save what is in force under a name.
    #[command(after_help = "Example: stickslip params save stiff")]
    Save {
        /// Letters, digits, `-` and `_`.
        name: String,
    },
    /// On the served bench: put in force what is saved under a name; without a name, list them.
    #[command(after_help = "Example: stickslip params load stiff")]
    Load {
        /// As it was saved.
        name: Option<String>,
    },
    /// Print a complete file: every parameter, its unit, range and meaning as comments.
    #[command(after_help = "Example: stickslip params write clm-bench > my-bench.toml")]
    Write {
        /// Preset or file; defaults only without it.
        source: Option<String>,
    },
}

impl ParamsCommand {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let read = |source: &str| Ok::<_, Failure>(self.find(source)?.read::<Preset>()?);
        match &self.what {
            Params::List { source: None } => {
                for (name, about) in presets::list() {
                    writeln!(out, "{name:12} {about}")?;
                }
            }
            Params::List { source: Some(source) } => {
                for entry in parameters::flatten(&read(source)?) {
                    writeln!(out, "{} = {entry}", entry.path)?;
                }
            }
            Params::Describe { path } => {
                for description in parameters::describe::<Preset>(path)? {
                    write!(out, "{description}")?;
                }
            }
            Params::Check { sources } => check(sources, out)?,
            Params::Diff { before, after } => {
                for difference in parameters::diff(&read(before)?, &read(after)?) {
                    show(&difference, out)?;
                }
            }
            Params::Set { source, path, value, out: None } if source == LIVE => {
                let values = BTreeMap::from([(path.clone(), value.clone())]);
                self.enter(&Call::Set { values }, out)?;
            }
            Params::Set { source, path, value, out: file } => {
                let source = self.find(source)?;
                let text = parameters::set::<Preset>(&source.text, &source.file, path, value)?;
                match file {
                    Some(file) => output::write(file, text)?,
                    None => out.write_all(text.as_bytes())?,
                }
            }
            Params::Undo => self.enter(&Call::Undo {}, out)?,
            Params::Redo => self.enter(&Call::Redo {}, out)?,
            Params::Reset => self.enter(&Call::Reset {}, out)?,
            Params::Load { name: Some(name) } => self.enter(&Call::Load { name: name.clone() }, out)?,
            Params::Load { name: None } => match Client::of(&self.project)?.call(&Call::Sets {})? {
                Answer::Names { names } => names.iter().try_for_each(|name| writeln!(out, "{name}"))?,
                other => return Err(unexpected(&other)),
            },
            Params::Save { name } => match Client::of(&self.project)?.call(&Call::Save { name: name.clone() })? {
                Answer::Done {} => writeln!(out, "Saved as {name}.")?,
                other => return Err(unexpected(&other)),
            },
            Params::Write { source } => {
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

    /// Puts parameters in force, and says what became another.
    fn enter(&self, call: &Call, out: &mut dyn Write) -> Result<(), Failure> {
        match Client::of(&self.project)?.call(call)? {
            Answer::Entered { cycle, differences, margin } => {
                let text = |value: Option<String>| value.unwrap_or_else(|| "none".into());
                for Changed { path, before, after } in differences {
                    writeln!(out, "{path}: {} → {}", text(before), text(after))?;
                }
                writeln!(out, "In force from cycle {cycle} on.")?;
                if let Some(margin) = margin {
                    writeln!(out, "Margin of the rendering law: {margin}.")?;
                }
                Ok(())
            }
            other => Err(unexpected(&other)),
        }
    }
}

/// The name of what is in force on the served bench.
const LIVE: &str = "live";

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
