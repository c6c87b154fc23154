//! Replaces the placeholder of a whole struct by a node for each of its parts.

use std::collections::HashMap;

use super::{Builder, INPUT, Role, STATE, bare};
use crate::diagram::text::Part;
use crate::diagram::{End, Kind, Page, Port, Wire};
use crate::tree::Tree;

impl<'a> Builder<'a> {
    /// A node for each separate part of input, state and output; the nodes in order of evaluation.
    pub(super) fn finish(mut self, label: String, output: usize) -> Page<'a> {
        let mut moved = HashMap::new();
        for (whole, tree) in [(INPUT, &self.step.input), (STATE, &self.step.state), (output, &self.step.output)] {
            let (inputs, outputs) =
                (std::mem::take(&mut self.nodes[whole].inputs), std::mem::take(&mut self.nodes[whole].outputs));
            let mut spans: Vec<(usize, usize)> =
                inputs.iter().chain(&outputs).map(|port| (port.first, port.first + port.numbers.len())).collect();
            spans.sort_unstable();
            let mut joined: Vec<(usize, usize)> = Vec::new();
            for span in spans {
                match joined.last_mut() {
                    Some(last) if span.0 < last.1 => last.1 = last.1.max(span.1),
                    _ => joined.push(span),
                }
            }
            for (first, end) in joined {
                let kind = self.nodes[whole].kind.clone();
                let node = self.node(kind, Vec::new());
                self.describe(node, tree, first, end);
                let within = |port: &Port| (first..end).contains(&port.first);
                for (is_input, ports) in [(true, &inputs), (false, &outputs)] {
                    for (number, port) in ports.iter().enumerate().filter(|(_, port)| within(port)) {
                        let list = if is_input { &mut self.nodes[node].inputs } else { &mut self.nodes[node].outputs };
                        moved.insert((is_input, End { node: whole, port: number }), End { node, port: list.len() });
                        list.push(port.clone());
                    }
                }
            }
        }
        // The state of a box is read there: its operations belong to the box.
        let boxes_with_state: Vec<(usize, usize)> = (0..self.nodes.len())
            .filter_map(|node| match self.nodes[node].kind {
                Kind::Call { call, keeps: Some(_), .. } => Some((node, call)),
                _ => None,
            })
            .collect();
        for (node, call) in boxes_with_state {
            let state = &self.step.graph.calls[call].state;
            self.nodes[node].operations.extend(state);
        }
        self.assign_sources(output);
        for wire in &mut self.wires {
            wire.from = moved.get(&(false, wire.from)).copied().unwrap_or(wire.from);
            wire.to = moved.get(&(true, wire.to)).copied().unwrap_or(wire.to);
        }
        self.without([INPUT, STATE, output], label)
    }

    fn describe(&mut self, node: usize, tree: &Tree, first: usize, end: usize) {
        let parts = Part::whole(tree).all();
        let around = |part: &&Part| part.first <= first && part.first + part.count() >= end;
        let Some(part) = parts.iter().filter(around).min_by_key(|part| (part.count(), usize::MAX - part.path.len()))
        else {
            return;
        };
        let node = &mut self.nodes[node];
        (node.name, node.symbol, node.unit, node.help) = (part.path.clone(), part.symbol(), part.unit(), part.help());
        if matches!(node.kind, Kind::Input | Kind::Output) && (part.path.is_empty() || tree.is_bare()) {
            node.symbol = bare(if node.kind == Kind::Input { Role::Input } else { Role::Output }).into();
        }
    }

    /// The numbers of input and state belong to the node that provides them.
    fn assign_sources(&mut self, output: usize) {
        for whole in [INPUT, STATE] {
            let operations = std::mem::take(&mut self.nodes[whole].operations);
            for operation in operations {
                let owner = self.nodes.iter().enumerate().skip(output).find(|(_, node)| {
                    matches!(node.kind, Kind::Input | Kind::Delay)
                        && node.outputs.iter().any(|port| port.numbers.contains(&operation))
                });
                if let Some((owner, _)) = owner {
                    self.nodes[owner].operations.push(operation);
                }
            }
        }
    }

    /// Removes the placeholders of whole structs.
    fn without(self, placeholders: [usize; 3], label: String) -> Page<'a> {
        let mut number = 0;
        let numbers: Vec<usize> = (0..self.nodes.len())
            .map(|node| {
                number += usize::from(!placeholders.contains(&node));
                number.saturating_sub(1)
            })
            .collect();
        let end = |end: End| End { node: numbers[end.node], ..end };
        let mut wires: Vec<Wire> = self.wires.iter().map(|w| Wire { from: end(w.from), to: end(w.to) }).collect();
        wires.sort_unstable_by_key(|wire| (wire.to, wire.from));
        let nodes =
            self.nodes.into_iter().enumerate().filter(|(node, _)| !placeholders.contains(node)).map(|(_, node)| node);
        Page { label, step: self.step, nodes: nodes.collect(), wires }
    }
}
