//! The software in force, compiled by the C compiler of this machine and put to its own test: beside the loop, on the
//! CPUs that are left to the rest of the program.

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

/// How long compiler and test may take, each.
const LIMIT: Duration = Duration::from_secs(60);
/// From look to look at what runs.
const LOOK: Duration = Duration::from_millis(10);
/// What the compiler writes is told so far [bytes].
const LOG: usize = 20_000;

/// How far a build is, or what came of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BuildProgress {
    /// How far.
    pub stage: BuildStage,
    /// What came of it, in a sentence.
    pub sentence: String,
    /// Commands and what they wrote.
    pub log: String,
    /// Where the files are.
    pub folder: String,
    /// What the compiler took, and the test [s].
    pub seconds: Option<[f64; 2]>,
    /// Size of the object: code and constants, data, zeroed data [bytes]; `null` where nobody tells.
    pub sizes: Option<[u64; 3]>,
    /// Errors of the compiler.
    pub errors: Vec<BuildError>,
}

/// How far a build is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BuildStage {
    /// None was asked for.
    #[default]
    Never,
    /// The compiler is at work.
    Compiling,
    /// The self-test runs.
    Testing,
    /// Compiled, and every bit of the test is the model's.
    Passed,
    /// It did not compile, or the test found a difference.
    Failed,
    /// There is no compiler; the files are written.
    NoCompiler,
    /// It was cancelled.
    Cancelled,
}

/// An error of the compiler.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BuildError {
    /// The page of the block's diagram, where the line is one of a block's.
    pub page: Option<String>,
    /// The block.
    pub block: String,
    /// File and line.
    pub place: String,
    /// What the compiler says.
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
    seen: Arc<Mutex<BuildProgress>>,
    cancelled: Arc<AtomicBool>,
}

impl Default for Builder {
    fn default() -> Self {
        let compiler = std::env::var_os("CC").unwrap_or_else(|| "cc".into()).into();
        Builder { compiler, limit: LIMIT, seen: Arc::default(), cancelled: Arc::default() }
    }
}

/// Why a command did not come to its end.
enum Broken {
    Missing,
    Cancelled,
    TooLong,
    Other(std::io::Error),
}

impl Builder {
    /// By this compiler, with so much time.
    #[cfg(all(test, unix))]
    pub(super) fn by(compiler: &Path, limit: Duration) -> Self {
        Builder { compiler: compiler.to_owned(), limit, ..Builder::default() }
    }

    pub(super) fn seen(&self) -> BuildProgress {
        lock(&self.seen).clone()
    }

    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Writes the files and begins.
    ///
    /// # Errors
    /// [`LiveError::Busy`]; [`Error::File`].
    pub(super) fn begin(&mut self, generated: Arc<Generated>, folder: &Path) -> Result<(), Error> {
        if self.seen().stage.runs() {
            return Err(LiveError::Busy { what: "a build".into() }.into());
        }
        generated.write(folder)?;
        self.cancelled = Arc::default();
        *lock(&self.seen) = BuildProgress {
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
                    return self.end(BuildStage::Failed, &sentence, |seen| seen.errors = errors);
                }
                Err(broken) => return self.broken(broken),
            }
        }
        let compiled = begun.elapsed().as_secs_f64();
        let sizes = self.command(Path::new("size"), &[&object], folder).ok().and_then(|(_, text)| sizes(&text));
        {
            let mut seen = lock(&self.seen);
            (seen.stage, seen.sizes) = (BuildStage::Testing, sizes);
        }
        let begun = Instant::now();
        match self.command(&folder.join(&program), &[], folder) {
            Ok((status, _)) => {
                let seconds = Some([compiled, begun.elapsed().as_secs_f64()]);
                let (stage, sentence) = if status.success() {
                    (BuildStage::Passed, "Compiled; the self-test gives every bit of the model.")
                } else {
                    (BuildStage::Failed, "Compiled, but the self-test found a difference to the model.")
                };
                self.end(stage, sentence, |seen| seen.seconds = seconds);
            }
            Err(broken) => self.broken(broken),
        }
    }

    fn broken(&self, broken: Broken) {
        let compiler = self.compiler.display();
        match broken {
            Broken::Missing => {
                let sentence = format!(
                    "There is no C compiler \"{compiler}\" on this machine: install one, or name one by the variable CC. \
                     The files are written all the same."
                );
                self.end(BuildStage::NoCompiler, &sentence, |_| {});
            }
            Broken::Cancelled => self.end(BuildStage::Cancelled, "Cancelled.", |_| {}),
            Broken::TooLong => {
                let sentence = format!("It took longer than {} s and was ended.", self.limit.as_secs_f64());
                self.end(BuildStage::Failed, &sentence, |_| {});
            }
            Broken::Other(error) => self.end(BuildStage::Failed, &format!("It could not be run: {error}."), |_| {}),
        }
    }

    fn end(&self, stage: BuildStage, sentence: &str, more: impl FnOnce(&mut BuildProgress)) {
        let mut seen = lock(&self.seen);
        (seen.stage, seen.sentence) = (stage, sentence.into());
        more(&mut seen);
    }

    /// Runs a command to its end: how it ended, and what it wrote.
    fn command(&self, program: &Path, arguments: &[&str], folder: &Path) -> Result<(ExitStatus, String), Broken> {
        let shown = program.file_name().unwrap_or(program.as_os_str()).to_string_lossy();
        lock(&self.seen).log += &format!("$ {shown} {}\n", arguments.join(" "));
        let written = folder.join("build.log");
        let log = File::create(&written).map_err(Broken::Other)?;
        let both = log.try_clone().map_err(Broken::Other)?;
        let mut command = Command::new(program);
        command.args(arguments).current_dir(folder).env("LC_ALL", "C");
        command.stdin(Stdio::null()).stdout(log).stderr(both);
        let mut child = command.spawn().map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => Broken::Missing,
            _ => Broken::Other(error),
        })?;
        let ended = self.wait(&mut child);
        let text = String::from_utf8_lossy(&std::fs::read(&written).unwrap_or_default()).into_owned();
        let mut seen = lock(&self.seen);
        seen.log.extend(text.chars().take(LOG));
        drop(seen);
        ended.map(|status| (status, text))
    }

    fn wait(&self, child: &mut Child) -> Result<ExitStatus, Broken> {
        let begun = Instant::now();
        let why = loop {
            match child.try_wait() {
                Ok(Some(status)) => return Ok(status),
                Ok(None) if self.cancelled.load(Ordering::Relaxed) => break Broken::Cancelled,
                Ok(None) if begun.elapsed() > self.limit => break Broken::TooLong,
                Ok(None) => thread::sleep(LOOK),
                Err(error) => break Broken::Other(error),
            }
        };
        // One that has ended meanwhile needs no end.
        let _ = child.kill();
        let _ = child.wait();
        Err(why)
    }
}

/// The errors in what a compiler writes, `FILE:LINE:COLUMN: error: TEXT`, each with its block.
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
