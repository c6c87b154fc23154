//! Controllers under test.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;
use stickslip_bench::BenchError;

use stickslip_core::control::compensation::{Hold, StictionHold};
use stickslip_core::control::{Cascade, Pid};
use stickslip_core::fields::{Field, Fields, Variant, Walk};
use stickslip_core::supervise::Fault;

use super::loaded::Loaded;
use super::run::run;
use super::{Manoeuvre, PROGRAM};
use stickslip_base::parameters::{self, presets};
use stickslip_base::preset::{
    CompensationChoice, ControllerChoice, FilterChoice, Observation, Preset, ShaperChoice, StateFeedback,
};
use stickslip_base::{Error, Watch, output};
use stickslip_design::{cascade_as_pid, tune};
use stickslip_experiment::workflow::position_loop::as_predictive;
use stickslip_simulate::manoeuvre::Course;

/// Speed at which a load slides for the tuning [rad/s].
const SLIDING: f64 = 10.0;

/// A controller with compensation and hold, and what it is called.
#[derive(Clone, Debug, PartialEq)]
pub struct Entrant {
    /// A base and what is added to it, joined by `+`; or the file that it comes from, with the values that are set.
    pub name: String,
    source: Source,
}

#[derive(Clone, Debug, PartialEq)]
enum Source {
    /// One of the house.
    House(Box<House>),
    /// That of a parameter file, as it is stated there.
    File(Box<Preset<f64>>),
    /// A library, an FMU, a function in Python.
    Loaded(Loaded),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct House {
    base: Base,
    compensation: CompensationChoice<f64>,
    holds: bool,
    dithers: bool,
}

/// Controllers of the house, each tuned once for a machine.
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

/// Endings of controllers of one's own.
const OWN: [&str; 5] = ["so", "dll", "dylib", "fmu", "py"];

const BASES: [(&str, Base); 7] = [
    ("pid", Base::Pid),
    ("cascade", Base::Cascade),
    ("state-feedback", Base::StateFeedback),
    ("reduced", Base::Reduced),
    ("load-side", Base::LoadSide),
    ("motor-side", Base::MotorSide),
    ("mpc", Base::Predictive),
];

/// Those that are compared where nobody names any; the first is the reference of the others. Where no limit is in the way,
/// as in the usual manoeuvres, `mpc` is `state-feedback`.
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

/// Kinds of compensation by their names in files, and none.
fn compensations() -> &'static [Variant] {
    <CompensationChoice<f64> as Fields<f64>>::SHAPE.variants()
}

/// The compensation of that name, as a file that says no more states it.
fn compensation(name: &str) -> Option<CompensationChoice<f64>> {
    // The first choice that a walk meets is the kind; what a kind has to choose from stays.
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
    // A network that was not trained is nothing, either: trained ones come in files.
    (!matches!(choice, CompensationChoice::Nothing | CompensationChoice::Network(_))).then_some(choice)
}

/// What a position is held with.
const HOLD: &str = "hold";
/// What keeps a contact moving.
const DITHER: &str = "dither";

/// What an entrant can be made of: controllers, and what they may be combined with.
fn parts() -> (Vec<&'static str>, Vec<&'static str>) {
    let kinds = compensations().iter().map(|kind| kind.name).filter(|name| compensation(name).is_some());
    (BASES.map(|(name, _)| name).to_vec(), kinds.chain([HOLD, DITHER]).collect())
}

/// How an entrant is named, for a user.
pub fn entrants() -> String {
    let (bases, added) = parts();
    let added: Vec<String> = added.iter().map(|name| format!("+{name}")).collect();
    format!("{}; with {}, at most one of them a compensation", bases.join(", "), added.join(", "))
}

impl Entrant {
    /// One of the house by its name, as `state-feedback+feedforward+hold`, or that of a parameter file (`*.toml`).
    ///
    /// # Errors
    /// A part that does not exist; what reading the file refuses.
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
        let base = parts.next().and_then(|part| BASES.iter().find(|(known, _)| *known == part)).ok_or_else(unknown)?.1;
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

    /// The same, or a controller of one's own: a shared library, an FMU, a function in Python (*.py), of which a library is
    /// made in the folder. Values of its parameters may follow the file: `servo.so,gain=6,damping=0.1`.
    ///
    /// # Errors
    /// As [`Entrant::find`] and [`ExternalFile::open`](stickslip_bench::external::ExternalFile::open); a value that is no number.
    pub fn open(name: &str, folder: &Path) -> Result<Self, Error> {
        let is_own =
            |path: &str| Path::new(path).extension().is_some_and(|ending| OWN.iter().any(|own| ending == *own));
        // A comma may be in the name of the file, too.
        let parts = name.match_indices(',').map(|(at, _)| (&name[..at], &name[at + 1..]));
        let Some((path, values)) = parts.chain([(name, "")]).find(|(path, _)| is_own(path)) else {
            return Entrant::find(name);
        };
        let path = Path::new(path);
        // Each in a folder of its own.
        let own: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let value = |text: &str| {
            let (name, value) = text.split_once('=')?;
            Some((name.trim().to_owned(), value.trim().parse().ok()?))
        };
        let values = values.split(',').filter(|text| !text.is_empty()).map(|text| {
            let problem = || format!("\"{text}\" sets no parameter of it: write NAME=VALUE, with a number");
            value(text).ok_or_else(|| BenchError::External { path: path.into(), problem: problem() })
        });
        let loaded = Loaded::open(path, values.collect::<Result<_, _>>()?, &folder.join(own))?;
        Ok(Entrant { name: name.into(), source: Source::Loaded(loaded) })
    }

