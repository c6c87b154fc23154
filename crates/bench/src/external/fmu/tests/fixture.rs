//! An FMU in the style of another tool: its description, its compiled library, and their archive.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use stickslip_codegen::fmu::Version;
use zip::write::{SimpleFileOptions, ZipWriter};

pub(crate) const MAP: [(&str, &str); 4] = [
    ("measured_angle", "Encoder.phi"),
    ("reference_position", "Command.phi[1]"),
    ("reference_velocity", "Command.w"),
    ("torque", "Motor.'tau (out)'"),
];

pub(crate) fn map(pairs: &[(&str, &str)]) -> Vec<(String, String)> {
    pairs.iter().map(|(signal, variable)| ((*signal).into(), (*variable).into())).collect()
}

/// The archive of these files.
pub(crate) fn packed(folder: &Path, name: &str, files: &[(&str, &[u8])]) -> PathBuf {
    let path = folder.join(name);
    let mut archive = ZipWriter::new(fs::File::create(&path).expect("the folder takes files"));
    for (name, contents) in files {
        archive.start_file(*name, SimpleFileOptions::default()).expect("the archive takes a file");
        archive.write_all(contents).expect("the archive takes its contents");
    }
    archive.finish().expect("the archive ends");
    path
}

/// The description of a servo with this co-simulation element.
pub(crate) fn description(version: u32, simulation: &str) -> String {
    let text = if version == 2 { include_str!("servo-2.xml") } else { include_str!("servo-3.xml") };
    text.replace("{simulation}", simulation)
}

pub(crate) const SIMULATION: &str = "<CoSimulation modelIdentifier=\"servo\"/>";

/// Path of the library of this computer in the archive.
pub(crate) fn library_path(version: u32) -> String {
    let version = if version == 2 { Version::Two } else { Version::Three };
    let (platform, ending) = version.platform().expect("a machine that the standard knows");
    format!("binaries/{platform}/servo.{ending}")
}

/// `servo.c` as an FMU of a version, with a fault.
pub(crate) fn servo(folder: &Path, version: u32, fault: usize) -> PathBuf {
    let library = folder.join("servo.so");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bench/src/external/fmu/tests/servo.c");
    let mut compiler = Command::new("cc");
    compiler.args(["-O1", "-Wall", "-Werror", "-shared", "-fPIC"]).arg(format!("-DFMI={version}"));
    compiler.arg(format!("-DFAULT={fault}")).arg("-o").arg(&library).arg(source).arg("-lm");
    assert!(compiler.status().expect("there is a compiler").success());
    let binary = fs::read(&library).expect("it was written");
    let (described, path) = (description(version, SIMULATION), library_path(version));
    let files: [(&str, &[u8]); 3] =
        [("modelDescription.xml", described.as_bytes()), (&path, &binary), ("resources/table.txt", b"1 2")];
    packed(folder, "servo.fmu", &files)
}
