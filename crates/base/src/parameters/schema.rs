//! All possible contents of a parameter struct, with every variant of every choice.

use std::fmt;

use stickslip_core::fields::{Field, Fields, Kind, Shape, Variant};

use super::entry::{join, within};
use super::number;
use crate::Error;

/// Description of one path.
#[derive(Clone, Debug)]
pub struct Description {
    /// As in files; a list of numbers is listed once, without an index.
    pub path: String,
    /// The field of a number; `None` for a choice.
    pub field: Option<&'static Field>,
    /// The variants of a choice; empty for a number.
    pub variants: &'static [Variant],
    /// The choice that this path requires, as in `friction.model = "lugre"`.
    pub only_with: Option<String>,
}

/// Everything at or below a path (`""`: everything), in the order of declaration. A path of several variants is listed
/// once for each.
///
/// # Errors
/// [`Error::UnknownParameter`] with the nearest known path.
pub fn describe<P: Fields<f64>>(path: &str) -> Result<Vec<Description>, Error> {
    let all = schema(P::SHAPE);
    let rows: Vec<_> = all.iter().filter(|row| within(&row.path, path)).cloned().collect();
    if !rows.is_empty() {
        return Ok(rows);
    }
    match all.iter().find(|row| is_element(row, path)) {
        Some(list) => Ok(vec![list.clone()]),
        None => {
            let known = || all.iter().map(|row| row.path.as_str());
            let nearest = known().find_map(|known| ending(known, path)).or_else(|| nearest(path, known()));
            Err(Error::UnknownParameter { path: path.into(), nearest: nearest.map(str::to_string) })
        }
    }
}

/// The beginning of a known path that ends with all of `path`: the right name without the groups around it.
fn ending<'a>(known: &'a str, path: &str) -> Option<&'a str> {
    let end = known.find(&format!(".{path}"))? + 1 + path.len();
    known[end..].is_empty().then_some(known).or_else(|| known[end..].starts_with('.').then(|| &known[..end]))
}

/// Whether a path is an element of a described list of numbers: `poles.1`.
fn is_element(list: &Description, path: &str) -> bool {
    let Some(field) = list.field.filter(|_| path != list.path && within(path, &list.path)) else { return false };
    let mut shape = field.shape;
    path[list.path.len() + 1..].split('.').all(|index| match (shape, index.parse::<usize>()) {
        (Shape::List(count, inner), Ok(index)) if index < count => {
            shape = *inner;
            true
        }
        _ => false,
    })
}

/// All rows of a shape.
pub(super) fn schema(shape: Shape) -> Vec<Description> {
    let mut rows = Vec::new();
    collect(shape, "", None, &mut rows);
    rows
}

fn collect(shape: Shape, path: &str, only_with: Option<&str>, rows: &mut Vec<Description>) {
    let only = || only_with.map(str::to_string);
    match shape {
        Shape::Number => {}
        Shape::List(count, inner) => {
            for index in 0..count {
                collect(*inner, &join(path, &index.to_string()), only_with, rows);
            }
        }
        Shape::Group(fields) => {
            for field in fields {
                let path = join(path, field.name);
                if holds_numbers(field.shape) {
                    rows.push(Description { path, field: Some(field), variants: &[], only_with: only() });
                } else {
                    collect(field.shape, &path, only_with, rows);
                }
            }
        }
        Shape::Choice { tag, variants } => {
            let tag = join(path, tag);
            rows.push(Description { path: tag.clone(), field: None, variants, only_with: only() });
            for variant in variants {
                collect(variant.shape, path, Some(&format!("{tag} = \"{}\"", variant.name)), rows);
            }
        }
    }
}

/// A number, or lists of numbers.
pub(super) fn holds_numbers(shape: Shape) -> bool {
    match shape {
        Shape::Number => true,
        Shape::List(_, inner) => holds_numbers(*inner),
        _ => false,
    }
}

/// Longest name that is compared with the known ones [bytes].
const LONGEST: usize = 200;

/// The most similar name, if one is similar enough.
pub fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // The comparison takes time and memory with the product of the lengths, and no known name is as long.
    if name.len() > LONGEST {
        return None;
    }
    known
        .map(|candidate| (strsim::normalized_damerau_levenshtein(name, candidate), candidate))
        .filter(|(likeness, _)| *likeness >= 0.6)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// Facts of a number: `M_S [N m], 1e-6 … 200, default 0.3`.
pub(super) fn facts(field: &Field) -> String {
    let mut facts = Vec::new();
    match (field.symbol, field.unit) {
        ("", "1") => {}
        ("", unit) => facts.push(format!("[{unit}]")),
        (symbol, "1") => facts.push(symbol.into()),
        (symbol, unit) => facts.push(format!("{symbol} [{unit}]")),
    }
    match field.kind {
        Kind::Flag => facts.push("true or false".into()),
        _ if field.minimum == f64::NEG_INFINITY && field.maximum == f64::INFINITY => {}
        _ => facts.push(number::range(field.minimum, field.maximum, "")),
    }
    if field.kind == Kind::Whole {
        facts.push("whole".into());
    }
    if let Shape::List(count, _) = field.shape {
        facts.push(format!("a list of {count}"));
    }
    facts.push(format!("default {}", number::of_field(field.default, &Field { unit: "1", ..*field })));
    facts.join(", ")
}

impl fmt::Display for Description {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{}", self.path)?;
        if let Some(condition) = &self.only_with {
            writeln!(f, "    only with {condition}")?;
        }
        if let Some(field) = self.field {
            writeln!(f, "    {}", facts(field))?;
            for line in field.help.lines().filter(|line| !line.is_empty()) {
                writeln!(f, "    {line}")?;
            }
        }
        for variant in self.variants {
            writeln!(f, "    \"{}\": {}", variant.name, variant.help.lines().next().unwrap_or(""))?;
        }
        Ok(())
    }
}
