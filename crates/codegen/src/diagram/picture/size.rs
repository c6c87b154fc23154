//! Size of a block, and positions of its ports.

use super::written::{function_names, port_name, short_name};
use super::{Element, Entry};
use crate::diagram::layout::{Column, Shape};
use crate::diagram::{Kind, Page, Port, text};

/// Height of a row of ports.
const ROW: f64 = 22.0;

/// Sizes of body and margin, heights of the ports.
pub(super) fn size(page: &Page, element: &mut Element) {
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
    let (width, height, inputs, outputs) = if element.is_formula() && element.inputs.len() == 1 {
        (label + 18.0, 28.0, vec![14.0], vec![14.0])
    } else if element.nodes.len() > 1 {
        let inside = function_names(page, &element.inputs);
        let outside: Vec<String> = element.outputs.iter().map(|end| short_name(page, *end)).collect();
        let wide = |names: &[String]| names.iter().map(|name| text::width(name)).fold(0.0, f64::max);
        let height = ROW * ins.max(outs as f64).max(1.0) + 30.0;
        let width = (wide(&inside) + wide(&outside) + 40.0).max(label + 18.0);
        (width, height, rows(34.0, element.inputs.len()), rows(34.0, outs))
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
                // The mask in the middle. Separate outputs of parts of a bus start above it.
                let outputs = rows(middle - if outs > 1 { ROW } else { 0.0 }, outs);
                (40.0, 20.0 + 2.0 * ROW, vec![middle, 10.0, middle + ROW], outputs)
            }
            Kind::Call { .. } => {
                let side = |ends: &mut dyn Iterator<Item = &Port>| {
                    ends.map(|port| text::width(&port_name(port))).fold(0.0, f64::max)
                };
                let wide = side(&mut node.inputs.iter()) + side(&mut node.outputs.iter()) + 34.0;
                let head = if node.name.is_empty() { 42.0 } else { 56.0 };
                let height = head - 8.0 + ROW * ins.max(outs as f64).max(1.0);
                let label = (1.1 * label).max(text::width(&node.name) * 0.9) + 24.0;
                (wide.max(label).max(90.0), height, rows(head, element.inputs.len()), rows(head, outs))
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
pub(super) fn wired(entries: &[Entry], rows: &[f64]) -> Vec<f64> {
    let is_wire = |(entry, _): &(&Entry, &f64)| matches!(entry, Entry::Wire(..));
    entries.iter().zip(rows).filter(is_wire).map(|(_, row)| *row).collect()
}

/// Into a summing point: from the left, from below, from above.
fn sum_rows(terms: usize) -> Vec<f64> {
    if terms == 3 { vec![2.0, 24.0, 46.0] } else { vec![24.0, 46.0][..terms].to_vec() }
}
