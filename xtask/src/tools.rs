//! What the checks need besides Rust and a C compiler's linker: found, else installed, else said.

use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::{Command, Stdio};

/// The bare-metal target that stands for "runs without an operating system": a Cortex-M4F or M7.
pub(crate) const BARE_TARGET: &str = "thumbv7em-none-eabihf";

/// The target that stands for Windows. Its programs are checked, not linked: no linker is needed.
pub(crate) const WINDOWS_TARGET: &str = "x86_64-pc-windows-gnu";

/// A program and the Debian package that holds it.
struct Program {
    command: &'static str,
    package: &'static str,
    /// What is not checked without it.
    purpose: &'static str,
}

const PROGRAMS: [Program; 3] = [
    Program { command: "gcc", package: "gcc", purpose: "compiling the generated C" },
    Program { command: "objdump", package: "binutils", purpose: "looking at machine code" },
    Program { command: "python3", package: "python3", purpose: "running the scripts of reference numbers" },
];

/// Which parts of the tool chain there are.
pub(crate) struct Tools {
    pub(crate) rustfmt: bool,
    pub(crate) clippy: bool,
    pub(crate) bare_target: bool,
    pub(crate) windows_target: bool,
    /// A line for each thing that could not be had.
    pub(crate) missing: Vec<String>,
}

/// Finds or installs what the checks need.
pub(crate) fn ensure() -> Tools {
    let absent = || PROGRAMS.iter().filter(|program| !runs(program.command, &["--version"]));
    let packages: Vec<&str> = absent().map(|program| program.package).collect();
    if !packages.is_empty() && may_install() {
        install(&packages);
    }
    let component = |name: &str, command: &str| {
        runs("cargo", &[command, "--version"])
            || (runs("rustup", &["component", "add", name]) && runs("cargo", &[command, "--version"]))
    };
    let rustfmt = component("rustfmt", "fmt");
    let clippy = component("clippy", "clippy");
    let bare_target = target(BARE_TARGET);
    let windows_target = target(WINDOWS_TARGET);

    let mut missing: Vec<String> = absent().map(sentence).collect();
    if !rustfmt {
        missing.push("rustfmt is missing (`rustup component add rustfmt`)".into());
    }
    if !clippy {
        missing.push("clippy is missing (`rustup component add clippy`)".into());
    }
    if !bare_target {
        missing.push(format!("target {BARE_TARGET} is missing (`rustup target add {BARE_TARGET}`)"));
    }
    if !windows_target {
        missing.push(format!("target {WINDOWS_TARGET} is missing (`rustup target add {WINDOWS_TARGET}`)"));
    }
    Tools { rustfmt, clippy, bare_target, windows_target, missing }
}

fn sentence(program: &Program) -> String {
    let Program { command, package, purpose } = program;
    format!("{command} is missing, needed for {purpose} (on Debian `apt-get install {package}`)")
}

/// Whether a command exists and succeeds.
fn runs(command: &str, arguments: &[&str]) -> bool {
    Command::new(command)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// Only root on Debian and its kin gets packages installed; anybody else gets a sentence.
fn may_install() -> bool {
    let is_root = std::fs::metadata("/proc/self").is_ok_and(|process| process.uid() == 0);
    is_root && runs("apt-get", &["--version"])
}

fn install(packages: &[&str]) {
    println!("installing {}", packages.join(", "));
    let apt = |arguments: &[&str]| {
        let mut command = Command::new("apt-get");
        // What fails here is found missing by the caller, who says so.
        let _ = command.env("DEBIAN_FRONTEND", "noninteractive").args(arguments).stdout(Stdio::null()).status();
    };
    apt(&["update"]);
    apt(&[&["install", "-y", "--no-install-recommends"], packages].concat());
}

/// Whether the standard library of a target is there, or can be fetched within two minutes.
pub(crate) fn target(target: &str) -> bool {
    // A download that hangs is as good as none, and must not hang a test.
    has_target(target) || (runs("timeout", &["120", "rustup", "target", "add", target]) && has_target(target))
}

fn has_target(target: &str) -> bool {
    let library = Command::new("rustc").args(["--print", "target-libdir", "--target", target]).output();
    library.is_ok_and(|path| Path::new(String::from_utf8_lossy(&path.stdout).trim()).is_dir())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_that_does_not_exist_does_not_run() {
        assert!(runs("cargo", &["--version"]));
        assert!(!runs("cargo", &["no-such-subcommand"]));
        assert!(!runs("no-such-command", &[]));
    }

    #[test]
    fn a_target_is_there_or_not() {
        // The one that this test was built for, and one that nobody makes.
        let output = Command::new("rustc").args(["--print", "host-tuple"]).output().expect("rustc runs");
        assert!(has_target(String::from_utf8_lossy(&output.stdout).trim()));
        assert!(!has_target("z80-unknown-cpm"));
    }

    #[test]
    fn a_missing_program_is_named_with_its_purpose_and_remedy() {
        let gcc = sentence(&PROGRAMS[0]);
        assert_eq!(gcc, "gcc is missing, needed for compiling the generated C (on Debian `apt-get install gcc`)");
    }
}
