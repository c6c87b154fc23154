//! Positions of the numbers of a graph, and their numbers of uses.

use crate::record::{Graph, Id, Node, Source};
use crate::tree::Tree;

/// The positions of the numbers of a source; unused numbers have an invalid position.
pub(super) fn sources(graph: &Graph, source: Source, tree: &Tree) -> Vec<Id> {
    let mut out = vec![Id(u32::MAX); tree.numbers()];
    for (position, node) in graph.nodes.iter().enumerate() {
        if let Node::Source(of, number) = node
            && *of == source
        {
            out[*number as usize] = Id(position as u32);
        }
    }
    out
}

/// The positions of the results of a call, likewise.
pub(super) fn results(graph: &Graph, call: usize, numbers: usize) -> Vec<Id> {
    let mut out = vec![Id(u32::MAX); numbers];
    for (position, node) in graph.nodes.iter().enumerate() {
        if let Node::Result(of, number) = node
            && *of as usize == call
        {
            out[*number as usize] = Id(position as u32);
        }
    }
    out
}

/// Number of uses of each operation by the operations that the roots require, and which calls are used.
pub(super) fn count<'a>(graph: &Graph, roots: impl IntoIterator<Item = &'a Id>) -> (Vec<u32>, Vec<bool>) {
    let mut uses = vec![0u32; graph.nodes.len()];
    let mut live = vec![false; graph.calls.len()];
    for root in roots {
        uses[root.index()] += 1;
    }
    // Operands are before their results: from the end, each operation is complete when it is visited.
    for position in (0..graph.nodes.len()).rev() {
        if uses[position] == 0 {
            continue;
        }
        for operand in graph.nodes[position].operands() {
            uses[operand.index()] += 1;
        }
        if let Node::Result(call, _) = graph.nodes[position]
            && !std::mem::replace(&mut live[call as usize], true)
        {
            let call = &graph.calls[call as usize];
            let operands = call.parameters.iter().chain(&call.state).chain(&call.input);
            for operand in operands.chain([&call.step]) {
                uses[operand.index()] += 1;
            }
        }
    }
    (uses, live)
}
