//! External position controllers, frictions and rendering laws in the loop of the bench.
//!
//! Each is a shared library with the five functions of `stickslip_module.h`, or an FMU for co-simulation. Unless it is
//! trusted, it runs in a separate process ([`process`]), so that its faults do not end the bench. Its torque is part of
//! the command and becomes active one sample later, so that a record of the run replays without the library. Its
//! [`Role`] is that of a controller, a friction or a law.

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
use std::io::Read as _;
use std::path::Path;
use std::time::Duration;

pub use file::ExternalFile;
pub use in_loop::ExternalInLoop;
use library::Library;
pub use operator::OperatorSide;
use operator::{CallTimes, Line, operator_side};
use sha2::{Digest as _, Sha256};
use stickslip_core::control::AxisControlInput;
use stickslip_rt::{Durations, Quantiles};
pub use stickslip_rt::{ModuleParameter, ModuleSample};
pub use stickslip_software::supervise::Role;
use stickslip_software::supervise::{ExternalFault, Fault};

use stickslip_base::parameters::schema::nearest;
use stickslip_base::{Error, input, output};

/// Time budget of a call [ns]; longer calls are counted.
pub const BUDGET: u64 = 10_000;
/// Time-out of an answer.
pub const PATIENCE: Duration = Duration::from_secs(2);

/// Maximum number of names in a message.
const LISTED: usize = 20;

/// The C header of a library.
pub const HEADER: &str = include_str!("stickslip_module.h");

/// Description of an external controller, friction or law.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Description {
    /// Name.
    pub name: String,
    /// Parameters.
    pub parameters: Vec<ModuleParameter>,
    /// Kind of the file: `C library`, `FMU 2.0`.
    pub kind: String,
    /// Tool that generated it, if stated.
    pub tool: Option<String>,
    /// Internal time step, if stated [s].
    pub step: Option<f64>,
    /// Variables mapped to signals of the bench; empty for a C library, whose signals are those of the header.
    pub signals: Vec<Signal>,
    /// Notes for the user, in sentences.
    pub notes: Vec<String>,
}

/// A signal of the bench, mapped to a variable of an FMU.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signal {
    /// Name as in `stickslip_module.h`.
    pub name: String,
    /// Name of the variable in the FMU.
    pub variable: String,
    /// Unit in the FMU; empty if not stated, in which case SI is assumed.
    pub unit: String,
}

/// Answer to a request.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Answer {
    /// Its torque [N m].
    pub(crate) torque: f64,
    /// Duration of the call [ns].
    pub(crate) time: u64,
    /// Result for new parameter values: 0 if accepted.
    pub(crate) refused: i32,
}

/// Request in real time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Question<'a> {
    /// Start at rest: sampling time [s], maximum torque of the drive [N m], parameter values.
    Begin(f64, f64, &'a [f64]),
    /// One sample, preceded by new parameter values if there are any.
    Step(&'a ModuleSample, Option<&'a [f64]>),
}

/// Calls the functions, in this or in another process.
pub(crate) trait Caller: Send {
    /// Starts at rest.
    fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> Result<(), ExternalFault>;

    /// One sample, preceded by new parameter values if there are any. Refused values are not used.
    fn step(&mut self, sample: &ModuleSample, values: Option<&[f64]>) -> Result<Answer, ExternalFault>;

    /// Most severe message since the start, if available.
    fn message(&self) -> Option<String> {
        None
    }

    /// In real time: sends a request without waiting. Returns the answer if available at once, as in this process.
    fn ask(&mut self, question: Question<'_>) -> Option<Result<Answer, ExternalFault>> {
        Some(match question {
            Question::Begin(sample_time, torque_limit, values) => {
                self.begin(sample_time, torque_limit, values).map(|()| Answer::default())
            }
            Question::Step(sample, values) => self.step(sample, values),
        })
    }

    /// Answer to the last request, if available.
    fn look(&mut self) -> Option<Result<Answer, ExternalFault>> {
        None
    }

    /// Whether the answer is computed within the call.
    fn answers_at_once(&self) -> bool {
        true
    }

    /// Requests a real-time priority for a separate process with one request per `_period`.
    fn hurry(&self, _priority: u8, _period: Duration) {}

