//! `stickslip generate`: code and diagrams of the blocks of the bench.

use std::io::Write;
use std::net::SocketAddr;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use stickslip::generate::{self, Precision, Variables, Version};
use stickslip::xcp::{Layout, a2l};
use stickslip::{Summary, output};

use super::xcp::{PORT, XcpDoors, address};
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
    /// The description for CANape, INCA and their like (ASAP2 1.61): of a bench that is served by XCP, or of the generated
    /// code of a block in your program.
    #[command(after_help = "Example: stickslip generate a2l bench --out tools\n\
                            Example: stickslip generate a2l bench --set bench.tick_rate=10000 --xcp-udp 192.168.0.5:5555\n\
                            Example: stickslip generate a2l pid --variable parameters=axis_parameters --single")]
    A2l(A2lCommand),
    /// An FMU, FMI 2.0 and 3.0 for co-simulation: the block in Simulink, OpenModelica, dSPACE, FMPy.
    #[command(after_help = "Example: stickslip generate fmu plant --out fmu\n\
                            Example: stickslip generate fmu bench --preset clm-soft --fmi 3 --prefix axis\n\
                            Example: stickslip generate fmu plant --xcp 5556 --out fmu\n\
                            Example: stickslip generate fmu position_controller --out fmu\n\
                            Example: stickslip generate fmu friction --out fmu")]
    Fmu(FmuCommand),
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

/// Which block, with which numbers.
#[derive(Args)]
struct FmuCommand {
    /// The block: `plant` is the machine, `bench` machine and software, `tick` the software, `position_controller` the
    /// controller of the preset; `stickslip generate --list` names them all.
    name: String,
    /// Where numbers and choices come from: a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Change a value of the preset.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// The version of the standard: 2 or 3; both without it.
    #[arg(long, value_name = "2|3", value_parser = clap::value_parser!(u32).range(2..=3))]
    fmi: Option<u32>,
    /// What it is called; the block's name without it.
    #[arg(long, value_name = "WORD")]
    prefix: Option<String>,
    /// Serve an XCP master (CANape, INCA, pyxcp) from within the FMU, as FMI-LS-XCP describes it, with its A2L [at
    /// 127.0.0.1:5555 unless told otherwise; the importer may choose another place].
    #[arg(long, value_name = "[ADDRESS:]PORT", num_args = 0..=1, default_missing_value = PORT, value_parser = address)]
    xcp: Option<SocketAddr>,
    /// Folder for the FMU and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/generate")]
    out: PathBuf,
    #[command(flatten)]
    shown: Shown,
}

impl FmuCommand {
    fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let preset = source::preset(&self.preset, settings)?;
        output::create_folder(&self.out)?;
        let mut summary = Summary::new("generate");
        let mut told = Vec::new();
        for version in [Version::Two, Version::Three] {
            if self.fmi.is_some_and(|number| number != version.number()) {
                continue;
            }
            let fmu = generate::fmu(&self.name, &preset, version, self.prefix.as_deref(), self.xcp)?;
            let path = self.out.join(&fmu.file);
            output::write(&path, &fmu.bytes)?;
            summary.file(&fmu.file);
            if told.is_empty() {
                summary.result("generate.variables", fmu.variables as f64, "1");
                summary.result("generate.step", fmu.step, "s");
            }
            let library = match fmu.platform {
                Some(platform) => format!("with its library for {platform} and the sources"),
                None => "with the sources alone: no C compiler (CC, or cc) was found here".into(),
            };
            told.push(format!("{}: {} variables, {library}", path.display(), fmu.variables));
        }
        summary.write(&self.out)?;
        self.shown.show(out, &summary, |out| {
            for line in &told {
                writeln!(out, "{line}")?;
            }
            Ok(())
        })
    }
}

