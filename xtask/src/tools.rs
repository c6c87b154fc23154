//! Tools besides Rust that the checks need: found, otherwise installed, otherwise reported as missing.

use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::test::Part;

/// The target without an operating system: a Cortex-M4F or M7.
pub(crate) const BARE_TARGET: &str = "thumbv7em-none-eabihf";

/// The target for Windows. Programs are checked, not linked; their C is compiled.
pub(crate) const WINDOWS_TARGET: &str = "x86_64-pc-windows-gnu";
const WINDOWS_COMPILER: &str = "x86_64-w64-mingw32-gcc";
const MUSL_COMPILER: &str = "musl-gcc";

/// A program, and the Debian packages that contain it and its libraries.
struct Program {
    command: &'static str,
    /// A line of shell that succeeds if the program works with its headers and libraries.
    probe: &'static str,
    packages: &'static [&'static str],
    /// The check that needs it.
    purpose: &'static str,
    parts: &'static [Part],
}

const PROGRAMS: [Program; 11] = [
    Program {
        command: "gcc",
        probe: "echo '#include <math.h>' | gcc -E -",
        packages: &["gcc", "libc6-dev"],
        purpose: "compiling the generated C",
        parts: &Part::ALL,
    },
    Program {
        command: "clang",
        probe: "echo 'int main(void) { return 0; }' | clang -fsanitize=address,undefined -x c -o /dev/null -",
        // Names without a version: each release of Debian has its own version.
        packages: &["clang", "libclang-rt-dev", "libc6-dev"],
        purpose: "compiling the generated C, a second time and with sanitizers",
        parts: &[Part::Rust, Part::Guide],
    },
    Program {
        command: "cppcheck",
        probe: "f=$(mktemp --suffix=.c) && cppcheck --addon=misra $f; r=$?; rm -f $f*; exit $r",
        packages: &["cppcheck", "python3"],
        purpose: "checking the generated C against MISRA C",
        parts: &[Part::Rust],
    },
    Program {
        command: "arm-none-eabi-gcc",
        probe: "echo '#include <stdio.h>' | arm-none-eabi-gcc --specs=rdimon.specs -E -",
        packages: &["gcc-arm-none-eabi", "libnewlib-arm-none-eabi"],
        purpose: "compiling the generated C for a Cortex-M",
        parts: &[Part::Rust],
    },
    Program {
        command: "qemu-system-arm",
        probe: "qemu-system-arm -M mps2-an500 -cpu help",
        packages: &["qemu-system-arm"],
        purpose: "running the generated C on a Cortex-M",
        parts: &[Part::Rust],
    },
    Program {
        command: "objdump",
        probe: "objdump --version",
        packages: &["binutils"],
        purpose: "reading machine code",
        parts: &[Part::Rust],
    },
    Program {
        command: WINDOWS_COMPILER,
        probe: "echo '#include <windows.h>' | x86_64-w64-mingw32-gcc -E -",
        packages: &["gcc-mingw-w64-x86-64"],
        purpose: "compiling C for Windows",
        parts: &[Part::Rust],
    },
    Program {
        command: MUSL_COMPILER,
        probe: "echo '#include <math.h>' | musl-gcc -E -",
        packages: &["musl-tools"],
        purpose: "compiling C for a statically linked program",
        parts: &[Part::Rust],
    },
    Program {
        command: "python3",
        probe: "python3 --version",
        packages: &["python3"],
        purpose: "running the scripts of reference values",
        parts: &[Part::Rust, Part::Python, Part::Guide],
    },
    Program {
        command: "node",
        probe: "node -e 'process.exit(Number(process.versions.node.split(`.`)[0]) >= 20 ? 0 : 1)' && npm --version",
        packages: &["nodejs", "npm"],
        purpose: "building the page",
        parts: &Part::ALL,
    },
    Program {
        command: "chromium",
        probe: "${CHROMIUM:-chromium} --version",
        packages: &["chromium"],
        purpose: "testing the page in a browser",
        parts: &[Part::Page],
    },
];

/// Available parts of the tool chain.
pub(crate) struct Tools {
    pub(crate) rustfmt: bool,
    pub(crate) clippy: bool,
    pub(crate) bare_target: bool,
    pub(crate) windows_target: bool,
    /// A line for each missing tool.
    pub(crate) missing: Vec<String>,
}

