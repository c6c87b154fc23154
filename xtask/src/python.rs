//! The part `python`: the Python package in a separate environment, as users install it.
//!
//! The compiled part is the one that the tests of the workspace are built with: `pip install .` would compile it again,
//! which takes minutes.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::JoinHandle;

use crate::budget::{PYTHON, PYTHON_BUILD};
use crate::command::{Cargo, PROGRAM, STUB, output, run, run_counting};
use crate::record::Reads;
use crate::suite::{Counts, Outcome};
use crate::test::Run;
use crate::{tools, tree};

/// Packages for the tests. Maturin reads `pyproject.toml`, as it does for `pip install .`.
const PACKAGES: [&str; 8] = [
    "maturin>=1.16,<2",
    "numpy",
    "pytest",
    "matplotlib",
    "xarray",
    "distributed>=2024.5,<2027",
    "mypy",
    "fmpy>=0.3.32,<0.4",
];
/// EtherCAT main devices for the tests of emulated drives, which are skipped where there is no wheel of them.
const MAIN_DEVICES: [&str; 3] = ["--only-binary=:all:", "pysoem>=1.1.12,<2", "kickcat>=2.5,<3"];
/// The extension module, its name within the package and of its stub.
const MODULE: &str = "_stickslip";
const SOURCES: &str = "python/stickslip";

/// An environment with the packages, or the reason why there is none.
type Prepared = JoinHandle<Result<Outcome, String>>;

/// Makes the environment in the target folder, while other stages run.
pub(crate) fn prepare(target: &Path) -> Prepared {
    let environment = environment(target);
    std::thread::spawn(move || {
        if !tools::runs("python3", &["-c", "import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 10))"]) {
            return Ok(Outcome::Skipped("Python 3.10 or newer with venv and pip is missing".into()));
        }
        let python = python(&environment);
        if !python.exists() {
            run(Command::new("python3").args(["-m", "venv"]).arg(&environment))?;
        }
        let outcome = install(&python, &PACKAGES).map_or(Outcome::Passed, Outcome::Skipped);
        if install(&python, &MAIN_DEVICES).is_some() {
            println!(
                "skipped: pip has no wheels of pysoem and kickcat, so the emulated drives were not operated by them"
            );
        }
        Ok(outcome)
    })
}

pub(crate) fn check(Run { suite, cargo, record, .. }: &mut Run, prepared: Prepared) {
    suite.stage(PYTHON_BUILD, |_| build(cargo).map(|()| Outcome::Passed));
    let inputs = record.inputs(Reads::All, [&cargo.program(), &extension(cargo)]);
    suite.stage(PYTHON, |counts| match prepared.join().expect("the thread does not panic") {
        Ok(Outcome::Passed) => record.unless_unchanged(PYTHON.name, inputs, || check_package(cargo, counts)),
        other => other,
    });
}

/// Builds the extension module, the program and the program that prints the stub.
fn build(cargo: &Cargo) -> Result<(), String> {
    cargo.build(&["--lib", "--bin", PROGRAM])
}

/// Checks the stub, runs the tests with the program for comparison, and checks the types.
fn check_package(cargo: &Cargo, counts: &mut Counts) -> Result<(), String> {
    let (copy, target) = (&cargo.folder, &cargo.target);
    let file = copy.join(SOURCES).join(stub_name());
    let committed = std::fs::read_to_string(&file).map_err(|error| tree::failure("read", &file, &error))?;
    if committed != stub(cargo)? {
        return Err(format!("{SOURCES}/{} differs from the extension module: run cargo xtask bless", stub_name()));
    }
    let packages = target.join("python-package");
    lay_out(&copy.join(SOURCES), &extension(cargo), &packages.join("stickslip"))?;

    let environment = environment(target);
    let in_environment = |folder: &Path, arguments: &[&str]| {
        let mut command = Command::new(python(&environment));
        command.current_dir(folder).args(arguments).env("PYTHONDONTWRITEBYTECODE", "1").env("PYTHONPATH", &packages);
        command
    };
    let metadata = environment.join("metadata");
    std::fs::create_dir_all(&metadata).map_err(|error| tree::failure("create", &metadata, &error))?;
    let write = ["-m", "maturin", "pep517", "write-dist-info", "--quiet", "--metadata-directory"];
    run(in_environment(copy, &write).arg(&metadata))?;
    let mut pytest = in_environment(copy, &["-m", "pytest", "--durations=5"]);
    run_counting(pytest.env("STICKSLIP", cargo.program()), counts)?;
    let types = ["-m", "mypy", "--strict", "--package", "stickslip", "--cache-dir"];
    run(in_environment(target, &types).env("MYPYPATH", &packages).arg(environment.join("mypy")))
}

