//! The picture of a page: elements with size and position.

mod size;
mod written;

use super::layout::{self, Column, Layout, Link, Shape};
use super::{Diagram, End, Kind, Page, crowd, draw};
use crate::distinct::distinct;
use size::{size, wired};
use written::Writer;
pub(super) use written::{function_formula, function_names, port_name, short_name};

/// A drawn element: a node, or several as one function.
pub(super) struct Element {
    pub(super) nodes: Vec<usize>,
    pub(super) inputs: Vec<Entry>,
    pub(super) outputs: Vec<End>,
    /// Width of the texts left of the body.
    pub(super) margin: f64,
    /// Heights of the inputs below the upper edge.
    pub(super) rows: Vec<f64>,
    pub(super) label: String,
    pub(super) shape: Shape,
}

impl Element {
    /// Whether it is several nodes as a formula.
    pub(super) fn is_formula(&self) -> bool {
        self.nodes.len() > 1 && !self.label.starts_with("f_")
    }
}

/// An input of a block.
pub(super) enum Entry {
    /// A wire; the ports that it is connected to.
    Wire(End, Vec<End>),
    /// An expression that depends on no signal: its text.
    Text(String),
}

/// A page with all positions.
pub(super) struct Picture {
    pub(super) elements: Vec<Element>,
    pub(super) layout: Layout,
    /// Coefficients such as `k₁` with their formulas.
    pub(super) coefficients: Vec<(String, String)>,
}

/// The SVG of a page.
pub(super) fn svg(diagram: &Diagram, page: usize) -> String {
    draw::svg(diagram, page, &arrange(diagram, page))
}

/// Places a page.
pub(super) fn arrange(diagram: &Diagram, page: usize) -> Picture {
    let callees = diagram.pages.iter().map(|page| page.step.name).collect();
    let page = &diagram.pages[page];
    let mut writer = Writer { page, callees, coefficients: Vec::new() };
    let mut elements = elements(page, &mut writer);
    let first = place(&elements);
    // If the order of the inputs is free, it is that of the arriving wires.
    for (element, ports) in elements.iter_mut().zip(&first.ports) {
        sort_rows(page, element, &ports[0], &first);
    }
    let layout = place(&elements);
    Picture { elements, layout, coefficients: writer.coefficients }
}

fn place(elements: &[Element]) -> Layout {
    // The element and port of the source of a signal; the last ones if there are several.
    let begin = |from: &End| {
        let place = |(number, element): (usize, &Element)| {
            element.outputs.iter().rposition(|end| end == from).map(|port| (number, port))
        };
        elements.iter().enumerate().rev().find_map(place).expect("a wire begins at an element")
    };
    let mut links = Vec::new();
    for (number, element) in elements.iter().enumerate() {
        let wires = element.inputs.iter().filter_map(|entry| match entry {
            Entry::Wire(from, _) => Some(*from),
            Entry::Text(_) => None,
        });
        links.extend(wires.enumerate().map(|(port, from)| Link { from: begin(&from), to: (number, port) }));
    }
    let shapes: Vec<Shape> = elements.iter().map(|element| element.shape.clone()).collect();
    layout::layout(&shapes, &links)
}

/// The elements of a page, sized.
fn elements(page: &Page, writer: &mut Writer) -> Vec<Element> {
    let group = crowd::groups(page);
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); group.len()];
    for (node, group) in group.iter().enumerate() {
        if !matches!(page.nodes[node].kind, Kind::Constant(_)) {
            members[*group].push(node);
        }
    }
    let mut functions = 0;
    let groups = members.into_iter().filter(|nodes| !nodes.is_empty());
    groups.map(|nodes| element(page, nodes, writer, &mut functions)).collect()
}

fn element(page: &Page, nodes: Vec<usize>, writer: &mut Writer, functions: &mut usize) -> Element {
    let alone = nodes.len() == 1;
    let mut inputs: Vec<Entry> = Vec::new();
    let inside = |node: usize| nodes.contains(&node);
    for wire in page.wires.iter().filter(|wire| inside(wire.to.node)) {
        let existing = inputs.iter_mut().find_map(|entry| match entry {
            Entry::Wire(from, to) if *from == wire.from && !alone => Some(to),
            _ => None,
        });
        match (&page.nodes[wire.from.node].kind, existing) {
            (Kind::Constant(_), _) if !alone => {}
            (Kind::Constant(ids), _) => inputs.push(Entry::Text(writer.constant(ids))),
            (_, Some(to)) => to.push(wire.to),
            (_, None) if !inside(wire.from.node) => inputs.push(Entry::Wire(wire.from, vec![wire.to])),
            _ => {}
        }
    }
    let leaving = page.wires.iter().filter(|wire| inside(wire.from.node) && (alone || !inside(wire.to.node)));
    let outputs = distinct(leaving.map(|wire| wire.from));
    let label = if alone {
        writer.label(&page.nodes[nodes[0]])
    } else {
        match writer.short_formula(&inputs, &outputs) {
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

/// Gives the rows of a sum or product to its inputs in the order of the arriving wires.
fn sort_rows(page: &Page, element: &mut Element, ports: &[[f64; 2]], layout: &Layout) {
    let free = element.nodes.len() == 1
        && matches!(page.nodes[element.nodes[0]].kind, Kind::Sum(_) | Kind::Product(_) | Kind::And | Kind::Or);
    if !(free || element.nodes.len() > 1) {
        return;
    }
    // Heights from which a wire arrives: the far end of the last piece, and of the one before.
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
    if rows.len() == 2 && element.nodes.len() == 1 && matches!(&page.nodes[element.nodes[0]].kind, Kind::Sum(_)) {
        // The first term is straight; the other one comes from above or below.
        rows = if arrivals[0].1 == 0 { vec![24.0, 46.0] } else { vec![2.0, 24.0] };
    } else {
        rows.sort_by(f64::total_cmp);
    }
    for ((_, number), row) in arrivals.into_iter().zip(rows) {
        element.rows[number] = row;
    }
    element.shape.inputs = wired(&element.inputs, &element.rows);
}

/// The height of the start of the wire that ends here.
fn source(layout: &Layout, end: [f64; 2]) -> f64 {
    let wire = layout.segments.iter().find(|segment| segment.from == end || segment.to == end).map(|s| s.wire);
    wire.map_or(end[1], |(node, port)| layout.ports[node][1][port][1])
}
