//! A library in a process of its own: the program itself, called anew, with a socket between the two as its standard input.
//!
//! First the host says what the library is, or why it is none; then each request has one answer. All are numbers in the
//! order of bytes of the machine, since both ends are the same program.

use std::ffi::OsString;
use std::io::{self, Read, Write};
use std::os::fd::{AsFd as _, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};
use stickslip_core::supervise::ControllerFault;
use stickslip_rt::{MOST_PARAMETERS, ModuleParameter, ModuleSample};
use tempfile::TempDir;

use super::fmu::is_fmu;
use super::library::Library;
use super::{Answer, Caller, Description, Foreign, PATIENCE, Signal, hash};
use crate::Error;

/// Kinds of requests.
const BEGIN: f64 = 1.0;
const STEP: f64 = 2.0;
/// How an answer begins.
const DONE: f64 = 0.0;
const FAILED: f64 = 1.0;
const MODE: f64 = 2.0;
/// What a host says of itself at most [bytes].
const LONGEST: usize = 1 << 22;
/// An FMU may take so long to be unpacked and opened.
const OPENING: Duration = Duration::from_secs(60);
/// Its messages, in the folder of the process.
const MESSAGES: &str = "said";

/// How the host is called; the file comes behind it.
#[derive(Clone, Debug)]
pub struct Host {
    /// The program.
    pub program: PathBuf,
    /// What it is given before the file.
    pub arguments: Vec<OsString>,
}

impl Host {
    /// This program, or the one that the variable `STICKSLIP` names, or `stickslip` of the path.
    pub fn find() -> Self {
        let own = std::env::current_exe().ok().filter(|path| path.file_stem().is_some_and(|stem| stem == "stickslip"));
        let named = || std::env::var_os("STICKSLIP").map(PathBuf::from);
        Host { program: own.or_else(named).unwrap_or_else(|| "stickslip".into()), arguments: vec!["host".into()] }
    }

    /// The same for an FMU of which these variables are other signals than their names say: signal, variable.
    #[must_use]
    pub fn mapping(mut self, map: &[(String, String)]) -> Self {
        let words = map.iter().flat_map(|(signal, variable)| ["--map".into(), format!("{signal}={variable}").into()]);
        self.arguments.extend(words);
        self
    }
}

impl Foreign {
    /// Opens a library in a process of its own.
    ///
    /// # Errors
    /// As [`Foreign::trusted`]; [`Error::File`] where the process cannot be started.
    pub fn apart(path: &Path, host: &Host) -> Result<Self, Error> {
        Self::apart_within(path, host, PATIENCE)
    }

    /// The same with another time without an answer after which it hangs.
    ///
    /// # Errors
    /// As [`Foreign::apart`].
    pub fn apart_within(path: &Path, host: &Host, patience: Duration) -> Result<Self, Error> {
        let hash = hash(path)?;
        let (process, description) = Process::start(path, host, patience)?;
        Ok(Self::new(description, hash, Box::new(process)))
    }
}

/// The process, as the bench sees it.
struct Process {
    child: Child,
    socket: UnixStream,
    patience: Duration,
    /// What it leaves here goes with it, however it ends.
    folder: TempDir,
}

impl Process {
    fn start(path: &Path, host: &Host, patience: Duration) -> Result<(Self, Description), Error> {
        let not_started = |source| Error::file(&host.program, "start a process of", source);
        let (socket, theirs) = UnixStream::pair().map_err(not_started)?;
        let folder = tempfile::tempdir().map_err(not_started)?;
        let opening = if is_fmu(path) { patience.max(OPENING) } else { patience };
        socket.set_read_timeout(Some(opening)).map_err(not_started)?;
        // What the library prints goes where messages go: results stay results.
        let child = Command::new(&host.program)
            .args(&host.arguments)
            .arg(path)
            .env("TMPDIR", folder.path())
            .stdin(OwnedFd::from(theirs))
            .stdout(Stdio::from(io::stderr()))
            .spawn()
            .map_err(not_started)?;
        let mut process = Process { child, socket, patience: opening, folder };
        let said = process.listen();
        let refused = |problem: String| Error::Foreign { path: path.into(), problem };
        let said = said.map_err(|error| refused(format!("while it was opened {}", process.why(&error))))?;
        let description = described(&said).map_err(refused)?;
        process.patience = patience;
        process.socket.set_read_timeout(Some(patience)).map_err(not_started)?;
        Ok((process, description))
    }

