//! From C to a shared library for this machine.

use crate::GenerateError;
use std::fs;
use std::io;
use std::path::Path;
use std::process::Command;

use stickslip_base::Error;

/// The C compiler of this machine.
pub(super) struct Compiler(String);

/// The compiler of `$CC`, or `cc`.
pub(super) fn compiler() -> Compiler {
    Compiler(std::env::var("CC").ok().filter(|name| !name.trim().is_empty()).unwrap_or_else(|| "cc".into()))
}

impl Compiler {
    /// Whether it can be started.
    pub(super) fn is_there(&self) -> bool {
        Command::new(&self.0).arg("--version").output().is_ok()
    }

    fn error(self, message: impl Into<String>) -> Error {
        GenerateError::Compiler { compiler: self.0, message: message.into() }.into()
    }
}

/// Compiles `sources` among the files, names and texts, in a temporary folder to the library `name`; returns its
/// contents. `threads` links the library for threads.
///
/// # Errors
/// [`GenerateError::Compiler`] if the compiler is missing or refuses the code; [`Error::File`].
pub(super) fn compile(
    files: &[(String, String)],
    sources: &[String],
    name: &str,
    threads: bool,
) -> Result<Vec<u8>, Error> {
    let failed = |source| Error::file(Path::new("the folder of the compiler"), "write to", source);
    let folder = tempfile::tempdir().map_err(failed)?;
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap_or(folder.path()))
            .and_then(|()| fs::write(&path, text))
            .map_err(failed)?;
    }
    let compiler = compiler();
    let mut outcome = run(&compiler, folder.path(), sources, name, if threads { THREADS_EARLY } else { &[] });
    if threads && outcome.as_ref().is_ok_and(|output| !output.status.success()) {
        outcome = run(&compiler, folder.path(), sources, name, &["-pthread"]);
    }
    match outcome {
        Ok(output) if output.status.success() => fs::read(folder.path().join(name)).map_err(failed),
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stderr);
            let worst = text.lines().find(|line| line.contains("error"));
            Err(compiler.error(worst.or_else(|| text.lines().next()).unwrap_or("no message")))
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Err(compiler.error("program not found")),
        Err(error) => Err(compiler.error(error.to_string())),
    }
}

/// Threads by the functions that also old systems have, in their library of that time. Other systems than Linux with the
/// GNU C library refuse these arguments.
const THREADS_EARLY: &[&str] =
    &["-pthread", "-DFMU_EARLY_GLIBC", "-Wl,--push-state,--no-as-needed", "-l:libpthread.so.0", "-Wl,--pop-state"];

/// Runs the compiler in a folder.
fn run(
    compiler: &Compiler,
    folder: &Path,
    sources: &[String],
    name: &str,
    threads: &[&str],
) -> io::Result<std::process::Output> {
    let mut command = Command::new(&compiler.0);
    command.current_dir(folder);
    // Only the public functions are visible: a process may load many libraries.
    command.args(["-std=c99", "-O2", "-shared", "-fvisibility=hidden", "-ffp-contract=off"]);
    command.args((!cfg!(windows)).then_some("-fPIC"));
    command.args(["-o", name]).args(sources).args(threads).arg("-lm").output()
}
