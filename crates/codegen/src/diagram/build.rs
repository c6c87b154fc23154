//! From the operations of a step to nodes and wires.
//!
//! A struct with one source is one wire, a bus; else it is connected member by member. If all members are chosen by the
//! same mask, one switch chooses the bus.

mod bus;
mod finish;

use std::collections::HashMap;

use super::condense::Reading;
use super::text::Part;
use super::{Bound, End, Kind, Node, Page, Port, Wire};
use crate::record::{self, Id, Source, Step};
use crate::tree::Tree;

/// Struct of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// No struct: a signal of an operation.
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

/// A struct with its source.
struct Producer<'a> {
    node: usize,
    role: Role,
    tree: &'a Tree,
    ids: Vec<Id>,
}

/// A struct that is required by a node.
struct Required<'a> {
    node: usize,
    role: Role,
    part: Part<'a>,
    /// The numbers of the whole struct; the part uses its own.
    ids: &'a [Id],
}

impl Required<'_> {
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
    /// The producer and place of a number of a struct.
    lies: HashMap<Id, (usize, usize)>,
    /// The node of an operation.
    operation: HashMap<Id, usize>,
}

/// Placeholders of the whole input and state, until the required parts are known.
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
    let mut required = builder.calls(steps);
    let whole = |node, role, tree, ids| Required { node, role, part: Part::whole(tree), ids };
    required.push(whole(STATE, Role::State, &step.state, &step.new_state));
    let output = builder.node(Kind::Output, Vec::new());
    required.push(whole(output, Role::Output, &step.output, &step.results));
    required.iter().for_each(|required| builder.find_switches(required.part.clone(), required.ids));
    builder.operations();
    required.iter().for_each(|required| builder.feed(required));
    builder.finish(label, output)
}

impl<'a> Builder<'a> {
    fn node(&mut self, kind: Kind, operations: Vec<Id>) -> usize {
        let (name, symbol) = Default::default();
        let (inputs, outputs) = Default::default();
        self.nodes.push(Node { kind, name, symbol, unit: "", help: "", inputs, outputs, operations });
        self.nodes.len() - 1
    }

    /// Registers a node as the source of a struct of these operations.
    fn produce(&mut self, node: usize, role: Role, tree: &'a Tree, operation: &dyn Fn(u32) -> record::Node) {
        let mut ids = vec![Id(u32::MAX); tree.numbers()];
        for (position, other) in self.step.graph.nodes.iter().enumerate() {
            let place = match other {
                record::Node::Source(_, place) | record::Node::Result(_, place) => *place,
                _ => continue,
            };
            // The output of a call is counted behind its state.
            let first = match operation(0) {
                record::Node::Result(_, first) => first,
                _ => 0,
            };
            if place >= first && ((place - first) as usize) < ids.len() && operation(place - first) == *other {
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

    /// A box for each used call; the structs that each requires.
    fn calls(&mut self, steps: &'a [Step]) -> Vec<Required<'a>> {
        let mut required = Vec::new();
        let step = self.step;
        for (number, call) in step.graph.calls.iter().enumerate() {
            if !self.reading.live[number] {
                continue;
            }
            let callee = &steps[call.function];
            let keeps = self.keeps(&call.state, number);
            let node = self.node(Kind::Call { call: number, page: call.function, keeps }, Vec::new());
            let belongs = self.part_of_parameters(&callee.parameters, &call.parameters);
            (self.nodes[node].name, self.nodes[node].help) = (belongs, callee.help);
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
                    required.push(Required { node, role, part: Part::whole(tree), ids });
                }
            }
        }
        required
    }

    /// The part of the page's parameters that a call uses; empty if they are assembled for it.
    fn part_of_parameters(&self, tree: &Tree, ids: &[Id]) -> String {
        let graph = &self.step.graph;
        let lies = |part: &Part| {
            let source = |place: usize| record::Node::Source(Source::Parameters, place as u32);
            part.tree == tree && ids.iter().zip(part.first..).all(|(id, place)| graph.node(*id) == source(place))
        };
        let part = Part::whole(&self.step.parameters).all().into_iter().find(lies).filter(|_| !ids.is_empty());
        part.map_or(String::new(), |part| part.path)
    }

    /// Place of a call's state within the page's, if nothing else reads or changes it.
    fn keeps(&self, state: &[Id], call: usize) -> Option<usize> {
        let graph = &self.step.graph;
        let record::Node::Source(Source::State, first) = graph.node(*state.first()?) else { return None };
        let first = first as usize;
        let in_place = state.iter().zip(first..).enumerate().all(|(number, (id, place))| {
            let new = self.step.new_state[place];
            let uses = |id: Id| self.reading.uses[id.index()];
            graph.node(*id) == record::Node::Source(Source::State, place as u32)
                && if new == *id {
                    // Neither the call nor the page changes it.
                    uses(new) == 2
                } else {
                    graph.node(new) == record::Node::Result(call as u32, number as u32)
                        && uses(*id) == 1
                        && uses(new) == 1
                }
        });
        in_place.then_some(first)
    }

    fn connect(&mut self, from: End, node: usize, port: Port) {
        self.nodes[node].inputs.push(port);
        let to = End { node, port: self.nodes[node].inputs.len() - 1 };
        self.wires.push(Wire { from, to });
    }

    /// Wires for a struct: one if it has one source, else those of its members. Parameters that depend on no signal and
    /// unchanged state have none.
    fn feed(&mut self, required: &Required<'a>) {
        let Required { node, role, part, .. } = required;
        let ids = required.ids();
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
            Some(from) => self.connect(from, *node, port(*role, part, required.ids)),
            None => {
                for part in part.members() {
                    self.feed(&Required { part, node: *node, role: *role, ids: required.ids });
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
}

fn signal(numbers: Vec<Id>) -> Port {
    Port { name: String::new(), symbol: String::new(), unit: "", role: Role::Signal, first: 0, numbers }
}

/// Symbol of a number that is the whole input or output.
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
    /// Number of wires that end at an operation of this kind.
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