    /// Reason why no answer can follow, if known.
    fn ended(&self) -> Option<ExternalFault> {
        None
    }

    /// Response time of the last request [ns], if known.
    fn response(&self) -> Option<u64> {
        None
    }
}

/// Outstanding answer in real time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outstanding {
    Begin,
    Torque,
}

/// State of a request in real time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Course {
    /// No request is outstanding.
    Nothing,
    /// No answer yet.
    Open,
    /// It has started.
    Started,
    /// Its torque [N m], finite.
    Torque(f64),
}

/// An open external controller, friction or law.
pub struct External {
    role: Role,
    description: Description,
    values: Vec<f64>,
    /// New parameter values not sent yet, and whether there are any.
    requested: Vec<f64>,
    pending: bool,
    line: Option<Line>,
    hash: String,
    caller: Box<dyn Caller>,
    durations: Durations,
    late: u64,
    /// In real time: the outstanding request, with its answer if it was available at once.
    outstanding: Option<(Outstanding, Option<Result<Answer, ExternalFault>>)>,
    responses: Durations,
}

impl External {
    /// Opens a library or an FMU in this process. Its faults, such as a crash, end this process.
    ///
    /// # Errors
    /// [`BenchError::External`] for an invalid file; [`Error::File`].
    pub fn trusted(path: &Path, role: Role) -> Result<Self, Error> {
        Self::trusted_as(path, role, &[])
    }

