//! Evaluation of a program, operation by operation: the reference of programs without a Rust function.

use stickslip_core::block::Status;

use super::graph::apply;
use super::{Graph, Id, Node, Operator, Precision, Program, Source, Step};

impl Program {
    /// One step in the recorded precision: the new state, and the output.
    pub fn evaluate<F: Precision>(&self, parameters: &[F], state: &[F], input: &[F], dt: F) -> (Vec<F>, Vec<F>) {
        run(&self.steps, self.steps.len() - 1, parameters, state, input, dt)
    }

    /// The same guarded as by [`stickslip_core::block::guarded`]: neither outputs nor state become NaN or infinite.
    pub fn evaluate_guarded<F: Precision>(
        &self,
        parameters: &[F],
        state: &mut Vec<F>,
        input: &[F],
        dt: F,
    ) -> (Vec<F>, Status) {
        let finite = |numbers: &[F]| numbers.iter().all(|number| number.abs().lt(F::of(f64::INFINITY)));
        let (next, output) = self.evaluate(parameters, state, input, dt);
        if !(finite(&[dt]) && dt.gt(F::of(0.0)) && finite(&next) && finite(&output)) {
            return (vec![F::of(0.0); output.len()], Status::NotComputed);
        }
        *state = next;
        (output, if finite(input) { Status::Ok } else { Status::InputNotFinite })
    }
}

/// A step of the program; masks are 0 or 1.
fn run<F: Precision>(
    steps: &[Step],
    number: usize,
    parameters: &[F],
    state: &[F],
    input: &[F],
    dt: F,
) -> (Vec<F>, Vec<F>) {
    let step = &steps[number];
    let graph: &Graph = &step.graph;
    let mut values: Vec<F> = Vec::with_capacity(graph.nodes.len());
    let mut results_of_calls: Vec<Option<Vec<F>>> = vec![None; graph.calls.len()];
    for node in &graph.nodes {
        let of = |id: Id| values[id.index()];
        let all = |ids: &[Id]| -> Vec<F> { ids.iter().map(|id| of(*id)).collect() };
        let is = |id: Id| of(id) == F::of(1.0);
        let mask = |truth: bool| F::of(f64::from(u8::from(truth)));
        let value = match *node {
            Node::Source(Source::Parameters, k) => parameters[k as usize],
            Node::Source(Source::State, k) => state[k as usize],
            Node::Source(Source::Input, k) => input[k as usize],
            Node::Source(Source::Step, _) => dt,
            Node::Constant(bits) => F::of(f64::from_bits(bits)),
            Node::Negate(a) => -of(a),
            Node::Apply(function, a) => apply(function, of(a)),
            Node::Binary(Operator::Add, a, b) => of(a) + of(b),
            Node::Binary(Operator::Subtract, a, b) => of(a) - of(b),
            Node::Binary(Operator::Multiply, a, b) => of(a) * of(b),
            Node::Binary(Operator::Divide, a, b) => of(a) / of(b),
            Node::Select(mask, yes, no) => of(if is(mask) { yes } else { no }),
            Node::Truth(truth) => mask(truth),
            Node::Less(a, b) => mask(of(a).lt(of(b))),
            Node::LessOrEqual(a, b) => mask(of(a).le(of(b))),
            Node::And(a, b) => mask(is(a) && is(b)),
            Node::Or(a, b) => mask(is(a) || is(b)),
            Node::Not(a) => mask(!is(a)),
            Node::Result(call, k) => {
                let results = results_of_calls[call as usize].get_or_insert_with(|| {
                    let call = &graph.calls[call as usize];
                    let (state, input) = (all(&call.state), all(&call.input));
                    let (state, output) =
                        run(steps, call.function, &all(&call.parameters), &state, &input, of(call.step));
                    [state, output].concat()
                });
                results[k as usize]
            }
        };
        values.push(value);
    }
    let all = |ids: &[Id]| ids.iter().map(|id| values[id.index()]).collect();
    (all(&step.new_state), all(&step.results))
}
