//! From a block to the functions that it consists of.

use std::cell::RefCell;
use std::marker::PhantomData;

use stickslip_core::block::Block;
use stickslip_core::fields::Fields;

use super::{Call, Graph, Id, LawBook, Node, Precision, Recorded, Source, laws};
use crate::tree::Tree;

/// A block's step as recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The block's name.
    pub name: &'static str,
    /// Its doc comment, Markdown as it stands in the source: equation and reference.
    pub help: &'static str,
    /// The type behind the name; empty where it was declared.
    pub(super) type_name: &'static str,
    /// The parameters.
    pub parameters: Tree,
    /// The state.
    pub state: Tree,
    /// The input.
    pub input: Tree,
    /// The output.
    pub output: Tree,
    /// What it computes.
    pub graph: Graph,
    /// The state after the step.
    pub new_state: Vec<Id>,
    /// The numbers of the output.
    pub results: Vec<Id>,
}

impl Step {
    /// Whether the step leaves a number of its state as it is.
    pub fn keeps(&self, number: usize) -> bool {
        self.graph.node(self.new_state[number]) == Node::Source(Source::State, number as u32)
    }
}

/// A block and the blocks that it calls.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Callees stand before their callers; the block itself is the last.
    pub steps: Vec<Step>,
    /// The values of its parameters.
    pub parameters: Vec<f64>,
    /// The values of its state at the start.
    pub start: Vec<f64>,
    /// The laws between its parameters.
    pub laws: LawBook,
}

/// What is being recorded on this thread: a graph for each block between the outermost and the one at work.
#[derive(Default)]
struct Recorder {
    graphs: Vec<Graph>,
    steps: Vec<Step>,
}

thread_local! {
    static RECORDER: RefCell<Recorder> = RefCell::default();
}

fn recorder<R>(f: impl FnOnce(&mut Recorder) -> R) -> R {
    RECORDER.with_borrow_mut(f)
}

fn graph<R>(f: impl FnOnce(&mut Graph) -> R) -> R {
    recorder(|s| f(s.graphs.last_mut().expect("recorded numbers live within `record`; none is at work on this thread")))
}

/// What a closure gives, the graph that it leaves behind and the steps that it calls, apart from what is being recorded.
pub(super) fn apart<R>(work: impl FnOnce() -> R) -> (R, Graph, Vec<Step>) {
    let own = Recorder { graphs: vec![Graph::default()], steps: Vec::new() };
    let outer = recorder(|s| std::mem::replace(s, own));
    let result = work();
    let Recorder { mut graphs, steps } = recorder(|s| std::mem::replace(s, outer));
    (result, graphs.pop().expect("each graph is closed where it was opened"), steps)
}

/// The position of an operation in the graph at work.
pub(super) fn node<F: Precision>(operation: Node) -> Id {
    graph(|g| g.add::<F>(operation))
}

fn number<F: Precision>(operation: Node) -> Recorded<F> {
    Recorded { id: node::<F>(operation), precision: PhantomData }
}

/// The same value with each number replaced, in order.
fn renumber<F: Precision, V: Fields<Recorded<F>>>(value: &V, operation: impl Fn(u32) -> Node) -> V {
    let mut count = 0;
    value.merge(value, &mut |_, _| {
        count += 1;
        number(operation(count - 1))
    })
}

/// The positions of a value's numbers, in order.
fn ids<F: Precision>(value: &impl Fields<Recorded<F>>) -> Vec<Id> {
    let mut out = Vec::new();
    value.map(&mut |v: Recorded<F>| {
        out.push(v.id);
        v
    });
    out
}

