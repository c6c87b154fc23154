//! A controller of a file among those that are compared.

use std::fmt;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use stickslip_core::control::AxisControlInput;
use stickslip_core::supervise::Fault;

use super::Manoeuvre;
use super::run::run_with;
use stickslip_base::preset::Preset;
use stickslip_base::{Error, Watch};
use stickslip_bench::external::{External, ExternalFile, read};
use stickslip_simulate::manoeuvre::Course;
use stickslip_simulate::simulation::Sample;

/// A file that was opened, as often as there are runs at once.
#[derive(Clone)]
pub(super) struct Loaded(Arc<Opened>);

struct Opened {
    file: ExternalFile,
    /// SHA-256 of what it was made of, with the values that were given.
    follows_from: String,
    idle: Mutex<Vec<External>>,
    /// What it failed of first.
    fault: Mutex<Option<Fault>>,
}

impl Loaded {
    /// Opens it with these values, and makes a library of it in the folder where it is a function in Python.
    pub(super) fn open(path: &Path, values: Vec<(String, f64)>, folder: &Path) -> Result<Self, Error> {
        let given = ExternalFile { path: path.into(), values, ..ExternalFile::default() };
        let file = given.made(folder, &mut |_| {})?;
        let first = file.open(folder, &mut |_| {})?;
        // What it was made of: a compiler may write other bytes each time.
        let hash = given.hash()?;
        let set = given.values.iter().map(|(name, value)| format!(", {name}={value}"));
        let follows_from = hash + &set.collect::<String>();
        Ok(Loaded(Arc::new(Opened { file, follows_from, idle: Mutex::new(vec![first]), fault: Mutex::default() })))
    }

    /// What its results follow from.
    pub(super) fn follows_from(&self) -> &str {
        &self.0.follows_from
    }

    /// What it failed of first, if it did.
    pub(super) fn fault(&self) -> Option<Fault> {
        *lock(&self.0.fault)
    }

    /// Runs it; `None` where it, or the bench, did not come to the end.
    pub(super) fn run(
        &self,
        preset: &Preset<f64>,
        manoeuvre: Manoeuvre,
        seed: u64,
        chance: f64,
        watch: &Watch,
    ) -> Result<Option<Course>, Error> {
        let Opened { file, idle, fault, .. } = &*self.0;
        let waits = lock(idle).pop();
        let mut external = match waits {
            Some(external) => external,
            None => file.open(Path::new(""), &mut |_| {})?,
        };
        let settings = &preset.bench;
        let begun = external.begin(settings.control_period(), settings.controller.torque_limit());
        let mut failed = begun.err();
        let mut course = None;
        if failed.is_none() {
            let mut torque = |sample: &Sample| {
                let Sample { time, reference, measured_angle, measured_velocity } = *sample;
                let input = AxisControlInput { reference, measured_angle, measured_velocity };
                let stepped = external.step(&read(time, &input));
                failed = stepped.err();
                stepped.ok()
            };
            course = run_with(preset, manoeuvre, seed, chance, &mut torque, watch)?;
        }
        match failed {
            // Whatever it is now, it is not asked again.
            Some(why) => drop(lock(fault).get_or_insert(external.told(why))),
            None => lock(idle).push(external),
        }
        Ok(course)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl fmt::Debug for Loaded {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:?}, SHA-256 {}", self.0.file, self.0.follows_from)
    }
}

impl PartialEq for Loaded {
    fn eq(&self, other: &Self) -> bool {
        (&self.0.file, &self.0.follows_from) == (&other.0.file, &other.0.follows_from)
    }
}
