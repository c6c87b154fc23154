//! From a block of the bench to C99 and its signal-flow diagram, with the numbers of a preset.
//!
//! [`blocks`] lists the blocks; [`generate`] makes the files of one: header, source, self-test, example, page and
//! diagram; [`fmu()`] makes an FMU of it for simulation tools; [`module()`] takes a controller that was recorded
//! elsewhere. The C code computes the same bits as the Rust code in the chosen precision. Choices of the preset (which
//! friction model, which controller) are fixed when the code is written; numbers stay variable, as parameters with the
//! preset's values.
//!
//! ```
//! use stickslip_base::{Preset, parameters};
//! use stickslip_generate::{Precision, generate};
//!
//! let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
//! let generated = generate("pid", &preset, Precision::Single, Some("axis"))?;
//! assert!(generated.files.iter().any(|(name, _)| name == "axis.c"));
//! # Ok::<(), stickslip_base::Error>(())
//! ```
#![forbid(unsafe_code)]

mod a2l;
pub mod archive;
mod asap2;
mod catalogue;
mod error;
mod fmu;
mod fmu_description;
mod glibc;
mod library;
mod module;
mod own;
pub mod xcp;

use std::path::Path;

use stickslip_codegen::c::{Project, Ready};
use stickslip_codegen::diagram;
use stickslip_codegen::record::Program;
use stickslip_core::tick::Tick;

pub use a2l::{CodeDescription, STRUCTS, Variables, code_description};
use catalogue::Setup;
pub use catalogue::{Entry, blocks};
pub use error::GenerateError;
pub use fmu::{Fmu, Version, fmu};
pub use glibc::Glibc;
pub use module::{Module, friction_module_of, module, module_of};
pub use own::{Own, own, own_friction};
use stickslip_base::{Error, Preset, Summary, output};

/// The software of the bench among [`blocks`].
pub const SOFTWARE: &str = "tick";

/// Folder of the signal-flow diagram within that of the code.
const DIAGRAM: &str = "diagram";

/// The arithmetic of the generated code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// `double`, the bits of `f64`.
    #[default]
    Double,
    /// `float`, the bits of `f32`.
    Single,
}

/// Generated files of a block.
#[derive(Clone, Debug)]
pub struct Generated {
    /// Name of the block.
    pub block: &'static str,
    /// Prefix of types and functions.
    pub prefix: String,
    /// Time step of the block [s].
    pub step: f64,
    /// Name and text of each file.
    pub files: Vec<(String, String)>,
    /// The recorded program.
    pub program: Program,
}

/// Makes the files of the block called `name`, its signal-flow diagram among them, with the numbers of a preset;
/// `prefix` is the prefix of types and functions, default: the name of the block.
///
/// # Errors
/// A name that is not in [`blocks`], a prefix that is not valid in C; errors of the design of observer and current
/// control, or a step that is too long for the virtual machine.
pub fn generate(
    name: &str,
    preset: &Preset<f64>,
    precision: Precision,
    prefix: Option<&str>,
) -> Result<Generated, Error> {
    code(name, preset, precision, prefix).map(Generated::with_diagram)
}

/// As [`generate`], without the diagram: drawing it takes most of the time.
///
/// # Errors
/// As [`generate`].
pub(crate) fn code(
    name: &str,
    preset: &Preset<f64>,
    precision: Precision,
    prefix: Option<&str>,
) -> Result<Generated, Error> {
    let block = catalogue::find(name)?;
    let setup = Setup::new(preset)?;
    catalogue::make(block, &setup, &Request { block, prefix: prefix.unwrap_or(block), precision })
}

/// The files of the software of a running bench, with its active law; `step` is its tick [s].
pub fn software(tick: &Tick<f64>, step: f64) -> Result<Generated, Error> {
    Request { block: SOFTWARE, prefix: SOFTWARE, precision: Precision::Double }
        .files(tick, step)
        .map(Generated::with_diagram)
}

/// A request for code.
struct Request<'a> {
    block: &'static str,
    prefix: &'a str,
    precision: Precision,
}

impl Request<'_> {
    /// The files of a block whose step is `step` [s].
    fn files(&self, block: &dyn Ready, step: f64) -> Result<Generated, Error> {
        let project = match self.precision {
            Precision::Double => block.double(self.prefix, step),
            Precision::Single => block.single(self.prefix, step),
        }
        .map_err(GenerateError::NoIdentifier)?;
        Ok(Generated::new(project, self.block, self.prefix, step))
    }
}

impl Generated {
    /// The files of a project, for steps of `step` [s].
    fn new(project: Project, block: &'static str, prefix: &str, step: f64) -> Self {
        Generated { block, prefix: prefix.into(), step, files: project.files, program: project.program }
    }

