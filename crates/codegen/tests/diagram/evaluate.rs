//! Evaluation of a diagram from its nodes and wires alone; only the texts of nodes are from the graph.

use stickslip_codegen::diagram::{Bound, Diagram, End, Factor, Kind, Node, Page, Relation, Role};
use stickslip_codegen::record;
use stickslip_codegen::record::{Function, Graph, Id, Operator, Source, Step};
use stickslip_core::scalar::Scalar;

/// Arguments of a step.
pub(crate) struct Given<'a> {
    pub(crate) parameters: &'a [f64],
    pub(crate) state: &'a [f64],
    pub(crate) input: &'a [f64],
    pub(crate) dt: f64,
}

/// New state and output of a page; masks are 0 or 1. Panics if a picture is incomplete.
pub(crate) fn evaluate(diagram: &Diagram, page: usize, given: &Given) -> (Vec<f64>, Vec<f64>) {
    let page = &diagram.pages[page];
    let fixed = fixed(page.step, given);
    let mut run = Run { diagram, page, given, fixed, values: vec![Vec::new(); page.nodes.len()], from: wires(page) };
    let (mut state, mut output) = (given.state.to_vec(), vec![f64::NAN; page.step.results.len()]);
    let mut waiting: Vec<usize> = (0..page.nodes.len()).collect();
    while !waiting.is_empty() {
        let before = waiting.len();
        waiting.retain(|node| !run.compute(*node, &mut state));
        assert!(waiting.len() < before, "{}: a loop without a delay through {:?}", page.label, page.nodes[waiting[0]]);
    }
    let mut reached = vec![false; output.len()];
    for (number, node) in page.nodes.iter().enumerate() {
        for (port, input) in node.inputs.iter().enumerate() {
            let values = || run.input(number, port).expect("all nodes are computed");
            match node.kind {
                Kind::Output => {
                    for (place, value) in (input.first..).zip(values()) {
                        output[place] = *value;
                        assert!(!std::mem::replace(&mut reached[place], true), "output {place} is reached twice");
                    }
                }
                Kind::Delay => state[input.first..input.first + input.numbers.len()].copy_from_slice(values()),
                _ => {}
            }
        }
    }
    assert!(reached.iter().all(|reached| *reached), "{}: outputs reached: {reached:?}", page.label);
    (state, output)
}

/// The start of the wire at each input port.
fn wires(page: &Page) -> Vec<Vec<Option<End>>> {
    let mut out: Vec<Vec<Option<End>>> = page.nodes.iter().map(|node| vec![None; node.inputs.len()]).collect();
    for wire in &page.wires {
        let end = &mut out[wire.to.node][wire.to.port];
        assert_eq!(end.replace(wire.from), None, "two wires end at one port");
    }
    out
}

struct Run<'a> {
    diagram: &'a Diagram<'a>,
    page: &'a Page<'a>,
    given: &'a Given<'a>,
    fixed: Vec<f64>,
    /// The values of each output port.
    values: Vec<Vec<Vec<f64>>>,
    from: Vec<Vec<Option<End>>>,
}

