//! The picture of a page: what is drawn, how large it is, and where.

use std::collections::{BTreeMap, BTreeSet};

use super::layout::{self, Column, Layout, Link, Shape};
use super::{Bound, Diagram, End, Factor, Kind, Node, Page, crowd, draw, text};
use crate::record::{Function, Id};

/// Widest text that is written at a block; what is wider is named k and written below the picture.
const WIDEST: f64 = 140.0;
/// Height of a row of ports.
const ROW: f64 = 22.0;

/// Something that is drawn: a node, or several as one function.
pub(super) struct Element {
    pub(super) nodes: Vec<usize>,
    pub(super) inputs: Vec<Entry>,
    pub(super) outputs: Vec<End>,
    /// Width of what is written left of the body.
    pub(super) margin: f64,
    /// Heights of the inputs below the upper edge.
    pub(super) rows: Vec<f64>,
    pub(super) label: String,
    pub(super) shape: Shape,
}

impl Element {
    /// Whether it is several nodes that are written as a formula.
    pub(super) fn is_formula(&self) -> bool {
        self.nodes.len() > 1 && !self.label.starts_with("f_")
    }
}

/// What enters a block.
pub(super) enum Entry {
    /// A wire, which begins there; the ports that it feeds.
    Wire(End, Vec<End>),
    /// Something that depends on no signal: its text.
    Text(String),
}

/// A page with everything placed.
pub(super) struct Picture {
    pub(super) elements: Vec<Element>,
    pub(super) layout: Layout,
    /// `k₁` and what it stands for.
    pub(super) coefficients: Vec<(String, String)>,
}

/// The SVG of a page.
pub(super) fn svg(diagram: &Diagram, page: usize) -> String {
    draw::svg(diagram, page, &arrange(&diagram.pages[page]))
}

/// Places a page.
pub(super) fn arrange(page: &Page) -> Picture {
    let mut writer = Writer { page, coefficients: Vec::new() };
    let mut elements = elements(page, &mut writer);
    let first = place(&elements);
    // Where the order of the inputs is free, they are taken in the order in which their wires arrive.
    for (element, ports) in elements.iter_mut().zip(&first.ports) {
        sort_rows(page, element, &ports[0], &first);
    }
    let layout = place(&elements);
    Picture { elements, layout, coefficients: writer.coefficients }
}

fn place(elements: &[Element]) -> Layout {
    let mut begins = BTreeMap::new();
    for (number, element) in elements.iter().enumerate() {
        element.outputs.iter().enumerate().for_each(|(port, end)| {
            begins.insert(*end, (number, port));
        });
    }
    let mut links = Vec::new();
    for (number, element) in elements.iter().enumerate() {
        let wires = element.inputs.iter().filter_map(|entry| match entry {
            Entry::Wire(from, _) => Some(*from),
            Entry::Text(_) => None,
        });
        links.extend(wires.enumerate().map(|(port, from)| Link { from: begins[&from], to: (number, port) }));
    }
    let shapes: Vec<Shape> = elements.iter().map(|element| element.shape.clone()).collect();
    layout::layout(&shapes, &links)
}

/// The elements of a page, sized.
fn elements(page: &Page, writer: &mut Writer) -> Vec<Element> {
    let group = crowd::groups(page);
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (node, group) in group.iter().enumerate() {
        if !matches!(page.nodes[node].kind, Kind::Constant(_)) {
            members.entry(*group).or_default().push(node);
        }
    }
    let mut functions = 0;
    members.into_values().map(|nodes| element(page, nodes, writer, &mut functions)).collect()
}

fn element(page: &Page, nodes: Vec<usize>, writer: &mut Writer, functions: &mut usize) -> Element {
    let alone = nodes.len() == 1;
    let mut inputs: Vec<Entry> = Vec::new();
    let inside = |node: usize| nodes.contains(&node);
    for wire in page.wires.iter().filter(|wire| inside(wire.to.node)) {
        let known = inputs.iter_mut().find_map(|entry| match entry {
            Entry::Wire(from, to) if *from == wire.from && !alone => Some(to),
            _ => None,
        });
        match (&page.nodes[wire.from.node].kind, known) {
            (Kind::Constant(_), _) if !alone => {}
            (Kind::Constant(ids), _) => inputs.push(Entry::Text(writer.constant(ids))),
            (_, Some(to)) => to.push(wire.to),
            (_, None) if !inside(wire.from.node) => inputs.push(Entry::Wire(wire.from, vec![wire.to])),
            _ => {}
        }
    }
    let leaving = page.wires.iter().filter(|wire| inside(wire.from.node) && (alone || !inside(wire.to.node)));
    let outputs: Vec<End> = leaving.map(|wire| wire.from).collect::<BTreeSet<_>>().into_iter().collect();
    let label = if alone {
        writer.label(&page.nodes[nodes[0]])
    } else {
        match writer.chain(&inputs, &outputs) {
            Some(formula) => formula,
            None => {
                *functions += 1;
                format!("f_{functions}")
            }
        }
    };
    let shape = Shape { width: 0.0, height: 0.0, inputs: Vec::new(), outputs: Vec::new(), column: Column::Free };
    let mut out = Element { nodes, inputs, outputs, margin: 0.0, rows: Vec::new(), label, shape };
    size(page, &mut out);
    out
}

