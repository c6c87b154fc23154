//! A block as an FMU, for simulation in other tools: the FMU of `stickslip_codegen::fmu` with its library.

use std::net::SocketAddr;

use stickslip_codegen::c::Project;
pub use stickslip_codegen::fmu::Version;
use stickslip_codegen::fmu::{self, Service};

use super::archive::archive;
use super::fmu_description::fmu_description;
use super::glibc::Glibc;
use super::library::{self, compiler};
use super::{Precision, code};
use crate::xcp::cycle_time;
use stickslip_base::{Error, Preset};

/// An FMU.
#[derive(Clone, Debug)]
pub struct Fmu {
    /// Its file: `NAME-fmi2.fmu`.
    pub file: String,
    /// Contents of the file.
    pub bytes: Vec<u8>,
    /// Folder of the library within, named after the platform as in the standard; `None` without a library: then only
    /// tools that compile its sources can use the FMU.
    pub platform: Option<&'static str>,
    /// The oldest GNU C library with which the library loads; `None` without it.
    pub glibc: Option<Glibc>,
    /// Variables of all kinds.
    pub variables: usize,
    /// Step size [s].
    pub step: f64,
}

/// Makes the FMU of the block called `name` with the numbers of a preset; `prefix` is its name, default: that of the
/// block. The library is compiled for this machine by `$CC`, or `cc`. With an address it serves XCP there, and states
/// it by FMI-LS-XCP.
///
/// # Errors
/// As [`generate`](super::generate()); [`GenerateError::Compiler`](crate::GenerateError::Compiler) if the compiler
/// refuses the code; [`Error::File`].
pub fn fmu(
    name: &str,
    preset: &Preset<f64>,
    version: Version,
    prefix: Option<&str>,
    xcp: Option<SocketAddr>,
) -> Result<Fmu, Error> {
    let code = code(name, preset, Precision::Double, prefix)?;
    fmu_of(&Project { files: code.files, program: code.program }, &code.prefix, code.step, version, xcp)
}

/// Makes the FMU of a project in `double`, called `name`, with steps of `step` [s].
///
/// # Errors
/// [`GenerateError::Compiler`](crate::GenerateError::Compiler) if the compiler refuses the code; [`Error::File`].
pub(super) fn fmu_of(
    project: &Project,
    name: &str,
    step: f64,
    version: Version,
    xcp: Option<SocketAddr>,
) -> Result<Fmu, Error> {
    let service = xcp.map(|address| Service {
        address: address.ip(),
        port: address.port(),
        epk: format!("stickslip {} {name}", env!("CARGO_PKG_VERSION")),
        cycle: cycle_time(1.0 / step),
    });
    let mut fmu = fmu::fmu(project, name, step, version, service.as_ref());
    let library = library(&fmu, service.is_some())?;
    if let Some(service) = &service {
        // Addresses are the same on all platforms: sources and libraries share the description.
        let text = fmu_description(project, name, service);
        for folder in [None, version.platform().map(|it| it.0)].into_iter().take(1 + usize::from(library.is_some())) {
            let place = folder.map_or_else(|| fmu::FOLDER.into(), |folder| format!("{}/{folder}", fmu::FOLDER));
            fmu.files.push((format!("{place}/{name}.a2l"), text.clone()));
        }
    }
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
        glibc: library.as_ref().and_then(|library| Glibc::needed_by(&library.bytes)),
        variables: top.map_or(0, numbers) + if service.is_some() { Service::VARIABLES } else { 0 },
        step,
    })
}

/// A compiled library.
struct Library {
    /// Path within the FMU.
    path: String,
    platform: &'static str,
    bytes: Vec<u8>,
}

/// The library of an FMU; `None` on a machine without a name in the standard, or without a C compiler.
fn library(fmu: &fmu::Fmu, threads: bool) -> Result<Option<Library>, Error> {
    let Some((platform, ending)) = fmu.version.platform() else { return Ok(None) };
    if !compiler().is_there() {
        return Ok(None);
    }
    let name = format!("{}.{ending}", fmu.name);
    let bytes = library::compile(&fmu.files, &fmu.sources, &name, threads)?;
    Ok(Some(Library { path: format!("binaries/{platform}/{name}"), platform, bytes }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    fn libraries_load_on_early_systems_with_xcp_and_without() {
        let preset = stickslip_base::parameters::presets::find("clm-bench").and_then(|preset| preset.read());
        let preset = preset.expect("a preset of the crate");
        for xcp in [None, "127.0.0.1:5555".parse().ok()] {
            let fmu = fmu("pid", &preset, Version::Three, None, xcp).expect("a C compiler");
            assert!(fmu.glibc.is_some_and(|glibc| glibc <= Glibc::EARLY), "{xcp:?}: {:?}", fmu.glibc);
        }
    }
}
