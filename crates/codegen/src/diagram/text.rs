//! Symbols and words of a diagram.

use std::collections::HashMap;

use stickslip_core::fields::Field;

use crate::tree::Tree;

/// A part of a struct: its path, the place of its first number, its tree, and its row in the tables.
#[derive(Clone)]
pub(super) struct Part<'a> {
    pub(super) path: String,
    pub(super) first: usize,
    pub(super) tree: &'a Tree,
    pub(super) field: Option<&'static Field>,
}

impl<'a> Part<'a> {
    pub(super) fn whole(tree: &'a Tree) -> Self {
        Part { path: String::new(), first: 0, tree, field: None }
    }

    pub(super) fn count(&self) -> usize {
        self.tree.numbers()
    }

    /// Its parts; none for a number.
    pub(super) fn members(&self) -> Vec<Part<'a>> {
        let mut first = self.first;
        let mut out = Vec::new();
        let mut add = |path: String, tree: &'a Tree, field| {
            out.push(Part { path, first, tree, field });
            first += tree.numbers();
        };
        match self.tree {
            Tree::Number => {}
            Tree::List(length, element) => {
                (0..*length).for_each(|i| add(format!("{}[{i}]", self.path), element, self.field));
            }
            Tree::Group(group) => {
                let dot = if self.path.is_empty() { "" } else { "." };
                group.members.iter().for_each(|m| {
                    add(format!("{}{dot}{}", self.path, m.name), &m.tree, Some(m.field));
                });
            }
        }
        out
    }

    /// This and all below, outermost first.
    pub(super) fn all(&self) -> Vec<Part<'a>> {
        let below = self.members().into_iter().flat_map(|member| member.all());
        std::iter::once(self.clone()).chain(below).collect()
    }

    /// As in an equation: its own symbol, if it is a number and has one.
    pub(super) fn symbol(&self) -> String {
        let symbol = self.field.filter(|_| *self.tree == Tree::Number).map_or("", |field| field.symbol);
        match (symbol, self.path.ends_with(']'), self.path.rfind('[')) {
            ("", ..) => String::new(),
            (_, true, Some(at)) => format!("{symbol}{}", &self.path[at..]),
            _ => symbol.into(),
        }
    }

    pub(super) fn unit(&self) -> &'static str {
        self.field.filter(|_| *self.tree == Tree::Number).map_or("", |field| field.unit)
    }

    pub(super) fn help(&self) -> &'static str {
        self.field.map_or("", |field| field.help)
    }
}

/// Name of each number of a struct of parameters in a formula: its symbol, with its group if several have the same
/// symbol; else its name.
pub(super) fn names(tree: &Tree) -> Vec<String> {
    let numbers: Vec<Part> = Part::whole(tree).all().into_iter().filter(|part| *part.tree == Tree::Number).collect();
    let symbols: Vec<String> = numbers.iter().map(Part::symbol).collect();
    let mut times: HashMap<&str, usize> = HashMap::new();
    symbols.iter().for_each(|symbol| *times.entry(symbol).or_default() += 1);
    let name = |(part, symbol): (&Part, &String)| {
        let alone = times[symbol.as_str()] == 1;
        match (symbol.is_empty(), alone, part.path.split_once('.')) {
            (true, ..) => part.path.rsplit('.').next().unwrap_or_default().to_string(),
            (false, false, Some((group, _))) => {
                format!("{symbol}{}{}", if symbol.contains('_') { "," } else { "_" }, group.replace('_', " "))
            }
            _ => symbol.clone(),
        }
    };
    numbers.iter().zip(&symbols).map(name).collect()
}

