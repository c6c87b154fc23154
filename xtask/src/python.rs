//! The Python package as its users have it: laid out for an environment of its own, and tested there. What is compiled is
//! what the tests of the workspace have built: another build, as `pip install .` makes it, takes minutes.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::JoinHandle;

use crate::suite::{Counts, Outcome};
use crate::{test, tools, tree};

/// What the package is tested with. Maturin reads `pyproject.toml`, as it does for `pip install .`.
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
/// The compiled part, its name within the package, and its stub.
const MODULE: &str = "_stickslip";
const SOURCES: &str = "python/stickslip";

/// An environment with all that the package is tested with; or why there is none.
type Prepared = JoinHandle<Result<Outcome, String>>;

/// Makes the environment below `target`, beside other work: most of the time it waits for an index of packages.
pub(crate) fn prepare(target: &Path) -> Prepared {
    let environment = environment(target);
    std::thread::spawn(move || {
        if !tools::runs("python3", &["-c", "import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 10))"]) {
            return Ok(Outcome::Skipped("Python 3.10 or newer with venv and pip is missing".into()));
        }
        let python = python(&environment);
        if !python.exists() {
            test::run(Command::new("python3").args(["-m", "venv"]).arg(&environment))?;
        }
        Ok(install(&python, &PACKAGES).map_or(Outcome::Passed, Outcome::Skipped))
    })
}

/// Tests the package in `copy`, compiled into `target`, and compares it with the program that was built beside it.
pub(crate) fn check(
    prepared: Prepared,
    copy: &Path,
    target: &Path,
    program: &Path,
    counts: &mut Counts,
) -> Result<Outcome, String> {
    match prepared.join().expect("nothing panics there") {
        Ok(Outcome::Passed) => {}
        other => return other,
    }
    let environment = environment(target);
    let python = python(&environment);
    let library = library(target);
    let stub = stub(&library)?;
    if std::fs::read_to_string(copy.join(SOURCES).join(stub_name())).is_ok_and(|text| text != stub) {
        return Err(format!("{SOURCES}/{} is not what the compiled part says: cargo xtask bless", stub_name()));
    }
    let packages = target.join("python-package");
    lay_out(&copy.join(SOURCES), &library, &packages.join("stickslip"))?;

    let in_environment = |folder: &Path, arguments: &[&str]| {
        let mut command = Command::new(&python);
        command.current_dir(folder).args(arguments).env("PYTHONDONTWRITEBYTECODE", "1").env("PYTHONPATH", &packages);
        command
    };
    let metadata = environment.join("metadata");
    std::fs::create_dir_all(&metadata).map_err(|error| tree::failure("create", &metadata, &error))?;
    let write = ["-m", "maturin", "pep517", "write-dist-info", "--quiet", "--metadata-directory"];
    test::run(in_environment(copy, &write).arg(&metadata))?;
    test::run_counting(in_environment(copy, &["-m", "pytest", "--durations=5"]).env("STICKSLIP", program), counts)?;
    let types = ["-m", "mypy", "--strict", "--package", "stickslip", "--cache-dir"];
    test::run(in_environment(target, &types).env("MYPYPATH", &packages).arg(environment.join("mypy")))?;
    Ok(Outcome::Passed)
}

/// Writes the stub of the compiled part as it is now.
pub(crate) fn bless(root: &Path, target: &Path) -> Result<(), String> {
    let file = root.join(SOURCES).join(stub_name());
    std::fs::write(&file, stub(&library(target))?).map_err(|error| tree::failure("write", &file, &error))
}

fn environment(target: &Path) -> PathBuf {
    target.join("python")
}

fn python(environment: &Path) -> PathBuf {
    environment.join("bin/python")
}

/// The compiled part as cargo leaves it beside the tests.
fn library(target: &Path) -> PathBuf {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    target.join("debug/deps").join(format!("{prefix}{MODULE}{suffix}"))
}

fn stub_name() -> String {
    format!("{MODULE}.pyi")
}

/// The types of the compiled part, from what it says of itself.
fn stub(library: &Path) -> Result<String, String> {
    let failure = |error| format!("{}: {error:#}", library.display());
    let module = pyo3_introspection::introspect_cdylib(library, MODULE).map_err(failure)?;
    let files = pyo3_introspection::module_stub_files(&module);
    files.into_values().next().ok_or_else(|| format!("{} says nothing of itself", library.display()))
}

/// The package as a wheel lays it out.
fn lay_out(sources: &Path, library: &Path, package: &Path) -> Result<(), String> {
    let _ = std::fs::remove_dir_all(package);
    std::fs::create_dir_all(package).map_err(|error| tree::failure("create", package, &error))?;
    let list = std::fs::read_dir(sources).map_err(|error| tree::failure("list", sources, &error))?;
    let mut files: Vec<(PathBuf, PathBuf)> = list
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|ending| ["py", "pyi", "typed"].iter().any(|it| ending == *it)))
        .filter_map(|path| Some((path.clone(), package.join(path.file_name()?))))
        .collect();
    files.push((library.to_path_buf(), package.join(format!("{MODULE}.abi3.so"))));
    for (from, to) in files {
        std::fs::copy(&from, &to).map_err(|error| tree::failure("copy", &from, &error))?;
    }
    Ok(())
}

/// Installs packages; why not, if so.
fn install(python: &Path, packages: &[&str]) -> Option<String> {
    let mut pip = Command::new(python);
    let quietly =
        ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries", "1", "--timeout", "20"];
    test::run(pip.args(quietly).args(packages)).err().map(|_| format!("pip cannot install {}", packages.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_that_cannot_be_installed_are_a_reason_and_no_failure() {
        // A Python that refuses whatever it is asked for: a real one might ask an index.
        let reason = install(Path::new("false"), &["numpy", "pytest"]).expect("nothing is installed");
        assert_eq!(reason, "pip cannot install numpy, pytest");
        assert_eq!(install(Path::new("true"), &["numpy"]), None);
    }

    #[test]
    fn a_library_that_is_none_has_no_stub() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let library = folder.path().join("lib.so");
        assert!(stub(&library).is_err());
        std::fs::write(&library, "no library").expect("it can be written");
        assert!(stub(&library).is_err());
    }

    #[test]
    fn a_package_is_laid_out_without_what_is_left_from_before() {
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
