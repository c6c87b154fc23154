//! From a block of the bench to C99 and its signal-flow diagram, with the numbers of a preset.
//!
//! [`blocks`] lists what there is; [`generate`] makes the files of one: header, source, self-test, example, page and
//! diagram. The C computes the bits of the Rust in the precision chosen. Choices of the preset (which friction model,
//! which controller) are made when the code is written; numbers stay open, as parameters with the preset's values.

mod catalogue;

use std::path::Path;

use stickslip_codegen::record::{self, Program, Recorded};
use stickslip_codegen::{c, diagram};
use stickslip_core::block::Block;

use crate::{Error, Preset, Summary, output};
use catalogue::Setup;
pub use catalogue::{Entry, blocks};

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

/// Files made of a block.
#[derive(Clone, Debug)]
pub struct Generated {
    /// Which block.
    pub block: &'static str,
    /// What types and functions begin with.
    pub prefix: String,
    /// Time step that the block was prepared for [s].
    pub step: f64,
    /// Name and text of each file.
    pub files: Vec<(String, String)>,
    /// What was recorded.
    pub program: Program,
}

/// Makes the files of the block called `name` with the numbers of a preset; `prefix` is what types and functions begin
/// with, the block's name unless given.
///
/// # Errors
/// A name that is none of [`blocks`], a prefix that C does not take; whatever the design of observer and current
/// control refuses, or a step that the virtual machine cannot take.
pub fn generate(
    name: &str,
    preset: &Preset<f64>,
    precision: Precision,
    prefix: Option<&str>,
) -> Result<Generated, Error> {
    let block = catalogue::find(name)?;
    let setup = Setup::new(preset)?;
    catalogue::make(block, &setup, &Request { block, prefix: prefix.unwrap_or(block), precision })
}

/// What is to be made.
struct Request<'a> {
    block: &'static str,
    prefix: &'a str,
    precision: Precision,
}

impl Request<'_> {
    /// The files of a block whose step is `step` [s].
    fn files<B>(&self, block: &B, step: f64) -> Result<Generated, Error>
    where
        B: Block<f64, Input: Default>,
        B::With<f32>: Block<f32, Input: Default>,
        B::With<f64>: Block<f64, Input: Default>,
        B::With<Recorded<f64>>: Block<Recorded<f64>, Input: Default>,
        B::With<Recorded<f32>>: Block<Recorded<f32>, Input: Default>,
    {
        let (program, project) = match self.precision {
            Precision::Double => (record::record::<B, f64>(block), c::project::<B, f64>(block, self.prefix, step)),
            Precision::Single => (record::record::<B, f32>(block), c::project::<B, f32>(block, self.prefix, step)),
        };
        let mut files = project?.files;
        files.push((format!("{DIAGRAM}/{}.json", self.prefix), diagram::json(&program, self.prefix)));
        let pages = diagram::pages(&program, self.prefix);
        files.extend(pages.into_iter().map(|(name, svg)| (format!("{DIAGRAM}/{name}"), svg)));
        Ok(Generated { block: self.block, prefix: self.prefix.into(), step, files, program })
    }
}

impl Generated {
    /// Writes the files and `summary.json` into a folder, which is created where it does not exist.
    ///
    /// # Errors
    /// [`Error::File`] where the system refuses.
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