/// Finds or installs the tools for some parts of the checks.
pub(crate) fn ensure(parts: &[Part]) -> Tools {
    let needed = |program: &&Program| program.parts.iter().any(|part| parts.contains(part));
    let absent = || -> Vec<&Program> {
        PROGRAMS.iter().filter(needed).filter(|program| !runs("sh", &["-c", program.probe])).collect()
    };
    let packages: Vec<_> = absent().iter().flat_map(|program| program.packages).collect();
    if !packages.is_empty() && may_install() {
        install(&packages);
    }
    let rust = parts.contains(&Part::Rust);
    let component = |name: &str, command: &str| {
        runs("cargo", &[command, "--version"])
            || (runs("rustup", &["component", "add", name]) && runs("cargo", &[command, "--version"]))
    };
    let rustfmt = rust && component("rustfmt", "fmt");
    let clippy = rust && component("clippy", "clippy");
    let bare_target = rust && target(BARE_TARGET);
    let windows_target = rust && target(WINDOWS_TARGET) && runs(WINDOWS_COMPILER, &["--version"]);

    let mut missing: Vec<String> = absent().into_iter().map(sentence).collect();
    if rust && !rustfmt {
        missing.push("rustfmt is missing (`rustup component add rustfmt`)".into());
    }
    if rust && !clippy {
        missing.push("clippy is missing (`rustup component add clippy`)".into());
    }
    if rust && !bare_target {
        missing.push(format!("target {BARE_TARGET} is missing (`rustup target add {BARE_TARGET}`)"));
    }
    if rust && !windows_target {
        let both = format!("`rustup target add {WINDOWS_TARGET}`, and {WINDOWS_COMPILER}");
        missing.push(format!("target {WINDOWS_TARGET} is missing ({both})"));
    }
    Tools { rustfmt, clippy, bare_target, windows_target, missing }
}

fn sentence(program: &Program) -> String {
    let Program { command, packages, purpose, .. } = program;
    format!("{command} is missing, needed for {purpose} (on Debian `apt-get install {}`)", packages.join(" "))
}

/// Whether a program can be started.
pub(crate) fn works(command: &str) -> bool {
    runs(command, &["--version"])
}

/// Whether a command exists and succeeds.
pub(crate) fn runs(command: &str, arguments: &[&str]) -> bool {
    Command::new(command)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// Packages are installed by root on Debian and its derivatives only.
fn may_install() -> bool {
    let is_root = std::fs::metadata("/proc/self").is_ok_and(|process| process.uid() == 0);
    is_root && runs("apt-get", &["--version"])
}

fn install(packages: &[&&str]) {
    let apt = |arguments: &[&str]| {
        let mut command = Command::new("apt-get");
        // The caller probes the programs again and reports those that are missing.
        let _ = command.env("DEBIAN_FRONTEND", "noninteractive").args(arguments).stdout(Stdio::null()).status();
    };
    apt(&["update"]);
    // A name that is unknown to this release of Debian would prevent the installation of all.
    let available = packages.iter().map(|package| **package).filter(|package| runs("apt-cache", &["show", package]));
    let available: Vec<&str> = available.collect();
    println!("installing {}", available.join(", "));
    apt(&[&["install", "-y", "--no-install-recommends"], &available[..]].concat());
}

/// Whether C can be compiled for linking with musl.
pub(crate) fn musl_compiler() -> bool {
    runs(MUSL_COMPILER, &["--version"])
}

/// Whether the standard library of a target is installed or can be downloaded within two minutes.
pub(crate) fn target(target: &str) -> bool {
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
    fn an_installed_target_is_found_and_an_unknown_one_is_not() {
        let output = Command::new("rustc").args(["--print", "host-tuple"]).output().expect("rustc runs");
        assert!(has_target(String::from_utf8_lossy(&output.stdout).trim()));
        assert!(!has_target("z80-unknown-cpm"));
    }

    #[test]
    fn a_missing_program_is_named_with_its_purpose_and_remedy() {
        let gcc = sentence(&PROGRAMS[0]);
        let expected =
            "gcc is missing, needed for compiling the generated C (on Debian `apt-get install gcc libc6-dev`)";
        assert_eq!(gcc, expected);
    }

    #[test]
    fn a_probe_fails_when_a_header_is_missing() {
        let gcc = PROGRAMS[0].probe;
        assert!(runs("sh", &["-c", gcc]));
        assert!(!runs("sh", &["-c", &gcc.replace("math.h", "no_such_header.h")]));
    }
}