    /// What the host says first.
    fn listen(&mut self) -> io::Result<Vec<u8>> {
        let mut length = [0; 8];
        self.socket.read_exact(&mut length)?;
        let mut said = vec![0; usize::from_ne_bytes(length).min(LONGEST)];
        self.socket.read_exact(&mut said)?;
        Ok(said)
    }

    /// Asks and waits.
    fn ask(&mut self, request: &[f64]) -> Result<Answer, ControllerFault> {
        let mut answer = [0.0; 3];
        let asked = self.socket.write_all(&bytes(request)).and_then(|()| read(&mut self.socket, &mut answer));
        asked.map_err(|error| self.why(&error))?;
        match answer {
            [DONE, torque, time] => Ok(Answer { torque, time: time as u64 }),
            [MODE, ..] => Err(ControllerFault::FloatingPoint),
            [_, code, _] => Err(ControllerFault::Failed { code: code as i32 }),
        }
    }

    /// Why nothing comes.
    fn why(&mut self, error: &io::Error) -> ControllerFault {
        if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) {
            // Whatever it does, it does it no more.
            let _ = self.child.kill();
            let _ = self.child.wait();
            return ControllerFault::Silent { time: self.patience.as_secs_f64() };
        }
        match self.child.wait() {
            Ok(status) => match status.signal() {
                Some(signal) => ControllerFault::Crashed { signal },
                None => ControllerFault::Ended { code: status.code().unwrap_or(-1) },
            },
            Err(_) => ControllerFault::Ended { code: -1 },
        }
    }
}

impl Caller for Process {
    fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> Result<(), ControllerFault> {
        let head = [BEGIN, sample_time, torque_limit, values.len() as f64];
        self.ask(&[&head, values].concat()).map(drop)
    }

    fn step(&mut self, sample: &ModuleSample) -> Result<Answer, ControllerFault> {
        let ModuleSample { time, reference_position, reference_velocity, reference_acceleration, .. } = *sample;
        let references = [reference_position, reference_velocity, reference_acceleration];
        let [position, velocity, acceleration] = references;
        self.ask(&[STEP, time, position, velocity, acceleration, sample.measured_angle, sample.measured_velocity])
    }