    /// The same with an explicit mapping of signals to variables of an FMU: signal, variable.
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
            requested: values.clone(),
            values,
            pending: false,
            line: None,
            hash,
            caller,
            durations,
            late: 0,
            outstanding: None,
            responses,
        }
    }

    /// Role in the loop.
    pub fn role(&self) -> Role {
        self.role
    }

    /// The fault of the bench for a fault of the external file.
    pub fn fault(&self, fault: ExternalFault) -> Fault {
        Fault::External(self.role, fault)
    }

    /// Description of an external controller, friction or law.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Identification in a record: role, name and hash of the file.
    pub fn words(&self) -> String {
        format!("{} {}, SHA-256 {}", self.role, self.description.name, self.hash)
    }

    /// SHA-256 of its file, in hexadecimal digits.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// Parameter values, in their order.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Sets the value of a parameter for the next start.
    ///
    /// # Errors
    /// [`Error::Unknown`], [`BenchError::ForeignValue`].
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), Error> {
        let parameters = &self.description.parameters;
        let Some(index) = parameters.iter().position(|parameter| parameter.name == name) else {
            let remedy = available(name, self.role, parameters);
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

    /// Most severe message since the start, if there is one.
    pub fn message(&self) -> Option<String> {
        self.caller.message()
    }

    /// Durations of its calls [ns], and number of calls longer than [`BUDGET`].
    pub fn durations(&self) -> (Quantiles, u64) {
        (self.durations.quantiles(), self.late)
    }

    /// Starts at rest: sampling time [s], maximum torque of the drive [N m].
    ///
    /// # Errors
    /// Reason why it does not start.
    pub fn begin(&mut self, sample_time: f64, torque_limit: f64) -> Result<(), ExternalFault> {
        self.caller.begin(sample_time, torque_limit, &self.values)
    }

    /// One sample: the torque [N m], finite.
    ///
    /// # Errors
    /// Its fault.
    pub fn step(&mut self, sample: &ModuleSample) -> Result<f64, ExternalFault> {
        self.take_values();
        let answer = self.caller.step(sample, self.pending.then_some(&self.requested[..]))?;
        self.evaluate(answer, None)
    }

    /// Evaluates an answer: counts its times and the result for new values.
    fn evaluate(&mut self, answer: Answer, response: Option<u64>) -> Result<f64, ExternalFault> {
        let Answer { torque, time, refused } = answer;
        if std::mem::take(&mut self.pending) {
            self.settle(refused);
        }
        self.durations.add(time);
        self.late += u64::from(time > BUDGET);
        response.into_iter().for_each(|time| self.responses.add(time));
        self.line.iter_mut().for_each(|line| line.count(CallTimes { call: time, response }));
        if torque.is_finite() { Ok(torque) } else { Err(ExternalFault::NotANumber) }
    }

    /// The side of the operator while it is in the loop.
    pub fn console(&mut self) -> OperatorSide {
        let (operator, line) = operator_side(&self.values);
        self.line = Some(line);
        operator
    }

    /// Sets a permitted value of a parameter for the next start.
    pub fn begin_with(&mut self, index: usize, value: f64) {
        self.values[index] = value;
    }

    /// Marks it as failed until it is reopened.
    pub(crate) fn fail(&self) {
        self.line.iter().for_each(Line::fail);
    }

    /// Takes new values for the next sample.
    fn take_values(&mut self) {
        if let Some(values) = self.line.as_mut().and_then(Line::values) {
            self.requested.copy_from_slice(values);
            self.pending = true;
        }
    }

    /// Handles its result for new values.
    fn settle(&mut self, code: i32) {
        if code == 0 {
            self.values.copy_from_slice(&self.requested);
        }
        self.line.iter().for_each(|line| line.set_result(code));
    }

    /// Takes new values for the next start. Returns whether there were any.
    pub fn take_for_begin(&mut self) -> bool {
        self.take_values();
        let changed = std::mem::take(&mut self.pending);
        if changed {
            self.settle(0);
        }
        changed
    }

    /// Whether its torque is available at once in real time.
    pub fn answers_at_once(&self) -> bool {
        self.caller.answers_at_once()
    }

    /// Requests a real-time priority for a separate process with one request per period [s].
    pub(crate) fn hurry(&self, priority: u8, period: f64) {
        self.caller.hurry(priority, Duration::from_secs_f64(period));
    }

    /// In real time: counts a late torque.
    pub(crate) fn count_late(&self) {
        self.line.iter().for_each(Line::late);
    }

    /// In real time: requests a start without waiting; no request may be outstanding.
    pub(crate) fn ask_to_begin(&mut self, sample_time: f64, torque_limit: f64) {
        let answer = self.caller.ask(Question::Begin(sample_time, torque_limit, &self.values));
        self.outstanding = Some((Outstanding::Begin, answer));
    }

    /// In real time: requests the torque of a sample without waiting; no request may be outstanding.
    pub(crate) fn ask(&mut self, sample: &ModuleSample) {
        self.take_values();
        let answer = self.caller.ask(Question::Step(sample, self.pending.then_some(&self.requested[..])));
        self.outstanding = Some((Outstanding::Torque, answer));
    }

    /// In real time: takes the answer to the request, if available.
    ///
    /// # Errors
    /// Its fault.
    pub(crate) fn look(&mut self) -> Result<Course, ExternalFault> {
        let Some((outstanding, answer)) = &mut self.outstanding else { return Ok(Course::Nothing) };
        let Some(answer) = answer.take().or_else(|| self.caller.look()) else { return Ok(Course::Open) };
        let outstanding = *outstanding;
        self.outstanding = None;
        match outstanding {
            Outstanding::Begin => answer.map(|_| Course::Started),
            Outstanding::Torque => {
                let response = self.caller.response();
                self.evaluate(answer?, response).map(Course::Torque)
            }
        }
    }

    /// Reason why no answer can follow, if known.
    pub(crate) fn ended(&self) -> Option<ExternalFault> {
        self.caller.ended()
    }

    /// Response times in real time [ns]; empty if it answers at once, or if the system does not support the
    /// measurement.
    pub fn responses(&self) -> Quantiles {
        self.responses.quantiles()
    }
}

/// Remedy for an unknown parameter: the similar and the available names.
fn available(name: &str, role: Role, parameters: &[ModuleParameter]) -> String {
    let names = || parameters.iter().map(|parameter| parameter.name.as_str());
    let did = nearest(name, names()).map_or(String::new(), |nearest| format!("Did you mean {nearest}? "));
    let mut all = names().take(LISTED).collect::<Vec<_>>().join(", ");
    if parameters.len() > LISTED {
        all += &format!(" and {} more", parameters.len() - LISTED);
    }
    format!("{did}The {role} has: {}.", if all.is_empty() { "none" } else { &all })
}

/// Inputs of a controller at a time since its start [s].
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
    let mut file = input::open(path, input::PROGRAM)?;
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
