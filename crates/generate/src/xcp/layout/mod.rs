//! Which value has which address. There is no memory behind it: an address is looked up here, or it is none.

mod tables;

use std::collections::{BTreeMap, HashMap};

use stickslip_core::fields::{Field, Variant};

use stickslip_base::parameters::{Entry, Value, number};

/// Where the measurements begin; the first is the number of the cycle.
pub const MEASUREMENTS: u32 = 0x1000_0000;
/// Where the segment of the parameters begins.
pub const PARAMETERS: u32 = 0x2000_0000;
/// Where the identification of the layout stands.
pub const EPK: u32 = 0x3000_0000;
/// Bytes of a value: all are double precision.
pub const SIZE: u32 = 8;

/// A value that has an address.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Dotted path of a parameter, name of a signal.
    pub path: String,
    /// Of its first byte.
    pub address: u32,
    /// As in an equation; may be empty.
    pub symbol: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// What it is.
    pub help: &'static str,
    /// Smallest value that may be written.
    pub minimum: f64,
    /// Largest one.
    pub maximum: f64,
    /// What it stands for.
    pub content: Content,
}

/// What the number in a cell stands for.
#[derive(Clone, Copy, Debug)]
pub enum Content {
    /// Any number.
    Real,
    /// A whole one.
    Whole,
    /// 0 or 1.
    Flag,
    /// The place of a variant among its like.
    Choice(&'static [Variant]),
}

/// A parameter that may change while the bench runs.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Its cell.
    pub cell: Cell,
    /// What stands there while a variant without it is chosen.
    pub default: f64,
    /// The variants that have it, of which one must be chosen; none: it is always there.
    owners: Vec<(String, String)>,
    /// Its field, for its text.
    field: Option<&'static Field>,
    /// The list that it is an element of: path, cell of the first element, length.
    list: Option<(String, usize, usize)>,
}

/// All values with their addresses, and what tells this layout from others.
#[derive(Clone, Debug)]
pub struct Layout {
    /// What every cycle leaves, the number of the cycle first.
    pub measurements: Vec<Cell>,
    /// What may be changed.
    pub parameters: Vec<Parameter>,
    /// Ticks in a second [Hz].
    pub rate: f64,
    /// A hash over the layout, this version and the rate: a description that does not have it is not of this bench.
    pub epk: String,
}

impl Layout {
    /// Of a bench with so many ticks a second [Hz]. All presets have the same.
    pub fn new(rate: f64) -> Self {
        Self::with(rate, &[])
    }

    /// The same with what a bench has besides its preset: of all values of such a bench, those that no preset has come
    /// last.
    pub fn with(rate: f64, entries: &[Entry]) -> Self {
        let parameters = tables::parameters(entries);
        let mut layout = Layout { measurements: tables::measurements(), parameters, rate, epk: String::new() };
        layout.epk = layout.hash();
        layout
    }

    /// The cell at an address, and the byte in it.
    pub fn parameter_at(&self, address: u32) -> Option<(usize, usize)> {
        let offset = address.checked_sub(PARAMETERS)?;
        let index = (offset / SIZE) as usize;
        (index < self.parameters.len()).then_some((index, (offset % SIZE) as usize))
    }

    /// So many measurements from an address on: the index of the first.
    pub fn measurement_at(&self, address: u32, count: usize) -> Option<usize> {
        let offset = address.checked_sub(MEASUREMENTS).filter(|offset| offset.is_multiple_of(SIZE))?;
        let first = (offset / SIZE) as usize;
        (first.checked_add(count)? <= self.measurements.len()).then_some(first)
    }

    /// The values of the parameters in a set, in the order of their addresses.
    pub fn values(&self, entries: &[Entry]) -> Vec<f64> {
        let known: HashMap<&str, Value> = entries.iter().map(|entry| (entry.path.as_str(), entry.value)).collect();
        let value = |parameter: &Parameter| match (known.get(parameter.cell.path.as_str()), parameter.cell.content) {
            (Some(Value::Number(value)), _) => *value,
            (Some(Value::Variant(name)), Content::Choice(variants)) => {
                variants.iter().position(|variant| variant.name == *name).map_or(f64::NAN, |place| place as f64)
            }
            _ => parameter.default,
        };
        self.parameters.iter().map(value).collect()
    }

    /// Whether a parameter exists where these are the values.
    pub fn exists(&self, index: usize, values: &[f64]) -> bool {
        let owners = &self.parameters[index].owners;
        let chosen = |(tag, name): &(String, String)| {
            let place = self.parameters.iter().position(|parameter| parameter.cell.path == *tag);
            place.is_some_and(|place| {
                self.text(place, values[place]).as_deref() == Some(name) && self.exists(place, values)
            })
        };
        owners.is_empty() || owners.iter().any(chosen)
    }

    /// What makes `to` of `from` as changes of a file, paths and values; only these parameters are looked at.
    pub fn changes(&self, from: &[f64], to: &[f64], looked_at: impl Fn(usize) -> bool) -> Vec<(String, String)> {
        let other = |index: usize| from[index].to_bits() != to[index].to_bits();
        // Another variant begins with its own defaults: then all that depends on one is said.
        let another = self.indices().any(|i| self.is_choice(i) && looked_at(i) && other(i));
        let wanted = |&index: &usize| {
            let said = other(index) || another && !self.is_choice(index) && !self.parameters[index].owners.is_empty();
            said && looked_at(index)
        };
        let mut changes = BTreeMap::new();
        for index in self.indices().filter(wanted) {
            // What no chosen variant has is said only where somebody asks for it alone, and is then refused by name.
            if another && !self.exists(index, to) {
                continue;
            }
            let (first, path, value) = match &self.parameters[index].list {
                Some((path, first, count)) => {
                    let all = (*first..first + count).map(|i| self.text(i, to[i]).unwrap_or_default());
                    (*first, path.clone(), format!("[{}]", all.collect::<Vec<_>>().join(", ")))
                }
                None => {
                    let path = self.parameters[index].cell.path.clone();
                    (index, path, self.text(index, to[index]).unwrap_or_else(|| to[index].to_string()))
                }
            };
            changes.insert(first, (path, value));
        }
        changes.into_values().collect()
    }

    fn indices(&self) -> std::ops::Range<usize> {
        0..self.parameters.len()
    }

    fn is_choice(&self, index: usize) -> bool {
        matches!(self.parameters[index].cell.content, Content::Choice(_))
    }

    /// A value as in a file; none where a choice has no such variant.
    fn text(&self, index: usize, value: f64) -> Option<String> {
        let parameter = &self.parameters[index];
        match (parameter.cell.content, parameter.field) {
            (Content::Choice(variants), _) => {
                let variant = (value >= 0.0 && value.fract() == 0.0).then(|| variants.get(value as usize)).flatten();
                variant.map(|variant| variant.name.to_owned())
            }
            (_, Some(field)) => Some(number::toml(value, field)),
            (_, None) => None,
        }
    }

    fn hash(&self) -> String {
        let mut text = format!("{} {:?}", env!("CARGO_PKG_VERSION"), self.rate.to_bits());
        for cell in self.measurements.iter().chain(self.parameters.iter().map(|parameter| &parameter.cell)) {
            let Cell { path, address, unit, minimum, maximum, content, .. } = cell;
            text += &format!("\n{path} {address} {unit} {minimum:e} {maximum:e}");
            if let Content::Choice(variants) = content {
                variants.iter().for_each(|variant| text += &format!(" {}", variant.name));
            }
        }
        // FNV-1a.
        let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        format!("stickslip {:016x}", text.bytes().fold(0xcbf2_9ce4_8422_2325, step))
    }
}
