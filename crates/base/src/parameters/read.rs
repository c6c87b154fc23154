//! From TOML to parameters. The text is first checked against the shape, so that all problems are reported at once.

use std::collections::BTreeMap;
use std::ops::Range;

use stickslip_core::fields::{Field, Fields, Kind, Shape, Variant, Walk};
use toml_edit::{Document, TableLike, Value};

use super::entry::{Place, join, within};
use super::laws::broken_laws;
use super::node::{Content, Node};
use super::problem::{Fault, ParameterProblems, Problem};
use super::schema::{Description, nearest, schema};
use super::{IDENTIFIED, UNCERTAINTY};
use crate::excerpt::parser_message;

/// Reads parameters; values that are not in the text keep their defaults.
///
/// Flags are `true` or `false`, numbers may be written as integers, a choice is named by its key. `file_name` is for
/// messages.
///
/// # Errors
/// All problems of the text at once: syntax, unknown names, types, ranges, laws between fields.
pub fn read<P: Fields<f64> + Default>(text: &str, file_name: &str) -> Result<P, ParameterProblems> {
    let mut contents = scan(text, P::SHAPE);
    let mut parameters = P::default();
    parameters.contents(&mut Apply { place: Place::default(), values: &contents.values });
    for (group, law) in broken_laws(&parameters) {
        // A law is checked only between values without other problems.
        if contents.problems.iter().any(|problem| within(&problem.path, &group)) {
            continue;
        }
        let path = join(&group, law.field);
        let row = contents.rows.iter().find(|row| row.path == path);
        let unit = row.and_then(|row| row.field).map_or("", |field| field.unit);
        contents.problems.push(Problem { line: contents.line_of(text, &path), path, fault: Fault::Law { law, unit } });
    }
    if contents.problems.is_empty() {
        return Ok(parameters);
    }
    contents.problems.sort_by_key(|problem| problem.line.unwrap_or(usize::MAX));
    Err(ParameterProblems { file: file_name.into(), problems: contents.problems })
}

/// Contents of a text, checked against a shape.
pub(super) struct Contents {
    values: BTreeMap<String, Value64>,
    /// Place of each path in the text.
    pub(super) spans: BTreeMap<String, Range<usize>>,
    problems: Vec<Problem>,
    rows: Vec<Description>,
}

/// A value in the form that a walk applies.
#[derive(Clone, Copy)]
enum Value64 {
    Number(f64),
    Variant(usize),
}

/// Checks a text against a shape.
pub(super) fn scan(text: &str, shape: Shape) -> Contents {
    let mut contents =
        Contents { values: BTreeMap::new(), spans: BTreeMap::new(), problems: Vec::new(), rows: schema(shape) };
    match Document::parse(text) {
        Ok(document) => contents.group(text, document.as_table(), shape, ""),
        Err(error) => {
            let line = error.span().map(|span| line(text, span.start));
            let message = parser_message(error.message());
            contents.problems.push(Problem { line, path: String::new(), fault: Fault::Syntax { message } });
        }
    }
    contents
}

/// The line of a byte, from 1.
fn line(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|byte| *byte == b'\n').count()
}

/// Problems of a text that are reported; a file of another kind may have a million.
const MOST_PROBLEMS: usize = 100;

/// Former names of variants, accepted until 0.2, and the current ones.
const FORMER: [(&str, &str); 1] = [("point-topoint", "point-to-point")];

/// The current name of a variant.
pub(super) fn current_name(name: &str) -> &str {
    FORMER.iter().find(|(former, _)| *former == name).map_or(name, |(_, current)| current)
}

impl Contents {
    /// The line of a path, or of the innermost group around it in the text.
    fn line_of(&self, text: &str, path: &str) -> Option<usize> {
        match self.spans.get(path) {
            Some(span) => Some(line(text, span.start)),
            None => self.line_of(text, path.rsplit_once('.')?.0),
        }
    }

    fn report(&mut self, text: &str, path: &str, fault: Fault) {
        // The place of each problem takes a pass over the text.
        if self.problems.len() >= MOST_PROBLEMS {
            return;
        }
        self.problems.push(Problem { line: self.line_of(text, path), path: path.into(), fault });
    }

    fn group(&mut self, text: &str, table: &dyn TableLike, shape: Shape, path: &str) {
        let mut shape = shape;
        let mut choices = Vec::new();
        while let Shape::Choice { tag, variants } = shape {
            let Some(chosen) = self.variant(text, table, tag, variants, path) else { return };
            choices.push((tag, variants, chosen));
            shape = variants[chosen].shape;
        }
        for (key, item) in table.iter() {
            let Some(node) = Node::of_item(item) else { continue };
            // Results of an identification and their covariance are additional tables.
            let additional = path.is_empty() && [IDENTIFIED, UNCERTAINTY].contains(&key);
            if choices.iter().any(|(tag, ..)| *tag == key) || additional {
                continue;
            }
            let path = join(path, &bare_or_quoted(key));
            if let Some(span) = node.span.clone().or_else(|| table.key(key).and_then(|key| key.span())) {
                self.spans.insert(path.clone(), span);
            }
            match shape.fields().iter().find(|field| field.name == key) {
                Some(field) => self.field(text, &node, field.shape, field, &path),
                None => {
                    let names = || choices.iter().map(|(tag, ..)| *tag).chain(shape.fields().iter().map(|f| f.name));
                    let fault = owner(&choices, key).unwrap_or_else(|| self.unknown(key, &path, names().collect()));
                    self.report(text, &path, fault);
                }
            }
        }
    }

