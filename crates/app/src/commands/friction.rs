//! `stickslip friction`: friction identified on physical machines.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use stickslip::library::{self, Role};
use stickslip::report::{Cell, Table};
use stickslip::{output, parameters};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source;

/// Friction to show, and the machine for it.
#[derive(Args)]
pub(crate) struct FrictionCommand {
    /// Name of a friction of the library, or a file like those of data/friction [default: list all].
    name: Option<String>,
    /// Factor for all torques, for a machine of another size.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = factor)]
    scale: f64,
    /// Name of a preset, or a parameter file, to combine with this friction; the result is preset.toml.
    #[arg(long, value_name = "NAME|FILE")]
    onto: Option<String>,
    /// Role of the friction in this preset.
    #[arg(long = "as", value_name = "ROLE", default_value = "desired", requires = "onto")]
    role: RoleName,
    /// Folder for figures, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/friction")]
    out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

/// Role of a friction on a bench.
#[derive(Clone, Copy, ValueEnum)]
enum RoleName {
    /// Desired friction, which the load motor renders.
    Desired,
    /// Own friction of the machine and of the controller's model; the friction wheel is released.
    Own,
}

fn factor(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err("choose a factor above 0".into()) }
}

impl FrictionCommand {
    /// Folder of the results; `None` for a list.
    pub(super) fn destination(&self) -> Option<PathBuf> {
        self.name.is_some().then(|| self.out.clone())
    }

    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let Some(name) = &self.name else { return list(out) };
        let entry = library::find(name)?.scaled(self.scale);
        let mut summary = entry.write(&self.out, &source::command_line())?;
        if let Some(onto) = &self.onto {
            let role = match self.role {
                RoleName::Desired => Role::Desired,
                RoleName::Own => Role::Own,
            };
            let preset = entry.on(&source::preset(onto, [])?, role)?;
            output::write(&self.out.join("preset.toml"), parameters::write_commented(&preset))?;
            summary.file("preset.toml");
            summary.write(&self.out)?;
        }
        self.shown.show(out, &summary, |out| {
            writeln!(out, "{}", entry.about.title)?;
            writeln!(out, "{}. Licence: {}.", entry.about.source, entry.about.licence)?;
            for line in entry.table().lines() {
                writeln!(out, "{line}")?;
            }
            for remark in entry.remarks() {
                writeln!(out, "{remark}")?;
            }
            if self.onto.is_some() {
                writeln!(out, "Preset with this friction: {}", self.out.join("preset.toml").display())?;
            }
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}

/// Prints the names and titles of all frictions.
fn list(out: &mut dyn Write) -> Result<(), Failure> {
    let mut table = Table::new(["name", "description"]);
    for name in library::names() {
        table = table.row([Cell::from(name), Cell::from(library::find(name)?.about.title)]);
    }
    for line in table.lines() {
        writeln!(out, "{line}")?;
    }
    Ok(())
}
