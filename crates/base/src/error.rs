//! What can go wrong, with what, where and how to mend it as fields; formatted at the edge.

use std::io;
use std::path::{Path, PathBuf};

use stickslip_core::supervise::{Fault, Role};

use crate::parameters::ParameterProblems;

/// Any failure of the laboratory.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused a file.
    #[error("{}: cannot {action} it ({source}). {}", path.display(), remedy(source))]
    File {
        /// Which file.
        path: PathBuf,
        /// What was tried: "read", "write".
        action: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// Something is wrong with a parameter file.
    #[error(transparent)]
    Parameters(#[from] ParameterProblems),
    /// Something is wrong with what a file of the friction library says about itself.
    #[error(
        "{file}: {problem}. A file of the friction library begins with [about]: title, source, licence, and, where \
             known, lacks and deviations"
    )]
    Library {
        /// Which file.
        file: String,
        /// What.
        problem: String,
    },
    /// There is no parameter at this path.
    #[error("{path} is no parameter. {}", did_you_mean(nearest.as_deref(), "`stickslip params describe` lists them all."))]
    UnknownParameter {
        /// The path asked for.
        path: String,
        /// The known path most like it.
        nearest: Option<String>,
    },
    /// There is no preset of this name, and it is no file.
    #[error("{name} is no preset. {} A path to a file will do, too.",
        did_you_mean(*nearest, &format!("There are: {}.", known.join(", "))))]
    UnknownPreset {
        /// The name asked for.
        name: String,
        /// The known name most like it.
        nearest: Option<&'static str>,
        /// All names.
        known: Vec<&'static str>,
    },
    /// A point that no curve can be fitted through.
    #[error("point {index} of the friction curve: {field} = {value}. {remedy}")]
    CurvePoint {
        /// Counted from 0.
        index: usize,
        /// `velocity`, `torque` or `standard_error`.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// Not enough of something for what was asked.
    #[error("{found} {what}, {needed} are needed. {remedy}")]
    TooFew {
        /// Of what.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        needed: usize,
        /// What to do.
        remedy: &'static str,
    },
    /// A low-pass that the sampling rate does not allow.
    #[error(
        "a low-pass at {cutoff} Hz needs a sampling rate above twice that, and there are {rate} Hz. Lower the cut-off."
    )]
    Cutoff {
        /// Asked for [Hz].
        cutoff: f64,
        /// Sampling rate [Hz].
        rate: f64,
    },
    /// A variant of a sweep that even the finest steps do not resolve.
    #[error(
        "variant {index}: the finest steps still differ by an estimated {error:.1e} of the angle, above the tolerance of \
         {tolerance:e}. Its motion depends on the smallest causes, or runs away: ask for less, or for a shorter time."
    )]
    Unresolved {
        /// Which variant, from 0.
        index: usize,
        /// Estimated error over the largest angle.
        error: f64,
        /// Asked for.
        tolerance: f64,
    },
    /// A step that an integrator cannot take without becoming wrong.
    #[error("a {scheme} step of {step:?} s is beyond the bound of {largest:.2e} s. {remedy}")]
    StepTooLarge {
        /// Which scheme.
        scheme: &'static str,
        /// Asked for [s].
        step: f64,
        /// The bound [s].
        largest: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A number that a design starts from makes no sense.
    #[error("{name} = {value} {unit} is outside {minimum} … {maximum} {unit}. {remedy}")]
    OutOfRange {
        /// What the number is, in words.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its SI unit.
        unit: &'static str,
        /// Smallest allowed value.
        minimum: f64,
        /// Largest allowed value.
        maximum: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// Matrices or lists that do not fit each other.
    #[error("{what} has {found} where {expected} belong. {remedy}")]
    Dimension {
        /// Which one.
        what: &'static str,
        /// Its size.
        found: usize,
        /// The size that the others ask for.
        expected: usize,
        /// What to do.
        remedy: &'static str,
    },
    /// A matrix with NaN or infinity.
    #[error("{what} contains {value}. Look where the number comes from: a parameter that was divided by zero?")]
    NotFinite {
        /// Which matrix.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A computation on a linear system that has no answer.
    #[error("{what} cannot be computed. {remedy}")]
    NotSolvable {
        /// What was asked for.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// The input does not reach, or the output does not show, all states.
    #[error(
        "the system is not {property}: the reciprocal condition of its {property} matrix is {reciprocal_condition:.1e}, \
         below {limit:.1e}. {remedy}"
    )]
    NotReachable {
        /// "controllable" or "observable".
        property: &'static str,
        /// Of the scaled matrix; 1 is perfect, 0 singular.
        reciprocal_condition: f64,
        /// Smallest one that still gives digits.
        limit: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A wanted pole outside the unit circle.
    #[error(
        "the pole {real} + {imaginary}i has magnitude {magnitude}, at most {limit} is stable. \
         Move it inwards: a pole at p 1/s is e^(-p T)."
    )]
    UnstablePole {
        /// Real part.
        real: f64,
        /// Imaginary part.
        imaginary: f64,
        /// Distance from the origin.
        magnitude: f64,
        /// Largest allowed distance.
        limit: f64,
    },
    /// A complex pole without its conjugate: the gains would be complex.
    #[error(
        "the pole {real} + {imaginary}i has no partner at {real} - {imaginary}i. Give complex poles in conjugate pairs."
    )]
    UnpairedPole {
        /// Real part.
        real: f64,
        /// Imaginary part.
        imaginary: f64,
    },
    /// A system without a stationary covariance.
    #[error(
        "the system's spectral radius is {spectral_radius}, a stationary covariance needs less than {limit}. {remedy}"
    )]
    Unstable {
        /// Magnitude of its largest eigenvalue.
        spectral_radius: f64,
        /// It must stay below this.
        limit: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A unit that is unknown or measures something else.
    #[error("{place}: unit \"{unit}\" does not fit. Use one of {known}.")]
    Unit {
        /// Whose unit.
        place: String,
        /// As given.
        unit: String,
        /// What would do.
        known: String,
    },
    /// A recording without a row.
    #[error("{}: there is no row of numbers in it. A recording is a header and one row a sample.", path.display())]
    EmptyRecording {
        /// Which file.
        path: PathBuf,
    },
    /// A row that is not as its header says.
    #[error("{}:{line}: {fault}. Mend or remove the row.", path.display())]
    BadRow {
        /// Which file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// What is wrong with it.
        fault: String,
    },
    /// A cell that is not a finite number.
    #[error("{}:{line}: column `{column}` holds \"{text}\", not a finite number. Write numbers with a decimal point, or cut the rows without a value.", path.display())]
    BadCell {
        /// Which file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// Which column.
        column: String,
        /// What stands there.
        text: String,
    },
    /// A column that the recording does not have.
    #[error("{}: there is no column `{name}` among {}. Is it `{nearest}`? Name it in the machine file under [columns].", path.display(), columns.join(", "))]
    MissingColumn {
        /// Which file.
        path: PathBuf,
        /// Asked for.
        name: String,
        /// What there is.
        columns: Vec<String>,
        /// The one most alike.
        nearest: String,
    },
    /// Time stamps that are not on an even grid.
    #[error("{}:{line}: {fault}: a step of {step:.3e} s where the period is {period:.3e} s. {remedy}", path.display())]
    UnevenTime {
        /// Which file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// What is wrong.
        fault: &'static str,
        /// The step that ends there [s].
        step: f64,
        /// Mean period [s].
        period: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A machine file that is not one.
    #[error("{}: {message}", path.display())]
    MachineFile {
        /// Which file.
        path: PathBuf,
        /// Place and reason.
        message: String,
    },
    /// A number of the machine file that cannot be.
    #[error("{}: {field} = {value} {remedy}", path.display())]
    MachineValue {
        /// Which file.
        path: PathBuf,
        /// Where in it.
        field: &'static str,
        /// As given.
        value: f64,
        /// What it should be.
        remedy: &'static str,
    },
    /// A recording that was not sampled as the machine file says.
    #[error("{}: its period is {found:.6e} s, the machine file says {expected:.6e} s. Correct `sampling_period`, or resample.", path.display())]
    OtherPeriod {
        /// The recording.
        path: PathBuf,
        /// Its period [s].
        found: f64,
        /// The machine's [s].
        expected: f64,
    },
    /// A column whose unit is given twice, and differently.
    #[error("{place}: the machine file says [{told}], the header says [{header}]. Correct one of them.")]
    TwoUnits {
        /// Whose unit.
        place: String,
        /// In the machine file.
        told: String,
        /// In the recording.
        header: String,
    },
    /// A motion that does not tell the parameters apart.
    #[error(
        "the motion does not tell the parameters apart: a share of {smallest:.3e} of one is left by the others, 1e-9 is \
         needed. Record several speeds and accelerations in both directions."
    )]
    Dependent {
        /// Share of a column that lies outside those before it.
        smallest: f64,
    },
    /// A result that no machine has.
    #[error("{what} is {value:.4e}. {remedy}")]
    Implausible {
        /// Of what.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// Supervision has taken the torque away.
    #[error("fault in cycle {cycle}: {reason}")]
    BenchFault {
        /// In which tick.
        cycle: u64,
        /// What was measured, what is allowed, what to do.
        reason: String,
    },
    /// Supervision does not admit what was asked for.
    #[error(transparent)]
    Refused(#[from] stickslip_core::supervise::Refusal),
    /// An experiment that needs the screw's zero.
    #[error("the bench is not homed: the screw's zero is unknown. Home it first.")]
    NotHomed,
    /// The user cancelled; results so far are kept by whoever has them.
    #[error("cancelled")]
    Cancelled,
    /// A recording, or a column of it, that cannot be what it is taken for.
    #[error("{}: {fault}. {remedy}", path.display())]
    Recording {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        fault: String,
        /// What to do.
        remedy: String,
    },
    /// A file that would be overwritten.
    #[error("{}: it exists already. Add --force to replace it, or give another name with --out.", path.display())]
    Exists {
        /// Which file.
        path: PathBuf,
    },
    /// An answer that is none.
    #[error("{question}: \"{answer}\" is no answer. {remedy}")]
    Answer {
        /// What was asked.
        question: String,
        /// What was said.
        answer: String,
        /// What can be said.
        remedy: String,
    },
    /// A saved document that is not one, or not of a kind that is understood here.
    #[error("{}{}: {reason}. {remedy}", path.display(), place.map(|[line, column]| format!(":{line}:{column}")).unwrap_or_default())]
    Document {
        /// Which file.
        path: PathBuf,
        /// Line and column, counted from 1, where the text breaks off.
        place: Option<[usize; 2]>,
        /// What is wrong.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
    /// There is no block of this name.
    #[error("{name} is no block. {}", did_you_mean(nearest.as_deref(), "`stickslip generate --list` names them."))]
    UnknownBlock {
        /// The name asked for.
        name: String,
        /// The known name most like it.
        nearest: Option<String>,
    },
    /// A name that C does not take.
    #[error("{0}. Say another by --prefix")]
    NoIdentifier(#[from] stickslip_codegen::c::NotAName),
    /// A C compiler that refuses what was generated.
    #[error(
        "{compiler} does not compile it: {said}. Say by the variable CC which C99 compiler to take, such as gcc or clang"
    )]
    Compiler {
        /// Which one.
        compiler: String,
        /// The first line of its complaint.
        said: String,
    },
    /// A linked program that does not hold what is looked for.
    #[error("{}: {reason}. {remedy}", path.display())]
    Program {
        /// Its file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A desired friction outside the renderable region.
    #[error("{0}")]
    NotRenderable(Box<dyn std::error::Error + Send + Sync>),
    /// A friction that the load motor cannot render.
    #[error("{name} cannot be the desired friction: {reason}. {remedy}")]
    NotAsDesired {
        /// The friction.
        name: String,
        /// Why.
        reason: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A bench that cannot render.
    #[error(
        "{preset} has no load motor, so that nothing can be rendered. Take a preset whose plant.load_motor has a torque constant."
    )]
    NothingToRender {
        /// The preset.
        preset: String,
    },
    /// A part of a benchmark that there is not.
    #[error("{name} is no {what}. There are: {}.", known.join(", "))]
    NothingToCompare {
        /// What it should be.
        what: &'static str,
        /// The name asked for.
        name: String,
        /// Those that there are.
        known: Vec<&'static str>,
    },
    /// An arm whose rigid part is too heavy to be rendered.
    #[error(
        "an arm of which {rigid_inertia:e} kg m² move with the carriage cannot be rendered: the loop over accelerometer \
         and load motor would oscillate. Up to {feasible:.2e} kg m² can be (bench.arm.rigid_inertia): take less, tick \
         faster, or add the rest to the load as a real mass."
    )]
    ArmTooHeavy {
        /// What was asked for [kg m²].
        rigid_inertia: f64,
        /// What can be rendered [kg m²].
        feasible: f64,
    },
    /// A rendering law that would chatter.
    #[error(
        "rendered like this the load motor would chatter by {}, {limit} N m are allowed: {cause}. {}",
        chatter_in_words(*predicted_chatter), chatter_remedy(*stiffness, *feasible)
    )]
    Chatters {
        /// Predicted change of the load torque from millisecond to millisecond [N m RMS].
        predicted_chatter: f64,
        /// What is allowed of it [N m].
        limit: f64,
        /// Where most of it comes from.
        cause: &'static str,
        /// Stiffness of the bristles that were to be rendered [N m/rad].
        stiffness: Option<f64>,
        /// The nearest below it that can be [N m/rad].
        feasible: Option<f64>,
    },
    /// A cycle that cannot run in real time.
    #[error(transparent)]
    RealTime(#[from] stickslip_rt::PlanError),
    /// A parameter that a bench cannot change while it runs.
    #[error("{path} cannot be changed while the bench runs. {remedy}")]
    NotWhileRunning {
        /// The parameter.
        path: String,
        /// What to do.
        remedy: String,
    },
    /// There is nothing of this name.
    #[error("there is no {what} {name}. {remedy}")]
    Unknown {
        /// Of what kind.
        what: &'static str,
        /// The name asked for.
        name: String,
        /// What there is.
        remedy: String,
    },
    /// Somebody else operates the bench.
    #[error(
        "{by} operates the bench. Wait until it is left for ten seconds, or take it over (`stickslip bench operate`)."
    )]
    Operated {
        /// Who.
        by: String,
    },
    /// Something runs that does not go with what was asked for.
    #[error("{what} runs. Wait for its end, or end it (`stickslip bench halt`).")]
    Busy {
        /// What runs.
        what: String,
    },
    /// A record whose first state is not one of the bench of its preset.
    #[error("the state that the record begins with does not fit its preset. Take the record as it was made.")]
    RecordState,
    /// Nothing of that kind runs.
    #[error("there is no {what} to end.")]
    NothingToEnd {
        /// What was asked for.
        what: &'static str,
    },
    /// No step back, or none forward.
    #[error("there is nothing to {what}.")]
    NothingToUndo {
        /// What was asked for.
        what: &'static str,
    },
    /// A trigger that makes no sense.
    #[error("trigger \"{text}\", column {column}: {fault}. {remedy}")]
    Trigger {
        /// The trigger in words.
        text: String,
        /// Counted from 1.
        column: usize,
        /// What is wrong there.
        fault: String,
        /// What to do.
        remedy: String,
    },
    /// A row of a stream that is not after the one before it.
    #[error("a row of cycle {cycle}{}: cycles increase, below 2^63. A bench that was started anew needs a new stream.",
        last.map_or(String::new(), |last| format!(" after one of cycle {last}")))]
    RowOrder {
        /// Its cycle.
        cycle: u64,
        /// That of the row before.
        last: Option<u64>,
    },
    /// More memory than is allowed.
    #[error("{what} would take {bytes} bytes, {limit} are allowed. {remedy}")]
    TooMuchMemory {
        /// What.
        what: &'static str,
        /// At most.
        bytes: u128,
        /// Allowed.
        limit: usize,
        /// What to do.
        remedy: &'static str,
    },
    /// The catalogue of runs does not take or give something. The runs themselves are as they were.
    #[error("{}: {fault}. {remedy}", path.display())]
    Catalogue {
        /// Its file.
        path: PathBuf,
        /// What is wrong.
        fault: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The catalogue knows no such run.
    #[error("there is no run {number}. `stickslip runs` lists them.")]
    NoRun {
        /// The number asked for.
        number: i64,
    },
    /// A run of the catalogue whose files are not where it says.
    #[error("run {number}: {how}. {remedy}")]
    RunGone {
        /// Its number.
        number: i64,
        /// Why.
        how: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// No name or tag of a run.
    #[error("{text:?} will not do for a run. {remedy}")]
    RunText {
        /// What was given.
        text: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A file that is nothing for the loop.
    #[error("{}: {problem}.", path.display())]
    Foreign {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        problem: String,
    },
    /// A value that what was brought along does not admit.
    #[error("{name} = {value} {unit} is outside {minimum} … {maximum} {unit}. Choose a value within.")]
    ForeignValue {
        /// Its parameter.
        name: String,
        /// As given.
        value: f64,
        /// Its unit.
        unit: String,
        /// Smallest value.
        minimum: f64,
        /// Largest value.
        maximum: f64,
    },
    /// Nothing was brought along.
    #[error(
        "no file was loaded. Start the bench with one: stickslip serve --controller FILE, --friction FILE or --law FILE."
    )]
    NothingLoaded,
    /// Values that what was brought along does not take.
    #[error(
        "{name} refuses these values of its parameters (it answers {code}): it goes on with those before. Choose others; \
         which it takes, its author knows."
    )]
    ForeignRefuses {
        /// Its name.
        name: String,
        /// What its function returned.
        code: i32,
    },
    /// Samples that leave a controller which was brought along no time.
    #[error(
        "the position controller runs in every tick of {tick_rate} Hz, and by the clock the torque of one in a process of \
         its own is taken a tick before it comes into force. Let a sample have two ticks or more (bench.control_divider), \
         or trust it (--trust)."
    )]
    ForeignRate {
        /// Ticks a second [Hz].
        tick_rate: f64,
    },
    /// What was brought along does not begin.
    #[error("{0}")]
    Brought(Fault),
    /// A law that renders the friction of a file away.
    #[error(
        "the admittance law makes the load follow one that does not feel the friction of a file. Choose another law beside \
         it (bench.law.kind = \"residual\")."
    )]
    FollowsNoFriction,
    /// The friction that is rendered is not that of the parameters.
    #[error(
        "a {role} of a file renders: what is measured under it is not the desired friction of the parameters. Measure it \
         by stickslip load FILE --as {role}, or let that of the preset take its place ({selector} = preset)."
    )]
    RendersItself {
        /// What the file is.
        role: Role,
        /// The parameter that says whether it acts.
        selector: &'static str,
    },
    /// A fault on purpose that there is not.
    #[error("no fault \"{fault}\". {remedy}")]
    Injection {
        /// What was asked for.
        fault: String,
        /// What can be injected, and where.
        remedy: String,
    },
}

