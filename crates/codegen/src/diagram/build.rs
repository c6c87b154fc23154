//! From the operations of a step to nodes and wires.
//!
//! A struct that lies somewhere as a whole is one wire, a bus; else it is fed member by member. Where all members are
//! chosen by the same mask, one switch chooses the bus.

use std::collections::HashMap;

use super::condense::Reading;
use super::text::Part;
use super::{Bound, End, Kind, Node, Page, Port, Wire};
use crate::record::{self, Id, Source, Step};
use crate::tree::Tree;

/// Which struct a port is a part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// None: a signal of an operation.
    Signal,
    /// The parameters.
    Parameters,
    /// The state.
    State,
    /// The input.
    Input,
    /// The output.
    Output,
}

/// A struct that lies somewhere: who has it.
struct Producer<'a> {
    node: usize,
    role: Role,
    tree: &'a Tree,
    ids: Vec<Id>,
}

/// A struct that is wanted somewhere.
struct Wanted<'a> {
    node: usize,
    role: Role,
    part: Part<'a>,
    /// The numbers of the whole struct; the part takes its own.
    ids: &'a [Id],
}

impl Wanted<'_> {
    fn ids(&self) -> &[Id] {
        &self.ids[self.part.first..self.part.first + self.part.count()]
    }
}

struct Builder<'a> {
    step: &'a Step,
    reading: Reading<'a>,
    nodes: Vec<Node>,
    wires: Vec<Wire>,
    producers: Vec<Producer<'a>>,
    /// The producer and place of a number that lies in a struct.
    lies: HashMap<Id, (usize, usize)>,
    /// The node of an operation.
    operation: HashMap<Id, usize>,
}

/// Stand for the whole input and the whole state, until it is known which parts are wanted.
const INPUT: usize = 0;
const STATE: usize = 1;

/// Draws a step.
pub(super) fn page<'a>(steps: &'a [Step], step: &'a Step, label: String) -> Page<'a> {
    let roots = step.new_state.iter().chain(&step.results).copied();
    let reading = Reading::of(&step.graph, roots);
    let mut builder = Builder {
        step,
        reading,
        nodes: Vec::new(),
        wires: Vec::new(),
        producers: Vec::new(),
        lies: HashMap::new(),
        operation: HashMap::new(),
    };
    builder.node(Kind::Input, Vec::new());
    builder.node(Kind::Delay, Vec::new());
    builder.produce(INPUT, Role::Input, &step.input, &|place| record::Node::Source(Source::Input, place));
    builder.produce(STATE, Role::State, &step.state, &|place| record::Node::Source(Source::State, place));
    let mut wanted = builder.calls(steps);
    let whole = |node, role, tree, ids| Wanted { node, role, part: Part::whole(tree), ids };
    wanted.push(whole(STATE, Role::State, &step.state, &step.new_state));
    let output = builder.node(Kind::Output, Vec::new());
    wanted.push(whole(output, Role::Output, &step.output, &step.results));
    wanted.iter().for_each(|wanted| builder.find_switches(wanted.part.clone(), wanted.ids));
    builder.operations();
    wanted.iter().for_each(|wanted| builder.feed(wanted));
    builder.finish(label, output)
}

impl<'a> Builder<'a> {
    fn node(&mut self, kind: Kind, operations: Vec<Id>) -> usize {
        let (name, symbol) = Default::default();
        let (inputs, outputs) = Default::default();
        self.nodes.push(Node { kind, name, symbol, unit: "", help: "", inputs, outputs, operations });
        self.nodes.len() - 1
    }

    /// Notes that a struct of these operations lies at a node.
    fn produce(&mut self, node: usize, role: Role, tree: &'a Tree, operation: &dyn Fn(u32) -> record::Node) {
        let mut ids = vec![Id(u32::MAX); tree.numbers()];
        for (position, known) in self.step.graph.nodes.iter().enumerate() {
            let place = match known {
                record::Node::Source(_, place) | record::Node::Result(_, place) => *place,
                _ => continue,
            };
            // The output of a call is counted behind its state.
            let first = match operation(0) {
                record::Node::Result(_, first) => first,
                _ => 0,
            };
            if place >= first && ((place - first) as usize) < ids.len() && operation(place - first) == *known {
                ids[(place - first) as usize] = Id(position as u32);
            }
        }
        self.lie(node, role, tree, ids);
    }

    fn lie(&mut self, node: usize, role: Role, tree: &'a Tree, ids: Vec<Id>) {
        let producer = self.producers.len();
        for (place, id) in ids.iter().enumerate() {
            if id.index() < self.step.graph.nodes.len() {
                self.lies.insert(*id, (producer, place));
                if self.reading.uses[id.index()] > 0 {
                    self.nodes[node].operations.push(*id);
                }
            }
        }
        self.producers.push(Producer { node, role, tree, ids });
    }

