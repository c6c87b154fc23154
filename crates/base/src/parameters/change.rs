//! Changes of single values in a struct, without a text, and the check of the result.

use stickslip_core::fields::{Field, Fields, Variant, Walk};

use super::entry::{Place, Value, flatten, join};
use super::laws::broken_laws;
use super::problem::{Fault, ParameterProblems, Problem};

/// Replaces the number at `path` by the result of `change`; false if these parameters have no number there.
pub fn change<P: Fields<f64>>(parameters: &mut P, path: &str, change: impl Fn(f64) -> f64) -> bool {
    let mut walk = Change { place: Place::default(), path, change, found: false };
    parameters.contents(&mut walk);
    walk.found
}

pub(crate) struct Change<'a, F> {
    place: Place,
    path: &'a str,
    change: F,
    found: bool,
}

impl<F: Fn(f64) -> f64> Walk<f64> for Change<'_, F> {
    fn number(&mut self, field: &'static Field, value: &mut f64) {
        if self.place.path(field) == self.path {
            *value = (self.change)(*value);
            self.found = true;
        }
    }

    fn choice(&mut self, _tag: &'static str, _variants: &'static [Variant], current: usize) -> usize {
        current
    }

    fn enter(&mut self, field: &'static Field) {
        self.place.enter(field);
    }

    fn leave(&mut self) {
        self.place.leave();
    }

    fn element(&mut self, index: usize) {
        self.place.element(index);
    }
}

/// Checks the ranges of all values and the laws between them, of parameters without a text; `name` is for messages.
///
/// # Errors
/// All problems at once.
pub fn check<P: Fields<f64>>(parameters: &P, name: &str) -> Result<(), ParameterProblems> {
    let mut problems = Vec::new();
    for entry in flatten(parameters) {
        if let Value::Number(value) = entry.value {
            let fault = Fault::of_number(value, entry.field);
            problems.extend(fault.map(|fault| Problem { line: None, path: entry.path, fault }));
        }
    }
    // A law is checked only between values within their ranges.
    if problems.is_empty() {
        let entries = flatten(parameters);
        problems.extend(broken_laws(parameters).into_iter().map(|(group, law)| {
            let path = join(&group, law.field);
            let unit = entries.iter().find(|entry| entry.path == path).map_or("", |entry| entry.field.unit);
            Problem { line: None, path, fault: Fault::Law { law, unit } }
        }));
    }
    if problems.is_empty() { Ok(()) } else { Err(ParameterProblems { file: name.into(), problems }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;
    use crate::parameters::{diff, presets};

    fn preset() -> Preset<f64> {
        presets::find("prototype").unwrap().read().unwrap()
    }

    #[test]
    fn one_value_changes_and_no_other() {
        let (before, mut after) = (preset(), preset());
        assert!(change(&mut after, "model.own.kinetic_torque", |value| 1.3 * value));
        assert!(change(&mut after, "bench.observer_poles.1", |_| 300.0));
        let changed: Vec<String> = diff(&before, &after).into_iter().map(|it| it.path).collect();
        assert_eq!(changed, ["model.own.kinetic_torque", "bench.observer_poles.1"]);
        assert_eq!(after.model.own.kinetic_torque, 1.3 * before.model.own.kinetic_torque);
        for path in ["model.own", "model.own.kinetic", "bench.observer_poles", "bench.controller.kind", ""] {
            assert!(!change(&mut after, path, |_| 0.0), "{path}");
        }
    }

    #[test]
    fn ranges_and_laws_are_checked_without_a_text() {
        assert_eq!(check(&preset(), "case 1"), Ok(()));
        let mut wrong = preset();
        wrong.model.own.kinetic_torque = -1.0;
        let message = check(&wrong, "case 7").unwrap_err().to_string();
        assert!(message.contains("model.own.kinetic_torque") && message.contains("case 7"), "{message}");
        // Within its range, but too much for the tick.
        let mut unlawful = preset();
        unlawful.plant.tick_jitter = 40e-6;
        let message = check(&unlawful, "case 8").unwrap_err().to_string();
        assert!(message.contains("plant.tick_jitter = 4e-5 s must be at most"), "{message}");
    }
}
