//! A library or an FMU in this process: its description is checked, and each call is timed and monitored.

use crate::BenchError;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

use stickslip_rt::{FloatingPoint, Module, ModuleParameter, ModuleSample};
use stickslip_software::supervise::{ExternalFault, Role};

use super::fmu::{Controller, is_fmu};
use super::{Answer, Caller, Description};
use stickslip_base::Error;

/// An open library or FMU.
pub(super) enum Library {
    /// A library with the five functions.
    Module(Box<OpenModule>),
    /// An FMU.
    Fmu(Box<Controller>),
}

/// An open library with the five functions.
pub(super) struct OpenModule {
    module: Module,
    description: Description,
}

impl Library {
    /// Opens a library or an FMU. For an FMU, `map` assigns variables to signals, and `messages` is a file for a copy
    /// of its messages.
    pub(super) fn open(
        path: &Path,
        role: Role,
        map: &[(String, String)],
        messages: Option<PathBuf>,
    ) -> Result<Self, Error> {
        let opened = if is_fmu(path) {
            Controller::open(path, role, map, messages).map(|fmu| Library::Fmu(Box::new(fmu)))
        } else if map.is_empty() {
            OpenModule::open(path).map(|module| Library::Module(Box::new(module)))
        } else {
            Err("the file is not an FMU and has no variables to map. Omit --map".into())
        };
        // Opening a library linked with fast-math changes the control word.
        FloatingPoint::set_standard();
        Ok(opened.map_err(|problem| BenchError::External { path: path.into(), problem })?)
    }

    pub(super) fn description(&self) -> &Description {
        match self {
            Library::Module(module) => &module.description,
            Library::Fmu(fmu) => fmu.description(),
        }
    }

    fn caller(&mut self) -> &mut dyn Caller {
        match self {
            Library::Module(module) => module.as_mut(),
            Library::Fmu(fmu) => fmu.as_mut(),
        }
    }
}

impl Caller for Library {
    fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> Result<(), ExternalFault> {
        self.caller().begin(sample_time, torque_limit, values)
    }

    fn step(&mut self, sample: &ModuleSample, values: Option<&[f64]>) -> Result<Answer, ExternalFault> {
        self.caller().step(sample, values)
    }

    fn message(&self) -> Option<String> {
        match self {
            Library::Module(module) => module.message(),
            Library::Fmu(fmu) => fmu.message(),
        }
    }
}

impl OpenModule {
    fn open(path: &Path) -> Result<Self, String> {
        let module = Module::open(path).map_err(|error| error.to_string())?;
        let (name, parameters) = (module.name().to_owned(), module.parameters().to_vec());
        let description = Description { name, parameters, kind: "C library".into(), ..Description::default() };
        check(&description)?;
        Ok(OpenModule { module, description })
    }
}

impl Caller for OpenModule {
    fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> Result<(), ExternalFault> {
        let started = self.module.begin(sample_time, torque_limit, values);
        if !FloatingPoint::set_standard() {
            return Err(ExternalFault::FloatingPoint);
        }
        if started { Ok(()) } else { Err(ExternalFault::Failed { code: -1 }) }
    }

    fn step(&mut self, sample: &ModuleSample, values: Option<&[f64]>) -> Result<Answer, ExternalFault> {
        let refused = values.map_or(0, |values| self.module.set(values));
        let begin = Instant::now();
        let torque = self.module.step(sample);
        let time = begin.elapsed().as_nanos() as u64;
        if !FloatingPoint::set_standard() {
            return Err(ExternalFault::FloatingPoint);
        }
        torque.map(|torque| Answer { torque, time, refused }).map_err(|code| ExternalFault::Failed { code })
    }
}

/// Checks a description.
fn check(description: &Description) -> Result<(), String> {
    let mut names = BTreeSet::new();
    for ModuleParameter { name, minimum, maximum, initial, .. } in &description.parameters {
        let legal = name.starts_with(|c: char| c.is_ascii_lowercase())
            && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
        if !legal {
            return Err(format!(
                "a parameter is called {name:?}. Use lower-case letters, digits and _, starting with a letter"
            ));
        }
        if !names.insert(name) {
            return Err(format!("two parameters are called {name}. Use distinct names"));
        }
        if !(minimum.is_finite() && maximum.is_finite() && minimum <= maximum) {
            return Err(format!(
                "the range of {name} is {minimum} … {maximum}. Set two finite numbers, the smaller one first"
            ));
        }
        if !(*minimum..=*maximum).contains(initial) {
            return Err(format!("{name} begins with {initial}, outside {minimum} … {maximum}. Choose a value within"));
        }
    }
    if description.name.trim().is_empty() {
        return Err("it has no name. Set one in its description".into());
    }
    Ok(())
}
