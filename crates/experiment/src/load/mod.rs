//! External controllers, frictions and laws on the virtual bench, in a simulation or in real time: a controller in
//! standard manoeuvres, compared with the preset's; a friction and a law by the measured friction.

mod manoeuvres;
mod rendered;

use std::fs;
use std::path::Path;

use manoeuvres::Manoeuvres;
use rendered::Rendered;
use stickslip_rt::Quantiles;

use crate::home;
use stickslip_base::figure::Figure;
use stickslip_base::preset::Settings;
use stickslip_base::report::{Provenance, Report, Table};
use stickslip_base::{Error, Preset, Summary, Watch, output, parameters};
use stickslip_bench::external::{BUDGET, Description, External, Role, Signal, role};
use stickslip_bench::run::{About, Recorder};
use stickslip_bench::tap::Tap;
use stickslip_bench::{Bench, Change, ClockedBench, Request, ThreadSettings, TimingReport, VirtualBench};

/// Results of a loaded controller, friction or law.
pub struct Loaded {
    preset: Preset<f64>,
    seed: u64,
    external: External,
    /// Durations of its calls in the loop, and the number of calls longer than [`BUDGET`].
    durations: (Quantiles, u64),
    task: Task,
    /// The fault that ended it early.
    pub fault: Option<String>,
    /// Timing report of a run in real time.
    pub clocked: Option<TimingReport>,
    lateness: Option<Lateness>,
}

/// The experiment, by the role of the external code.
enum Task {
    Manoeuvres(Manoeuvres),
    Friction(Rendered),
}

impl Task {
    /// The experiment within a duration [s].
    fn planned(role: Role, preset: &Preset<f64>, duration: f64) -> Self {
        match role {
            Role::Controller => Task::Manoeuvres(Manoeuvres::planned(preset, duration)),
            Role::Friction | Role::Law => Task::Friction(Rendered::planned(role, preset, duration)),
        }
    }

    /// Runs with the external code in the loop.
    fn with(&mut self, preset: &Preset<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
        match self {
            Task::Manoeuvres(manoeuvres) => manoeuvres.with(preset, bench, watch),
            Task::Friction(rendered) => rendered.with(bench, watch),
        }
    }

    /// Runs with the preset's counterpart.
    fn without(&mut self, preset: &Preset<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
        match self {
            Task::Manoeuvres(manoeuvres) => manoeuvres.without(preset, bench, watch),
            Task::Friction(rendered) => rendered.without(bench, watch),
        }
    }

    /// Names of files, figures and captions.
    fn figures(&self, preset: &Preset<f64>) -> Vec<(String, Figure, String)> {
        match self {
            Task::Manoeuvres(manoeuvres) => manoeuvres.figures(),
            Task::Friction(rendered) => rendered.figures(preset),
        }
    }
}

/// In real time: the time allowed for a torque [s], and the number of late torques.
type Lateness = (f64, u64);

/// A bench that hosts external code.
trait Host: Bench {
    fn bring(&mut self, external: External) -> Result<(), Error>;

    /// Removes it; in real time with the time allowed and the number of late torques.
    fn take_back(&mut self, settings: &Settings<f64>) -> Result<Option<(External, Option<Lateness>)>, Error>;

    /// The fault of the bench behind an error; other errors are returned.
    fn fault(&mut self, error: Error) -> Result<String, Error>;
}

impl Host for VirtualBench {
    fn bring(&mut self, external: External) -> Result<(), Error> {
        self.bring(external)
    }

    fn take_back(&mut self, settings: &Settings<f64>) -> Result<Option<(External, Option<Lateness>)>, Error> {
        Ok(self.take_back(settings)?.map(|external| (external, None)))
    }

    fn fault(&mut self, error: Error) -> Result<String, Error> {
        match error {
            Error::BenchFault { reason, .. } => Ok(reason),
            error => Err(error),
        }
    }
}

