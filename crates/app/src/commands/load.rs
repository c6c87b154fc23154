//! `stickslip load`: an external controller, friction or law, as a shared library, an FMU or a function in Python, in the
//! loop of the virtual bench, simulated or in real time.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use stickslip::bench::ThreadSettings;
use stickslip::external::{ExternalFile, Role};
use stickslip::load::{load, load_in_real_time};
use stickslip::{Error, Watch};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// External file and bench.
#[derive(Args)]
pub(crate) struct LoadCommand {
    /// File: a shared library with the functions of stickslip_module.h, an FMU for co-simulation (FMI 2.0 or 3.0), or a
    /// function in Python (law.py), which the Python package compiles to a library; the variable PYTHON names the Python
    /// that has this package.
    #[arg(value_name = "FILE", required_unless_present = "header")]
    file: Option<PathBuf>,
    /// Only write stickslip_module.h into this folder.
    #[arg(long, value_name = "DIR", conflicts_with = "file")]
    header: Option<PathBuf>,
    /// Role in the loop: controller, friction (which the load motor renders) or law (the whole torque of the load
    /// motor).
    #[arg(long = "as", value_name = "ROLE", value_parser = role(), default_value = "controller")]
    role: Role,
    #[command(flatten)]
    options: ExternalOptions,
    /// Run in real time, as physical hardware does [default: as fast as possible]: a torque that is missing at the end of
    /// its sample is a fault. The run takes as long as the manoeuvres, once for each controller.
    #[arg(long, visible_alias = "clock")]
    real_time: bool,
    /// Value of a parameter of the file; may be given several times.
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<Setting>,
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    pub(super) preset: String,
    /// Change a value of the preset; may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    preset_set: Vec<Setting>,
    /// Bench time for manoeuvres [s]: those that fit, at least one. For a friction or a law: for speeds of the
    /// measurement, at least two.
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    duration: f64,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for figures, report, summary.json and the recorded run.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/load")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

/// The names of the roles.
pub(super) fn role() -> impl TypedValueParser<Value = Role> {
    let names = PossibleValuesParser::new(Role::ALL.map(Role::name));
    names.map(|name| Role::find(&name).expect("the parser accepts only these names"))
}

/// Options of an external file.
#[derive(Args)]
pub(super) struct ExternalOptions {
    /// Run the file in this process: faster, but a crash of the file ends the program [default: a separate process].
    #[arg(long)]
    trust: bool,
    /// Variable of an FMU for a signal, if its name does not identify it; may be given several times. Signals:
    /// measured_angle, measured_velocity, torque; optionally time and torque_limit; for a controller reference_position,
    /// reference_velocity, reference_acceleration; for a friction or a law estimated_velocity, measured_load_torque,
    /// commanded_torque.
    #[arg(long, value_name = "SIGNAL=VARIABLE")]
    map: Vec<Setting>,
}

impl ExternalOptions {
    /// Whether an option was given.
    pub(super) fn is_set(&self) -> bool {
        self.trust || !self.map.is_empty()
    }

    /// The file in a role with these values of its parameters.
    pub(super) fn file(self, path: PathBuf, role: Role, values: &[Setting]) -> Result<ExternalFile, Error> {
        let number = |Setting { path, value }: &Setting| {
            let (question, answer) = (path.clone(), value.clone());
            let refused = |_| Error::Answer { question, answer, remedy: "Give a number.".into() };
            value.parse().map(|value| (path.clone(), value)).map_err(refused)
        };
        let values = values.iter().map(number).collect::<Result<_, _>>()?;
        Ok(ExternalFile { path, role, map: pairs(self.map), trust: self.trust, values })
    }
}

impl LoadCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        if let Some(folder) = &self.header {
            stickslip::external::write_header(folder)?;
            writeln!(
                out,
                "{}: the five functions of an external controller, friction or law.",
                folder.join("stickslip_module.h").display()
            )?;
            return Ok(writeln!(out, "Compile with: cc -O2 -shared -fPIC -o my_controller.so my_controller.c")?);
        }
        let preset = source::preset(&self.preset, self.preset_set.iter().map(|s| (s.path.as_str(), s.value.as_str())))?;
        std::fs::create_dir_all(&self.out).map_err(|error| Error::file(&self.out, "create", error))?;
        let file = self.options.file(self.file.unwrap_or_default(), self.role, &self.set)?;
        let external = file.open(&self.out, &mut |line| eprintln!("{line}"))?;
        let (run, duration, seed) = (self.out.join("run.mf4"), self.duration, self.seed);
        let loaded = if self.real_time {
            load_in_real_time(&preset, external, duration, seed, Some(&run), ThreadSettings::default(), watch)?
        } else {
            load(&preset, external, duration, seed, Some(&run), watch)?
        };
        let summary = loaded.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            for line in loaded.table().lines() {
                writeln!(out, "{line}")?;
            }
            for line in loaded.clocked.iter().flat_map(|clocked| clocked.table().lines()) {
                writeln!(out, "{line}")?;
            }
            for remark in loaded.remarks() {
                writeln!(out, "{remark}")?;
            }
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })?;
        match loaded.fault {
            Some(fault) => Err(Failure::Stopped(fault)),
            None => Ok(()),
        }
    }
}

/// Pairs of signal and variable.
fn pairs(map: Vec<Setting>) -> Vec<(String, String)> {
    map.into_iter().map(|Setting { path, value }| (path, value)).collect()
}

/// The separate process of an external file.
#[derive(Args)]
pub(crate) struct HostCommand {
    /// External file.
    file: PathBuf,
    /// Role in the loop.
    #[arg(long = "as", value_name = "ROLE", value_parser = role(), default_value = "controller")]
    role: Role,
    /// Variable of an FMU for a signal.
    #[arg(long, value_name = "SIGNAL=VARIABLE")]
    map: Vec<Setting>,
}

impl HostCommand {
    #[cfg(unix)]
    pub(crate) fn run(self) -> Result<(), Failure> {
        Ok(stickslip::external::process::host(&self.file, self.role, &pairs(self.map))?)
    }

    #[cfg(not(unix))]
    pub(crate) fn run(self) -> Result<(), Failure> {
        // These systems have no such process: opening the file reports the error.
        let file = ExternalFile { path: self.file, role: self.role, map: pairs(self.map), ..ExternalFile::default() };
        Ok(file.open(".".as_ref(), &mut |_| {}).map(drop)?)
    }
}
