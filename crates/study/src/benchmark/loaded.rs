//! External controllers in the benchmark.

use std::fmt;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use stickslip_core::control::AxisControlInput;
use stickslip_software::supervise::Fault;

use super::Lane;
use stickslip_base::{Error, Watch};
use stickslip_bench::external::{External, ExternalFile, read};
use stickslip_simulate::manoeuvre::Course;
use stickslip_simulate::manoeuvre::run_with;
use stickslip_simulate::simulation::Sample;

/// An opened file, with one instance for each concurrent run.
#[derive(Clone)]
pub(super) struct Loaded(Arc<Opened>);

struct Opened {
    file: ExternalFile,
    /// SHA-256 of its sources, and the parameter values.
    follows_from: String,
    idle: Mutex<Vec<External>>,
    /// First fault.
    fault: Mutex<Option<Fault>>,
}

impl Loaded {
    /// Opens a file with these values; a Python function is compiled to a library in the folder.
    pub(super) fn open(path: &Path, values: Vec<(String, f64)>, folder: &Path) -> Result<Self, Error> {
        let source = ExternalFile { path: path.into(), values, ..ExternalFile::default() };
        let file = source.made(folder, &mut |_| {})?;
        let first = file.open(folder, &mut |_| {})?;
        // Hash of the source: compilers may write other bytes each time.
        let hash = source.hash()?;
        let set = source.values.iter().map(|(name, value)| format!(", {name}={value}"));
        let follows_from = hash + &set.collect::<String>();
        Ok(Loaded(Arc::new(Opened { file, follows_from, idle: Mutex::new(vec![first]), fault: Mutex::default() })))
    }

    /// Inputs of its results.
    pub(super) fn follows_from(&self) -> &str {
        &self.0.follows_from
    }

    /// First fault, if any.
    pub(super) fn fault(&self) -> Option<Fault> {
        *lock(&self.0.fault)
    }

    /// Runs it; `None` where it, or the bench, failed.
    pub(super) fn run(&self, lane: &Lane<'_>, watch: &Watch) -> Result<Option<Course>, Error> {
        let Opened { file, idle, fault, .. } = &*self.0;
        let instance = lock(idle).pop();
        let mut external = match instance {
            Some(external) => external,
            None => file.open(Path::new(""), &mut |_| {})?,
        };
        let settings = &lane.preset.bench;
        let start = external.begin(settings.control_period(), settings.controller.torque_limit());
        let mut failed = start.err();
        let mut course = None;
        if failed.is_none() {
            let mut torque = |sample: &Sample| {
                let Sample { time, reference, measured_angle, measured_velocity } = *sample;
                let input = AxisControlInput { reference, measured_angle, measured_velocity };
                let stepped = external.step(&read(time, &input));
                failed = stepped.err();
                stepped.ok()
            };
            course = run_with(*lane, &mut torque, watch)?;
        }
        match failed {
            // A failed instance is not used again.
            Some(why) => drop(lock(fault).get_or_insert(external.fault(why))),
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