impl Host for ClockedBench {
    fn bring(&mut self, external: External) -> Result<(), Error> {
        self.bring(external)
    }

    fn take_back(&mut self, settings: &Settings<f64>) -> Result<Option<(External, Option<Lateness>)>, Error> {
        let guest = self.take_back(settings)?;
        Ok(guest.map(|guest| {
            let lateness = guest.lateness();
            (guest.into_external(), Some(lateness))
        }))
    }

    fn fault(&mut self, error: Error) -> Result<String, Error> {
        // An experiment may also fall behind, or the loop end.
        match self.named_fault() {
            Ok(Some(fault)) => Ok(fault.to_string()),
            _ => Err(error),
        }
    }
}

/// Runs a controller through the manoeuvres that fit into a duration [s], at least the first, and then the preset's
/// controller through the same. For a friction or a law the friction is measured at as many speeds as fit, for a law
/// also under the preset's law. With `record` the run is recorded in this file.
///
/// # Errors
/// Errors of [`VirtualBench::bring`]; [`Error::Cancelled`]. A fault of the external code is a result, not an error.
pub fn load(
    preset: &Preset<f64>,
    external: External,
    duration: f64,
    seed: u64,
    record: Option<&Path>,
    watch: &Watch,
) -> Result<Loaded, Error> {
    let (recorder, tap) = recorder(preset, &external, seed, record)?.unzip();
    let mut bench = VirtualBench::new(preset, seed)?;
    tap.into_iter().for_each(|tap| bench.tap(tap));
    let loaded = run(&mut bench, preset, external, duration, seed, watch)?;
    drop(bench);
    recorder.map(Recorder::finish).transpose()?;
    Ok(loaded)
}

/// The same in real time: a torque that is not computed when its sample ends is late; too long a delay ends the run.
///
/// # Errors
/// As [`load`]; [`BenchError::ForeignRate`](stickslip_bench::BenchError::ForeignRate);
/// [`BenchError::RealTime`](stickslip_bench::BenchError::RealTime); [`Error::BenchFault`] if the bench missed its
/// deadlines.
pub fn load_in_real_time(
    preset: &Preset<f64>,
    external: External,
    duration: f64,
    seed: u64,
    record: Option<&Path>,
    wishes: ThreadSettings,
    watch: &Watch,
) -> Result<Loaded, Error> {
    let (recorder, tap) = recorder(preset, &external, seed, record)?.unzip();
    let mut bench = ClockedBench::virtual_machine(preset, seed, wishes, tap)?;
    let loaded = run(&mut bench, preset, external, duration, seed, watch)?;
    let clocked = bench.stop();
    recorder.map(Recorder::finish).transpose()?;
    Ok(Loaded { clocked, ..loaded })
}

/// Recorder and tap of a run with a file.
fn recorder(
    preset: &Preset<f64>,
    external: &External,
    seed: u64,
    record: Option<&Path>,
) -> Result<Option<(Recorder, Tap)>, Error> {
    let Some(path) = record else { return Ok(None) };
    if path.exists() {
        fs::remove_file(path).map_err(|source| Error::file(path, "replace", source))?;
    }
    // The torques replay without the file; the command identifies it.
    let command = format!("stickslip load ({})", external.words());
    let about = About { command, preset: *preset, seed: Some(seed) };
    Recorder::start(path, &about).map(Some)
}

