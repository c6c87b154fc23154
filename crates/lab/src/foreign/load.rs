//! A controller that was brought along on the virtual bench, simulated or by the clock: standard manoeuvres, beside the
//! preset's own controller.

use std::fs;
use std::path::Path;

use stickslip_core::control::reference::Generator;

use super::{BUDGET, Description, Foreign, Signal};
use crate::bench::tap::Tap;
use crate::bench::{Bench, Change, Clocked, ClockedBench, Command, Frame, Request, VirtualBench, Wishes};
use crate::benchmark::Manoeuvre;
use crate::experiment::home;
use crate::figure::{Axis, Figure, Role, Series};
use crate::preset::Settings;
use crate::quantity::Estimate;
use crate::report::{Cell, Provenance, Report, Table};
use crate::run::{About, Recorder};
use crate::{Error, Preset, Summary, Watch, output, parameters};

/// What is followed, in this order.
const MANOEUVRES: [Manoeuvre; 4] =
    [Manoeuvre::SlowSine, Manoeuvre::FastSine, Manoeuvre::PointToPoint, Manoeuvre::Reversal];
/// What the table of deviations has.
const CAPTION: &str =
    "Deviation over the whole of each manoeuvre, by the encoder, with the loaded controller and with the preset's.";
/// What is shown of a course at most, in points.
const POINTS: usize = 4000;

/// How a manoeuvre was followed, by the encoder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Followed {
    /// Its stable name.
    pub manoeuvre: &'static str,
    /// Deviation, RMS and largest magnitude [rad].
    pub deviation: [f64; 2],
    /// Time and deviation of each sample [s], [rad].
    pub course: Vec<(f64, f64)>,
}

/// What came of it.
pub struct Loaded {
    preset: Preset<f64>,
    seed: u64,
    foreign: Foreign,
    brought: Vec<Followed>,
    own: Vec<Followed>,
    /// What ended it before its time.
    pub fault: Option<String>,
    /// How the clock was kept.
    pub clocked: Option<Clocked>,
    lateness: Option<Lateness>,
}

/// By the clock: how long a controller had for a torque [s], and how many were not there in time.
type Lateness = (f64, u64);

/// A bench that takes a controller along.
trait Takes: Bench {
    fn bring(&mut self, foreign: Foreign) -> Result<(), Error>;

    /// Without it again; by the clock with how long it had, and how often it was late.
    fn take_back(&mut self, settings: &Settings<f64>) -> Result<Option<(Foreign, Option<Lateness>)>, Error>;

    /// The fault that ended something, unless it was none of the bench.
    fn fault(&mut self, error: Error) -> Result<String, Error>;
}

impl Takes for VirtualBench {
    fn bring(&mut self, foreign: Foreign) -> Result<(), Error> {
        self.bring(foreign)
    }

    fn take_back(&mut self, settings: &Settings<f64>) -> Result<Option<(Foreign, Option<Lateness>)>, Error> {
        Ok(self.take_back(settings)?.map(|foreign| (foreign, None)))
    }

    fn fault(&mut self, error: Error) -> Result<String, Error> {
        match error {
            Error::BenchFault { reason, .. } => Ok(reason),
            error => Err(error),
        }
    }
}

impl Takes for ClockedBench {
    fn bring(&mut self, foreign: Foreign) -> Result<(), Error> {
        self.bring(foreign)
    }

