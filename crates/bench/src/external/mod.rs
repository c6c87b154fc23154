//! A position controller, a friction or a rendering law that somebody else wrote, in the loop of the bench.
//!
//! It is a shared library with the five functions of `stickslip_module.h`, or an FMU for co-simulation. Unless it is trusted
//! it runs in a process of its own ([`process`]), so that whatever it does the bench lives on. On a bench its torque is a
//! part of the command, in force a sample later, so that a record of the run replays without the library. What it is there,
//! its [`Role`] says.

mod file;
mod fmu;
#[cfg(unix)]
mod host;
mod in_loop;
mod library;
mod operator;
#[cfg(unix)]
pub mod process;
pub mod role;
#[cfg(all(test, unix))]
mod tests;
#[cfg(unix)]
mod watchdog;
#[cfg(unix)]
mod wire;

use crate::BenchError;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;
use std::time::Duration;

pub use file::ExternalFile;
pub use in_loop::ExternalInLoop;
use library::Library;
pub use operator::OperatorSide;
use operator::{Line, Took, console};
use sha2::{Digest as _, Sha256};
use stickslip_core::control::AxisControlInput;
pub use stickslip_core::supervise::Role;
use stickslip_core::supervise::{ExternalFault, Fault};
use stickslip_rt::{Durations, Quantiles};
pub use stickslip_rt::{ModuleParameter, ModuleSample};

use stickslip_base::parameters::schema::nearest;
use stickslip_base::{Error, output};

/// A call may take so long; longer ones are counted [ns].
pub const BUDGET: u64 = 10_000;
/// Without an answer for so long it hangs.
pub const PATIENCE: Duration = Duration::from_secs(2);

/// Names that a message lists at most.
const LISTED: usize = 20;

/// The header that a library in C is written against.
pub const HEADER: &str = include_str!("stickslip_module.h");

/// What it says of itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Description {
    /// Its name.
    pub name: String,
    /// Its parameters.
    pub parameters: Vec<ModuleParameter>,
    /// What it is: `C library`, `FMU 2.0`.
    pub kind: String,
    /// The tool that wrote it, if it says so.
    pub tool: Option<String>,
    /// Time step that it takes by itself, if it says so [s].
    pub step: Option<f64>,
    /// Its variables that are signals of the bench; none of a C library, whose signals are those of the header.
    pub signals: Vec<Signal>,
    /// What else a reader should know, in sentences.
    pub notes: Vec<String>,
}

/// A signal of the bench that is a variable of an FMU.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signal {
    /// As in `stickslip_module.h`.
    pub name: String,
    /// What the FMU calls it.
    pub variable: String,
    /// Its unit there; empty where none is stated, which is taken for the SI's.
    pub unit: String,
}

/// What came of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Answer {
    /// Its torque [N m].
    pub(crate) torque: f64,
    /// How long the call took [ns].
    pub(crate) time: u64,
    /// What it says to other values of its parameters: 0 takes them.
    pub(crate) refused: i32,
}

/// What is asked for by the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Question<'a> {
    /// To begin anew, at rest: time from sample to sample [s], largest torque of the drive [N m], values of its parameters.
    Begin(f64, f64, &'a [f64]),
    /// One sample, with other values of its parameters before it where there are some.
    Step(&'a ModuleSample, Option<&'a [f64]>),
}

/// Whoever calls the functions: here, or in another process.
pub(crate) trait Caller: Send {
    /// Begins anew, at rest.
    fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> Result<(), ExternalFault>;

    /// One sample, with other values of its parameters before it where there are some: the last ones stay where it
    /// refuses them.
    fn step(&mut self, sample: &ModuleSample, values: Option<&[f64]>) -> Result<Answer, ExternalFault>;

    /// The gravest message that it left since its begin, if it can leave any.
    fn said(&self) -> Option<String> {
        None
    }

    /// By the clock: asks, and does not wait. The answer where it is known at once, as that of a function called here.
    fn ask(&mut self, question: Question<'_>) -> Option<Result<Answer, ExternalFault>> {
        Some(match question {
            Question::Begin(sample_time, torque_limit, values) => {
                self.begin(sample_time, torque_limit, values).map(|()| Answer::default())
            }
            Question::Step(sample, values) => self.step(sample, values),
        })
    }

    /// The answer to what was asked last, where it has come since.
    fn look(&mut self) -> Option<Result<Answer, ExternalFault>> {
        None
    }

    /// Whether all is computed within the call.
    fn answers_at_once(&self) -> bool {
        true
    }

    /// Runs at this real-time priority from now on where it is a process of its own, asked once in such a period.
    fn hurry(&self, _priority: u8, _period: Duration) {}

    /// Why no answer will come, where that is known.
    fn ended(&self) -> Option<ExternalFault> {
        None
    }

    /// From the last question until its answer was there [ns], where that is known.
    fn response(&self) -> Option<u64> {
        None
    }
}

/// What is awaited by the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Awaited {
    Begin,
    Torque,
}

/// What has become of what was asked for by the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Course {
    /// Nothing is awaited.
    Nothing,
    /// No answer yet.
    Open,
    /// It has begun.
    Begun,
    /// Its torque [N m], a finite number.
    Torque(f64),
}