    /// Adds the signal-flow diagram.
    fn with_diagram(mut self) -> Self {
        let (program, prefix) = (&self.program, &self.prefix);
        self.files.push((format!("{DIAGRAM}/{prefix}.json"), diagram::json(program, prefix)));
        let pages = diagram::pages(program, prefix);
        self.files.extend(pages.into_iter().map(|(name, svg)| (format!("{DIAGRAM}/{name}"), svg)));
        self
    }

    /// The text of a file.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.files.iter().find(|file| file.0 == name).map(|file| file.1.as_str())
    }

    /// Writes the files and `summary.json` into a folder, which is created if it does not exist.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn write(&self, folder: &Path) -> Result<Summary, Error> {
        output::create_folder(&folder.join(DIAGRAM))?;
        for (name, text) in &self.files {
            output::write(&folder.join(name), text)?;
        }
        let summary = self.summary();
        summary.write(folder)?;
        Ok(summary)
    }

    /// Sizes and files.
    fn summary(&self) -> Summary {
        let mut summary = Summary::new("generate");
        if let Some(top) = self.program.steps.last() {
            for (name, tree) in [
                ("parameters", &top.parameters),
                ("states", &top.state),
                ("inputs", &top.input),
                ("outputs", &top.output),
            ] {
                summary.result(&format!("generate.{name}"), tree.numbers() as f64, "1");
            }
        }
        let operations: usize = self.program.steps.iter().map(|step| step.graph.nodes.len()).sum();
        summary.result("generate.functions", self.program.steps.len() as f64, "1");
        summary.result("generate.operations", operations as f64, "1");
        summary.result("generate.step", self.step, "s");
        for (name, text) in &self.files {
            let lines = text.lines().count() as f64;
            if *name == format!("{}.h", self.prefix) {
                summary.result("generate.header_lines", lines, "1");
            } else if *name == format!("{}.c", self.prefix) {
                summary.result("generate.source_lines", lines, "1");
            }
            summary.file(name);
        }
        summary
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::parameters::presets;

    fn generated(name: &str) -> Generated {
        let preset = presets::find("clm-bench").and_then(|source| source.read()).expect("a preset of the product");
        generate(name, &preset, Precision::Double, None).expect("a block of the catalogue")
    }

    #[test]
    fn the_size_of_every_block_is_bounded() {
        let preset = presets::find("clm-bench").and_then(|source| source.read()).expect("a preset of the product");
        let sizes = |name: &str| {
            let summary = code(name, &preset, Precision::Double, None).expect("a block of the catalogue").summary();
            let size = |of: &str| summary.value(&format!("generate.{of}")).expect("each summary has it");
            let numbers: f64 = ["parameters", "states", "inputs", "outputs"].into_iter().map(size).sum();
            (size("operations"), numbers, size("source_lines"))
        };
        for Entry { name, .. } in blocks() {
            let (operations, numbers, lines) = sizes(name);
            // One line per operation, two per number (load and store, or set and check), and a constant part.
            let budget = 100.0 + 1.2 * operations + 2.0 * numbers;
            assert!(lines <= budget, "{name}: {lines} lines for {operations} operations and {numbers} numbers");
        }
        // Inner blocks are called, not copied: the size of the whole is that of its parts and of the wires between
        // them.
        let [(bench, numbers, _), (tick, ..), (plant, ..)] = ["bench", "tick", "plant"].map(sizes);
        assert!(bench <= tick + plant + 2.0 * numbers, "{bench} operations of {tick} and {plant}");
    }

    #[test]
    fn numbers_and_choices_come_from_the_preset() {
        let mut preset: Preset<f64> = presets::find("clm-bench").and_then(|source| source.read()).expect("a preset");
        preset.bench.desired.stribeck_velocity = 1.375;
        let text = |precision, prefix| {
            let generated =
                generate("difference_torque", &preset, precision, prefix).expect("a block of the catalogue");
            generated.files.into_iter().find(|file| file.0.ends_with("law.c")).expect("its source").1
        };
        let (double, single) = (text(Precision::Double, Some("law")), text(Precision::Single, Some("law")));
        assert!(double.contains("p->desired.stribeck_velocity = 1.375;"));
        assert!(single.contains("p->desired.stribeck_velocity = 1.375f;"));
        let refused = generate("difference_torque", &preset, Precision::Double, Some("double"));
        let message = refused.map(drop).expect_err("it is a keyword of C").to_string();
        assert!(message.contains("\"double\"") && message.contains("--prefix"), "{message}");
    }

    #[test]
    fn a_folder_that_cannot_be_created_is_reported() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("taken");
        std::fs::write(&file, "").expect("a small file");
        let refused = generated("pid").write(&file).expect_err("a file is not a folder");
        assert!(refused.to_string().contains("taken"), "{refused}");
    }
}
