//! Builds of the active software by the C compiler of this machine, with its self-test. The loop continues; a build uses
//! the CPUs that are not reserved for the loop.

use crate::LiveError;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_codegen::diagram::Diagram;

use super::page::{function, words};
use crate::lock;
use stickslip_base::Error;
use stickslip_generate::Generated;

/// Time limit of each command.
const LIMIT: Duration = Duration::from_secs(60);
/// Polling interval of a running command.
const POLL_INTERVAL: Duration = Duration::from_millis(10);
/// Maximum length of the shown output of a command [bytes].
const LOG: usize = 20_000;

/// Progress or result of a build.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BuildProgress {
    /// The current stage.
    pub stage: BuildStage,
    /// The result in a sentence.
    pub sentence: String,
    /// Commands and their output.
    pub log: String,
    /// Folder of the files.
    pub folder: String,
    /// Duration of compilation and test [s].
    pub seconds: Option<[f64; 2]>,
    /// Size of the object: code and constants, data, zeroed data [bytes]; `null` if unknown.
    pub sizes: Option<[u64; 3]>,
    /// Errors of the compiler.
    pub errors: Vec<BuildError>,
}

/// Stage of a build.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BuildStage {
    /// No build yet.
    #[default]
    Never,
    /// The compiler runs.
    Compiling,
    /// The self-test runs.
    Testing,
    /// Compiled; the self-test agrees with the model bit for bit.
    Passed,
    /// The compilation failed, or the self-test found a difference.
    Failed,
    /// No compiler found; the files were written.
    NoCompiler,
    /// Cancelled.
    Cancelled,
}

/// An error of the compiler.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BuildError {
    /// Diagram page of the block; `null` if the line belongs to no block.
    pub page: Option<String>,
    /// Name of the block.
    pub block: String,
    /// File and line.
    pub place: String,
    /// Message of the compiler.
    pub text: String,
}

impl BuildStage {
    fn runs(self) -> bool {
        matches!(self, BuildStage::Compiling | BuildStage::Testing)
    }
}

/// Builds, one at a time.
#[derive(Clone, Debug)]
pub(super) struct Builder {
    compiler: PathBuf,
    limit: Duration,
    progress: Arc<Mutex<BuildProgress>>,
    cancelled: Arc<AtomicBool>,
}

impl Default for Builder {
    fn default() -> Self {
        let compiler = std::env::var_os("CC").unwrap_or_else(|| "cc".into()).into();
        Builder { compiler, limit: LIMIT, progress: Arc::default(), cancelled: Arc::default() }
    }
}

/// Reason why a command did not complete.
enum CommandFailure {
    Missing,
    Cancelled,
    TooLong,
    Other(std::io::Error),
}

impl Builder {
    /// Uses this compiler and time limit.
    #[cfg(all(test, unix))]
    pub(super) fn by(compiler: &Path, limit: Duration) -> Self {
        Builder { compiler: compiler.to_owned(), limit, ..Builder::default() }
    }

    pub(super) fn progress(&self) -> BuildProgress {
        lock(&self.progress).clone()
    }

    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Writes the files and starts the build.
    ///
    /// # Errors
    /// [`LiveError::Busy`]; [`Error::File`].
    pub(super) fn begin(&mut self, generated: Arc<Generated>, folder: &Path) -> Result<(), Error> {
        if self.progress().stage.runs() {
            return Err(LiveError::Busy { what: "a build".into(), remedy: "Wait for its end, or cancel it." }.into());
        }
        generated.write(folder)?;
        self.cancelled = Arc::default();
        *lock(&self.progress) = BuildProgress {
            stage: BuildStage::Compiling,
            folder: folder.display().to_string(),
            ..BuildProgress::default()
        };
        let (builder, folder) = (self.clone(), folder.to_owned());
        thread::spawn(move || builder.run(&generated, &folder));
        Ok(())
    }

    fn run(&self, generated: &Generated, folder: &Path) {
        let name = &generated.prefix;
        let object = format!("{name}.o");
        let source = format!("{name}.c");
        let program = format!("{name}{}", std::env::consts::EXE_SUFFIX);
        let compile = ["-std=c99", "-O2", "-c", &source, "-o", &object];
        let test = format!("{name}_selftest.c");
        let link = ["-std=c99", "-O2", &object, &test, "main.c", "-o", &program];
        let begun = Instant::now();
        for arguments in [&compile[..], &link[..]] {
            match self.command(&self.compiler, arguments, folder) {
                Ok((status, _)) if status.success() => {}
                Ok((_, text)) => {
                    let errors = errors(&text, generated);
                    let sentence = format!("The compiler found {} errors.", errors.len().max(1));
                    return self.end(BuildStage::Failed, &sentence, |progress| progress.errors = errors);
                }
                Err(failure) => return self.fail(failure),
            }
        }
        let compiled = begun.elapsed().as_secs_f64();
        let sizes = self.command(Path::new("size"), &[&object], folder).ok().and_then(|(_, text)| sizes(&text));
        {
            let mut progress = lock(&self.progress);
            (progress.stage, progress.sizes) = (BuildStage::Testing, sizes);
        }
        let begun = Instant::now();
        match self.command(&folder.join(&program), &[], folder) {
            Ok((status, _)) => {
                let seconds = Some([compiled, begun.elapsed().as_secs_f64()]);
                let (stage, sentence) = if status.success() {
                    (BuildStage::Passed, "Compiled; the self-test agrees with the model bit for bit.")
                } else {
                    (BuildStage::Failed, "Compiled, but the self-test found a difference from the model.")
                };
                self.end(stage, sentence, |progress| progress.seconds = seconds);
            }
            Err(failure) => self.fail(failure),
        }
    }

