//! Texts at the blocks of a page.

use super::Entry;
use crate::diagram::{Bound, End, Factor, Kind, Node, Page, Port, draw, formula, text};
use crate::record::{Function, Id};

/// Widest text at a block; a wider one is named k and written below the picture.
const WIDEST: f64 = 140.0;

/// Texts at the blocks of a page.
pub(super) struct Writer<'a> {
    pub(super) page: &'a Page<'a>,
    /// The names of all pages.
    pub(super) callees: Vec<&'static str>,
    pub(super) coefficients: Vec<(String, String)>,
}

impl Writer<'_> {
    fn fixed(&self, id: Id) -> String {
        formula(self.page.step, id, &|_| None)
    }

    /// The text, or a coefficient if it is long.
    fn short(&mut self, text: String) -> String {
        if text::width(&text) <= WIDEST {
            return text;
        }
        let known = self.coefficients.iter().find(|(_, known)| *known == text).map(|(name, _)| name.clone());
        known.unwrap_or_else(|| {
            let name = format!("k_{}", self.coefficients.len() + 1);
            self.coefficients.push((name.clone(), text));
            name
        })
    }

    /// A function as its formula, if that is short.
    pub(super) fn short_formula(&self, inputs: &[Entry], outputs: &[End]) -> Option<String> {
        let [to] = outputs else { return None };
        let [result] = self.page.nodes[to.node].outputs[to.port].numbers[..] else { return None };
        let text = function_formula(self.page, inputs, result);
        (text::width(&text) <= WIDEST).then_some(text)
    }

    pub(super) fn constant(&mut self, ids: &[Id]) -> String {
        let texts: Vec<String> = ids.iter().map(|id| self.fixed(*id)).collect();
        let same = texts.iter().all(|text| *text == texts[0]);
        let text = if same { texts[0].clone() } else { format!("({})", texts.join(", ")) };
        self.short(text)
    }

    pub(super) fn label(&mut self, node: &Node) -> String {
        match &node.kind {
            Kind::Gain(factors) => {
                let text = self.gain(factors);
                self.short(text)
            }
            Kind::Apply(function) => applied(*function).into(),
            Kind::Minimum => "min".into(),
            Kind::Maximum => "max".into(),
            Kind::Sum(_) => "Σ".into(),
            Kind::Product(_) => "×".into(),
            Kind::And => "and".into(),
            Kind::Or => "or".into(),
            Kind::Not => "not".into(),
            Kind::Compare(relation) => format!("a {} b", relation.sign()),
            Kind::Within { magnitude, bounds } => {
                let signal = if *magnitude { "|u|" } else { "u" };
                let bounds: Vec<_> = bounds.iter().map(|(relation, id)| (*relation, self.fixed(*id))).collect();
                let bounds: Vec<_> = bounds.into_iter().map(|(relation, text)| (relation, self.short(text))).collect();
                match &bounds[..] {
                    [(low, below), (high, above)] if low.sign() == ">" && high.sign() == "<" => {
                        format!("{below} < {signal} < {above}")
                    }
                    bounds => {
                        let each = bounds.iter().map(|(relation, text)| format!("{signal} {} {text}", relation.sign()));
                        each.collect::<Vec<_>>().join(", ")
                    }
                }
            }
            Kind::Saturation { low, high } => self.limits(*low, *high),
            Kind::Input | Kind::Output | Kind::Delay if node.symbol.is_empty() => {
                node.name.rsplit('.').next().unwrap_or_default().into()
            }
            Kind::Input | Kind::Output | Kind::Delay => node.symbol.clone(),
            Kind::Call { call, .. } => text::words(self.callees[self.page.step.graph.calls[*call].function]),
            Kind::Constant(_) | Kind::Sign | Kind::Switch => String::new(),
        }
    }

    fn gain(&self, factors: &[Factor]) -> String {
        let (mut above, mut below, mut minus) = (Vec::new(), Vec::new(), false);
        for factor in factors {
            match factor {
                Factor::Times(id) => above.push(self.fixed(*id)),
                Factor::Over(id) => below.push(self.fixed(*id)),
                Factor::Negated => minus = !minus,
            }
        }
        let wrapped = |texts: Vec<String>| {
            let many = texts.len() > 1;
            let wrap = |text: String| if many && text.contains(' ') { format!("({text})") } else { text };
            texts.into_iter().map(wrap).collect::<Vec<_>>().join("·")
        };
        let sign = if minus { "−" } else { "" };
        let plain = |text: &String| !text.contains([' ', '·', '/']);
        match (above.is_empty(), below.is_empty()) {
            (true, true) => format!("{sign}1"),
            (false, true) => format!("{sign}{}", wrapped(above)),
            (no_factor, _) => {
                let above = if no_factor { "1".into() } else { wrapped(above) };
                let bare = below.len() == 1 && below.iter().all(plain);
                let below = if bare { wrapped(below) } else { format!("({})", wrapped(below)) };
                format!("{sign}{above}/{below}")
            }
        }
    }

    fn limits(&mut self, low: Bound, high: Bound) -> String {
        let text = |bound: Bound| match bound {
            Bound::Fixed(id) => self.fixed(id),
            Bound::Signal | Bound::Opposite => String::new(),
        };
        let (low, high) = (text(low), text(high));
        match (low.is_empty(), high.is_empty()) {
            (true, true) => String::new(),
            _ if low == format!("−{high}") || low == format!("−({high})") => {
                let high = self.short(high);
                format!("±{high}")
            }
            _ => {
                let (low, high) = (self.short(low), self.short(high));
                format!("{low} … {high}")
            }
        }
    }
}

