//! The laws between the parameters of a block.

use stickslip_core::fields::{Field, Fields, Laws, Order, Relation};

use super::{Graph, Id, Recorded};

/// A law between fields: a value and a bound, both computed from the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Law {
    /// The field to change: `machine.plant.screw_friction.model.fading`.
    pub path: String,
    /// Its value.
    pub value: Id,
    /// Relation to the bound.
    pub order: Order,
    /// The bound, from the other fields.
    pub bound: Id,
    /// Reason and remedy.
    pub remedy: &'static str,
}

/// All laws of a block and its parts, with the graph of their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LawBook {
    /// The graph of values and bounds, from the parameters alone.
    pub graph: Graph,
    /// The laws.
    pub laws: Vec<Law>,
}

/// The laws of recorded parameters; the graph is filled in by the caller, who opened it.
pub(super) fn collect(parameters: &impl Fields<Recorded>) -> Vec<Law> {
    let mut collector = Collector::default();
    parameters.laws(&mut collector);
    collector.laws
}

#[derive(Default)]
struct Collector {
    /// Names of the fields entered, and the element where they are lists.
    groups: Vec<(&'static str, Option<usize>)>,
    laws: Vec<Law>,
}

impl Laws<Recorded> for Collector {
    fn enter(&mut self, field: &'static Field) {
        self.groups.push((field.name, None));
    }

    fn leave(&mut self) {
        self.groups.pop();
    }

    fn element(&mut self, index: usize) {
        if let Some((_, element)) = self.groups.last_mut() {
            *element = Some(index);
        }
    }

    fn state(&mut self, law: Relation<Recorded>) {
        let mut path = String::new();
        for (name, element) in &self.groups {
            path += name;
            if let Some(index) = element {
                path += &format!("[{index}]");
            }
            path.push('.');
        }
        path += law.field;
        let (value, bound) = (law.value.id, law.bound.id);
        self.laws.push(Law { path, value, order: law.order, bound, remedy: law.remedy });
    }
}
