//! Controllers under test.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;
use stickslip_bench::BenchError;

use stickslip_core::control::compensation::{Hold, StictionHold};
use stickslip_core::control::{Cascade, Pid};
use stickslip_core::fields::{Field, Fields, Variant, Walk};
use stickslip_software::supervise::Fault;

use super::PROGRAM;
use super::loaded::Loaded;
use super::{Lane, run_in_lanes};
use stickslip_base::parameters::{self, presets};
use stickslip_base::preset::{
    CompensationChoice, ControllerChoice, FilterChoice, Observation, Preset, ShaperChoice, StateFeedback,
};
use stickslip_base::{Error, Watch, output};
use stickslip_design::{cascade_as_pid, tune};
use stickslip_experiment::workflow::position_loop::as_predictive;
use stickslip_simulate::manoeuvre::Course;

/// Speed of the sliding load for the tuning [rad/s].
const SLIDING: f64 = 10.0;

/// A controller with compensation and hold, with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Entrant {
    /// A base and its additions, joined by `+`; or the file, with the parameter values that are set.
    pub name: String,
    source: Source,
}

#[derive(Clone, Debug, PartialEq)]
enum Source {
    /// A built-in controller.
    House(Box<House>),
    /// A controller from a parameter file, used as written.
    File(Box<Preset<f64>>),
    /// A library, an FMU or a Python function.
    Loaded(Loaded),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct House {
    base: Base,
    compensation: CompensationChoice<f64>,
    holds: bool,
    dithers: bool,
}

/// Built-in controllers, each tuned once for a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Base {
    Pid,
    Cascade,
    StateFeedback,
    Reduced,
    LoadSide,
    MotorSide,
    Predictive,
}

/// File endings of external controllers.
const EXTERNAL: [&str; 5] = ["so", "dll", "dylib", "fmu", "py"];

const BASES: [(&str, Base); 7] = [
    ("pid", Base::Pid),
    ("cascade", Base::Cascade),
    ("state-feedback", Base::StateFeedback),
    ("reduced", Base::Reduced),
    ("load-side", Base::LoadSide),
    ("motor-side", Base::MotorSide),
    ("mpc", Base::Predictive),
];

/// Default controllers; the first is the reference of the others. Where no limit is active, as in the usual manoeuvres,
/// `mpc` is `state-feedback`.
pub const HOUSE: [&str; 15] = [
    "pid",
    "cascade",
    "state-feedback",
    "load-side",
    "cascade+feedforward",
    "cascade+adaptive",
    "cascade+friedland-park",
    "cascade+friction-observer",
    "cascade+disturbance-observer",
    "state-feedback+feedforward",
    "state-feedback+adaptive",
    "state-feedback+friction-observer",
    "pid+hold",
    "state-feedback+hold",
    "cascade+dither",
];

/// Kinds of compensation by their names in files, including none.
fn compensations() -> &'static [Variant] {
    <CompensationChoice<f64> as Fields<f64>>::SHAPE.variants()
}

