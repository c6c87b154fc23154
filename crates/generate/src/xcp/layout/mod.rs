//! Addresses of the values. They are virtual: an address is looked up here, or it is invalid.

mod tables;

use std::collections::{BTreeMap, HashMap};

use stickslip_core::fields::{Field, Variant};

use stickslip_base::parameters::{Entry, Value, number};

/// Start of the measurements; the first is the number of the cycle.
pub const MEASUREMENTS: u32 = 0x1000_0000;
/// Start of the segment of the parameters.
pub const PARAMETERS: u32 = 0x2000_0000;
/// Address of the identification of the layout.
pub const EPK: u32 = 0x3000_0000;
/// Bytes of a value: all are double precision.
pub const SIZE: u32 = 8;

/// A value that has an address.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Dotted path of a parameter, name of a signal.
    pub path: String,
    /// Address of its first byte.
    pub address: u32,
    /// As in an equation; may be empty.
    pub symbol: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Description.
    pub help: &'static str,
    /// Smallest value that may be written.
    pub minimum: f64,
    /// Largest one.
    pub maximum: f64,
    /// Kind of the value.
    pub content: Content,
}

/// Kind of the number in a cell.
#[derive(Clone, Copy, Debug)]
pub enum Content {
    /// Any number.
    Real,
    /// A whole one.
    Whole,
    /// 0 or 1.
    Flag,
    /// The index of a variant.
    Choice(&'static [Variant]),
}

/// A parameter that may be changed while the bench runs.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Its cell.
    pub cell: Cell,
    /// Its value while a variant without it is chosen.
    pub default: f64,
    /// The variants that have it, of which one must be chosen; empty if it always exists.
    owners: Vec<(String, String)>,
    /// Its field, for its text.
    field: Option<&'static Field>,
    /// The list that it is an element of: path, cell of the first element, length.
    list: Option<(String, usize, usize)>,
}

/// All values with their addresses, and the identification of the layout.
#[derive(Clone, Debug)]
pub struct Layout {
    /// The signals of every cycle, the number of the cycle first.
    pub measurements: Vec<Cell>,
    /// The parameters.
    pub parameters: Vec<Parameter>,
    /// Ticks in a second [Hz].
    pub rate: f64,
    /// A hash over the layout, this version and the rate: a description with another hash is not for this bench.
    pub epk: String,
}

impl Layout {
    /// The layout of a bench with this tick rate [Hz]. It is the same for all presets.
    pub fn new(rate: f64) -> Self {
        Self::with(rate, &[])
    }

    /// The same with the additional values of a bench, which no preset has; they come last.
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

    /// The index of the first of `count` measurements from an address.
    pub fn measurement_at(&self, address: u32, count: usize) -> Option<usize> {
        let offset = address.checked_sub(MEASUREMENTS).filter(|offset| offset.is_multiple_of(SIZE))?;
        let first = (offset / SIZE) as usize;
        (first.checked_add(count)? <= self.measurements.len()).then_some(first)
    }

    /// The values of the parameters in a set, in the order of their addresses.
    pub fn values(&self, entries: &[Entry]) -> Vec<f64> {
        let by_path: HashMap<&str, Value> = entries.iter().map(|entry| (entry.path.as_str(), entry.value)).collect();
        let value = |parameter: &Parameter| match (by_path.get(parameter.cell.path.as_str()), parameter.cell.content) {
            (Some(Value::Number(value)), _) => *value,
            (Some(Value::Variant(name)), Content::Choice(variants)) => {
                variants.iter().position(|variant| variant.name == *name).map_or(f64::NAN, |place| place as f64)
            }
            _ => parameter.default,
        };
        self.parameters.iter().map(value).collect()
    }

    /// Whether a parameter exists with these values.
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

    /// The changes from `from` to `to` as paths and values of a file; only these parameters are compared.
    pub fn changes(&self, from: &[f64], to: &[f64], looked_at: impl Fn(usize) -> bool) -> Vec<(String, String)> {
        let other = |index: usize| from[index].to_bits() != to[index].to_bits();
        // Another variant starts with its own defaults: then all values that depend on a variant are listed.
        let another = self.indices().any(|i| self.is_choice(i) && looked_at(i) && other(i));
        let included = |&index: &usize| {
            let listed = other(index) || another && !self.is_choice(index) && !self.parameters[index].owners.is_empty();
            listed && looked_at(index)
        };
        let mut changes = BTreeMap::new();
        for index in self.indices().filter(included) {
            // A value that no chosen variant has is listed only in a request without a new variant, and is then refused
            // with its path.
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

    /// A value as in a file; `None` if a choice has no such variant.
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
