//! `stickslip generate`: C, FMU, A2L and diagrams of the blocks of the bench.

use std::io::Write;
use std::net::SocketAddr;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use stickslip::generate::{self, Precision, Variables, Version};
use stickslip::xcp::{Layout, a2l};
use stickslip::{Summary, output};

use super::xcp::{PORT, XcpDoors, address};
use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// Output to generate of a block.
#[derive(Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct Generate {
    /// List all blocks.
    #[arg(long)]
    list: bool,
    #[command(subcommand)]
    target: Option<Target>,
}

/// Kinds of output.
#[derive(Subcommand)]
enum Target {
    /// Generate C99 that computes the same bits: header, source, self-test, example, page, diagram.
    #[command(after_help = "Example: stickslip generate c velocity_observer --out observer\n\
                            Example: stickslip generate c tick --preset clm-soft --single --prefix axis")]
    C(CCommand),
    /// Generate an A2L (ASAP2 1.61) for CANape, INCA or similar tools: of a running bench with XCP, or of the generated
    /// code of a block in your program.
    #[command(after_help = "Example: stickslip generate a2l bench --out tools\n\
                            Example: stickslip generate a2l bench --set bench.tick_rate=10000 --xcp-udp 192.168.0.5:5555\n\
                            Example: stickslip generate a2l pid --variable parameters=axis_parameters --single")]
    A2l(A2lCommand),
    /// Generate an FMU (FMI 2.0 and 3.0, co-simulation) for Simulink, OpenModelica, dSPACE, FMPy.
    #[command(after_help = "Example: stickslip generate fmu plant --out fmu\n\
                            Example: stickslip generate fmu bench --preset clm-soft --fmi 3 --prefix axis\n\
                            Example: stickslip generate fmu plant --xcp 5556 --out fmu\n\
                            Example: stickslip generate fmu position_controller --out fmu\n\
                            Example: stickslip generate fmu friction --out fmu")]
    Fmu(FmuCommand),
}

/// Block, values and output.
#[derive(Args)]
struct CCommand {
    /// Name of the block; `stickslip generate --list` lists them.
    name: String,
    /// Source of values and variants: name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Change a value of the preset.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Compute in `float` instead of `double`.
    #[arg(long)]
    single: bool,
    /// Prefix of types and functions [default: name of the block].
    #[arg(long, value_name = "WORD")]
    prefix: Option<String>,
    /// Folder for the files and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/generate")]
    out: PathBuf,
    #[command(flatten)]
    shown: OutputOptions,
}

/// Block, values and output.
#[derive(Args)]
struct FmuCommand {
    /// Name of the block: `plant` is the machine, `bench` machine and software, `tick` the software, `position_controller`
    /// the controller of the preset; `stickslip generate --list` lists them all.
    name: String,
    /// Source of values and variants: name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Change a value of the preset.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Version of the standard: 2 or 3 [default: both].
    #[arg(long, value_name = "2|3", value_parser = clap::value_parser!(u32).range(2..=3))]
    fmi: Option<u32>,
    /// Name of the FMU [default: name of the block].
    #[arg(long, value_name = "WORD")]
    prefix: Option<String>,
    /// Serve an XCP master (CANape, INCA, pyxcp) from within the FMU, according to FMI-LS-XCP, with its A2L [default:
    /// 127.0.0.1:5555; the importer may choose another address].
    #[arg(long, value_name = "[ADDRESS:]PORT", num_args = 0..=1, default_missing_value = PORT, value_parser = address)]
    xcp: Option<SocketAddr>,
    /// Folder for the FMU and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/generate")]
    out: PathBuf,
    #[command(flatten)]
    shown: OutputOptions,
}

