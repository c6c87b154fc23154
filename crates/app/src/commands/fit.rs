//! `stickslip fit`: Stribeck curves through measured friction curves.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use stickslip::curve_file::CurveColumns;
use stickslip::workflow::fit::fit_file;

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source;

/// Friction curve to fit.
#[derive(Args)]
pub(crate) struct Fit {
    /// Friction curve (CSV, MAT, Parquet or MDF 4: a row for each speed, with velocity and torque), the folder of a
    /// measurement, or its number in the catalogue.
    curve: PathBuf,
    /// One curve for both directions, or one for each direction.
    #[arg(long, value_enum, default_value_t = Directions::Both)]
    side: Directions,
    /// Column of the velocity, if its name does not identify it.
    #[arg(long, value_name = "NAME")]
    velocity: Option<String>,
    /// Column of the friction torque or force.
    #[arg(long, value_name = "NAME")]
    torque: Option<String>,
    /// Column of the torque's standard error.
    #[arg(long, value_name = "NAME")]
    standard_error: Option<String>,
    /// Column of the number that separates several curves in one file.
    #[arg(long, value_name = "NAME")]
    group: Option<String>,
    /// Folder for fit.toml, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/fit")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Directions {
    Both,
    Each,
}

impl Fit {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let Fit { velocity, torque, standard_error, group, .. } = self;
        let columns = CurveColumns { velocity, torque, standard_error, group };
        let fits = fit_file(&super::runs::run_path(&self.curve)?, &columns, self.side == Directions::Each)?;
        let (summary, missing) = fits.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            for fitted in &fits.fits {
                let name = if fitted.name.is_empty() { String::new() } else { format!(", {}", fitted.name) };
                writeln!(out, "Stribeck curve through {} points{name}:", fitted.points.len())?;
                for (_, name, estimate) in fits.parameters(fitted) {
                    writeln!(out, "  {name:<26} {estimate}")?;
                }
                for advice in fits.advice(fitted) {
                    writeln!(out, "  Note: {advice}")?;
                }
            }
            match missing {
                None => writeln!(out, "Own friction for design and render: {}", self.out.join("fit.toml").display())?,
                Some(reason) => writeln!(out, "No fit.toml: {reason}.")?,
            }
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}
