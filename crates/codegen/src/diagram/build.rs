//! From the operations of a step to nodes and wires.
//!
//! A struct that lies somewhere as a whole is one wire, a bus; else it is fed member by member. Where all members are
//! chosen by the same mask, one switch chooses the bus.

mod bus;
mod finish;

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
                    wanted.push(Wanted { node, role, part: Part::whole(tree), ids });
                }
            }
        }
        wanted
    }

    /// The part of the page's parameters that a call has; empty if they are put together for it.
    fn part_of_parameters(&self, tree: &Tree, ids: &[Id]) -> String {
        let graph = &self.step.graph;
        let lies = |part: &Part| {
            let source = |place: usize| record::Node::Source(Source::Parameters, place as u32);
            part.tree == tree && ids.iter().zip(part.first..).all(|(id, place)| graph.node(*id) == source(place))
        };
        let part = Part::whole(&self.step.parameters).all().into_iter().find(lies).filter(|_| !ids.is_empty());
        part.map_or(String::new(), |part| part.path)
    }

    /// Where a call's state lies within the page's, if nobody else reads or changes it.
    fn keeps(&self, state: &[Id], call: usize) -> Option<usize> {
        let graph = &self.step.graph;
        let record::Node::Source(Source::State, first) = graph.node(*state.first()?) else { return None };
        let first = first as usize;
        let kept = state.iter().zip(first..).enumerate().all(|(number, (id, place))| {
            let new = self.step.new_state[place];
            let uses = |id: Id| self.reading.uses[id.index()];
            graph.node(*id) == record::Node::Source(Source::State, place as u32)
                && if new == *id {
                    // The call leaves it as it is, and so does the page.
                    uses(new) == 2
                } else {
                    graph.node(new) == record::Node::Result(call as u32, number as u32)
                        && uses(*id) == 1
                        && uses(new) == 1
                }
        });
        kept.then_some(first)
    }

    fn connect(&mut self, from: End, node: usize, port: Port) {
        self.nodes[node].inputs.push(port);
        let to = End { node, port: self.nodes[node].inputs.len() - 1 };
        self.wires.push(Wire { from, to });
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