/// A function of the signal u.
fn applied(function: Function) -> &'static str {
    match function {
        Function::Abs => "|u|",
        Function::Exp => "exp u",
        Function::Ln => "ln u",
        Function::Sin => "sin u",
        Function::Cos => "cos u",
        Function::Round => "round u",
        Function::Floor => "⌊u⌋",
        Function::PowerOfTwo => "2^u",
        Function::Exponent => "exponent u",
    }
}

/// Name of a port of a box.
pub(in crate::diagram) fn port_name(port: &Port) -> String {
    if port.symbol.is_empty() { port.name.clone() } else { port.symbol.clone() }
}

/// Names of the signals at the inputs of a function: as elsewhere, else u.
pub(in crate::diagram) fn function_names(page: &Page, inputs: &[Entry]) -> Vec<String> {
    let name = |(number, entry): (usize, &Entry)| match entry {
        Entry::Text(text) => text.clone(),
        Entry::Wire(..) if inputs.len() == 1 => "u".into(),
        Entry::Wire(from, _) => {
            Some(short_name(page, *from)).filter(|n| !n.is_empty()).unwrap_or(format!("u_{}", number + 1))
        }
    };
    inputs.iter().enumerate().map(name).collect()
}

/// A name that fits next to a port.
pub(in crate::diagram) fn short_name(page: &Page, end: End) -> String {
    let name = draw::name(page, end);
    if text::width(&name) > WIDEST / 2.0 { name.rsplit('.').next().unwrap_or_default().into() } else { name }
}

/// The formula of a function of its inputs.
pub(in crate::diagram) fn function_formula(page: &Page, inputs: &[Entry], result: Id) -> String {
    let names = function_names(page, inputs);
    let known = |id: Id| {
        inputs.iter().zip(&names).find_map(|(entry, name)| match entry {
            Entry::Wire(from, _) => {
                let numbers = &page.nodes[from.node].outputs[from.port].numbers;
                let place = numbers.iter().position(|number| *number == id)?;
                Some(if numbers.len() == 1 { name.clone() } else { format!("{name}[{place}]") })
            }
            Entry::Text(_) => None,
        })
    };
    formula(page.step, result, &known)
}