    /// A box for each call that is needed; what each wants.
    fn calls(&mut self, steps: &'a [Step]) -> Vec<Wanted<'a>> {
        let mut wanted = Vec::new();
        let step = self.step;
        for (number, call) in step.graph.calls.iter().enumerate() {
            if !self.reading.live[number] {
                continue;
            }
            let callee = &steps[call.function];
            let keeps = self.keeps(&call.state, number);
            let node = self.node(Kind::Call { call: number, page: call.function, keeps }, Vec::new());
            (self.nodes[node].name, self.nodes[node].help) = (callee.name.into(), callee.help);
            let numbers = callee.new_state.len() as u32;
            let result = |first: u32| move |place: u32| record::Node::Result(number as u32, first + place);
            self.produce(node, Role::State, &callee.state, &result(0));
            self.produce(node, Role::Output, &callee.output, &result(numbers));
            for (role, tree, ids) in [
                (Role::Parameters, &callee.parameters, &call.parameters),
                (Role::State, &callee.state, &call.state),
                (Role::Input, &callee.input, &call.input),
            ] {
                if role != Role::State || keeps.is_none() {
                    wanted.push(Wanted { node, role, part: Part::whole(tree), ids });
                }
            }
        }
        wanted
    }

    /// Where a call's state lies within the page's, if nobody else reads or changes it.
    fn keeps(&self, state: &[Id], call: usize) -> Option<usize> {
        let graph = &self.step.graph;
        let record::Node::Source(Source::State, first) = graph.node(*state.first()?) else { return None };
        let first = first as usize;
        let kept = state.iter().zip(first..).enumerate().all(|(number, (id, place))| {
            let new = self.step.new_state[place];
            graph.node(*id) == record::Node::Source(Source::State, place as u32)
                && graph.node(new) == record::Node::Result(call as u32, number as u32)
                && self.reading.uses[id.index()] == 1
                && self.reading.uses[new.index()] == 1
        });
        kept.then_some(first)
    }

    /// Where this struct lies as a whole, or could.
    fn lying(&self, tree: &Tree, ids: &[Id]) -> Option<(usize, Part<'a>)> {
        let (producer, _) = *self.lies.get(ids.first()?)?;
        let known = &self.producers[producer];
        let fits = |part: &Part| part.tree == tree && known.ids[part.first..part.first + part.count()] == *ids;
        Part::whole(known.tree).all().into_iter().find(fits).map(|part| (producer, part))
    }

    /// Makes one switch of those that choose the members of a struct by the same mask.
    fn find_switches(&mut self, part: Part<'a>, all: &'a [Id]) {
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
        let nodes = self.nodes.len();
        for side in &sides {
            let whole = side.iter().all(|id| self.reading.is_fixed(*id)) || self.lying(tree, side).is_some();
            if !whole && !self.switch(tree, side) {
                debug_assert!(self.nodes.len() >= nodes);
                return false;
            }
        }
        ids.iter().for_each(|id| self.reading.bundled[id.index()] = true);
        let node = self.node(Kind::Switch, Vec::new());
        self.lie(node, Role::Signal, tree, ids.to_vec());
        true
    }

    /// Nodes for the operations, and the wires that end at them.
    fn operations(&mut self) {
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
            let known = self.producers.iter().find(|p| p.node == node).expect("a switch of a bus has its struct");
            let (tree, ids) = (known.tree, known.ids.clone());
            let choice = |id: &Id| match self.step.graph.node(*id) {
                record::Node::Select(mask, yes, no) => (mask, yes, no),
                _ => unreachable!("a switch was made of choices"),
            };
            let choices: Vec<_> = ids.iter().map(choice).collect();
            let mask = self.number(choices[0].0);
            self.connect(mask, node, signal(vec![choices[0].0]));
            for side in [choices.iter().map(|c| c.1).collect::<Vec<_>>(), choices.iter().map(|c| c.2).collect()] {
                let from = self.bus(tree, &side).expect("both sides of a switch were looked for");
                self.connect(from, node, signal(side));
            }
        }
    }

    fn connect(&mut self, from: End, node: usize, port: Port) {
        self.nodes[node].inputs.push(port);
        let to = End { node, port: self.nodes[node].inputs.len() - 1 };
        self.wires.push(Wire { from, to });
    }

    fn constant(&mut self, ids: Vec<Id>) -> End {
        let node = self.node(Kind::Constant(ids.clone()), Vec::new());
        self.nodes[node].outputs.push(signal(ids));
        End { node, port: 0 }
    }