impl FmuCommand {
    fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let preset = source::preset(&self.preset, settings)?;
        output::create_folder(&self.out)?;
        let mut summary = Summary::new("generate");
        let mut lines = Vec::new();
        for version in [Version::Two, Version::Three] {
            if self.fmi.is_some_and(|number| number != version.number()) {
                continue;
            }
            let fmu = generate::fmu(&self.name, &preset, version, self.prefix.as_deref(), self.xcp)?;
            let path = self.out.join(&fmu.file);
            output::write(&path, &fmu.bytes)?;
            summary.file(&fmu.file);
            if lines.is_empty() {
                summary.result("generate.variables", fmu.variables as f64, "1");
                summary.result("generate.step", fmu.step, "s");
            }
            let library = match (fmu.platform, fmu.glibc) {
                (Some(platform), Some(glibc)) => {
                    format!("with its library for {platform} (glibc {glibc} or later) and the sources")
                }
                (Some(platform), None) => format!("with its library for {platform} and the sources"),
                (None, _) => "with the sources only: no C compiler (CC, or cc) was found on this computer".into(),
            };
            lines.push(format!("{}: {} variables, {library}", path.display(), fmu.variables));
            lines.extend(fmu.glibc.and_then(generate::Glibc::note).map(|note| format!("Note: {note}")));
        }
        summary.write(&self.out)?;
        self.shown.show(out, &summary, |out| {
            for line in &lines {
                writeln!(out, "{line}")?;
            }
            Ok(())
        })
    }
}

/// Bench or block of a description, and its addresses.
#[derive(Args)]
struct A2lCommand {
    /// Subject of the description: `bench` is the running bench, any other name a block whose code is in your program;
    /// `stickslip generate --list` lists them.
    name: String,
    /// Source of values and variants: name of a preset, or a parameter file. For a running bench only the rate matters:
    /// all presets have the same addresses.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Change a value of the preset.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    #[command(flatten)]
    xcp: XcpDoors,
    /// For a block: linked program with the addresses [default: placeholders with SYMBOL_LINK].
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    /// For a block: name of the variable for parameters, state, input or output [default: PREFIX_parameters and so on].
    #[arg(long, value_name = "STRUCT=NAME", value_parser = variable)]
    variable: Vec<(usize, String)>,
    /// For a block: its code computes in `float` instead of `double`.
    #[arg(long)]
    single: bool,
    /// For a block: prefix of types and functions [default: name of the block].
    #[arg(long, value_name = "WORD")]
    prefix: Option<String>,
    /// Folder for the file and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/generate")]
    out: PathBuf,
    #[command(flatten)]
    shown: OutputOptions,
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

/// The index of the struct that a variable contains, and the name of the variable.
fn variable(text: &str) -> Result<(usize, String), String> {
    let variable = text.split_once('=').and_then(|(group, name)| {
        let place = generate::STRUCTS.iter().position(|name| *name == group)?;
        (!name.is_empty()).then(|| (place, name.to_owned()))
    });
    variable.ok_or_else(|| format!("write STRUCT=NAME, where STRUCT is one of {}", generate::STRUCTS.join(", ")))
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
        let description = generate::code_description(&self.name, &preset, precision, prefix, &variables)?;
        let file = format!("{}.a2l", prefix.unwrap_or(&self.name));
        let path = self.out.join(&file);
        output::create_folder(&self.out)?;
        output::write(&path, &description.text)?;
        let mut summary = Summary::new("generate");
        summary.result("generate.measurements", description.measurements as f64, "1");
        summary.result("generate.parameters", description.parameters as f64, "1");
        summary.file(&file);
        summary.write(&self.out)?;
        self.shown.show(out, &summary, |out| {
            let (measurements, parameters) = (description.measurements, description.parameters);
            writeln!(out, "{}: {measurements} measurements, {parameters} parameters", path.display())?;
            for (name, address) in &description.variables {
                writeln!(out, "{address:#010x}  {name}")?;
            }
            if self.elf.is_none() {
                writeln!(
                    out,
                    "These addresses are placeholders: name the linked program with --elf, or use SYMBOL_LINK in the tool."
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
