//! Every value of a parameter struct under its dotted path: `plant.drive.motor_inertia`, `joint.stiffness.1`.

use std::collections::BTreeMap;
use std::fmt;

use stickslip_core::fields::{Field, Fields, Kind, Shape, Variant, Walk};

use super::number;

/// One value with its path and field.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Names from the outside in, joined by dots; elements of a list are numbered from 0.
    pub path: String,
    /// The field of a number; of a choice, the field that holds it.
    pub field: &'static Field,
    /// The value.
    pub value: Value,
}

/// A number, or the name of a variant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// In the field's unit; 0 or 1 for a flag.
    Number(f64),
    /// The name of the variant.
    Variant(&'static str),
}

/// The value with its unit: `4.1e-4 kg m^2`, `true`, `lugre`.
impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.value {
            Value::Number(value) => f.write_str(&number::of_field(value, self.field)),
            Value::Variant(name) => f.write_str(name),
        }
    }
}

/// All values in the order of declaration.
pub fn flatten<P: Fields<f64>>(parameters: &P) -> Vec<Entry> {
    let mut flatten = Flatten::default();
    let mut copy = *parameters;
    copy.contents(&mut flatten);
    flatten.entries
}

/// A value that differs between two structs; `None` where a variant has no such field.
#[derive(Clone, Debug)]
pub struct Difference {
    /// As [`Entry::path`].
    pub path: String,
    /// In the first.
    pub before: Option<Entry>,
    /// In the second.
    pub after: Option<Entry>,
}

/// Differences in the order of the first, then the values that only the second has. Numbers are compared by their bits.
pub fn diff<P: Fields<f64>>(before: &P, after: &P) -> Vec<Difference> {
    differences(flatten(before), flatten(after))
}

/// The same for lists of values.
pub fn differences(before: Vec<Entry>, after: Vec<Entry>) -> Vec<Difference> {
    let mut others: BTreeMap<_, _> = after.into_iter().map(|entry| (entry.path.clone(), entry)).collect();
    let mut order: Vec<_> = others.keys().cloned().collect();
    let mut out = Vec::new();
    for entry in before {
        let after = others.remove(&entry.path);
        if after.as_ref().is_none_or(|after| !same(after.value, entry.value)) {
            out.push(Difference { path: entry.path.clone(), before: Some(entry), after });
        }
    }
    order.retain(|path| others.contains_key(path));
    out.extend(order.into_iter().map(|path| Difference { after: others.remove(&path), path, before: None }));
    out
}

fn same(a: Value, b: Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => a.to_bits() == b.to_bits(),
        (a, b) => a == b,
    }
}

/// The root as a field, for a choice at the top.
static ROOT: Field = Field {
    name: "",
    symbol: "",
    unit: "",
    minimum: f64::NEG_INFINITY,
    maximum: f64::INFINITY,
    default: 0.0,
    help: "",
    kind: Kind::Real,
    shape: Shape::Group(&[]),
};

/// Position of a walk: converts its events to paths.
#[derive(Default)]
pub(super) struct Place {
    groups: Vec<(String, &'static Field)>,
    index: Vec<usize>,
    pending: Vec<usize>,
}

impl Place {
    /// The next field is this element of its list.
    pub(super) fn element(&mut self, index: usize) {
        self.pending.push(index);
    }

    /// The following fields are within `field`.
    pub(super) fn enter(&mut self, field: &'static Field) {
        let path = self.path(field);
        self.groups.push((path, field));
    }

    /// The end of the field.
    pub(super) fn leave(&mut self) {
        self.groups.pop();
    }

    /// The path of a field of the current group.
    pub(super) fn path(&mut self, field: &'static Field) -> String {
        // In a list of lists only the inner index is repeated with each element.
        self.index.truncate(depth(field.shape).saturating_sub(self.pending.len()));
        self.index.append(&mut self.pending);
        self.index.iter().fold(join(self.group(), field.name), |path, index| format!("{path}.{index}"))
    }

    /// The path of the current group; empty at the top.
    pub(super) fn group(&self) -> &str {
        self.groups.last().map_or("", |(path, _)| path)
    }

    fn field(&self) -> &'static Field {
        self.groups.last().map_or(&ROOT, |(_, field)| field)
    }
}

/// `group.name`; `name` at the top.
pub(super) fn join(group: &str, name: &str) -> String {
    if group.is_empty() { name.into() } else { format!("{group}.{name}") }
}

/// Whether a path is a group or below it; all paths are below the top.
pub fn within(path: &str, group: &str) -> bool {
    group.is_empty() || path.strip_prefix(group).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Depth of nested lists.
fn depth(shape: Shape) -> usize {
    if let Shape::List(_, inner) = shape { 1 + depth(*inner) } else { 0 }
}

#[derive(Default)]
struct Flatten {
    place: Place,
    entries: Vec<Entry>,
}

impl Walk<f64> for Flatten {
    fn number(&mut self, field: &'static Field, value: &mut f64) {
        self.entries.push(Entry { path: self.place.path(field), field, value: Value::Number(*value) });
    }

    fn choice(&mut self, tag: &'static str, variants: &'static [Variant], current: usize) -> usize {
        let value = Value::Variant(variants[current].name);
        self.entries.push(Entry { path: join(self.place.group(), tag), field: self.place.field(), value });
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