    /// The variant of a table; the first by default, `None` if there is no such variant.
    fn variant(
        &mut self,
        text: &str,
        table: &dyn TableLike,
        tag: &'static str,
        variants: &'static [Variant],
        path: &str,
    ) -> Option<usize> {
        let Some(node) = table.get(tag).and_then(Node::of_item) else { return Some(0) };
        let path = join(path, tag);
        self.spans.extend(node.span.clone().map(|span| (path.clone(), span)));
        let Content::Value(Value::String(name)) = node.content else {
            let names: Vec<_> = variants.iter().map(|variant| format!("\"{}\"", variant.name)).collect();
            let fault = Fault::WrongType { expected: format!("one of {}", names.join(", ")), got: node.in_words() };
            self.report(text, &path, fault);
            return None;
        };
        let chosen = variants.iter().position(|variant| variant.name == current_name(name.value()));
        match chosen {
            Some(index) => drop(self.values.insert(path, Value64::Variant(index))),
            None => self.report(text, &path, Fault::unknown_variant(name.value(), variants)),
        }
        chosen
    }

    fn field(&mut self, text: &str, node: &Node, shape: Shape, field: &'static Field, path: &str) {
        match (shape, &node.content) {
            (Shape::Number, Content::Value(value)) => match number(value, field.kind) {
                Some(value) => match Fault::of_number(value, field) {
                    Some(fault) => self.report(text, path, fault),
                    None => drop(self.values.insert(path.into(), Value64::Number(value))),
                },
                None => self.wrong_type(text, node, shape, field, path),
            },
            (Shape::List(count, inner), Content::List(list)) if list.len() == count => {
                for (index, node) in list.iter().enumerate() {
                    let path = join(path, &index.to_string());
                    self.spans.extend(node.span.clone().map(|span| (path.clone(), span)));
                    self.field(text, node, *inner, field, &path);
                }
            }
            (Shape::Group(_) | Shape::Choice { .. }, Content::Table(table)) => self.group(text, *table, shape, path),
            _ => self.wrong_type(text, node, shape, field, path),
        }
    }

    fn wrong_type(&mut self, text: &str, node: &Node, shape: Shape, field: &'static Field, path: &str) {
        let expected = match shape {
            Shape::Number if field.kind == Kind::Flag => "true or false".into(),
            Shape::Number if field.unit == "1" => "a number, without quotes".into(),
            Shape::Number => format!("a number in {}, without quotes", field.unit),
            Shape::List(count, _) => format!("a list of {count}"),
            Shape::Group(_) | Shape::Choice { .. } => format!("a table, [{path}]"),
        };
        self.report(text, path, Fault::WrongType { expected, got: node.in_words() });
    }

    fn unknown(&self, key: &str, path: &str, names: Vec<&'static str>) -> Fault {
        if self.problems.len() >= MOST_PROBLEMS {
            return Fault::Unknown { nearest: None, known: names };
        }
        let here = nearest(key, names.iter().copied())
            .map(|name| path.rsplit_once('.').map_or(name.into(), |(group, _)| join(group, name)));
        // The correct name in another table.
        let elsewhere = || self.rows.iter().find(|row| row.path.rsplit('.').next() == Some(key));
        Fault::Unknown { nearest: here.or_else(|| elsewhere().map(|row| row.path.clone())), known: names }
    }
}

/// The problem of a key that another variant has.
fn owner(choices: &[(&'static str, &'static [Variant], usize)], key: &str) -> Option<Fault> {
    choices.iter().find_map(|&(tag, variants, chosen)| {
        let owner = variants.iter().find(|variant| variant.shape.fields().iter().any(|field| field.name == key))?;
        Some(Fault::OtherVariant { tag, chosen: variants[chosen].name, owner: owner.name })
    })
}

fn number(value: &Value, kind: Kind) -> Option<f64> {
    match (kind, value) {
        (Kind::Flag, Value::Boolean(flag)) => Some(f64::from(u8::from(*flag.value()))),
        (Kind::Real | Kind::Whole, Value::Float(number)) => Some(*number.value()),
        (Kind::Real | Kind::Whole, Value::Integer(number)) => Some(*number.value() as f64),
        _ => None,
    }
}

/// A key as in a file, quoted if it has dots, which would be read as a path.
fn bare_or_quoted(key: &str) -> String {
    let bare = !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-".contains(&byte));
    if bare { key.into() } else { format!("{key:?}") }
}

struct Apply<'a> {
    place: Place,
    values: &'a BTreeMap<String, Value64>,
}

impl Walk<f64> for Apply<'_> {
    fn number(&mut self, field: &'static Field, value: &mut f64) {
        if let Some(Value64::Number(number)) = self.values.get(&self.place.path(field)) {
            *value = *number;
        }
    }

    fn choice(&mut self, tag: &'static str, _variants: &'static [Variant], current: usize) -> usize {
        match self.values.get(&join(self.place.group(), tag)) {
            Some(Value64::Variant(index)) => *index,
            _ => current,
        }
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