fn run(
    bench: &mut impl Host,
    preset: &Preset<f64>,
    external: External,
    duration: f64,
    seed: u64,
    watch: &Watch,
) -> Result<Loaded, Error> {
    home(bench, watch)?;
    bench.come_to_rest()?;
    let mut task = Task::planned(external.role(), preset, duration);
    bench.bring(external)?;
    let fault = match task.with(preset, bench, watch) {
        Err(error @ Error::BenchFault { .. }) => Some(bench.fault(error)?),
        ended => ended.map(|()| None)?,
    };
    // The bench continues after a fault of the external code.
    let (mut external, lateness) = bench.take_back(&preset.bench)?.expect("the bench has the external code");
    let fault = fault.map(|reason| match external.message() {
        Some(message) => format!("{reason} Its message: {}.", message.trim_end_matches('.')),
        None => reason,
    });
    if fault.is_some() {
        bench.change(Change::Request(Request::Acknowledge))?;
        home(bench, watch)?;
        bench.come_to_rest()?;
    }
    task.without(preset, bench, watch)?;
    let durations = external.durations();
    if let (Task::Friction(rendered), None) = (&mut task, &fault) {
        rendered.compute_alone(&mut external, preset);
    }
    Ok(Loaded { preset: *preset, seed, external, durations, task, fault, clocked: None, lateness })
}

impl Loaded {
    /// Remarks for the report.
    pub fn remarks(&self) -> Vec<String> {
        let description = self.external.description();
        let mut remarks = vec![format!("{}, SHA-256 {}.", description.name, self.external.hash())];
        if let Task::Friction(rendered) = &self.task {
            remarks.extend(rendered.lead(&self.preset));
        }
        let is_fmu = !description.signals.is_empty();
        remarks.extend(is_fmu.then(|| self.connected()));
        remarks.extend(description.notes.iter().cloned());
        let mut unchanged = 0;
        for (parameter, value) in description.parameters.iter().zip(self.external.values()) {
            // An FMU has many parameters; only changed values are listed.
            if is_fmu && parameter.initial.to_bits() == value.to_bits() {
                unchanged += 1;
                continue;
            }
            let unit = if parameter.unit == "1" { String::new() } else { format!(" {}", parameter.unit) };
            remarks.push(format!("{} = {value}{unit}: {}", parameter.name, parameter.help));
        }
        if unchanged > 0 {
            remarks.push(format!("{unchanged} parameters and inputs have the values of the FMU."));
        }
        let (calls, late) = self.durations;
        let micro = |time: u64| format!("{:.2} µs", 1e-3 * time as f64);
        remarks.push(format!(
            "A call took {} (median), {} (99 %), {} (largest); {late} of {} took longer than {}.",
            micro(calls.p50),
            micro(calls.p99),
            micro(calls.max),
            calls.count,
            micro(BUDGET)
        ));
        if let Some((allowed, late)) = self.lateness {
            let responses = self.external.responses();
            let times = [(responses.p50, "median"), (responses.p99, "99 %"), (responses.max, "largest")];
            let times = times.map(|(time, name)| format!("{} ({name})", micro(time))).join(", ");
            let when =
                if responses.count > 0 { format!("was ready after {times}") } else { "is computed immediately".into() };
            let lateness = match late {
                0 => "none was late".into(),
                _ => format!("{late} were late; the last torque was held meanwhile"),
            };
            remarks.push(format!(
                "In real time its torque {when}; allowed: {} from the start of its sample; {lateness}.",
                micro((1e9 * allowed) as u64)
            ));
        }
        remarks.extend(self.clocked.iter().flat_map(TimingReport::warnings));
        match &self.fault {
            Some(fault) => remarks.push(format!("The bench stopped: {fault}")),
            None => remarks.extend(
                self.external.message().map(|message| format!("Its message: {}.", message.trim_end_matches('.'))),
            ),
        }
        remarks
    }

    /// Kind and connections of an FMU.
    fn connected(&self) -> String {
        let Description { kind, tool, step, signals, .. } = self.external.description();
        let tool = tool.as_ref().map_or(String::new(), |tool| format!(" by {tool}"));
        let one = |signal: &Signal| {
            let unit = if signal.unit.is_empty() { String::new() } else { format!(" [{}]", signal.unit) };
            format!("{} is {}{unit}", signal.name, signal.variable)
        };
        let signals: Vec<String> = signals.iter().map(one).collect();
        let period = role::period(self.external.role(), &self.preset.bench);
        // A sample is a whole number of its steps, up to rounding.
        let apart = |step: &f64| (period / step - (period / step).round()).abs() > 1e-6 || *step > 1.5 * period;
        let steps = step
            .filter(apart)
            .map_or(String::new(), |step| format!(" Designed for steps of {step} s; sample time {period} s."));
        format!("{kind}{tool}: {}.{steps}", signals.join(", "))
    }