    fn said(&self) -> Option<String> {
        let said = std::fs::read_to_string(self.folder.path().join(MESSAGES)).ok()?;
        (!said.is_empty()).then_some(said)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The other side: opens the library, or the FMU with these variables as signals, says what it is, and answers until
/// nobody asks any more. What `stickslip host` does.
///
/// # Errors
/// [`Error::File`] where nobody is there to ask.
pub fn host(path: &Path, map: &[(String, String)]) -> Result<(), Error> {
    let lost = |source| Error::file(Path::new("standard input"), "talk through", source);
    let mut socket = UnixStream::from(io::stdin().as_fd().try_clone_to_owned().map_err(lost)?);
    // The folder that whoever asks has made for this process.
    let opened = Library::open(path, map, Some(std::env::temp_dir().join(MESSAGES)));
    let said = match &opened {
        Ok(library) => told(library.description()),
        Err(Error::Foreign { problem, .. }) => json!({ "problem": problem }),
        Err(error) => json!({ "problem": error.to_string() }),
    };
    let said = said.to_string().into_bytes();
    socket.write_all(&said.len().to_ne_bytes()).and_then(|()| socket.write_all(&said)).map_err(lost)?;
    let Ok(mut library) = opened else { return Ok(()) };
    // The other end closes its socket when it has ended.
    while let Ok(answer) = answered(&mut socket, &mut library) {
        if socket.write_all(&bytes(&answer)).is_err() {
            break;
        }
    }
    Ok(())
}

/// Takes a request and does it.
fn answered(socket: &mut UnixStream, library: &mut Library) -> io::Result<[f64; 3]> {
    let mut kind = [0.0];
    read(socket, &mut kind)?;
    let done = if kind == [BEGIN] {
        let mut head = [0.0; 3];
        read(socket, &mut head)?;
        let [sample_time, torque_limit, count] = head;
        let mut values = vec![0.0; (count as usize).min(MOST_PARAMETERS)];
        read(socket, &mut values)?;
        library.begin(sample_time, torque_limit, &values).map(|()| Answer { torque: 0.0, time: 0 })
    } else {
        let mut numbers = [0.0; 6];
        read(socket, &mut numbers)?;
        let [time, reference_position, reference_velocity, reference_acceleration, measured_angle, measured_velocity] =
            numbers;
        let references = (reference_position, reference_velocity, reference_acceleration);
        let (reference_position, reference_velocity, reference_acceleration) = references;
        library.step(&ModuleSample {
            time,
            reference_position,
            reference_velocity,
            reference_acceleration,
            measured_angle,
            measured_velocity,
        })
    };
    Ok(match done {
        Ok(Answer { torque, time }) => [DONE, torque, time as f64],
        Err(ControllerFault::Failed { code }) => [FAILED, f64::from(code), 0.0],
        Err(_) => [MODE, 0.0, 0.0],
    })
}

fn bytes(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_ne_bytes()).collect()
}

fn read(socket: &mut UnixStream, numbers: &mut [f64]) -> io::Result<()> {
    let mut bytes = vec![0; 8 * numbers.len()];
    socket.read_exact(&mut bytes)?;
    for (number, eight) in numbers.iter_mut().zip(bytes.chunks_exact(8)) {
        *number = f64::from_ne_bytes(eight.try_into().expect("eight bytes"));
    }
    Ok(())
}

/// A description for the other side.
fn told(description: &Description) -> Value {
    let parameter = |p: &ModuleParameter| json!([p.name, p.unit, p.help, p.minimum, p.maximum, p.initial]);
    let signal = |signal: &Signal| json!([signal.name, signal.variable, signal.unit]);
    json!({
        "name": description.name,
        "parameters": description.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "kind": description.kind,
        "tool": description.tool,
        "step": description.step,
        "signals": description.signals.iter().map(signal).collect::<Vec<_>>(),
        "notes": description.notes,
    })
}

/// A description from the other side, or its problem.
fn described(said: &[u8]) -> Result<Description, String> {
    let said: Value = serde_json::from_slice(said).map_err(|error| format!("its process says nonsense ({error})"))?;
    if let Some(problem) = said["problem"].as_str() {
        return Err(problem.to_owned());
    }
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let parameter = |p: &Value| ModuleParameter {
        name: text(&p[0]),
        unit: text(&p[1]),
        help: text(&p[2]),
        minimum: number(&p[3]),
        maximum: number(&p[4]),
        initial: number(&p[5]),
    };
    let signal = |s: &Value| Signal { name: text(&s[0]), variable: text(&s[1]), unit: text(&s[2]) };
    let all = |what: &str| said[what].as_array().map_or(&[][..], Vec::as_slice);
    Ok(Description {
        name: text(&said["name"]),
        parameters: all("parameters").iter().map(parameter).collect(),
        kind: text(&said["kind"]),
        tool: said["tool"].as_str().map(String::from),
        step: said["step"].as_f64(),
        signals: all("signals").iter().map(signal).collect(),
        notes: all("notes").iter().map(text).collect(),
    })
}
