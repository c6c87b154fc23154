//! A library in a separate process, which runs this program as a host.
//!
//! A socket, the standard input of the host, transfers the shared memory and then the description of the library or the
//! reason of its refusal. Each sample is a question and an answer in that memory ([`stickslip_rt::Requester`]). The
//! library can write to this memory, so its contents are untrusted. The host ends when the socket closes; a thread
//! (`watchdog.rs`) reports to this side why no answer comes.

use crate::BenchError;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Read as _};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use stickslip_rt::{ANSWER, ModuleSample, Requester, Responder, hand_over};
use stickslip_software::supervise::{ExternalFault, Fault};
use tempfile::TempDir;

use super::fmu::is_fmu;
pub use super::host::host;
use super::watchdog::Watchdog;
use super::wire::{self, LONGEST, QUESTION};
use super::{Answer, Caller, Description, External, PATIENCE, Question, Role, hash};
use stickslip_base::Error;

/// Interval of the checks of a process that does not answer.
const LOOK: Duration = Duration::from_millis(5);
/// Time-out for unpacking and opening an FMU.
const OPENING: Duration = Duration::from_secs(60);
/// File of its messages, in the folder of the process.
pub(super) const MESSAGES: &str = "said";

/// Command of the host process; the file is appended.
#[derive(Clone, Debug)]
pub struct HostProcess {
    /// Program.
    pub program: PathBuf,
    /// Arguments before the file.
    pub arguments: Vec<OsString>,
}

impl HostProcess {
    /// This program, or the one in the variable `STICKSLIP`, or `stickslip` from the path.
    pub fn find() -> Self {
        let own = std::env::current_exe().ok().filter(|path| path.file_stem().is_some_and(|stem| stem == "stickslip"));
        let configured = || std::env::var_os("STICKSLIP").map(PathBuf::from);
        HostProcess {
            program: own.or_else(configured).unwrap_or_else(|| "stickslip".into()),
            arguments: vec!["host".into()],
        }
    }

    /// The same with an explicit mapping of signals to variables of an FMU: signal, variable.
    #[must_use]
    pub fn mapping(mut self, map: &[(String, String)]) -> Self {
        let words = map.iter().flat_map(|(signal, variable)| ["--map".into(), format!("{signal}={variable}").into()]);
        self.arguments.extend(words);
        self
    }
}

impl External {
    /// Opens a library in a separate process.
    ///
    /// # Errors
    /// As [`External::trusted`]; [`Error::File`] if the process cannot be started.
    pub fn in_own_process(path: &Path, role: Role, host: &HostProcess) -> Result<Self, Error> {
        Self::in_own_process_within(path, role, host, PATIENCE)
    }

    /// The same with another time-out of an answer.
    ///
    /// # Errors
    /// As [`External::in_own_process`].
    pub fn in_own_process_within(
        path: &Path,
        role: Role,
        host: &HostProcess,
        patience: Duration,
    ) -> Result<Self, Error> {
        let hash = hash(path)?;
        let (process, description) = Process::start(path, role, host, patience)?;
        Ok(Self::new(role, description, hash, Box::new(process)))
    }
}

/// The host process, from the side of the bench.
struct Process {
    requester: Requester,
    watchdog: Watchdog,
    /// Response time of the last request according to the host [ns].
    response: u64,
    /// The host ends when it closes.
    _socket: UnixStream,
    /// Its temporary folder, removed with the process.
    folder: TempDir,
}

