//! A library in this process: what it says of itself is checked, and each call is timed and watched.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

use stickslip_core::supervise::ControllerFault;
use stickslip_rt::{FloatingPoint, Module, ModuleParameter, ModuleSample};

use super::{Answer, Caller, Description};
use crate::Error;

/// An open library.
pub(super) struct Library {
    module: Module,
    description: Description,
}

impl Library {
    /// Opens it.
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let refused = |problem: String| Error::Foreign { path: path.into(), problem };
        let module = Module::open(path).map_err(|error| refused(error.to_string()));
        // A library that was linked with fast mathematics has changed it by being opened.
        FloatingPoint::mend();
        let module = module?;
        let description = Description { name: module.name().to_owned(), parameters: module.parameters().to_vec() };
        check(&description).map_err(refused)?;
        Ok(Library { module, description })
    }

    pub(super) fn description(&self) -> &Description {
        &self.description
    }
}

impl Caller for Library {
    fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> Result<(), ControllerFault> {
        let begun = self.module.begin(sample_time, torque_limit, values);
        if !FloatingPoint::mend() {
            return Err(ControllerFault::FloatingPoint);
        }
        if begun { Ok(()) } else { Err(ControllerFault::Failed { code: -1 }) }
    }

    fn step(&mut self, sample: &ModuleSample) -> Result<Answer, ControllerFault> {
        let begin = Instant::now();
        let torque = self.module.step(sample);
        let time = begin.elapsed().as_nanos() as u64;
        if !FloatingPoint::mend() {
            return Err(ControllerFault::FloatingPoint);
        }
        torque.map(|torque| Answer { torque, time }).map_err(|code| ControllerFault::Failed { code })
    }
}

/// What is wrong with a description.
fn check(description: &Description) -> Result<(), String> {
    let mut names = BTreeSet::new();
    for ModuleParameter { name, minimum, maximum, initial, .. } in &description.parameters {
        let legal = name.starts_with(|c: char| c.is_ascii_lowercase())
            && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
        if !legal {
            return Err(format!(
                "a parameter is called {name:?}. Take lower-case letters, digits and _, a letter first"
            ));
        }
        if !names.insert(name) {
            return Err(format!("two parameters are called {name}. Give each a name of its own"));
        }
        if !(minimum.is_finite() && maximum.is_finite() && minimum <= maximum) {
            return Err(format!(
                "the range of {name} is {minimum} … {maximum}. State two finite numbers, the smaller first"
            ));
        }
        if !(*minimum..=*maximum).contains(initial) {
            return Err(format!("{name} begins with {initial}, outside {minimum} … {maximum}. Choose a value within"));
        }
    }
    if description.name.trim().is_empty() {
        return Err("it has no name. Give it one in its description".into());
    }
    Ok(())
}