impl Error {
    /// The system refused to `action` ("read", "write", "create") the file or folder.
    pub fn file(path: &Path, action: &'static str, source: io::Error) -> Self {
        Error::File { path: path.into(), action, source }
    }
}

/// What to do about a refusal of the system.
fn remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "Check the path: a part of it does not exist.",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "Choose another place, or get the right."
        }
        io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => "A part of the path is a file; choose another.",
        io::ErrorKind::IsADirectory | io::ErrorKind::DirectoryNotEmpty => "It is a folder; choose another name.",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "The disk is full: make room, or choose another.",
        io::ErrorKind::InvalidData => "It is no text in UTF-8; is it the right file?",
        _ => "Choose another place, or mend what the system says.",
    }
}

/// Chatter [N m]: what has grown for half a second is of no size.
fn chatter_in_words(torque: f64) -> String {
    if torque < 10.0 { format!("{torque:.3} N m") } else { "as much as it can".into() }
}

/// What to do about chatter.
fn chatter_remedy(stiffness: Option<f64>, feasible: Option<f64>) -> String {
    match (stiffness, feasible) {
        (Some(stiffness), Some(feasible)) => format!(
            "Of bench.desired_bristles.stiffness = {stiffness:.0} N m/rad the nearest that is rendered quietly is \
             {feasible:.0} N m/rad."
        ),
        _ => "Raise bench.tick_rate, or choose another bench.law.".into(),
    }
}

fn did_you_mean(nearest: Option<&str>, otherwise: &str) -> String {
    nearest.map_or_else(|| otherwise.into(), |nearest| format!("Did you mean {nearest}?"))
}