    /// Runs it in a manoeuvre, `preset` being [what it is on](Self::on); `None` where it did not come to its end.
    pub(super) fn run(
        &self,
        preset: &Preset<f64>,
        manoeuvre: Manoeuvre,
        seed: u64,
        chance: f64,
        watch: &Watch,
    ) -> Result<Option<Course>, Error> {
        match &self.source {
            Source::Loaded(loaded) => loaded.run(preset, manoeuvre, seed, chance, watch),
            Source::House(_) | Source::File(_) => run(preset, manoeuvre, seed, chance, watch),
        }
    }

    /// What its results follow from besides parameters.
    pub(super) fn follows_from(&self) -> &str {
        if let Source::Loaded(loaded) = &self.source { loaded.follows_from() } else { "" }
    }

    /// What it failed of first, where it is one of a file of its own.
    pub(super) fn fault(&self) -> Option<Fault> {
        if let Source::Loaded(loaded) = &self.source { loaded.fault() } else { None }
    }

    /// The parameters that it is stated by, if it comes from a file.
    pub(crate) fn stated(&self) -> Option<&Preset<f64>> {
        match &self.source {
            Source::House(_) | Source::Loaded(_) => None,
            Source::File(preset) => Some(preset),
        }
    }

    /// The entrant of that name that these parameters state: on a machine that may lack its file.
    pub(crate) fn of_parameters(name: String, preset: Preset<f64>) -> Self {
        Entrant { name, source: Source::File(Box::new(preset)) }
    }

    /// What is tuned of it: entrants with the same share their gains. `None` where it runs as it is stated.
    pub(crate) fn tuned_as(&self) -> Option<&'static str> {
        match &self.source {
            Source::House(house) => BASES.iter().find(|(_, base)| *base == house.base).map(|(name, _)| *name),
            Source::File(_) | Source::Loaded(_) => None,
        }
    }

    /// The controller that the tuning of this entrant starts from.
    pub(crate) fn start(&self, preset: &Preset<f64>) -> Option<ControllerChoice<f64>> {
        match &self.source {
            Source::House(house) => Some(start(house.base, preset)),
            Source::File(_) | Source::Loaded(_) => None,
        }
    }

    /// The controller of that name, tuned on what a preset believes. What was tuned from the same before is taken from
    /// the folder; what is tuned is put there.
    ///
    /// # Errors
    /// As [`tune`]; [`Error::File`].
    pub(crate) fn tuned(
        name: &'static str,
        preset: &Preset<f64>,
        folder: &Path,
        watch: &Watch,
    ) -> Result<ControllerChoice<f64>, Error> {
        let kept = folder.join(format!("tuned-{name}.toml"));
        let follows_from = format!("# {PROGRAM}\n{}", parameters::write_commented(preset));
        if let Some(controller) = read_tuned(&kept, &follows_from) {
            return Ok(controller);
        }
        let base = BASES.iter().find(|(known, _)| *known == name).map_or(Base::Pid, |(_, base)| *base);
        let controller = tune(&start(base, preset), &preset.model, &preset.bench, SLIDING, watch)?.controller;
        let mut with = *preset;
        with.bench.controller = controller;
        output::write(&kept, format!("{}\n{FOLLOWS}\n{follows_from}", parameters::write_commented(&with)))?;
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
            // Nothing of the bench is in force.
            Source::Loaded(_) => {}
        }
        preset.bench.shaper = ShaperChoice::Nothing;
        preset
    }
}

/// What the tuning of a base starts from.
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

/// Stands between a tuned preset and the one that it follows from, which is all comment.
const FOLLOWS: &str = "# ---- tuned from ----";

/// The controller that was tuned from the same before.
fn read_tuned(path: &Path, follows_from: &str) -> Option<ControllerChoice<f64>> {
    let text = fs::read_to_string(path).ok()?;
    let (preset, from) = text.split_once(&format!("\n{FOLLOWS}\n"))?;
    let preset: Preset<f64> = parameters::read(preset, &path.display().to_string()).ok()?;
    (from == follows_from).then_some(preset.bench.controller)
}

impl House {
    /// Dead zone of two counts; a knocker that breaks a load away which the integral has brought near to breakaway, by
    /// somewhat more than friction then falls: a larger one throws it past the set-point. A dither of two thirds of the
    /// believed breakaway torque, well above the vibration of the coupling and well below what samples can show.
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