/// A file that was opened.
pub struct External {
    role: Role,
    description: Description,
    values: Vec<f64>,
    /// Other values that it has not taken yet.
    wished: Vec<f64>,
    wishes: bool,
    line: Option<Line>,
    hash: String,
    caller: Box<dyn Caller>,
    durations: Durations,
    late: u64,
    /// By the clock: what was asked for and not taken, and its answer where it was known at once.
    awaited: Option<(Awaited, Option<Result<Answer, ExternalFault>>)>,
    responses: Durations,
}

impl External {
    /// Opens a library or an FMU in this process: whatever it does, it does to this process.
    ///
    /// # Errors
    /// [`BenchError::External`] for a file that cannot be one; [`Error::File`].
    pub fn trusted(path: &Path, role: Role) -> Result<Self, Error> {
        Self::trusted_as(path, role, &[])
    }

    /// The same with variables of an FMU that are other signals than their names say: signal, variable.
    ///
    /// # Errors
    /// As [`External::trusted`].
    pub fn trusted_as(path: &Path, role: Role, map: &[(String, String)]) -> Result<Self, Error> {
        let hash = hash(path)?;
        let library = Library::open(path, role, map, None)?;
        Ok(Self::new(role, library.description().clone(), hash, Box::new(library)))
    }

    pub(crate) fn new(role: Role, description: Description, hash: String, caller: Box<dyn Caller>) -> Self {
        let values: Vec<f64> = description.parameters.iter().map(|parameter| parameter.initial).collect();
        let (durations, responses) = (Durations::default(), Durations::default());
        External {
            role,
            description,
            wished: values.clone(),
            values,
            wishes: false,
            line: None,
            hash,
            caller,
            durations,
            late: 0,
            awaited: None,
            responses,
        }
    }

    /// What it is in the loop.
    pub fn role(&self) -> Role {
        self.role
    }

    /// A fault of it, as it is told.
    pub fn told(&self, fault: ExternalFault) -> Fault {
        Fault::External(self.role, fault)
    }

    /// What it says of itself.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// As a record names it: role, name, and the file.
    pub fn words(&self) -> String {
        format!("{} {}, SHA-256 {}", self.role, self.description.name, self.hash)
    }

