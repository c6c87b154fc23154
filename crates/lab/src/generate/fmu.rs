//! A block as one file that other tools simulate: the FMU of `stickslip_codegen::fmu` with its library.

use stickslip_codegen::c::Project;
use stickslip_codegen::fmu;
pub use stickslip_codegen::fmu::Version;

use super::archive::archive;
use super::library::{self, compiler};
use super::{Precision, generate};
use crate::{Error, Preset};

/// An FMU.
#[derive(Clone, Debug)]
pub struct Fmu {
    /// Its file: `NAME-fmi2.fmu`.
    pub file: String,
    /// What that contains.
    pub bytes: Vec<u8>,
    /// Folder of the library within, as the standard calls the platform; `None` if there is none: then it is of use to
    /// tools that compile its sources.
    pub platform: Option<&'static str>,
    /// Variables of all kinds.
    pub variables: usize,
    /// Step that it takes [s].
    pub step: f64,
}

/// Makes the FMU of the block called `name` with the numbers of a preset; `prefix` is what it is called, the block's name
/// unless given. The library is compiled for this machine by `$CC`, or `cc`.
///
/// # Errors
/// As [`generate`]; [`Error::Compiler`] where the compiler is there and refuses; [`Error::File`].
pub fn fmu(name: &str, preset: &Preset<f64>, version: Version, prefix: Option<&str>) -> Result<Fmu, Error> {
    let made = generate(name, preset, Precision::Double, prefix)?;
    fmu_of(&Project { files: made.files, program: made.program }, &made.prefix, made.step, version)
}

/// Makes the FMU of a project in `double`, called `name`, with steps of `step` [s].
///
/// # Errors
/// [`Error::Compiler`] where the compiler is there and refuses; [`Error::File`].
pub(super) fn fmu_of(project: &Project, name: &str, step: f64, version: Version) -> Result<Fmu, Error> {
    let fmu = fmu::fmu(project, name, step, version);
    let library = library(&fmu)?;
    let file = format!("{name}-fmi{}.fmu", version.number());
    let texts = fmu.files.iter().map(|(name, text)| (name.clone(), text.as_bytes()));
    let binary = library.iter().map(|library| (library.path.clone(), library.bytes.as_slice()));
    let top = project.program.steps.last();
    let numbers = |top: &stickslip_codegen::record::Step| {
        [&top.input, &top.output, &top.parameters, &top.state].map(|tree| tree.numbers()).into_iter().sum()
    };
    Ok(Fmu {
        bytes: archive(&file, texts.chain(binary))?,
        file,
        platform: library.as_ref().map(|library| library.platform),
        variables: top.map_or(0, numbers),
        step,
    })
}

/// What was compiled.
struct Library {
    /// Within the FMU.
    path: String,
    platform: &'static str,
    bytes: Vec<u8>,
}

/// The library of an FMU; none on a machine that the standard has no name for, or without a C compiler.
fn library(fmu: &fmu::Fmu) -> Result<Option<Library>, Error> {
    let Some((platform, ending)) = fmu.version.platform() else { return Ok(None) };
    if !compiler().is_there() {
        return Ok(None);
    }
    let name = format!("{}.{ending}", fmu.name);
    let bytes = library::compile(&fmu.files, &fmu.sources, &name)?;
    Ok(Some(Library { path: format!("binaries/{platform}/{name}"), platform, bytes }))
}