/// What is written at the blocks of a page.
struct Writer<'a> {
    page: &'a Page<'a>,
    coefficients: Vec<(String, String)>,
}

impl Writer<'_> {
    fn fixed(&self, id: Id) -> String {
        super::formula(self.page.step, id, &|_| None)
    }

    /// As it is, or as a coefficient where it is long.
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

    /// A function of one signal as its formula in u, if that is short.
    fn chain(&self, inputs: &[Entry], outputs: &[End]) -> Option<String> {
        let ([Entry::Wire(from, _)], [to]) = (inputs, outputs) else { return None };
        let only = |end: &End| self.page.nodes[end.node].outputs[end.port].numbers.clone();
        let ([u], [result]) = (&only(from)[..], &only(to)[..]) else { return None };
        let text = super::formula(self.page.step, *result, &|id| (id == *u).then(|| "u".into()));
        (text::width(&text) <= WIDEST).then_some(text)
    }

    fn constant(&mut self, ids: &[Id]) -> String {
        let texts: Vec<String> = ids.iter().map(|id| self.fixed(*id)).collect();
        let same = texts.iter().all(|text| *text == texts[0]);
        let text = if same { texts[0].clone() } else { format!("({})", texts.join(", ")) };
        self.short(text)
    }

    fn label(&mut self, node: &Node) -> String {
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
            Kind::Call { .. } => node.name.clone(),
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

/// What a port of a box is called.
pub(super) fn port_name(port: &super::Port) -> String {
    if port.symbol.is_empty() { port.name.clone() } else { port.symbol.clone() }
}

/// What the signals at the inputs and outputs of a function are called.
pub(super) fn function_names(page: &Page, element: &Element) -> (Vec<String>, Vec<String>) {
    let short = |end: End| {
        let name = draw::name(page, end);
        if text::width(&name) > WIDEST / 2.0 { name.rsplit('.').next().unwrap_or_default().into() } else { name }
    };
    let inputs = element.inputs.iter().map(|entry| match entry {
        Entry::Wire(from, _) => short(*from),
        Entry::Text(_) => String::new(),
    });
    (inputs.collect(), element.outputs.iter().map(|end| short(*end)).collect())
}

/// Sizes of body and margin, heights of the ports.
fn size(page: &Page, element: &mut Element) {
    let node = &page.nodes[element.nodes[0]];
    let label = text::width(&element.label);
    let texts = element.inputs.iter().map(|entry| match entry {
        Entry::Wire(..) => 0.0,
        Entry::Text(text) => text::width(text) + 10.0,
    });
    let margin = texts.fold(0.0, f64::max);
    let ins = element.inputs.len() as f64;
    let rows = |top: f64, count: usize| (0..count).map(|row| top + ROW * row as f64).collect::<Vec<_>>();
    let even = |height: f64, count: usize| {
        (0..count).map(|row| height / 2.0 + ROW * (row as f64 - (count as f64 - 1.0) / 2.0)).collect::<Vec<_>>()
    };
    let outs = element.outputs.len();
    let (mut column, mut foot) = (Column::Free, 0.0);
    let (width, height, inputs, outputs) = if element.is_formula() {
        (label + 18.0, 28.0, vec![14.0], vec![14.0])
    } else if element.nodes.len() > 1 {
        let (inside, outside) = function_names(page, element);
        let wide = |names: &[String]| names.iter().map(|name| text::width(name)).fold(0.0, f64::max);
        let height = ROW * ins.max(outs as f64).max(1.0) + 30.0;
        ((wide(&inside) + wide(&outside) + 40.0).max(64.0), height, rows(34.0, element.inputs.len()), rows(34.0, outs))
    } else {
        match &node.kind {
            Kind::Input | Kind::Output => {
                column = if node.kind == Kind::Input { Column::First } else { Column::Last };
                let unit = text::unit(node.unit);
                let unit = if unit.is_empty() { 0.0 } else { text::width(&unit) * 0.85 + 10.0 };
                let height = ROW * ins.max(outs as f64).max(1.0) + 4.0;
                (label + unit + 26.0, height, even(height, element.inputs.len()), even(height, outs))
            }
            Kind::Delay => {
                column = Column::Delay;
                foot = 18.0;
                let height = ROW * ins.max(outs as f64).max(1.0) + 12.0;
                (44.0, height, even(height, element.inputs.len()), even(height, outs))
            }
            Kind::Sum(terms) if terms.len() <= 3 => (26.0 + 10.0, 48.0, sum_rows(terms.len()), vec![24.0; outs]),
            Kind::Gain(_) if label <= 30.0 => (label + 24.0, 38.0, vec![19.0], vec![19.0; outs]),
            Kind::Gain(_) => (label + 30.0, 28.0, vec![14.0], vec![14.0; outs]),
            Kind::Saturation { .. } => {
                foot = if element.label.is_empty() { 0.0 } else { 18.0 };
                let height = (ROW * ins).max(38.0);
                ((label).max(44.0), height, even(height, element.inputs.len()), vec![height / 2.0; outs])
            }
            Kind::Sign => (38.0, 38.0, vec![19.0], vec![19.0; outs]),
            Kind::Switch => {
                let middle = 10.0 + ROW;
                // The mask in the middle. Parts of a bus that leave by themselves begin above it.
                let outputs = rows(middle - if outs > 1 { ROW } else { 0.0 }, outs);
                (40.0, 20.0 + 2.0 * ROW, vec![middle, 10.0, middle + ROW], outputs)
            }
            Kind::Call { .. } => {
                let side = |ends: &mut dyn Iterator<Item = &super::Port>| {
                    ends.map(|port| text::width(&port_name(port))).fold(0.0, f64::max)
                };
                let wide = side(&mut node.inputs.iter()) + side(&mut node.outputs.iter()) + 34.0;
                let height = 34.0 + ROW * ins.max(outs as f64).max(1.0);
                (wide.max(label + 28.0).max(90.0), height, rows(42.0, element.inputs.len()), rows(42.0, outs))
            }
            _ => {
                let height = (ROW * ins).max(28.0);
                ((label + 18.0).max(34.0), height, even(height, element.inputs.len()), vec![height / 2.0; outs])
            }
        }
    };
    element.margin = margin;
    element.rows = inputs;
    let width = (width + margin).round();
    let inputs = wired(&element.inputs, &element.rows);
    element.shape = Shape { width, height: height + foot, inputs, outputs, column };
}

/// The rows that wires end at.
fn wired(entries: &[Entry], rows: &[f64]) -> Vec<f64> {
    let is_wire = |(entry, _): &(&Entry, &f64)| matches!(entry, Entry::Wire(..));
    entries.iter().zip(rows).filter(is_wire).map(|(_, row)| *row).collect()
}

/// Into a summing point: from the left, from below, from above.
fn sum_rows(terms: usize) -> Vec<f64> {
    if terms == 3 { vec![2.0, 24.0, 46.0] } else { vec![24.0, 46.0][..terms].to_vec() }
}

/// Gives the rows of a sum or product to its inputs in the order in which they arrive.
fn sort_rows(page: &Page, element: &mut Element, ports: &[[f64; 2]], layout: &Layout) {
    let free = element.nodes.len() == 1
        && matches!(page.nodes[element.nodes[0]].kind, Kind::Sum(_) | Kind::Product(_) | Kind::And | Kind::Or);
    if !(free || element.nodes.len() > 1) {
        return;
    }
    // How high a wire comes from: the far end of the piece that ends at the port, and of the one before.
    let mut ends = ports.iter();
    let mut arrivals: Vec<(f64, usize)> = Vec::new();
    for (number, entry) in element.inputs.iter().enumerate() {
        let from = match entry {
            Entry::Wire(..) => ends.next().map_or(0.0, |end| source(layout, *end)),
            Entry::Text(_) => f64::INFINITY,
        };
        arrivals.push((from, number));
    }
    arrivals.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut rows = element.rows.clone();
    if rows.len() == 2 && matches!(&page.nodes[element.nodes[0]].kind, Kind::Sum(_)) {
        // The first term goes straight on; the other one comes from above or below.
        rows = if arrivals[0].1 == 0 { vec![24.0, 46.0] } else { vec![2.0, 24.0] };
    } else {
        rows.sort_by(f64::total_cmp);
    }
    for ((_, number), row) in arrivals.into_iter().zip(rows) {
        element.rows[number] = row;
    }
    element.shape.inputs = wired(&element.inputs, &element.rows);
}

/// The height at which the wire that ends here began.
fn source(layout: &Layout, end: [f64; 2]) -> f64 {
    let wire = layout.segments.iter().find(|segment| segment.from == end || segment.to == end).map(|s| s.wire);
    wire.map_or(end[1], |(node, port)| layout.ports[node][1][port][1])
}