/// Writes the stub of the extension module as it is now.
pub(crate) fn bless(cargo: &Cargo) -> Result<(), String> {
    build(cargo)?;
    let file = cargo.folder.join(SOURCES).join(stub_name());
    std::fs::write(&file, stub(cargo)?).map_err(|error| tree::failure("write", &file, &error))
}

fn environment(target: &Path) -> PathBuf {
    target.join("python")
}

fn python(environment: &Path) -> PathBuf {
    environment.join("bin/python")
}

fn stub_name() -> String {
    format!("{MODULE}.pyi")
}

/// The extension module, once built.
fn extension(cargo: &Cargo) -> PathBuf {
    cargo.built(&format!("{}{MODULE}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX))
}

/// The types of the extension module.
fn stub(cargo: &Cargo) -> Result<String, String> {
    let mut print = Command::new(cargo.built("examples").join(STUB));
    let stub = output(print.arg(extension(cargo)).arg(MODULE))?;
    String::from_utf8(stub).map_err(|error| format!("the stub is not text: {error}"))
}

/// Lays the package out as a wheel does.
fn lay_out(sources: &Path, extension: &Path, package: &Path) -> Result<(), String> {
    let _ = std::fs::remove_dir_all(package);
    std::fs::create_dir_all(package).map_err(|error| tree::failure("create", package, &error))?;
    let list = std::fs::read_dir(sources).map_err(|error| tree::failure("list", sources, &error))?;
    let mut files: Vec<(PathBuf, PathBuf)> = list
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|ending| ["py", "pyi", "typed"].iter().any(|it| ending == *it)))
        .filter_map(|path| Some((path.clone(), package.join(path.file_name()?))))
        .collect();
    files.push((extension.to_path_buf(), package.join(format!("{MODULE}.abi3.so"))));
    for (from, to) in files {
        std::fs::copy(&from, &to).map_err(|error| tree::failure("copy", &from, &error))?;
    }
    Ok(())
}

/// Installs packages. Returns the reason if that fails.
fn install(python: &Path, packages: &[&str]) -> Option<String> {
    let mut pip = Command::new(python);
    let quietly =
        ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries", "1", "--timeout", "20"];
    run(pip.args(quietly).args(packages)).err().map(|_| format!("pip cannot install {}", packages.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_installation_is_a_reason_to_skip() {
        // Programs in place of Python, which would contact the package index.
        let reason = install(Path::new("false"), &["numpy", "pytest"]).expect("nothing is installed");
        assert_eq!(reason, "pip cannot install numpy, pytest");
        assert_eq!(install(Path::new("true"), &["numpy"]), None);
    }

    #[test]
    fn a_package_is_laid_out_without_files_of_the_last_time() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("sources/__pycache__")).expect("it can be made");
        std::fs::create_dir_all(at("package")).expect("it can be made");
        for name in ["sources/__init__.py", "sources/py.typed", "sources/stray.txt", "package/old.py", "lib.so"] {
            std::fs::write(at(name), name).expect("it can be written");
        }
        lay_out(&at("sources"), &at("lib.so"), &at("package")).unwrap();
        let mut names: Vec<_> = std::fs::read_dir(at("package")).unwrap().map(|it| it.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["__init__.py", "_stickslip.abi3.so", "py.typed"]);
        assert!(lay_out(&at("sources"), &at("absent.so"), &at("package")).is_err());
    }
}
