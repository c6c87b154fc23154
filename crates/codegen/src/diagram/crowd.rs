//! Groups on a crowded page: connected pure arithmetic becomes one box, a function f.

use super::{Kind, Page, Wire};
use crate::distinct::{distinct, insert};

/// A page with more boxes than this is hard to read.
const BOXES: usize = 40;
/// A page with more wires than this is hard to read.
const WIRES: usize = 84;

/// For each node the first one of its group; a single node is its own group.
pub(super) fn groups(page: &Page) -> Vec<usize> {
    let mut group: Vec<usize> = (0..page.nodes.len()).collect();
    let crowded = |group: &[usize]| {
        let shown = |node: usize| !matches!(page.nodes[node].kind, Kind::Constant(_));
        let boxes = distinct((0..group.len()).filter(|node| shown(*node)).map(|node| group[node]));
        let between = page.wires.iter().filter(|w| shown(w.from.node) && group[w.from.node] != group[w.to.node]);
        let wires = distinct(between.map(|wire| (wire.from, group[wire.to.node])));
        boxes.len() > BOXES || wires.len() > WIRES
    };
    if page.nodes.len() > 2 * BOXES {
        cones(page, &mut group);
    }
    while crowded(&group) && merge(page, &mut group) {}
    group
}

/// Whether it only computes, from numbers to numbers.
fn is_pure(kind: &Kind) -> bool {
    !matches!(kind, Kind::Input | Kind::Output | Kind::Delay | Kind::Call { .. } | Kind::Constant(_))
}

/// A node that only one group reads joins it.
fn cones(page: &Page, group: &mut [usize]) {
    let mut changed = true;
    while changed {
        changed = false;
        for node in (0..page.nodes.len()).rev().filter(|node| is_pure(&page.nodes[*node].kind)) {
            let mut readers = page.wires.iter().filter(|w| w.from.node == node).map(|w| w.to.node);
            let Some(first) = readers.next().map(|reader| group[reader]) else { continue };
            let joins = is_pure(&page.nodes[first].kind) && readers.all(|reader| group[reader] == first);
            if joins && group[node] != first {
                group[node] = first;
                changed = true;
            }
        }
    }
}

/// Joins two groups, one of which reads the other: those that together have the fewest ports. `false` if none can be.
fn merge(page: &Page, group: &mut [usize]) -> bool {
    let crossing = Crossing::of(page, group);
    let is_pure = |node: usize| is_pure(&page.nodes[node].kind);
    let pairs = crossing.all.iter().map(|wire| (group[wire.from.node], group[wire.to.node]));
    let between = distinct(pairs.filter(|(a, b)| is_pure(*a) && is_pure(*b)));
    let mut candidates: Vec<_> = between.into_iter().map(|(a, b)| (crossing.ports(group, a, b), a, b)).collect();
    candidates.sort_unstable();
    let detour = |from, to| crossing.detour(page, group, from, to);
    let Some((_, from, into)) = candidates.into_iter().find(|(_, a, b)| !detour(*a, *b)) else {
        return false;
    };
    group.iter_mut().filter(|member| **member == from).for_each(|member| *member = into);
    true
}

/// The wires between groups.
struct Crossing<'a> {
    all: Vec<&'a Wire>,
    /// Of each group those that touch it.
    touching: Vec<Vec<&'a Wire>>,
}

impl<'a> Crossing<'a> {
    fn of(page: &'a Page, group: &[usize]) -> Self {
        let all: Vec<&Wire> = page.wires.iter().filter(|w| group[w.from.node] != group[w.to.node]).collect();
        let mut touching = vec![Vec::new(); group.len()];
        for wire in &all {
            [wire.from.node, wire.to.node].into_iter().for_each(|node| touching[group[node]].push(*wire));
        }
        Crossing { all, touching }
    }

    /// Ports of two groups as one box. A function should have one result; several results are separate functions.
    fn ports(&self, group: &[usize], a: usize, b: usize) -> usize {
        let inside = |node: usize| group[node] == a || group[node] == b;
        let touching = self.touching[a].iter().chain(&self.touching[b]);
        let ends = touching.filter(|wire| inside(wire.from.node) != inside(wire.to.node)).map(|wire| wire.from);
        let ends = distinct(ends);
        ends.len() + 3 * ends.iter().filter(|end| inside(end.node)).count()
    }

    /// Whether one group reads the other also through a third: then one box would close a loop.
    fn detour(&self, page: &Page, group: &[usize], from: usize, to: usize) -> bool {
        let mut visited = Vec::new();
        let after = |of: usize| {
            let memory = matches!(page.nodes[of].kind, Kind::Delay);
            let wires = self.touching[of].iter().filter(move |wire| !memory && group[wire.from.node] == of);
            wires.map(|wire| group[wire.to.node])
        };
        let mut open: Vec<usize> = after(from).filter(|next| *next != to).collect();
        while let Some(next) = open.pop() {
            if next == to {
                return true;
            }
            if insert(&mut visited, next) {
                open.extend(after(next));
            }
        }
        false
    }
}