    /// Where a number comes from.
    fn number(&mut self, id: Id) -> End {
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

    /// Where a struct comes from, if it lies somewhere as a whole.
    fn bus(&mut self, tree: &'a Tree, ids: &[Id]) -> Option<End> {
        if let Some((producer, part)) = self.lying(tree, ids) {
            return Some(self.leave(producer, &part));
        }
        ids.iter().all(|id| self.reading.is_fixed(*id)).then(|| self.constant(ids.to_vec()))
    }

    /// The port by which a part of a struct leaves a node.
    fn leave(&mut self, producer: usize, part: &Part) -> End {
        let Producer { node, role, ids, .. } = &self.producers[producer];
        let (node, port) = (*node, port(*role, part, ids));
        let outputs = &mut self.nodes[node].outputs;
        let known = outputs
            .iter()
            .position(|other| (other.role, other.first, &other.numbers) == (port.role, port.first, &port.numbers));
        let port = known.unwrap_or_else(|| {
            outputs.push(port);
            outputs.len() - 1
        });
        End { node, port }
    }

    /// Wires for a struct: one if it lies as a whole, else those of its members. Parameters that depend on no signal
    /// and state that stays have none.
    fn feed(&mut self, wanted: &Wanted<'a>) {
        let Wanted { node, role, part, .. } = wanted;
        let ids = wanted.ids();
        let stays =
            |(id, place): (&Id, usize)| self.step.graph.node(*id) == record::Node::Source(Source::State, place as u32);
        let hidden = match role {
            Role::Parameters => ids.iter().all(|id| self.reading.is_fixed(*id)),
            Role::State if *node == STATE => ids.iter().zip(part.first..).all(stays) || self.is_kept(part),
            _ => false,
        };
        if hidden || ids.is_empty() {
            return;
        }
        let from = match part.tree {
            Tree::Number => Some(self.number(ids[0])),
            _ if part.count() == 1 => None,
            tree => self.lying(tree, ids).map(|(producer, part)| self.leave(producer, &part)),
        };
        match from {
            Some(from) => self.connect(from, *node, port(*role, part, wanted.ids)),
            None => {
                for part in part.members() {
                    self.feed(&Wanted { part, node: *node, role: *role, ids: wanted.ids });
                }
            }
        }
    }

    fn is_kept(&self, part: &Part) -> bool {
        self.nodes.iter().any(|node| match node.kind {
            Kind::Call { call, keeps: Some(first), .. } => {
                let count = self.step.graph.calls[call].state.len();
                (first..first + count).contains(&part.first) && part.first + part.count() <= first + count
            }
            _ => false,
        })
    }

    /// A node for each part of input, state and output that stands by itself; the nodes in order of evaluation.
    fn finish(mut self, label: String, output: usize) -> Page<'a> {
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
        // The state that a box keeps is read there: its operations belong to the box.
        let kept: Vec<(usize, usize)> = (0..self.nodes.len())
            .filter_map(|node| match self.nodes[node].kind {
                Kind::Call { call, keeps: Some(_), .. } => Some((node, call)),
                _ => None,
            })
            .collect();
        for (node, call) in kept {
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
        if matches!(node.kind, Kind::Input | Kind::Output) && node.symbol.is_empty() && tree.is_bare() {
            node.symbol = bare(if node.kind == Kind::Input { Role::Input } else { Role::Output }).into();
        }
    }

    /// The numbers of input and state belong to the node that hands them out.
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

    /// Takes out the nodes that stood for whole structs.
    fn without(self, gone: [usize; 3], label: String) -> Page<'a> {
        let mut number = 0;
        let numbers: Vec<usize> = (0..self.nodes.len())
            .map(|node| {
                number += usize::from(!gone.contains(&node));
                number.saturating_sub(1)
            })
            .collect();
        let end = |end: End| End { node: numbers[end.node], ..end };
        let mut wires: Vec<Wire> = self.wires.iter().map(|w| Wire { from: end(w.from), to: end(w.to) }).collect();
        wires.sort_unstable_by_key(|wire| (wire.to, wire.from));
        let nodes = self.nodes.into_iter().enumerate().filter(|(node, _)| !gone.contains(node)).map(|(_, node)| node);
        Page { label, step: self.step, nodes: nodes.collect(), wires }
    }
}

fn signal(numbers: Vec<Id>) -> Port {
    Port { name: String::new(), symbol: String::new(), unit: "", role: Role::Signal, first: 0, numbers }
}

/// What a number is called that is the whole input or output.
fn bare(role: Role) -> &'static str {
    match role {
        Role::Input => "u",
        Role::Output => "y",
        Role::Signal | Role::Parameters | Role::State => "",
    }
}

fn port(role: Role, part: &Part, ids: &[Id]) -> Port {
    let numbers = ids[part.first..part.first + part.count()].to_vec();
    let whole = ids.len() == 1 && part.path == "value" && part.symbol().is_empty();
    let symbol = if whole { bare(role).into() } else { part.symbol() };
    Port { name: part.path.clone(), symbol, unit: part.unit(), role, first: part.first, numbers }
}

impl Kind {
    /// How many wires end at an operation of this kind.
    pub fn arity(&self) -> Option<usize> {
        Some(match self {
            Kind::Constant(_) => 0,
            Kind::Sum(terms) | Kind::Product(terms) => terms.len(),
            Kind::Gain(_) | Kind::Apply(_) | Kind::Sign | Kind::Within { .. } | Kind::Not => 1,
            Kind::Minimum | Kind::Maximum | Kind::Compare(_) => 2,
            Kind::Saturation { low, high } => {
                1 + [low, high].iter().filter(|bound| matches!(bound, Bound::Signal)).count()
            }
            Kind::Switch => 3,
            Kind::Input | Kind::Output | Kind::Delay | Kind::And | Kind::Or | Kind::Call { .. } => return None,
        })
    }
}
