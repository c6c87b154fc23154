//! A library in a process of its own: the program itself, called anew.
//!
//! A socket between the two, its standard input, carries what is said once: the memory that both share, what the library
//! is or why it is none. Each sample then is a question and an answer in that memory ([`stickslip_rt::Requester`]). Where it
//! lies anybody's code can write: what is read from it is a value and nothing more. The end of the socket tells the other
//! side that nobody asks any more; a thread (`watchdog.rs`) tells this side why no answer comes.

use crate::BenchError;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Read as _};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use stickslip_core::supervise::{ExternalFault, Fault};
use stickslip_rt::{ANSWER, ModuleSample, Requester, Responder, hand_over};
use tempfile::TempDir;

use super::fmu::is_fmu;
pub use super::host::host;
use super::watchdog::Watchdog;
use super::wire::{self, LONGEST, QUESTION};
use super::{Answer, Caller, Description, External, PATIENCE, Question, Role, hash};
use stickslip_base::Error;

/// From look to look at what has become of a process that does not answer.
const LOOK: Duration = Duration::from_millis(5);
/// An FMU may take so long to be unpacked and opened.
const OPENING: Duration = Duration::from_secs(60);
/// Its messages, in the folder of the process.
pub(super) const MESSAGES: &str = "said";

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

impl External {
    /// Opens a library in a process of its own.
    ///
    /// # Errors
    /// As [`External::trusted`]; [`Error::File`] where the process cannot be started.
    pub fn in_own_process(path: &Path, role: Role, host: &Host) -> Result<Self, Error> {
        Self::in_own_process_within(path, role, host, PATIENCE)
    }

    /// The same with another time without an answer after which it hangs.
    ///
    /// # Errors
    /// As [`External::apart`].
    pub fn in_own_process_within(path: &Path, role: Role, host: &Host, patience: Duration) -> Result<Self, Error> {
        let hash = hash(path)?;
        let (process, description) = Process::start(path, role, host, patience)?;
        Ok(Self::new(role, description, hash, Box::new(process)))
    }
}

/// The process, as the bench sees it.
struct Process {
    asker: Requester,
    minder: Watchdog,
    /// From the last question until its answer was there, as the other side says [ns].
    response: u64,
    /// The other side ends with it.
    _socket: UnixStream,
    /// What it leaves here goes with it, however it ends.
    folder: TempDir,
}

impl Process {
    fn start(path: &Path, role: Role, host: &Host, patience: Duration) -> Result<(Self, Description), Error> {
        let not_started = |source| Error::file(&host.program, "start a process of", source);
        let (socket, theirs) = UnixStream::pair().map_err(not_started)?;
        let folder = tempfile::tempdir().map_err(not_started)?;
        let opening = if is_fmu(path) { patience.max(OPENING) } else { patience };
        let (asker, memory) = Requester::new(QUESTION).map_err(not_started)?;
        // A process that it starts in its turn could hold the other end open.
        socket.set_read_timeout(Some(opening)).map_err(not_started)?;
        // What the library prints goes where messages go: results stay results.
        let child = Command::new(&host.program)
            .args(&host.arguments)
            .args(["--as", role.name()])
            .arg(path)
            .env("TMPDIR", folder.path())
            .stdin(OwnedFd::from(theirs))
            .stdout(Stdio::from(io::stderr()))
            .spawn()
            .map_err(not_started)?;
        let minder = Watchdog::start(child, asker.alarm(), opening).map_err(not_started)?;
        minder.asked();
        let said = listen(&socket, &memory);
        let refused = |problem: String| BenchError::External { path: path.into(), problem };
        let why = || Fault::External(role, minder.why());
        let said = said.map_err(|_| refused(format!("while it was opened {}", why())))?;
        minder.answered();
        minder.be_patient_for(patience);
        let description = wire::described(&said).map_err(refused)?;
        Ok((Process { asker, minder, response: 0, _socket: socket, folder }, description))
    }

    /// Asks; false where the last question has no answer yet.
    fn put(&mut self, question: Question<'_>) -> bool {
        if self.asker.is_open() {
            return false;
        }
        let asked = self.minder.asked();
        match question {
            Question::Begin(time, limit, values) => self.asker.ask(wire::begin(asked, time, limit, values)),
            Question::Step(sample, values) => self.asker.ask(wire::step(asked, sample, values)),
        }
    }

    /// An answer that has come.
    fn taken(&mut self, words: [u64; ANSWER]) -> Result<Answer, ExternalFault> {
        self.minder.answered();
        self.response = wire::response(words);
        wire::answer(words)
    }

    /// Asks and waits.
    fn asked(&mut self, question: Question<'_>) -> Result<Answer, ExternalFault> {
        if !self.put(question) {
            return Err(self.minder.why());
        }
        loop {
            if let Some(answer) = self.asker.wait(LOOK) {
                return self.taken(answer);
            }
            if let Some(fault) = self.minder.ended() {
                return Err(fault);
            }
        }
    }
}

/// Gives the memory to the host; what it says first.
fn listen(mut socket: &UnixStream, memory: &File) -> io::Result<Vec<u8>> {
    hand_over(socket, memory)?;
    let mut length = [0; 8];
    socket.read_exact(&mut length)?;
    let mut said = vec![0; usize::from_ne_bytes(length).min(LONGEST)];
    socket.read_exact(&mut said)?;
    Ok(said)
}

impl Caller for Process {
    fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> Result<(), ExternalFault> {
        self.asked(Question::Begin(sample_time, torque_limit, values)).map(drop)
    }

    fn step(&mut self, sample: &ModuleSample, values: Option<&[f64]>) -> Result<Answer, ExternalFault> {
        self.asked(Question::Step(sample, values))
    }

    fn ask(&mut self, question: Question<'_>) -> Option<Result<Answer, ExternalFault>> {
        // Refused, it has no answer when it is due.
        let _ = self.put(question);
        None
    }

    fn look(&mut self) -> Option<Result<Answer, ExternalFault>> {
        self.asker.answer().map(|words| self.taken(words))
    }

    fn answers_at_once(&self) -> bool {
        false
    }

    fn hurry(&self, priority: u8, period: Duration) {
        if Responder::sleeps_between(period) {
            self.minder.hurry(priority);
        }
    }

    fn ended(&self) -> Option<ExternalFault> {
        self.minder.ended()
    }

    fn response(&self) -> Option<u64> {
        // Elsewhere each process has a clock of its own.
        cfg!(target_os = "linux").then_some(self.response)
    }

    fn said(&self) -> Option<String> {
        let said = std::fs::read_to_string(self.folder.path().join(MESSAGES)).ok()?;
        (!said.is_empty()).then_some(said)
    }
}