/// The compensation of a name, with its default parameters.
fn compensation(name: &str) -> Option<CompensationChoice<f64>> {
    // The first choice of a walk is the kind; choices within the kind stay.
    struct Choose(Option<usize>);
    impl Walk<f64> for Choose {
        fn number(&mut self, _: &'static Field, _: &mut f64) {}
        fn choice(&mut self, _: &'static str, _: &'static [Variant], current: usize) -> usize {
            self.0.take().unwrap_or(current)
        }
    }
    let index = compensations().iter().position(|kind| kind.name == name)?;
    let mut choice = CompensationChoice::Nothing;
    choice.contents(&mut Choose(Some(index)));
    // An untrained network does nothing; trained ones come in files.
    (!matches!(choice, CompensationChoice::Nothing | CompensationChoice::Network(_))).then_some(choice)
}

/// Addition for holding a position.
const HOLD: &str = "hold";
/// Addition for keeping a contact in motion.
const DITHER: &str = "dither";

/// Parts of a name: controllers, and additions.
fn parts() -> (Vec<&'static str>, Vec<&'static str>) {
    let kinds = compensations().iter().map(|kind| kind.name).filter(|name| compensation(name).is_some());
    (BASES.map(|(name, _)| name).to_vec(), kinds.chain([HOLD, DITHER]).collect())
}

/// Naming rule of entrants, for users.
pub fn entrants() -> String {
    let (bases, added) = parts();
    let added: Vec<String> = added.iter().map(|name| format!("+{name}")).collect();
    format!("{}; with {}, at most one of them a compensation", bases.join(", "), added.join(", "))
}

impl Entrant {
    /// A built-in controller by its name, as `state-feedback+feedforward+hold`, or the controller of a parameter file
    /// (`*.toml`).
    ///
    /// # Errors
    /// An unknown part; an invalid file.
    pub fn find(name: &str) -> Result<Self, Error> {
        if name.ends_with(".toml") {
            let preset: Preset<f64> = presets::find(name)?.read()?;
            return Ok(Entrant::of_parameters(name.into(), preset));
        }
        let unknown = || {
            let (bases, added) = parts();
            Error::NothingToCompare { what: "controller", name: name.into(), known: [bases, added].concat() }
        };
        let mut parts = name.split('+');
        let base = parts.next().and_then(|part| BASES.iter().find(|(base, _)| *base == part)).ok_or_else(unknown)?.1;
        let mut house = House { base, compensation: CompensationChoice::Nothing, holds: false, dithers: false };
        for part in parts {
            match (part, compensation(part)) {
                (HOLD, _) => house.holds = true,
                (DITHER, _) => house.dithers = true,
                // Two compensations would push the drive twice.
                (_, Some(kind)) if house.compensation == CompensationChoice::Nothing => house.compensation = kind,
                _ => return Err(unknown()),
            }
        }
        Ok(Entrant { name: name.into(), source: Source::House(Box::new(house)) })
    }

    /// A built-in controller, or an external one: a shared library, an FMU, or a Python function (*.py), which is
    /// compiled to a library in the folder. Values of its parameters may follow the file:
    /// `servo.so,gain=6,damping=0.1`.
    ///
    /// # Errors
    /// As [`Entrant::find`] and [`ExternalFile::open`](stickslip_bench::external::ExternalFile::open); an invalid
    /// parameter value.
    pub fn open(name: &str, folder: &Path) -> Result<Self, Error> {
        let is_external = |path: &str| {
            Path::new(path).extension().is_some_and(|ending| EXTERNAL.iter().any(|external| ending == *external))
        };
        // The name of the file may contain a comma, too.
        let parts = name.match_indices(',').map(|(at, _)| (&name[..at], &name[at + 1..]));
        let Some((path, values)) = parts.chain([(name, "")]).find(|(path, _)| is_external(path)) else {
            return Entrant::find(name);
        };
        let path = Path::new(path);
        // Each entrant has its own folder.
        let subfolder: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let value = |text: &str| {
            let (name, value) = text.split_once('=')?;
            Some((name.trim().to_owned(), value.trim().parse().ok()?))
        };
        let values = values.split(',').filter(|text| !text.is_empty()).map(|text| {
            let problem = || format!("invalid parameter setting \"{text}\". Write NAME=VALUE with a number.");
            value(text).ok_or_else(|| BenchError::External { path: path.into(), problem: problem() })
        });
        let loaded = Loaded::open(path, values.collect::<Result<_, _>>()?, &folder.join(subfolder))?;
        Ok(Entrant { name: name.into(), source: Source::Loaded(loaded) })
    }

    /// Runs on presets that are results of [`on`](Self::on), side by side where it is built in; `None` where a run
    /// failed.
    pub(super) fn run(&self, lanes: &[Lane<'_>], watch: &Watch) -> Result<Vec<Option<Course>>, Error> {
        match &self.source {
            Source::Loaded(loaded) => lanes.iter().map(|lane| loaded.run(lane, watch)).collect(),
            Source::House(_) | Source::File(_) => run_in_lanes(lanes, watch)?.into_iter().collect(),
        }
    }

    /// Inputs of its results besides parameters.
    pub(super) fn follows_from(&self) -> &str {
        if let Source::Loaded(loaded) = &self.source { loaded.follows_from() } else { "" }
    }

    /// First fault of an external controller.
    pub(super) fn fault(&self) -> Option<Fault> {
        if let Source::Loaded(loaded) = &self.source { loaded.fault() } else { None }
    }

    /// Parameters of an entrant from a file.
    pub(crate) fn stated(&self) -> Option<&Preset<f64>> {
        match &self.source {
            Source::House(_) | Source::Loaded(_) => None,
            Source::File(preset) => Some(preset),
        }
    }

    /// An entrant of this name with the controller, compensation, filter and hold of these parameters.
    pub fn of_parameters(name: String, preset: Preset<f64>) -> Self {
        Entrant { name, source: Source::File(Box::new(preset)) }
    }

    /// Name of the tuned base: entrants with the same base share their gains. `None` for untuned entrants.
    pub(crate) fn tuned_as(&self) -> Option<&'static str> {
        match &self.source {
            Source::House(house) => BASES.iter().find(|(_, base)| *base == house.base).map(|(name, _)| *name),
            Source::File(_) | Source::Loaded(_) => None,
        }
    }

    /// The controller from which the tuning of this entrant starts.
    pub(crate) fn start(&self, preset: &Preset<f64>) -> Option<ControllerChoice<f64>> {
        match &self.source {
            Source::House(house) => Some(start(house.base, preset)),
            Source::File(_) | Source::Loaded(_) => None,
        }
    }

    /// The controller of this name, tuned on the model of a preset. An earlier result of the same tuning is read from
    /// the folder; a new one is written there.
    ///
    /// # Errors
    /// As [`tune`]; [`Error::File`].
    pub(crate) fn tuned(
        name: &'static str,
        preset: &Preset<f64>,
        folder: &Path,
        watch: &Watch,
    ) -> Result<ControllerChoice<f64>, Error> {
        let path = folder.join(format!("tuned-{name}.toml"));
        let follows_from = format!("# {PROGRAM}\n{}", parameters::write_commented(preset));
        if let Some(controller) = read_tuned(&path, &follows_from) {
            return Ok(controller);
        }
        let base = BASES.iter().find(|(base, _)| *base == name).map_or(Base::Pid, |(_, base)| *base);
        let controller = tune(&start(base, preset), &preset.model, &preset.bench, SLIDING, watch)?.controller;
        let mut with = *preset;
        with.bench.controller = controller;
        output::write(&path, format!("{}\n{FOLLOWS}\n{follows_from}", parameters::write_commented(&with)))?;
        Ok(controller)
    }

    /// A preset with this entrant; `tuned` is the controller of [`tuned_as`](Self::tuned_as).
    pub(crate) fn on(&self, preset: &Preset<f64>, tuned: Option<ControllerChoice<f64>>) -> Preset<f64> {
        let stated = *preset;
        let mut preset = *preset;
        let bench = &mut preset.bench;
        match &self.source {
            Source::House(house) => {
                bench.controller = tuned.unwrap_or(bench.controller);
                bench.compensation = house.compensation;
                bench.filter = FilterChoice::Nothing;
                bench.hold = house.hold(&stated);
            }
            Source::File(stated) => {
                bench.controller = stated.bench.controller;
                bench.compensation = stated.bench.compensation;
                bench.filter = stated.bench.filter;
                bench.hold = stated.bench.hold;
            }
            // None of the bench's own additions is active.
            Source::Loaded(_) => {}
        }
        preset.bench.shaper = ShaperChoice::Nothing;
        preset
    }
}

/// Start of the tuning of a base.
fn start(base: Base, preset: &Preset<f64>) -> ControllerChoice<f64> {
    let torque_limit = preset.bench.controller.torque_limit();
    let cascade = Cascade { torque_limit, inertia: preset.model.drive.inertia(), ..Cascade::default() };
    let feedback = |observer| {
        ControllerChoice::StateFeedback(StateFeedback { observer, torque_limit, ..StateFeedback::default() })
    };
    match base {
        Base::Pid => ControllerChoice::Pid(Pid { torque_limit, ..cascade_as_pid(&cascade) }),
        Base::Cascade => ControllerChoice::Cascade(cascade),
        Base::StateFeedback => feedback(Observation::Full(Default::default())),
        Base::Reduced => feedback(Observation::Reduced(Default::default())),
        Base::LoadSide => feedback(Observation::LoadSide(Default::default())),
        Base::MotorSide => feedback(Observation::MotorSide(Default::default())),
        Base::Predictive => as_predictive(&feedback(Observation::Full(Default::default()))),
    }
}

/// Separator between a tuned preset and the preset from which it was tuned, which follows as comments.
const FOLLOWS: &str = "# ---- tuned from ----";

/// The stored controller, if it was tuned from the same preset.
fn read_tuned(path: &Path, follows_from: &str) -> Option<ControllerChoice<f64>> {
    let text = fs::read_to_string(path).ok()?;
    let (preset, from) = text.split_once(&format!("\n{FOLLOWS}\n"))?;
    let preset: Preset<f64> = parameters::read(preset, &path.display().to_string()).ok()?;
    (from == follows_from).then_some(preset.bench.controller)
}

impl House {
    /// Dead zone of two counts. A knocker that starts a load which the integral has brought near breakaway, by slightly
    /// more than the following drop of friction: a larger knock overshoots the set-point. A dither of two thirds of the
    /// modelled breakaway torque, well above the vibration of the coupling and well below the resolution of the
    /// samples.
    fn hold(&self, preset: &Preset<f64>) -> Hold<f64> {
        let Preset { model, bench, .. } = preset;
        let count = TAU / model.encoder.counts_per_revolution;
        let breakaway = model.own.breakaway_torque;
        let knock = (1.2 * (breakaway - model.own.kinetic_torque)).max(0.1 * breakaway);
        let mut hold = StictionHold { dead_zone: 0.0, knock_torque: 0.0, ..StictionHold::default() };
        if self.holds {
            (hold.dead_zone, hold.knock_torque, hold.knock_zone) = (2.0 * count, knock, 1.5 * count);
        }
        if self.dithers {
            hold.dither_torque = breakaway * 2.0 / 3.0;
            hold.dither_frequency = (1.6 * model.drive.vibration() / TAU).min(0.2 / bench.control_period());
        }
        if self.holds || self.dithers { Hold::Stiction(hold) } else { Hold::Nothing }
    }
}
