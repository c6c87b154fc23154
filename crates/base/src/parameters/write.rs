//! From parameters to TOML with comments.

use std::collections::BTreeMap;
use std::fmt::{self, Write};

use stickslip_core::fields::{Field, Fields, Shape};

use super::entry::{Value, flatten, join};
use super::number;
use super::schema::{facts, holds_numbers};

/// A complete file: every key, with symbol, unit, range, default and help as comments. Reads back to the same bits.
pub fn write_commented<P: Fields<f64>>(parameters: &P) -> String {
    let values = flatten(parameters).into_iter().map(|entry| (entry.path, entry.value)).collect();
    let mut writer = Writer { values, out: String::new() };
    writer.group(P::SHAPE, "", "").expect("writing to a String cannot fail");
    writer.out.trim_start().to_string()
}

struct Writer {
    values: BTreeMap<String, Value>,
    out: String,
}

impl Writer {
    /// `path` is for values (lists numbered), `heading` is the table's name in the file.
    fn group(&mut self, mut shape: Shape, path: &str, heading: &str) -> fmt::Result {
        let chooses = !shape.variants().is_empty();
        while let Shape::Choice { tag, variants } = shape {
            let chosen = match self.values.get(&join(path, tag)) {
                Some(Value::Variant(name)) => variants.iter().find(|variant| variant.name == *name),
                _ => None,
            };
            let chosen = chosen.expect("a walk names a variant of the choice's own table");
            self.comment(chosen.help)?;
            let names: Vec<_> = variants.iter().map(|variant| variant.name).collect();
            self.comment(&format!("One of: {}.", names.join(", ")))?;
            writeln!(self.out, "{tag} = \"{}\"", chosen.name)?;
            shape = chosen.shape;
        }
        // Numbers first: in TOML everything below a heading belongs to it.
        let (numbers, groups): (Vec<_>, Vec<_>) = shape.fields().iter().partition(|field| holds_numbers(field.shape));
        for (index, field) in numbers.into_iter().enumerate() {
            if index > 0 || chooses {
                writeln!(self.out)?;
            }
            self.comment(field.help)?;
            self.comment(&facts(field))?;
            let value = self.number(field.shape, field, &join(path, field.name));
            writeln!(self.out, "{} = {value}", field.name)?;
        }
        for field in groups {
            let (path, heading) = (join(path, field.name), join(heading, field.name));
            if let Shape::List(count, inner) = field.shape {
                for index in 0..count {
                    self.heading(field, &format!("[[{heading}]]"))?;
                    self.group(*inner, &join(&path, &index.to_string()), &heading)?;
                }
            } else {
                self.heading(field, &format!("[{heading}]"))?;
                self.group(field.shape, &path, &heading)?;
            }
        }
        Ok(())
    }

    fn heading(&mut self, field: &Field, heading: &str) -> fmt::Result {
        writeln!(self.out)?;
        self.comment(field.help)?;
        writeln!(self.out, "{heading}")
    }

    fn number(&self, shape: Shape, field: &Field, path: &str) -> String {
        match (shape, self.values.get(path)) {
            (Shape::List(count, inner), _) => {
                let element = |index: usize| self.number(*inner, field, &join(path, &index.to_string()));
                format!("[{}]", (0..count).map(element).collect::<Vec<_>>().join(", "))
            }
            (_, Some(Value::Number(value))) => number::toml(*value, field),
            _ => unreachable!("a walk visits every number of the shape"),
        }
    }

    /// Comment lines of at most 100 characters.
    fn comment(&mut self, text: &str) -> fmt::Result {
        for paragraph in text.lines().filter(|line| !line.is_empty()) {
            let mut length = 0;
            for word in paragraph.split_whitespace() {
                let wider = length + 1 + word.chars().count();
                if length == 0 || wider > 100 {
                    let end = if length == 0 { "" } else { "\n" };
                    write!(self.out, "{end}# {word}")?;
                    length = 2 + word.chars().count();
                } else {
                    write!(self.out, " {word}")?;
                    length = wider;
                }
            }
            writeln!(self.out)?;
        }
        Ok(())
    }
}