/// Of which bench, and where it is served.
#[derive(Args)]
struct A2lCommand {
    /// What is described: `bench` is the bench that is served, any other a block whose code is in your program;
    /// `stickslip generate --list` names them.
    name: String,
    /// Where numbers and choices come from: a preset, or a parameter file. Of a served bench only the rate, all presets have
    /// the same addresses.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Change a value of the preset.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    #[command(flatten)]
    xcp: XcpDoors,
    /// Of a block: the linked program, from which the addresses are read. Without it tools take them by SYMBOL_LINK.
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    /// Of a block: the variable that holds its parameters, state, input or output; PREFIX_parameters and so on without it.
    #[arg(long, value_name = "STRUCT=NAME", value_parser = variable)]
    variable: Vec<(usize, String)>,
    /// Of a block: its code computes in `float` instead of `double`.
    #[arg(long)]
    single: bool,
    /// Of a block: what its types and functions begin with; its name without it.
    #[arg(long, value_name = "WORD")]
    prefix: Option<String>,
    /// Folder for the file and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/generate")]
    out: PathBuf,
    #[command(flatten)]
    shown: Shown,
}

impl A2lCommand {
    fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        if self.name != "bench" {
            return self.of_block(out);
        }
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let layout = Layout::new(source::preset(&self.preset, settings)?.bench.tick_rate);
        let path = self.out.join("bench.a2l");
        output::create_folder(&self.out)?;
        output::write(&path, a2l::describe(&layout, self.xcp.doors_or_both()))?;
        let mut summary = Summary::new("generate");
        summary.result("generate.measurements", layout.measurements.len() as f64, "1");
        summary.result("generate.parameters", layout.parameters.len() as f64, "1");
        summary.file("bench.a2l");
        summary.write(&self.out)?;
        self.shown.show(out, &summary, |out| {
            let (measurements, parameters) = (layout.measurements.len(), layout.parameters.len());
            Ok(writeln!(
                out,
                "{}: {measurements} measurements, {parameters} parameters, {}",
                path.display(),
                layout.epk
            )?)
        })
    }
}

/// Which struct of a block a variable holds, and its name.
fn variable(text: &str) -> Result<(usize, String), String> {
    let found = text.split_once('=').and_then(|(group, name)| {
        let place = generate::STRUCTS.iter().position(|known| *known == group)?;
        (!name.is_empty()).then(|| (place, name.to_owned()))
    });
    found.ok_or_else(|| format!("write STRUCT=NAME, where STRUCT is one of {}", generate::STRUCTS.join(", ")))
}

impl A2lCommand {
    fn of_block(self, out: &mut dyn Write) -> Result<(), Failure> {
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let preset = source::preset(&self.preset, settings)?;
        let precision = if self.single { Precision::Single } else { Precision::Double };
        let mut variables = Variables { program: self.elf.as_deref(), ..Variables::default() };
        for (place, name) in self.variable {
            variables.names[place] = Some(name);
        }
        let prefix = self.prefix.as_deref();
        let made = generate::code_description(&self.name, &preset, precision, prefix, &variables)?;
        let file = format!("{}.a2l", prefix.unwrap_or(&self.name));
        let path = self.out.join(&file);
        output::create_folder(&self.out)?;
        output::write(&path, &made.text)?;
        let mut summary = Summary::new("generate");
        summary.result("generate.measurements", made.measurements as f64, "1");
        summary.result("generate.parameters", made.parameters as f64, "1");
        summary.file(&file);
        summary.write(&self.out)?;
        self.shown.show(out, &summary, |out| {
            let (measurements, parameters) = (made.measurements, made.parameters);
            writeln!(out, "{}: {measurements} measurements, {parameters} parameters", path.display())?;
            for (name, address) in &made.variables {
                writeln!(out, "{address:#010x}  {name}")?;
            }
            if self.elf.is_none() {
                writeln!(
                    out,
                    "These addresses are placeholders: give the linked program (--elf), or link by SYMBOL_LINK."
                )?;
            }
            Ok(())
        })
    }
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
            Some(Target::A2l(command)) => command.run(out),
            Some(Target::Fmu(command)) => command.run(out),
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
