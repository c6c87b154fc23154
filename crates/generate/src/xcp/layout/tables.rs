//! The cells, from the tables of signals and parameters.

use std::collections::{BTreeSet, HashMap};

use stickslip_core::fields::{Field, Kind, Shape};

use super::{Cell, Content, MEASUREMENTS, PARAMETERS, Parameter, SIZE};
use crate::xcp::a2l::name;
use stickslip_base::parameters::{Entry, Value};
use stickslip_base::{Preset, parameters};
use stickslip_bench::run::channels;
use stickslip_bench::tuning;

/// Number `index` of an area.
fn address(area: u32, index: usize) -> u32 {
    area + SIZE * index as u32
}

fn content(field: &Field) -> Content {
    match field.kind {
        Kind::Real => Content::Real,
        Kind::Whole => Content::Whole,
        Kind::Flag => Content::Flag,
    }
}

pub(super) fn measurements() -> Vec<Cell> {
    let cycle = Cell {
        path: "cycle".into(),
        address: MEASUREMENTS,
        symbol: "",
        unit: "1",
        help: "Number of the cycle.",
        minimum: 0.0,
        maximum: f64::MAX,
        content: Content::Whole,
    };
    let cell = |(index, entry): (usize, parameters::Entry)| Cell {
        path: entry.path,
        address: address(MEASUREMENTS, index + 1),
        symbol: entry.field.symbol,
        unit: entry.field.unit,
        help: entry.field.help,
        minimum: entry.field.minimum.max(f64::MIN),
        maximum: entry.field.maximum.min(f64::MAX),
        content: content(entry.field),
    };
    std::iter::once(cycle).chain(channels().into_iter().enumerate().map(cell)).collect()
}

/// The parameters of all variants, so that a layout does not depend on the choices.
pub(super) fn parameters(entries: &[Entry]) -> Vec<Parameter> {
    let mut all = of_presets();
    // Values of presets, in any variant, are not additional.
    let additions = entries.iter().filter(|entry| tuning::is_of_it(&entry.path));
    let mut names = BTreeSet::new();
    // Two parameters with the same name in a description would be ambiguous.
    for entry in additions.filter(|entry| names.insert(name(&entry.path))) {
        let field = entry.field;
        let (content, maximum) = match entry.value {
            Value::Number(_) => (content(field), field.maximum.min(f64::MAX)),
            Value::Variant(_) => (Content::Choice(field.shape.variants()), field.shape.variants().len() as f64 - 1.0),
        };
        let is_number = matches!(entry.value, Value::Number(_));
        let cell = Cell {
            path: entry.path.clone(),
            address: address(PARAMETERS, all.len()),
            symbol: field.symbol,
            unit: if is_number { field.unit } else { "1" },
            help: field.help,
            minimum: if is_number { field.minimum.max(f64::MIN) } else { 0.0 },
            maximum,
            content,
        };
        let field = is_number.then_some(field);
        all.push(Parameter { cell, default: entry.field.default, owners: Vec::new(), field, list: None });
    }
    all
}

fn of_presets() -> Vec<Parameter> {
    let rows = parameters::describe::<Preset<f64>>("").expect("everything is known");
    let mut all: Vec<Parameter> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    for row in rows.into_iter().filter(|row| tuning::fixed(&row.path).is_none()) {
        let owner = row.only_with.as_deref().and_then(|with| with.split_once(" = "));
        let owner = owner.map(|(tag, name)| (tag.to_owned(), name.trim_matches('"').to_owned()));
        let count = match row.field.map(|field| field.shape) {
            Some(Shape::List(count, _)) => Some(count),
            _ => None,
        };
        let first = all.len();
        for element in 0..count.unwrap_or(1) {
            let path = if count.is_some() { format!("{}.{element}", row.path) } else { row.path.clone() };
            if let Some(&place) = places.get(&path) {
                all[place].shared_with(row.field, owner.clone());
                continue;
            }
            let last = row.variants.len().saturating_sub(1) as f64;
            let cell = Cell {
                path: path.clone(),
                address: address(PARAMETERS, all.len()),
                symbol: row.field.map_or("", |field| field.symbol),
                unit: row.field.map_or("1", |field| field.unit),
                help: row.field.map_or("The chosen variant.", |field| field.help),
                minimum: row.field.map_or(0.0, |field| field.minimum.max(f64::MIN)),
                maximum: row.field.map_or(last, |field| field.maximum.min(f64::MAX)),
                content: row.field.map_or(Content::Choice(row.variants), content),
            };
            places.insert(path, all.len());
            all.push(Parameter {
                cell,
                default: row.field.map_or(0.0, |field| field.default),
                owners: owner.clone().into_iter().collect(),
                field: row.field,
                list: count.map(|count| (row.path.clone(), first, count)),
            });
        }
    }
    all
}

impl Parameter {
    /// Another variant has it as well: its range is the union of both; the reader of the set checks the correct one.
    fn shared_with(&mut self, field: Option<&'static Field>, owner: Option<(String, String)>) {
        if let Some(field) = field {
            self.cell.minimum = self.cell.minimum.min(field.minimum.max(f64::MIN));
            self.cell.maximum = self.cell.maximum.max(field.maximum.min(f64::MAX));
        }
        self.owners.extend(owner);
    }
}
