//! Check of all laws between fields.

use stickslip_core::fields::{Field, Fields, Laws, ParameterError, Relation};

use super::entry::join;

/// Each broken law with the path of the group that states it.
pub(super) fn broken_laws<P: Fields<f64>>(parameters: &P) -> Vec<(String, ParameterError)> {
    let mut broken = BrokenLaws::default();
    parameters.laws(&mut broken);
    broken.errors.extend(P::check(&parameters.map(&mut |value: f64| value)).err().map(|error| (String::new(), error)));
    broken.errors
}

#[derive(Default)]
struct BrokenLaws {
    /// Path of the field, and the element of its list.
    groups: Vec<(String, Option<usize>)>,
    errors: Vec<(String, ParameterError)>,
}

impl BrokenLaws {
    fn group(&self) -> String {
        match self.groups.last() {
            None => String::new(),
            Some((path, None)) => path.clone(),
            Some((path, Some(index))) => format!("{path}.{index}"),
        }
    }
}

impl Laws<f64> for BrokenLaws {
    fn enter(&mut self, field: &'static Field) {
        self.groups.push((join(&self.group(), field.name), None));
    }

    fn leave(&mut self) {
        self.groups.pop();
    }

    fn element(&mut self, index: usize) {
        if let Some((_, element)) = self.groups.last_mut() {
            *element = Some(index);
        }
    }

    fn state(&mut self, law: Relation<f64>) {
        if let Err(error) = law.check() {
            self.errors.push((self.group(), error));
        }
    }
}