    fn fail(&self, failure: CommandFailure) {
        let compiler = self.compiler.display();
        match failure {
            CommandFailure::Missing => {
                let sentence = format!(
                    "C compiler \"{compiler}\" not found: install one, or set CC to a C99 compiler. The files were written."
                );
                self.end(BuildStage::NoCompiler, &sentence, |_| {});
            }
            CommandFailure::Cancelled => self.end(BuildStage::Cancelled, "Cancelled.", |_| {}),
            CommandFailure::TooLong => {
                let sentence = format!("Stopped: a command took longer than {} s.", self.limit.as_secs_f64());
                self.end(BuildStage::Failed, &sentence, |_| {});
            }
            CommandFailure::Other(error) => {
                self.end(BuildStage::Failed, &format!("A command could not be run: {error}."), |_| {});
            }
        }
    }

    fn end(&self, stage: BuildStage, sentence: &str, more: impl FnOnce(&mut BuildProgress)) {
        let mut progress = lock(&self.progress);
        (progress.stage, progress.sentence) = (stage, sentence.into());
        more(&mut progress);
    }

    /// Runs a command to its end. Returns its exit status and its output.
    fn command(
        &self,
        program: &Path,
        arguments: &[&str],
        folder: &Path,
    ) -> Result<(ExitStatus, String), CommandFailure> {
        let shown = program.file_name().unwrap_or(program.as_os_str()).to_string_lossy();
        lock(&self.progress).log += &format!("$ {shown} {}\n", arguments.join(" "));
        let written = folder.join("build.log");
        let log = File::create(&written).map_err(CommandFailure::Other)?;
        let both = log.try_clone().map_err(CommandFailure::Other)?;
        let mut command = Command::new(program);
        command.args(arguments).current_dir(folder).env("LC_ALL", "C");
        command.stdin(Stdio::null()).stdout(log).stderr(both);
        let mut child = command.spawn().map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => CommandFailure::Missing,
            _ => CommandFailure::Other(error),
        })?;
        let ended = self.wait(&mut child);
        let text = String::from_utf8_lossy(&std::fs::read(&written).unwrap_or_default()).into_owned();
        let mut progress = lock(&self.progress);
        progress.log.extend(text.chars().take(LOG));
        drop(progress);
        ended.map(|status| (status, text))
    }

    fn wait(&self, child: &mut Child) -> Result<ExitStatus, CommandFailure> {
        let begun = Instant::now();
        let why = loop {
            match child.try_wait() {
                Ok(Some(status)) => return Ok(status),
                Ok(None) if self.cancelled.load(Ordering::Relaxed) => break CommandFailure::Cancelled,
                Ok(None) if begun.elapsed() > self.limit => break CommandFailure::TooLong,
                Ok(None) => thread::sleep(POLL_INTERVAL),
                Err(error) => break CommandFailure::Other(error),
            }
        };
        // The command may have ended meanwhile.
        let _ = child.kill();
        let _ = child.wait();
        Err(why)
    }
}

/// The errors in a compiler's output, `FILE:LINE:COLUMN: error: TEXT`, each with its block.
fn errors(text: &str, generated: &Generated) -> Vec<BuildError> {
    let diagram = Diagram::of(&generated.program, &generated.prefix);
    let source = generated.text(&format!("{}.c", generated.prefix)).unwrap_or_default();
    let owner = |file: &str, line: usize| {
        let begins = source.lines().take(line).collect::<Vec<_>>();
        let begin = begins.iter().rev().find(|line| line.starts_with("static void "))?;
        let page =
            |number: &usize| begin.starts_with(&format!("static void {}(", function(generated, &diagram, *number)));
        (0..diagram.pages.len()).find(page).filter(|_| file == format!("{}.c", generated.prefix))
    };
    text.lines()
        .filter_map(|line| {
            let (place, text) = line.split_once(": error: ").or_else(|| line.split_once(": fatal error: "))?;
            let mut parts = place.split(':');
            let (file, number) = (parts.next()?, parts.next()?.parse().ok()?);
            let page = owner(file, number);
            Some(BuildError {
                block: page.map_or(String::new(), |page| words(diagram.pages[page].step.name)),
                page: page.map(|page| diagram.file(page)),
                place: format!("{file}:{number}"),
                text: text.into(),
            })
        })
        .collect()
}

/// Code and constants, data, zeroed data, as `size` prints them.
fn sizes(text: &str) -> Option<[u64; 3]> {
    let row: Vec<u64> = text.lines().nth(1)?.split_whitespace().map_while(|word| word.parse().ok()).collect();
    row.get(..3)?.try_into().ok()
}