    fn take_back(&mut self, settings: &Settings<f64>) -> Result<Option<(Foreign, Option<Lateness>)>, Error> {
        let guest = self.take_back(settings)?;
        Ok(guest.map(|guest| {
            let lateness = guest.lateness();
            (guest.into_foreign(), Some(lateness))
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

/// Runs a controller through the manoeuvres that fit into a duration [s], the first in any case, and then the preset's own
/// through the same; the run is recorded where a file is named.
///
/// # Errors
/// What the bench refuses; [`Error::Cancelled`]. A fault of the controller is a result.
pub fn load(
    preset: &Preset<f64>,
    foreign: Foreign,
    duration: f64,
    seed: u64,
    record: Option<&Path>,
    watch: &Watch,
) -> Result<Loaded, Error> {
    let (recorder, tap) = recorded(preset, &foreign, seed, record)?.unzip();
    let mut bench = VirtualBench::new(preset, seed)?;
    tap.into_iter().for_each(|tap| bench.tap(tap));
    let loaded = run(&mut bench, preset, foreign, duration, seed, watch)?;
    drop(bench);
    recorder.map(Recorder::finish).transpose()?;
    Ok(loaded)
}

/// The same by the clock: what is not computed when its sample ends is late, and ends it.
///
/// # Errors
/// As [`load`]; [`Error::ForeignRate`]; [`Error::RealTime`]; [`Error::BenchFault`] where the clock could not be kept.
pub fn load_by_the_clock(
    preset: &Preset<f64>,
    foreign: Foreign,
    duration: f64,
    seed: u64,
    record: Option<&Path>,
    wishes: Wishes,
    watch: &Watch,
) -> Result<Loaded, Error> {
    let (recorder, tap) = recorded(preset, &foreign, seed, record)?.unzip();
    let mut bench = ClockedBench::virtual_machine(preset, seed, wishes, tap)?;
    let loaded = run(&mut bench, preset, foreign, duration, seed, watch)?;
    let clocked = bench.stop();
    recorder.map(Recorder::finish).transpose()?;
    Ok(Loaded { clocked, ..loaded })
}

/// Who records the run, where a file is named.
fn recorded(
    preset: &Preset<f64>,
    foreign: &Foreign,
    seed: u64,
    record: Option<&Path>,
) -> Result<Option<(Recorder, Tap)>, Error> {
    let Some(path) = record else { return Ok(None) };
    if path.exists() {
        fs::remove_file(path).map_err(|source| Error::file(path, "replace", source))?;
    }
    // The torques replay without the file; which one gave them is told by this.
    let command = format!("stickslip load ({}, SHA-256 {})", foreign.description().name, foreign.hash());
    let about = About { command, preset: *preset, seed: Some(seed) };
    Recorder::start(path, &about).map(Some)
}

fn run(
    bench: &mut impl Takes,
    preset: &Preset<f64>,
    foreign: Foreign,
    duration: f64,
    seed: u64,
    watch: &Watch,
) -> Result<Loaded, Error> {
    let mut wanted = Vec::new();
    let mut total = 0.0;
    for manoeuvre in MANOEUVRES {
        total += manoeuvre.reference(preset, 0.5).1;
        if wanted.is_empty() || total <= duration {
            wanted.push(manoeuvre);
        }
    }
    home(bench, watch)?;
    bench.come_to_rest()?;
    bench.bring(foreign)?;
    let mut brought = Vec::new();
    let fault = match follow(&wanted, preset, bench, &mut brought, watch) {
        Err(error @ Error::BenchFault { .. }) => Some(bench.fault(error)?),
        ended => ended.map(|()| None)?,
    };
    // The bench lives on, whatever became of the controller.
    let (foreign, lateness) = bench.take_back(&preset.bench)?.expect("it was brought");
    let fault = fault.map(|reason| match foreign.said() {
        Some(said) => format!("{reason} It said: {}.", said.trim_end_matches('.')),
        None => reason,
    });
    if fault.is_some() {
        bench.change(Change::Request(Request::Acknowledge))?;
        home(bench, watch)?;
        bench.come_to_rest()?;
    }
    let mut own = Vec::new();
    follow(&wanted, preset, bench, &mut own, watch)?;
    Ok(Loaded { preset: *preset, seed, foreign, brought, own, fault, clocked: None, lateness })
}

fn follow(
    wanted: &[Manoeuvre],
    preset: &Preset<f64>,
    bench: &mut impl Bench,
    followed: &mut Vec<Followed>,
    watch: &Watch,
) -> Result<(), Error> {
    let (rate, divider) = (preset.bench.tick_rate, preset.bench.divider());
    for (number, manoeuvre) in wanted.iter().enumerate() {
        // One tick without torque tells where the screw is.
        let home = bench.step(Command::default())?.angle;
        let (reference, duration) = manoeuvre.reference(preset, 0.5);
        let mut setpoints = Generator::new(reference, rate).with_origin(home);
        let mut course = Vec::new();
        let mut begin = None;
        let mut see = |frame: &Frame| {
            let before = *begin.get_or_insert(frame.cycle - 1);
            if frame.cycle.is_multiple_of(divider) {
                let time = (frame.cycle - before) as f64 / rate;
                course.push((time, frame.command.setpoint.position - frame.angle));
            }
        };
        let ticks = (duration * rate).round() as u64;
        for tick in 0..ticks {
            if tick.is_multiple_of(2048) {
                let part = (number as f64 + tick as f64 / ticks as f64) / wanted.len() as f64;
                watch.stage(manoeuvre.name(), part)?;
            }
            let command = Command { setpoint: setpoints.next(), control: true, ..Command::default() };
            bench.hand_over(command)?.iter().for_each(&mut see);
        }
        bench.drain(&mut see)?;
        bench.come_to_rest()?;
        let square: f64 = course.iter().map(|(_, deviation)| deviation * deviation).sum();
        let peak = course.iter().fold(0.0f64, |most, (_, deviation)| most.max(deviation.abs()));
        let deviation = [libm::sqrt(square / course.len() as f64), peak];
        followed.push(Followed { manoeuvre: manoeuvre.name(), deviation, course });
    }
    Ok(())
}

impl Loaded {
    /// What a reader should know.
    pub fn remarks(&self) -> Vec<String> {
        let description = self.foreign.description();
        let mut remarks = vec![format!("{}, SHA-256 {}.", description.name, self.foreign.hash())];
        let is_fmu = !description.signals.is_empty();
        remarks.extend(is_fmu.then(|| self.connected()));
        remarks.extend(description.notes.iter().cloned());
        let mut kept = 0;
        for (parameter, value) in description.parameters.iter().zip(self.foreign.values()) {
            // A model has many parameters; what was set is what counts.
            if is_fmu && parameter.initial.to_bits() == value.to_bits() {
                kept += 1;
                continue;
            }
            let unit = if parameter.unit == "1" { String::new() } else { format!(" {}", parameter.unit) };
            remarks.push(format!("{} = {value}{unit}: {}", parameter.name, parameter.help));
        }
        if kept > 0 {
            remarks.push(format!("{kept} parameters and inputs have the values of the FMU."));
        }
        let (calls, late) = self.foreign.durations();
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
            let responses = self.foreign.responses();
            let there = [(responses.p50, "median"), (responses.p99, "99 %"), (responses.max, "largest")];
            let there = there.map(|(time, which)| format!("{} ({which})", micro(time))).join(", ");
            let when =
                if responses.count > 0 { format!("was there after {there}") } else { "is computed at once".into() };
            remarks.push(format!(
                "By the clock its torque {when}, of the {} that it has from the begin of its sample; {late} came too late.",
                micro((1e9 * allowed) as u64)
            ));
        }
        remarks.extend(self.clocked.iter().flat_map(Clocked::warnings));
        match &self.fault {
            Some(fault) => remarks.push(format!("The bench stopped: {fault}")),
            None => remarks.extend(self.foreign.said().map(|said| format!("It said: {}.", said.trim_end_matches('.')))),
        }
        remarks
    }

    /// What an FMU is, and how it is connected.
    fn connected(&self) -> String {
        let Description { kind, tool, step, signals, .. } = self.foreign.description();
        let tool = tool.as_ref().map_or(String::new(), |tool| format!(" by {tool}"));
        let one = |signal: &Signal| {
            let unit = if signal.unit.is_empty() { String::new() } else { format!(" [{}]", signal.unit) };
            format!("{} is {}{unit}", signal.name, signal.variable)
        };
        let signals: Vec<String> = signals.iter().map(one).collect();
        let period = self.preset.bench.control_period();
        // A sample is a whole number of its steps, up to rounding.
        let apart = |step: &f64| (period / step - (period / step).round()).abs() > 1e-6 || *step > 1.5 * period;
        let steps = step
            .filter(apart)
            .map_or(String::new(), |step| format!(" It is made for steps of {step} s, and a sample has {period} s."));
        format!("{kind}{tool}: {}.{steps}", signals.join(", "))
    }

    /// Deviations of both.
    pub fn table(&self) -> Table {
        let cell = |followed: Option<&Followed>, which: usize| {
            followed
                .map_or_else(|| Cell::from("stopped"), |it| Cell::Estimate(Estimate::new(it.deviation[which], "rad")))
        };
        self.own.iter().enumerate().fold(
            Table::new(["manoeuvre", "RMS", "RMS, preset's", "peak", "peak, preset's"]).caption(CAPTION),
            |table, (k, own)| {
                let brought = self.brought.get(k);
                table.row([
                    own.manoeuvre.into(),
                    cell(brought, 0),
                    cell(Some(own), 0),
                    cell(brought, 1),
                    cell(Some(own), 1),
                ])
            },
        )
    }

    /// The numbers, under their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("load");
        for (who, all) in [("controller", &self.brought), ("own", &self.own)] {
            for Followed { manoeuvre, deviation: [rms, peak], .. } in all {
                summary.result(&format!("{who}.{manoeuvre}.rms"), *rms, "rad");
                summary.result(&format!("{who}.{manoeuvre}.peak"), *peak, "rad");
            }
        }
        let (calls, late) = self.foreign.durations();
        for (name, time) in [("p50", calls.p50), ("p99", calls.p99), ("largest", calls.max)] {
            summary.result(&format!("call.{name}"), 1e-9 * time as f64, "s");
        }
        summary.result("call.count", calls.count as f64, "1").result("call.over_budget", late as f64, "1");
        if let Some((allowed, late)) = self.lateness {
            let responses = self.foreign.responses();
            for (name, time) in [("p50", responses.p50), ("p99", responses.p99), ("largest", responses.max)] {
                summary.result(&format!("response.{name}"), 1e-9 * time as f64, "s");
            }
            summary.result("response.allowed", allowed, "s").result("response.late", late as f64, "1");
        }
        self.clocked.iter().for_each(|clocked| clocked.tell(&mut summary));
        summary.result("fault", f64::from(u8::from(self.fault.is_some())), "1");
        let description = self.foreign.description();
        summary.row([
            ("kind", "controller".into()),
            ("name", description.name.clone().into()),
            ("form", description.kind.clone().into()),
            ("tool", description.tool.clone().into()),
            ("sha256", self.foreign.hash().into()),
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
        for (parameter, value) in description.parameters.iter().zip(self.foreign.values()) {
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
        let report = Report::new(format!("{} in the loop", self.foreign.description().name), provenance);
        let report = report.summary(self.lead()).table(self.table());
        let report = self.figures().into_iter().fold(report, |report, (_, figure)| {
            report.figure(
                figure,
                "Deviation of the measured angle from the set-point, with the loaded controller and with the preset's.",
            )
        });
        let report = report.heading("What was loaded, and how it ran").list(self.remarks());
        self.clocked.iter().fold(report, |report, clocked| {
            report.table(clocked.table().caption("How the clock was kept, all cycles."))
        })
    }

    /// What came of it, in a sentence or two.
    fn lead(&self) -> String {
        let stopped = self.fault.iter().map(|fault| format!("The bench stopped: {fault}"));
        let compared = self.brought.iter().zip(&self.own).map(|(brought, own)| {
            let [brought_rms, own_rms] = [brought, own].map(|it| Estimate::new(it.deviation[0], "rad").to_string());
            format!("{}: {brought_rms} RMS, with the preset's controller {own_rms}.", brought.manoeuvre)
        });
        stopped.chain(compared).collect::<Vec<_>>().join(" ")
    }

    fn figures(&self) -> Vec<(String, Figure)> {
        let figure = |(k, own): (usize, &Followed)| {
            let line = |role, name: &'static str, of: &Followed| {
                let stride = of.course.len().div_ceil(POINTS).max(1);
                let points = of.course.iter().step_by(stride).map(|(time, deviation)| (*time, 1e3 * deviation));
                Series::line(role, name, points.collect::<Vec<_>>())
            };
            let figure = Figure::new(format!("Deviation: {}", own.manoeuvre))
                .x(Axis::new("time", "s"))
                .y(Axis::new("deviation", "mrad"))
                .series(line(Role::Reference, "preset's controller", own));
            let figure = match self.brought.get(k) {
                Some(brought) => figure.series(line(Role::Trace(0), "loaded controller", brought)),
                None => figure,
            };
            (format!("{}.svg", own.manoeuvre), figure)
        };
        self.own.iter().enumerate().map(figure).collect()
    }

    /// Writes figures, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        let mut summary = self.summary();
        for (name, figure) in self.figures() {
            output::write(&directory.join(&name), figure.svg())?;
            summary.file(&name);
        }
        self.report(command).write_all(summary, [], directory)
    }
}
