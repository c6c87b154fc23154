//! Commands that are run, and where cargo is run.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::suite::Counts;

/// Cargo in a folder, with its target folder.
pub(crate) struct Cargo {
    pub(crate) folder: PathBuf,
    pub(crate) target: PathBuf,
}

impl Cargo {
    /// Cargo in `folder` with the target folder of the repository at `root`: each dependency is built once for both.
    pub(crate) fn new(folder: &Path, root: &Path) -> Self {
        let target = std::env::var_os("CARGO_TARGET_DIR");
        let target = target.map_or_else(|| root.join("target"), |folder| root.join(folder));
        Self { folder: folder.to_path_buf(), target }
    }

    pub(crate) fn command<A: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = A>) -> Command {
        let mut command = Command::new("cargo");
        command.current_dir(&self.folder).env("CARGO_TARGET_DIR", &self.target).args(arguments);
        command
    }

    pub(crate) fn run<A: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = A>) -> Result<(), String> {
        run(&mut self.command(arguments))
    }

    /// Builds programs and libraries for the parts that start them. `--workspace` and the example, which needs the
    /// dependencies of tests, give the features that the tests of the workspace are built with: what either has
    /// built, the other takes.
    pub(crate) fn build(&self, targets: &[&str]) -> Result<(), String> {
        self.run([&["build", "--workspace", "--locked", "--quiet", "--example", STUB], targets].concat())
    }

    /// A program, an example or a library that [`Self::build`] has built.
    pub(crate) fn built(&self, name: &str) -> PathBuf {
        self.target.join("debug").join(name)
    }

    /// The program `stickslip`, once built.
    pub(crate) fn program(&self) -> PathBuf {
        self.built(&format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX))
    }
}

/// The program that users start.
pub(crate) const PROGRAM: &str = "stickslip";
/// The example of this package that prints the stub of the extension module.
pub(crate) const STUB: &str = "stub";

/// `Err` with the command unless it succeeds.
pub(crate) fn run(command: &mut Command) -> Result<(), String> {
    let status = command.status().map_err(|error| cannot_start(command, &error))?;
    if status.success() { Ok(()) } else { Err(format!("{} failed", line(command))) }
}

/// As [`run`], counting the tests in the output.
pub(crate) fn run_counting(command: &mut Command, counts: &mut Counts) -> Result<(), String> {
    let mut child = command.stdout(Stdio::piped()).spawn().map_err(|error| cannot_start(command, &error))?;
    let output = child.stdout.take().expect("the output is piped");
    for line in BufReader::new(output).lines() {
        let line = line.map_err(|error| format!("cannot read the output of the tests: {error}"))?;
        println!("{line}");
        counts.read(&line);
    }
    let status = child.wait().map_err(|error| cannot_start(command, &error))?;
    if status.success() { Ok(()) } else { Err(format!("{} failed", line(command))) }
}

/// The output of a command that must succeed.
pub(crate) fn output(command: &mut Command) -> Result<Vec<u8>, String> {
    let output = command.stderr(Stdio::inherit()).output().map_err(|error| cannot_start(command, &error))?;
    if output.status.success() { Ok(output.stdout) } else { Err(format!("{} failed", line(command))) }
}

/// The output of a command that prints JSON.
pub(crate) fn json(command: &mut Command) -> Result<Value, String> {
    serde_json::from_slice(&output(command)?).map_err(|error| format!("{}: {error}", line(command)))
}

fn cannot_start(command: &Command, error: &std::io::Error) -> String {
    format!("cannot start {}: {error}", line(command))
}

fn line(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_the_command_that_failed_or_is_missing() {
        let failed = run(Command::new("cargo").arg("no-such-subcommand").stderr(Stdio::null()));
        assert_eq!(failed, Err("cargo no-such-subcommand failed".into()));
        let missing = run(&mut Command::new("no-such-command")).expect_err("the command does not exist");
        assert!(missing.starts_with("cannot start no-such-command: "), "{missing}");
    }

    #[test]
    fn output_that_is_not_json_is_an_error() {
        assert!(json(Command::new("cargo").arg("--version")).is_err());
    }
}