/// A constant in few characters; longer ones are rounded to four digits.
pub(super) fn number(value: f64) -> String {
    for (known, text) in [(std::f64::consts::TAU, "2π"), (std::f64::consts::PI, "π")] {
        if value == known {
            return text.into();
        }
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞".into() } else { "−∞".into() };
    }
    let exact = format!("{value}");
    let plain = if exact.len() <= 6 {
        exact
    } else {
        let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
        let (short, scientific) = (format!("{rounded}"), format!("{rounded:e}"));
        if short.len() <= 7 { short } else { scientific }
    };
    let plain = plain.replace('-', "−");
    match plain.split_once('e') {
        None => plain,
        Some((mantissa, exponent)) => {
            let raised = |c: char| match c {
                '−' => '⁻',
                '1' => '¹',
                '2' => '²',
                '3' => '³',
                digit => char::from_u32('⁰' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
            };
            let mantissa = if mantissa == "1" { String::new() } else { format!("{mantissa}·") };
            format!("{mantissa}10{}", exponent.chars().map(raised).collect::<String>())
        }
    }
}

/// `CurrentControl` as words.
pub(super) fn words(name: &str) -> String {
    let mut out = String::new();
    let mut before = 'A';
    for c in name.chars() {
        if c.is_uppercase() && before.is_lowercase() {
            out.push(' ');
        }
        out.push(c);
        before = c;
    }
    out
}

/// The first sentence of a doc comment, without its marks.
pub(super) fn first_sentence(help: &str) -> String {
    let paragraph = help.trim().split("\n\n").next().unwrap_or_default().replace('\n', " ");
    let plain: String = paragraph.chars().filter(|c| !"[]`*".contains(*c)).collect();
    let plain = plain.split_whitespace().collect::<Vec<_>>().join(" ");
    let end = plain.find(". ").unwrap_or(plain.len());
    plain[..end].trim_end_matches(['.', ':']).into()
}

/// A printed unit; empty for a pure number.
pub(super) fn unit(unit: &str) -> String {
    if unit == "1" { String::new() } else { unit.replace("^2", "²").replace("^3", "³").replace(' ', "\u{a0}") }
}

/// Text between tags or in an attribute.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A piece of a formula: upright text, or a letter in italics with an index below.
enum Run<'a> {
    Plain(&'a str),
    Symbol(&'a str, &'a str),
}

/// A symbol is a single letter or one with an index behind `_` or of lowered digits; longer words are names.
fn runs(text: &str) -> Vec<Run<'_>> {
    let mut runs = Vec::new();
    let mut remainder = text;
    while let Some(first) = remainder.chars().next() {
        let end = |text: &str, part: fn(char) -> bool| text.find(|c: char| !part(c)).unwrap_or(text.len());
        if !first.is_alphabetic() {
            let end = end(remainder, |c| !c.is_alphabetic());
            runs.push(Run::Plain(&remainder[..end]));
            remainder = &remainder[end..];
            continue;
        }
        let word = end(remainder, |c| c.is_alphanumeric() || c == '_' || c == ',' || c == '.');
        let word = remainder[..word].trim_end_matches([',', '.']).len();
        let letter = first.len_utf8();
        let index = &remainder[letter..word];
        let lowered = !index.is_empty() && index.chars().all(|c| ('₀'..='₉').contains(&c));
        runs.push(match index.strip_prefix('_') {
            Some(index) => Run::Symbol(&remainder[..letter], index),
            None if index.is_empty() || lowered => Run::Symbol(&remainder[..letter], index),
            None => Run::Plain(&remainder[..word]),
        });
        remainder = &remainder[word..];
    }
    runs
}

/// The inside of an SVG `text`: symbols in italics, their index upright and below.
pub(super) fn svg(text: &str) -> String {
    let mut lowered = false;
    let run = |run: Run| {
        let back = if std::mem::take(&mut lowered) { " dy=\"-3\"" } else { "" };
        match run {
            Run::Plain(text) if back.is_empty() => escape(text),
            Run::Plain(text) => format!("<tspan{back}>{}</tspan>", escape(text)),
            Run::Symbol(letter, index) => {
                let index = index.chars().map(|c| match c {
                    '₀'..='₉' => char::from_u32(c as u32 - '₀' as u32 + '0' as u32).unwrap_or(c),
                    '_' => ' ',
                    other => other,
                });
                let index: String = index.collect();
                lowered = !index.is_empty();
                let below = if lowered {
                    format!("<tspan dy=\"3\" font-size=\"75%\">{}</tspan>", escape(&index))
                } else {
                    String::new()
                };
                format!("<tspan{back} font-style=\"italic\">{}</tspan>{below}", escape(letter))
            }
        }
    };
    runs(text).into_iter().map(run).collect()
}

/// Printed width at a size of 12 px; indices are smaller.
pub(super) fn width(text: &str) -> f64 {
    let characters = |text: &str| text.chars().filter(|c| !('\u{300}'..='\u{36f}').contains(c)).count() as f64;
    let run = |run: Run| match run {
        Run::Plain(text) => 6.8 * characters(text),
        Run::Symbol(letter, index) => 7.6 * characters(letter) + 5.4 * characters(index),
    };
    runs(text).into_iter().map(run).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_short() {
        let texts = [0.0, -0.5, 1e9, 2.5e-4, std::f64::consts::TAU, 1256.6370614359173, 1e-300].map(number);
        assert_eq!(texts, ["0", "−0.5", "10⁹", "0.00025", "2π", "1257", "10⁻³⁰⁰"]);
    }

    #[test]
    fn symbols_have_their_index_below_and_names_stay() {
        assert_eq!(
            svg("K_p e"),
            "<tspan font-style=\"italic\">K</tspan><tspan dy=\"3\" font-size=\"75%\">p</tspan>\
             <tspan dy=\"-3\"> </tspan><tspan font-style=\"italic\">e</tspan>"
        );
        assert_eq!(svg("min(use_tacho, 1)"), "min(use_tacho, 1)");
        assert!(width("M_breakaway") < width("breakaway_torque"));
    }
}