impl Process {
    fn start(path: &Path, role: Role, host: &HostProcess, patience: Duration) -> Result<(Self, Description), Error> {
        let not_started = |source| Error::file(&host.program, "start a process of", source);
        let (socket, theirs) = UnixStream::pair().map_err(not_started)?;
        let folder = tempfile::tempdir().map_err(not_started)?;
        let opening = if is_fmu(path) { patience.max(OPENING) } else { patience };
        let (requester, memory) = Requester::new(QUESTION).map_err(not_started)?;
        // A child process of the host could keep the other end open.
        socket.set_read_timeout(Some(opening)).map_err(not_started)?;
        // Output of the library goes to standard error, apart from the results.
        let child = Command::new(&host.program)
            .args(&host.arguments)
            .args(["--as", role.name()])
            .arg(path)
            .env("TMPDIR", folder.path())
            .stdin(OwnedFd::from(theirs))
            .stdout(Stdio::from(io::stderr()))
            .spawn()
            .map_err(not_started)?;
        let watchdog = Watchdog::start(child, requester.alarm(), opening).map_err(not_started)?;
        watchdog.start_timeout();
        let received = receive_description(&socket, &memory);
        let refused = |problem: String| BenchError::External { path: path.into(), problem };
        let reason = || Fault::External(role, watchdog.wait_for_end());
        let received = received.map_err(|_| refused(format!("while it was opened {}", reason())))?;
        watchdog.stop_timeout();
        watchdog.be_patient_for(patience);
        let description = wire::decode_description(&received).map_err(refused)?;
        Ok((Process { requester, watchdog, response: 0, _socket: socket, folder }, description))
    }

    /// Sends a question; false if the last one has no answer yet.
    fn put(&mut self, question: Question<'_>) -> bool {
        if self.requester.is_open() {
            return false;
        }
        let sent = self.watchdog.start_timeout();
        match question {
            Question::Begin(time, limit, values) => self.requester.ask(wire::begin(sent, time, limit, values)),
            Question::Step(sample, values) => self.requester.ask(wire::step(sent, sample, values)),
        }
    }

    /// Evaluates a received answer.
    fn evaluate(&mut self, words: [u64; ANSWER]) -> Result<Answer, ExternalFault> {
        self.watchdog.stop_timeout();
        self.response = wire::response(words);
        wire::answer(words)
    }

    /// Sends a question and waits for the answer.
    fn request(&mut self, question: Question<'_>) -> Result<Answer, ExternalFault> {
        if !self.put(question) {
            return Err(self.watchdog.wait_for_end());
        }
        loop {
            if let Some(answer) = self.requester.wait(LOOK) {
                return self.evaluate(answer);
            }
            if let Some(fault) = self.watchdog.ended() {
                return Err(fault);
            }
        }
    }
}

/// Sends the memory to the host and receives its description.
fn receive_description(mut socket: &UnixStream, memory: &File) -> io::Result<Vec<u8>> {
    hand_over(socket, memory)?;
    let mut length = [0; 8];
    socket.read_exact(&mut length)?;
    let mut description = vec![0; usize::from_ne_bytes(length).min(LONGEST)];
    socket.read_exact(&mut description)?;
    Ok(description)
}

impl Caller for Process {
    fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> Result<(), ExternalFault> {
        self.request(Question::Begin(sample_time, torque_limit, values)).map(drop)
    }

    fn step(&mut self, sample: &ModuleSample, values: Option<&[f64]>) -> Result<Answer, ExternalFault> {
        self.request(Question::Step(sample, values))
    }

    fn ask(&mut self, question: Question<'_>) -> Option<Result<Answer, ExternalFault>> {
        // If refused, the answer is missing when due.
        let _ = self.put(question);
        None
    }

    fn look(&mut self) -> Option<Result<Answer, ExternalFault>> {
        self.requester.answer().map(|words| self.evaluate(words))
    }

    fn answers_at_once(&self) -> bool {
        false
    }

    fn hurry(&self, priority: u8, period: Duration) {
        if Responder::sleeps_between(period) {
            self.watchdog.hurry(priority);
        }
    }

    fn ended(&self) -> Option<ExternalFault> {
        self.watchdog.ended()
    }

    fn response(&self) -> Option<u64> {
        // On other systems the clocks of processes differ.
        cfg!(target_os = "linux").then_some(self.response)
    }

    fn message(&self) -> Option<String> {
        let message = std::fs::read_to_string(self.folder.path().join(MESSAGES)).ok()?;
        (!message.is_empty()).then_some(message)
    }
}