    /// Deviations with the external code and with the preset's counterpart.
    pub fn table(&self) -> Table {
        match &self.task {
            Task::Manoeuvres(manoeuvres) => manoeuvres.table(),
            Task::Friction(rendered) => rendered.table(&self.preset),
        }
    }

    /// The numbers, under their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("load");
        match &self.task {
            Task::Manoeuvres(manoeuvres) => manoeuvres.add_to(&mut summary),
            Task::Friction(rendered) => rendered.add_to(&self.preset, &mut summary),
        }
        let (calls, late) = self.durations;
        for (name, time) in [("p50", calls.p50), ("p99", calls.p99), ("largest", calls.max)] {
            summary.result(&format!("call.{name}"), 1e-9 * time as f64, "s");
        }
        summary.result("call.count", calls.count as f64, "1").result("call.over_budget", late as f64, "1");
        if let Some((allowed, late)) = self.lateness {
            let responses = self.external.responses();
            for (name, time) in [("p50", responses.p50), ("p99", responses.p99), ("largest", responses.max)] {
                summary.result(&format!("response.{name}"), 1e-9 * time as f64, "s");
            }
            summary.result("response.allowed", allowed, "s").result("response.late", late as f64, "1");
        }
        self.clocked.iter().for_each(|clocked| clocked.add_to(&mut summary));
        summary.result("fault", f64::from(u8::from(self.fault.is_some())), "1");
        let description = self.external.description();
        summary.row([
            ("kind", self.external.role().name().into()),
            ("name", description.name.clone().into()),
            ("form", description.kind.clone().into()),
            ("tool", description.tool.clone().into()),
            ("sha256", self.external.hash().into()),
            ("fault", self.fault.clone().into()),
        ]);
        for Signal { name, variable, unit } in &description.signals {
            summary.row([
                ("kind", "signal".into()),
                ("name", name.clone().into()),
                ("variable", variable.clone().into()),
                ("unit", unit.clone().into()),
            ]);
        }
        for (parameter, value) in description.parameters.iter().zip(self.external.values()) {
            summary.row([
                ("kind", "parameter".into()),
                ("name", parameter.name.clone().into()),
                ("value", (*value).into()),
                ("unit", parameter.unit.clone().into()),
            ]);
        }
        summary
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let provenance = Provenance::new(command, Some(self.seed), parameters::write_commented(&self.preset));
        let report = Report::new(format!("{} in the loop", self.external.description().name), provenance);
        let report = report.summary(self.lead()).table(self.table());
        let report = self
            .task
            .figures(&self.preset)
            .into_iter()
            .fold(report, |report, (_, figure, caption)| report.figure(figure, caption));
        let report = report.heading("Loaded code and its timing").list(self.remarks());
        self.clocked
            .iter()
            .fold(report, |report, clocked| report.table(clocked.table().caption("Timing of all cycles.")))
    }

    /// Summary, in one or two sentences.
    fn lead(&self) -> String {
        let stopped = self.fault.iter().map(|fault| format!("The bench stopped: {fault}"));
        let results = match &self.task {
            Task::Manoeuvres(manoeuvres) => manoeuvres.lead(),
            Task::Friction(rendered) => rendered.lead(&self.preset),
        };
        stopped.chain(results).collect::<Vec<_>>().join(" ")
    }

    /// Writes figures, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        let mut summary = self.summary();
        for (name, figure, _) in self.task.figures(&self.preset) {
            output::write(&directory.join(&name), figure.svg())?;
            summary.file(&name);
        }
        self.report(command).write_all(summary, [], directory)
    }
}