    /// SHA-256 of its file, in hexadecimal digits.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// The values of its parameters, in their order.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Another value of a parameter, with which it begins.
    ///
    /// # Errors
    /// [`Error::Unknown`], [`BenchError::ForeignValue`].
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), Error> {
        let parameters = &self.description.parameters;
        let Some(index) = parameters.iter().position(|parameter| parameter.name == name) else {
            let remedy = known(name, self.role, parameters);
            return Err(Error::Unknown { what: "parameter", name: name.into(), remedy });
        };
        if !value.is_finite() {
            let (question, answer) = (name.into(), value.to_string());
            return Err(Error::Answer { question, answer, remedy: "Give a finite number.".into() });
        }
        let ModuleParameter { unit, minimum, maximum, .. } = &parameters[index];
        if !(*minimum..=*maximum).contains(&value) {
            let (name, unit) = (name.into(), unit.clone());
            return Err(BenchError::ForeignValue { name, value, unit, minimum: *minimum, maximum: *maximum }.into());
        }
        self.values[index] = value;
        Ok(())
    }

    /// The gravest message that it left since its begin, if it left any.
    pub fn said(&self) -> Option<String> {
        self.caller.said()
    }

    /// How long its calls took [ns], and how many took longer than [`BUDGET`].
    pub fn durations(&self) -> (Quantiles, u64) {
        (self.durations.quantiles(), self.late)
    }

    /// Begins anew, at rest: time from sample to sample [s], largest torque of the drive [N m].
    ///
    /// # Errors
    /// Why it does not.
    pub fn begin(&mut self, sample_time: f64, torque_limit: f64) -> Result<(), ExternalFault> {
        self.caller.begin(sample_time, torque_limit, &self.values)
    }

    /// One sample: the torque [N m], a finite number.
    ///
    /// # Errors
    /// What went wrong.
    pub fn step(&mut self, sample: &ModuleSample) -> Result<f64, ExternalFault> {
        self.hear();
        let answer = self.caller.step(sample, self.wishes.then_some(&self.wished[..]))?;
        self.judged(answer, None)
    }

    /// A torque, counted, with what was said to other values.
    fn judged(&mut self, answer: Answer, response: Option<u64>) -> Result<f64, ExternalFault> {
        let Answer { torque, time, refused } = answer;
        if std::mem::take(&mut self.wishes) {
            self.settle(refused);
        }
        self.durations.add(time);
        self.late += u64::from(time > BUDGET);
        response.into_iter().for_each(|time| self.responses.add(time));
        self.line.iter_mut().for_each(|line| line.took(Took { call: time, response }));
        if torque.is_finite() { Ok(torque) } else { Err(ExternalFault::NotANumber) }
    }

    /// The way for whoever operates it while it is in the loop.
    pub fn console(&mut self) -> OperatorSide {
        let (console, line) = console(&self.values);
        self.line = Some(line);
        console
    }

    /// The value of a parameter, with which it begins: one that it admits.
    pub fn begin_with(&mut self, index: usize, value: f64) {
        self.values[index] = value;
    }

    /// It does not control any more until it is opened again.
    pub(crate) fn fail(&self) {
        self.line.iter().for_each(Line::fail);
    }

    /// Takes other values that have come for its next sample.
    fn hear(&mut self) {
        if let Some(values) = self.line.as_mut().and_then(Line::values) {
            self.wished.copy_from_slice(values);
            self.wishes = true;
        }
    }

    /// It has said this to other values.
    fn settle(&mut self, code: i32) {
        if code == 0 {
            self.values.copy_from_slice(&self.wished);
        }
        self.line.iter().for_each(|line| line.say(code));
    }

    /// Takes other values that have come with which it begins; whether there were any.
    pub fn take_for_begin(&mut self) -> bool {
        self.hear();
        let wished = std::mem::take(&mut self.wishes);
        if wished {
            self.settle(0);
        }
        wished
    }

    /// By the clock: whether its torque is there when its sample has been asked for.
    pub fn answers_at_once(&self) -> bool {
        self.caller.answers_at_once()
    }

    /// A process of its own runs at this real-time priority from now on, where it is asked once in such a period [s] and
    /// the system lets it.
    pub(crate) fn hurry(&self, priority: u8, period: f64) {
        self.caller.hurry(priority, Duration::from_secs_f64(period));
    }

    /// By the clock: a torque was not there when it was due.
    pub(crate) fn count_late(&self) {
        self.line.iter().for_each(Line::late);
    }

    /// By the clock: asks it to begin anew, and does not wait; nothing may be awaited.
    pub(crate) fn ask_to_begin(&mut self, sample_time: f64, torque_limit: f64) {
        let answer = self.caller.ask(Question::Begin(sample_time, torque_limit, &self.values));
        self.awaited = Some((Awaited::Begin, answer));
    }

    /// By the clock: asks for the torque of a sample, and does not wait; nothing may be awaited.
    pub(crate) fn ask(&mut self, sample: &ModuleSample) {
        self.hear();
        let answer = self.caller.ask(Question::Step(sample, self.wishes.then_some(&self.wished[..])));
        self.awaited = Some((Awaited::Torque, answer));
    }

    /// By the clock: takes the answer to what was asked for, where it is there.
    ///
    /// # Errors
    /// What went wrong.
    pub(crate) fn look(&mut self) -> Result<Course, ExternalFault> {
        let Some((awaited, answer)) = &mut self.awaited else { return Ok(Course::Nothing) };
        let Some(answer) = answer.take().or_else(|| self.caller.look()) else { return Ok(Course::Open) };
        let awaited = *awaited;
        self.awaited = None;
        match awaited {
            Awaited::Begin => answer.map(|_| Course::Begun),
            Awaited::Torque => {
                let response = self.caller.response();
                self.judged(answer?, response).map(Course::Torque)
            }
        }
    }

    /// Why no answer will come any more, where that is known.
    pub(crate) fn ended(&self) -> Option<ExternalFault> {
        self.caller.ended()
    }

    /// By the clock: from a question until its answer was there [ns]; empty where it answers at once, and where the system
    /// does not tell.
    pub fn responses(&self) -> Quantiles {
        self.responses.quantiles()
    }
}

/// What there is instead of a parameter of this name.
fn known(name: &str, role: Role, parameters: &[ModuleParameter]) -> String {
    let names = || parameters.iter().map(|parameter| parameter.name.as_str());
    let did = nearest(name, names()).map_or(String::new(), |nearest| format!("Did you mean {nearest}? "));
    let mut all = names().take(LISTED).collect::<Vec<_>>().join(", ");
    if parameters.len() > LISTED {
        all += &format!(" and {} more", parameters.len() - LISTED);
    }
    format!("{did}The {role} has: {}.", if all.is_empty() { "none" } else { &all })
}

/// What a controller reads at a time since its begin [s].
pub fn read(time: f64, input: &AxisControlInput<f64>) -> ModuleSample {
    let AxisControlInput { reference, measured_angle, measured_velocity } = *input;
    ModuleSample {
        time,
        reference_position: reference.position,
        reference_velocity: reference.velocity,
        reference_acceleration: reference.acceleration,
        measured_angle,
        measured_velocity,
        ..ModuleSample::default()
    }
}

/// SHA-256 of a file.
fn hash(path: &Path) -> Result<String, Error> {
    let refused = |source| Error::file(path, "read", source);
    let mut file = File::open(path).map_err(refused)?;
    let (mut digest, mut piece) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut piece).map_err(refused)? {
            0 => break,
            count => digest.update(&piece[..count]),
        }
    }
    Ok(digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Writes the header into a folder.
///
/// # Errors
/// [`Error::File`].
pub fn write_header(directory: &Path) -> Result<(), Error> {
    output::create_folder(directory)?;
    output::write(&directory.join("stickslip_module.h"), HEADER)
}