/// The step of a block in a graph of its own; with it the state and output, for their choices.
fn record_step<F: Precision, B: Block<Recorded<F>>>(
    block: &B,
    state: &B::State,
    input: &B::Input,
) -> (Step, B::State, B::Output) {
    recorder(|s| s.graphs.push(Graph::default()));
    let parameters = renumber(block, |i| Node::Source(Source::Parameters, i));
    let mut new_state = renumber(state, |i| Node::Source(Source::State, i));
    let input = renumber(input, |i| Node::Source(Source::Input, i));
    let dt = number(Node::Source(Source::Step, 0));
    let output = parameters.step(&mut new_state, input, dt);
    let graph = recorder(|s| s.graphs.pop()).expect("each graph is closed where it was opened");
    assert_eq!(Tree::of(state), Tree::of(&new_state), "{}: a step does not change the choices of its state", B::NAME);
    let step = Step {
        name: B::NAME,
        help: B::HELP,
        type_name: std::any::type_name::<B>(),
        parameters: Tree::of(block),
        state: Tree::of(&new_state),
        input: Tree::of(&input),
        output: Tree::of(&output),
        graph,
        new_state: ids(&new_state),
        results: ids(&output),
    };
    (step, new_state, output)
}

/// The laws between the parameters of a block, in a graph of their own.
fn record_laws<F: Precision>(block: &impl Fields<Recorded<F>>) -> LawBook {
    recorder(|s| s.graphs.push(Graph::default()));
    let laws = laws::collect(&renumber(block, |i| Node::Source(Source::Parameters, i)));
    let graph = recorder(|s| s.graphs.pop()).expect("each graph is closed where it was opened");
    LawBook { graph, laws }
}

/// A block within another: a function of its own, and a call of it.
///
/// The callee is recorded at each call and then compared with those known: whatever its parameters choose, equal steps
/// are one function. That costs as many operations as the flat step has, and no key can be too coarse.
pub(super) fn call<F: Precision, B: Block<Recorded<F>>>(
    block: &B,
    state: &mut B::State,
    input: B::Input,
    dt: Recorded<F>,
) -> B::Output {
    let (step, new_state, output) = record_step(block, state, &input);
    let kept: Vec<bool> = (0..step.new_state.len()).map(|number| step.keeps(number)).collect();
    let function = recorder(|s| {
        s.steps.iter().position(|known| *known == step).unwrap_or_else(|| {
            s.steps.push(step);
            s.steps.len() - 1
        })
    });
    let call = Call { function, parameters: ids(block), state: ids(state), input: ids(&input), step: dt.id };
    let call = graph(|g| g.call(call));
    let mut number = 0;
    *state = state.merge(&new_state, &mut |before, _| {
        number += 1;
        if kept[number - 1] { before } else { self::number(Node::Result(call, number as u32 - 1)) }
    });
    renumber(&output, |i| Node::Result(call, kept.len() as u32 + i))
}

/// Records a block in the precision `F`. Choices in the parameters are made here; numbers stay open.
pub fn record<B, F>(parameters: &B) -> Program
where
    F: Precision,
    B: Fields<f64>,
    B::With<Recorded<F>>: Block<Recorded<F>, Input: Default>,
{
    recorder(|s| *s = Recorder { graphs: vec![Graph::default()], steps: Vec::new() });
    let mut values = Vec::new();
    let block = parameters.map(&mut |v: f64| {
        values.push(v);
        number::<F>(Node::Constant(F::of(v).into().to_bits()))
    });
    let state = Default::default();
    let start = ids::<F>(&state);
    let start = graph(|g| start.iter().map(|id| g.constant(*id).unwrap_or(0.0)).collect());
    let laws = record_laws(&block);
    let (top, _, _) = record_step(&block, &state, &Default::default());
    let mut steps = recorder(std::mem::take).steps;
    steps.push(top);
    Program { steps, parameters: values, start, laws }
}

/// Records a function of one number. Its argument is the first input.
pub fn record_function<F: Precision>(function: impl FnOnce(Recorded<F>) -> Recorded<F>) -> (Graph, Id) {
    recorder(|s| s.graphs.push(Graph::default()));
    let out = function(number(Node::Source(Source::Input, 0))).id;
    (recorder(|s| s.graphs.pop()).expect("each graph is closed where it was opened"), out)
}
