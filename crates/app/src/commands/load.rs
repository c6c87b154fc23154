//! `stickslip load`: a controller, friction or law of one's own, as a shared library or an FMU, in the loop of the virtual
//! bench, simulated or by the clock.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use stickslip::bench::ThreadSettings;
use stickslip::external::{ExternalFile, Role};
use stickslip::load::{load, load_in_real_time};
use stickslip::{Error, Watch};

use crate::failure::Failure;
use crate::shown::Shown;
use crate::source::{self, Setting};

/// Which file, and on which bench.
#[derive(Args)]
pub(crate) struct LoadCommand {
    /// The file: a shared library with the functions of stickslip_module.h, an FMU for co-simulation (FMI 2.0 or 3.0),
    /// or a function in Python (law.py), which the Python package then makes a library of; the variable PYTHON says which
    /// Python has it.
    #[arg(value_name = "FILE", required_unless_present = "header")]
    file: Option<PathBuf>,
    /// Write stickslip_module.h into this folder, and nothing else.
    #[arg(long, value_name = "DIR", conflicts_with = "file")]
    header: Option<PathBuf>,
    /// What it is in the loop: controller, friction (a friction that the load motor renders) or law (all of the load
    /// motor's torque).
    #[arg(long = "as", value_name = "ROLE", value_parser = role(), default_value = "controller")]
    role: Role,
    #[command(flatten)]
    how: HowLoaded,
    /// Run by the clock, as a bench of steel does, instead of as fast as it goes: a torque that is not there when its
    /// sample ends is a fault. It takes as long as the manoeuvres do, once for each controller.
    #[arg(long, visible_alias = "clock")]
    real_time: bool,
    /// Value of a parameter of it; may be given several times.
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<Setting>,
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    pub(super) preset: String,
    /// Change a value of the preset; may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    preset_set: Vec<Setting>,
    /// Manoeuvres are followed as long as they fit into this time [s], the first one always; under a friction or a law it is
    /// measured at as many speeds as fit, two always.
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    duration: f64,
    /// Seed of the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for figures, report, summary.json and the recorded run.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/load")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: Shown,
}

/// The names of the roles.
pub(super) fn role() -> impl TypedValueParser<Value = Role> {
    let names = PossibleValuesParser::new(Role::ALL.map(Role::name));
    names.map(|name| Role::find(&name).expect("it is one of them"))
}

/// How a file of one's own is opened.
#[derive(Args)]
pub(super) struct HowLoaded {
    /// Run it in this process, faster; a crash of it then ends the program. Without it: in a process of its
    /// own.
    #[arg(long)]
    trust: bool,
    /// Which variable of an FMU is a signal, where its name does not say so; may be given several times. Signals are
    /// measured_angle, measured_velocity, torque, and, if it wants them, time and torque_limit; of a controller
    /// reference_position, reference_velocity, reference_acceleration; of a friction or a law estimated_velocity,
    /// measured_load_torque, commanded_torque.
    #[arg(long, value_name = "SIGNAL=VARIABLE")]
    map: Vec<Setting>,
}

impl HowLoaded {
    /// Whether anything was said of it.
    pub(super) fn is_said(&self) -> bool {
        self.trust || !self.map.is_empty()
    }

    /// A file in a role with these values of its parameters.
    pub(super) fn of(self, path: PathBuf, role: Role, values: &[Setting]) -> Result<ExternalFile, Error> {
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
                "{}: a controller, a friction and a law have these five functions.",
                folder.join("stickslip_module.h").display()
            )?;
            return Ok(writeln!(out, "Compile yours by: cc -O2 -shared -fPIC -o my_controller.so my_controller.c")?);
        }
        let preset = source::preset(&self.preset, self.preset_set.iter().map(|s| (s.path.as_str(), s.value.as_str())))?;
        std::fs::create_dir_all(&self.out).map_err(|error| Error::file(&self.out, "create", error))?;
        let file = self.how.of(self.file.unwrap_or_default(), self.role, &self.set)?;
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

/// Signals and variables.
fn pairs(map: Vec<Setting>) -> Vec<(String, String)> {
    map.into_iter().map(|Setting { path, value }| (path, value)).collect()
}

/// The process of a file.
#[derive(Args)]
pub(crate) struct HostCommand {
    /// The library.
    file: PathBuf,
    /// What it is in the loop.
    #[arg(long = "as", value_name = "ROLE", value_parser = role(), default_value = "controller")]
    role: Role,
    /// Which variable of an FMU is a signal.
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
        // Nobody starts it where there are no such processes: it is refused as the file itself.
        let file = ExternalFile { path: self.file, role: self.role, map: pairs(self.map), ..ExternalFile::default() };
        Ok(file.open(".".as_ref(), &mut |_| {}).map(drop)?)
    }
}
