//! Sources of numbers and of whole structs; switches of a bus.

use super::{Builder, Producer, Role, port, signal};
use crate::diagram::text::Part;
use crate::diagram::{End, Kind};
use crate::record::{self, Id};
use crate::tree::Tree;

impl<'a> Builder<'a> {
    /// The single source of this struct, if it has one.
    pub(super) fn lying(&self, tree: &Tree, ids: &[Id]) -> Option<(usize, Part<'a>)> {
        let (producer, _) = *self.lies.get(ids.first()?)?;
        let existing = &self.producers[producer];
        let fits = |part: &Part| part.tree == tree && existing.ids[part.first..part.first + part.count()] == *ids;
        Part::whole(existing.tree).all().into_iter().find(fits).map(|part| (producer, part))
    }

    /// Combines the switches that choose the members of a struct by the same mask.
    pub(super) fn find_switches(&mut self, part: Part<'a>, all: &'a [Id]) {
        let ids = &all[part.first..part.first + part.count()];
        if part.count() < 2 || self.lying(part.tree, ids).is_some() || self.switch(part.tree, ids) {
            return;
        }
        part.members().into_iter().for_each(|member| self.find_switches(member, all));
    }

    fn switch(&mut self, tree: &'a Tree, ids: &[Id]) -> bool {
        let choice = |id: &Id| match self.step.graph.node(*id) {
            record::Node::Select(mask, yes, no) if !self.reading.is_fixed(*id) => Some((mask, yes, no)),
            _ => None,
        };
        let free = ids.iter().all(|id| !self.reading.bundled[id.index()]);
        let Some(choices) = ids.iter().map(choice).collect::<Option<Vec<_>>>().filter(|_| free) else { return false };
        let sides = [choices.iter().map(|c| c.1).collect::<Vec<_>>(), choices.iter().map(|c| c.2).collect()];
        let mut distinct = ids.to_vec();
        distinct.sort_unstable();
        distinct.dedup();
        if distinct.len() < ids.len() || choices.iter().any(|c| c.0 != choices[0].0) {
            return false;
        }
        for side in &sides {
            let whole = side.iter().all(|id| self.reading.is_fixed(*id)) || self.lying(tree, side).is_some();
            if !whole && !self.switch(tree, side) {
                return false;
            }
        }
        ids.iter().for_each(|id| self.reading.bundled[id.index()] = true);
        let node = self.node(Kind::Switch, Vec::new());
        self.lie(node, Role::Signal, tree, ids.to_vec());
        true
    }

    /// Nodes for the operations, and the wires that end at them.
    pub(super) fn operations(&mut self) {
        let switches: Vec<usize> = (0..self.nodes.len()).filter(|n| self.nodes[*n].kind == Kind::Switch).collect();
        let mut ends = Vec::new();
        for shape in self.reading.shapes() {
            let result = *shape.covers.iter().max().expect("a shape covers its own operation");
            let node = self.node(shape.kind, shape.covers);
            self.operation.insert(result, node);
            self.nodes[node].outputs.push(signal(vec![result]));
            ends.push((node, shape.operands));
        }
        for (node, operands) in ends {
            for operand in operands {
                let from = self.number(operand);
                self.connect(from, node, signal(vec![operand]));
            }
        }
        for node in switches {
            let existing = self.producers.iter().find(|p| p.node == node).expect("a switch of a bus has its struct");
            let (tree, ids) = (existing.tree, existing.ids.clone());
            let choice = |id: &Id| match self.step.graph.node(*id) {
                record::Node::Select(mask, yes, no) => (mask, yes, no),
                _ => unreachable!("a switch was made of choices"),
            };
            let choices: Vec<_> = ids.iter().map(choice).collect();
            let mask = self.number(choices[0].0);
            self.connect(mask, node, signal(vec![choices[0].0]));
            for side in [choices.iter().map(|c| c.1).collect::<Vec<_>>(), choices.iter().map(|c| c.2).collect()] {
                let from = self.bus(tree, &side).expect("both sides of a switch have a source");
                self.connect(from, node, signal(side));
            }
        }
    }

    fn constant(&mut self, ids: Vec<Id>) -> End {
        let node = self.node(Kind::Constant(ids.clone()), Vec::new());
        self.nodes[node].outputs.push(signal(ids));
        End { node, port: 0 }
    }

    /// Source of a number.
    pub(super) fn number(&mut self, id: Id) -> End {
        if let Some(node) = self.operation.get(&id) {
            return End { node: *node, port: 0 };
        }
        match self.lies.get(&id) {
            Some((producer, place)) => {
                let whole = Part::whole(self.producers[*producer].tree);
                let number = |part: &Part| *part.tree == Tree::Number && part.first == *place;
                let part = whole.all().into_iter().find(number).expect("each number of a struct is a part of it");
                self.leave(*producer, &part)
            }
            None => self.constant(vec![id]),
        }
    }

    /// Source of a struct, if it has a single one.
    fn bus(&mut self, tree: &'a Tree, ids: &[Id]) -> Option<End> {
        if let Some((producer, part)) = self.lying(tree, ids) {
            return Some(self.leave(producer, &part));
        }
        ids.iter().all(|id| self.reading.is_fixed(*id)).then(|| self.constant(ids.to_vec()))
    }

    /// The output port of a part of a struct.
    pub(super) fn leave(&mut self, producer: usize, part: &Part) -> End {
        let Producer { node, role, ids, .. } = &self.producers[producer];
        let (node, port) = (*node, port(*role, part, ids));
        let outputs = &mut self.nodes[node].outputs;
        let existing = outputs
            .iter()
            .position(|other| (other.role, other.first, &other.numbers) == (port.role, port.first, &port.numbers));
        let port = existing.unwrap_or_else(|| {
            outputs.push(port);
            outputs.len() - 1
        });
        End { node, port }
    }
}