impl Run<'_> {
    fn input(&self, node: usize, port: usize) -> Option<&[f64]> {
        let from = self.from[node][port].expect("a wire ends at each input port");
        self.values[from.node].get(from.port).map(Vec::as_slice)
    }

    /// Whether the node could be computed. The output of a delay is known before its input.
    fn compute(&mut self, number: usize, state: &mut [f64]) -> bool {
        let page = self.page;
        let node = &page.nodes[number];
        let part = |whole: &[f64], first: usize, count: usize| whole[first..first + count].to_vec();
        let of = |whole: &[f64]| node.outputs.iter().map(|port| part(whole, port.first, port.numbers.len())).collect();
        let values = match &node.kind {
            Kind::Input => of(self.given.input),
            Kind::Delay => of(self.given.state),
            _ => {
                let inputs: Option<Vec<Vec<f64>>> =
                    (0..node.inputs.len()).map(|port| Some(self.input(number, port)?.to_vec())).collect();
                let Some(inputs) = inputs else { return false };
                match node.kind {
                    Kind::Call { call, page, keeps } => self.call(node, &inputs, call, page, keeps, state),
                    Kind::Switch => self.switch(node, &inputs),
                    _ => vec![self.operation(&node.kind, &inputs)],
                }
            }
        };
        self.values[number] = values;
        true
    }

    fn switch(&self, node: &Node, inputs: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let all = &inputs[if inputs[0][0] == 0.0 { 2 } else { 1 }];
        node.outputs.iter().map(|port| all[port.first..port.first + port.numbers.len()].to_vec()).collect()
    }

    fn call(
        &self,
        node: &Node,
        inputs: &[Vec<f64>],
        call: usize,
        page: usize,
        keeps: Option<usize>,
        state: &mut [f64],
    ) -> Vec<Vec<f64>> {
        let call = &self.page.step.graph.calls[call];
        // Ports without a wire depend on no signal, or are within the box.
        let fixed = |ids: &[Id]| ids.iter().map(|id| self.fixed[id.index()]).collect::<Vec<_>>();
        let (mut parameters, mut own, mut input) = (fixed(&call.parameters), fixed(&call.state), fixed(&call.input));
        if let Some(first) = keeps {
            own.copy_from_slice(&self.given.state[first..first + call.state.len()]);
        }
        for (port, values) in node.inputs.iter().zip(inputs) {
            let whole = match port.role {
                Role::Parameters => &mut parameters,
                Role::State => &mut own,
                Role::Input => &mut input,
                other => panic!("{other:?} does not enter a box"),
            };
            whole[port.first..port.first + values.len()].copy_from_slice(values);
        }
        let dt = self.fixed[call.step.index()];
        let given = Given { parameters: &parameters, state: &own, input: &input, dt };
        let (new, output) = evaluate(self.diagram, page, &given);
        if let Some(first) = keeps {
            state[first..first + new.len()].copy_from_slice(&new);
        }
        let leave = |port: &stickslip_codegen::diagram::Port| {
            let whole = if port.role == Role::State { &new } else { &output };
            whole[port.first..port.first + port.numbers.len()].to_vec()
        };
        node.outputs.iter().map(leave).collect()
    }

    fn operation(&self, kind: &Kind, inputs: &[Vec<f64>]) -> Vec<f64> {
        let fixed = |id: &Id| self.fixed[id.index()];
        let x: Vec<f64> = inputs.iter().map(|values| values[0]).collect();
        let truth = |truth: bool| f64::from(u8::from(truth));
        let one = match kind {
            Kind::Constant(ids) => return ids.iter().map(fixed).collect(),
            Kind::Sum(signs) => {
                let first = if signs[0] { -x[0] } else { x[0] };
                x.iter().zip(signs).skip(1).fold(first, |sum, (x, minus)| if *minus { sum - x } else { sum + x })
            }
            Kind::Gain(factors) => factors.iter().fold(x[0], |x, factor| match factor {
                Factor::Times(id) => x * fixed(id),
                Factor::Over(id) => x / fixed(id),
                Factor::Negated => -x,
            }),
            Kind::Product(over) => x
                .iter()
                .zip(over)
                .skip(1)
                .fold(x[0], |product, (x, over)| if *over { product / x } else { product * x }),
            Kind::Apply(function) => apply(*function, x[0]),
            Kind::Minimum => Scalar::min(x[0], x[1]),
            Kind::Maximum => Scalar::max(x[0], x[1]),
            Kind::Saturation { low, high } => {
                let mut signals = x[1..].iter();
                let mut bound = |bound: &Bound| match bound {
                    Bound::Fixed(id) => Some(fixed(id)),
                    Bound::Signal => Some(*signals.next().expect("a port for each bound that is a signal")),
                    Bound::Opposite => None,
                };
                let (low, high) = (bound(low), bound(high).expect("the upper bound is a number"));
                Scalar::clamp(x[0], low.unwrap_or(-high), high)
            }
            Kind::Sign => Scalar::sign(x[0]),
            Kind::Within { magnitude, bounds } => {
                let x = if *magnitude { x[0].abs() } else { x[0] };
                truth(bounds.iter().all(|(relation, bound)| compare(*relation, x, fixed(bound))))
            }
            Kind::Compare(relation) => truth(compare(*relation, x[0], x[1])),
            Kind::And => truth(x.iter().all(|x| *x != 0.0)),
            Kind::Or => truth(x.iter().any(|x| *x != 0.0)),
            Kind::Not => truth(x[0] == 0.0),
            Kind::Input | Kind::Output | Kind::Delay | Kind::Call { .. } | Kind::Switch => return Vec::new(),
        };
        vec![one]
    }
}

fn compare(relation: Relation, a: f64, b: f64) -> bool {
    match relation {
        Relation::Less => a < b,
        Relation::LessOrEqual => a <= b,
        Relation::Greater => a > b,
        Relation::GreaterOrEqual => a >= b,
    }
}

fn apply(function: Function, a: f64) -> f64 {
    match function {
        Function::Abs => a.abs(),
        Function::Exp => Scalar::exp(a),
        Function::Ln => Scalar::ln(a),
        Function::Sin => Scalar::sin(a),
        Function::Cos => Scalar::cos(a),
        Function::Round => Scalar::round(a),
        Function::Floor => Scalar::floor(a),
        Function::PowerOfTwo => a.power_of_two(),
        Function::Exponent => a.exponent(),
    }
}

/// The operations of a step that depend on no signal; the others are NaN.
fn fixed(step: &Step, given: &Given) -> Vec<f64> {
    let graph: &Graph = &step.graph;
    let mut out: Vec<f64> = Vec::with_capacity(graph.nodes.len());
    for node in &graph.nodes {
        let at = |id: Id| out[id.index()];
        let truth = |truth: bool| f64::from(u8::from(truth));
        out.push(match *node {
            record::Node::Source(Source::Parameters, place) => given.parameters[place as usize],
            record::Node::Source(Source::Step, _) => given.dt,
            record::Node::Source(..) | record::Node::Result(..) => f64::NAN,
            record::Node::Constant(bits) => f64::from_bits(bits),
            record::Node::Negate(a) => -at(a),
            record::Node::Apply(function, a) => apply(function, at(a)),
            record::Node::Binary(Operator::Add, a, b) => at(a) + at(b),
            record::Node::Binary(Operator::Subtract, a, b) => at(a) - at(b),
            record::Node::Binary(Operator::Multiply, a, b) => at(a) * at(b),
            record::Node::Binary(Operator::Divide, a, b) => at(a) / at(b),
            record::Node::Select(mask, yes, no) => at(if at(mask) == 0.0 { no } else { yes }),
            record::Node::Truth(known) => truth(known),
            record::Node::Less(a, b) => truth(at(a) < at(b)),
            record::Node::LessOrEqual(a, b) => truth(at(a) <= at(b)),
            record::Node::And(a, b) => truth(at(a) != 0.0 && at(b) != 0.0),
            record::Node::Or(a, b) => truth(at(a) != 0.0 || at(b) != 0.0),
            record::Node::Not(a) => truth(at(a) == 0.0),
        });
    }
    out
}
