//! From a block to its functions.

use std::cell::RefCell;

use stickslip_core::block::Block;
use stickslip_core::fields::{Fields, each};

use super::{Call, Graph, Id, LawBook, Node, Precision, Real, Recorded, Source, laws};
use crate::tree::Tree;

/// The recorded step of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The block's name.
    pub name: &'static str,
    /// Its doc comment, as Markdown: equation and reference.
    pub help: &'static str,
    /// The Rust type; empty for a declared step.
    pub(super) type_name: &'static str,
    /// The parameters.
    pub parameters: Tree,
    /// The state.
    pub state: Tree,
    /// The input.
    pub input: Tree,
    /// The output.
    pub output: Tree,
    /// The operations.
    pub graph: Graph,
    /// The state after the step.
    pub new_state: Vec<Id>,
    /// The numbers of the output.
    pub results: Vec<Id>,
}

impl Step {
    /// Whether the step does not change a number of its state.
    pub fn keeps(&self, number: usize) -> bool {
        self.graph.node(self.new_state[number]) == Node::Source(Source::State, number as u32)
    }
}

/// A block and the blocks that it calls.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Callees are before their callers; the block itself is the last.
    pub steps: Vec<Step>,
    /// The values of its parameters.
    pub parameters: Vec<f64>,
    /// The values of its state at the start.
    pub start: Vec<f64>,
    /// The laws between its parameters.
    pub laws: LawBook,
}

impl Program {
    /// The block itself.
    pub(crate) fn top(&self) -> &Step {
        self.steps.last().expect("a program has at least the block itself")
    }
}

/// The recording on this thread: one graph for each block from the outermost to the current one.
struct Recorder {
    real: Real,
    graphs: Vec<Graph>,
    steps: Vec<Step>,
}

thread_local! {
    static RECORDER: RefCell<Option<Recorder>> = const { RefCell::new(None) };
}

/// Changes the recording on this thread. Only functions that are not generic call it, so that it is compiled only about
/// a dozen times.
fn recorder<R>(change: impl FnOnce(&mut Recorder) -> R) -> R {
    RECORDER.with_borrow_mut(|it| {
        change(it.as_mut().expect("recorded numbers live within `record`; no recording is active on this thread"))
    })
}

fn graph<R>(change: impl FnOnce(&mut Graph) -> R) -> R {
    recorder(|it| change(it.graphs.last_mut().expect("a recording has a graph")))
}

/// The result of a closure, its graph and the steps that it calls, separate from any other recording.
pub(super) fn isolated<R>(real: Real, work: impl FnOnce() -> R) -> (R, Graph, Vec<Step>) {
    let outer = begin(real);
    let result = work();
    let (graph, steps) = end(outer);
    (result, graph, steps)
}

/// Begins a recording; returns the previous one.
fn begin(real: Real) -> Option<Recorder> {
    RECORDER.replace(Some(Recorder { real, graphs: vec![Graph::default()], steps: Vec::new() }))
}

/// Ends a recording and continues the outer one: the graph and the steps of the recording.
fn end(outer: Option<Recorder>) -> (Graph, Vec<Step>) {
    let Recorder { mut graphs, steps, .. } = RECORDER.replace(outer).expect("a recording ends once");
    (graphs.pop().expect("each graph is closed by its opener"), steps)
}

/// Opens the graph of a block within the current one.
fn open() {
    recorder(|it| it.graphs.push(Graph::default()));
}

/// Closes the current graph.
fn close() -> Graph {
    recorder(|it| it.graphs.pop()).expect("each graph is closed by its opener")
}

/// The position of an operation in the current graph.
#[inline(never)]
pub(super) fn node(operation: Node) -> Id {
    recorder(|it| (it.real.add)(it.graphs.last_mut().expect("a recording has a graph"), operation))
}

/// A constant: one value in double precision, one in single precision.
#[inline(never)]
pub(super) fn constant(double: f64, single: f64) -> Recorded {
    let round = recorder(|it| it.real.round);
    Recorded::new(Node::Constant(round(double, single).to_bits()))
}

/// A struct of recorded numbers of any type: all code except the step itself is compiled once.
trait Numbers {
    /// Its structure.
    fn tree(&self) -> Tree;
    /// Visits each number.
    fn each(&mut self, visit: &mut dyn FnMut(&mut Recorded));
    /// The positions of the numbers, in order.
    fn ids(&self) -> Vec<Id>;
}

impl<V: Fields<Recorded>> Numbers for V {
    fn tree(&self) -> Tree {
        Tree::of(self)
    }

    fn each(&mut self, visit: &mut dyn FnMut(&mut Recorded)) {
        each(self, visit);
    }

    fn ids(&self) -> Vec<Id> {
        let mut copy = *self;
        ids(&mut copy)
    }
}

fn ids(values: &mut dyn Numbers) -> Vec<Id> {
    let mut ids = Vec::new();
    values.each(&mut |number| ids.push(number.id));
    ids
}

/// Replaces the numbers by arguments of the block.
fn take_from(values: &mut dyn Numbers, source: Source) {
    let mut place = 0;
    values.each(&mut |number| {
        *number = Recorded::new(Node::Source(source, place));
        place += 1;
    });
}

/// Replaces the numbers by the results of a call, from the one at `first` on; a number marked `unchanged` stays.
fn take_results(values: &mut dyn Numbers, call: u32, first: usize, unchanged: &[bool]) {
    let mut place = 0;
    values.each(&mut |number| {
        if !unchanged.get(place).is_some_and(|unchanged| *unchanged) {
            *number = Recorded::new(Node::Result(call, (first + place) as u32));
        }
        place += 1;
    });
}

/// The structs of a step whose graph is open, and its time step.
struct Opened {
    parameters: Tree,
    state: Tree,
    input: Tree,
    dt: Recorded,
}

/// Opens the graph of a block: its parameters, state and input become numbers from outside.
fn open_step([parameters, state, input]: [&mut dyn Numbers; 3]) -> Opened {
    open();
    take_from(parameters, Source::Parameters);
    take_from(state, Source::State);
    take_from(input, Source::Input);
    let dt = Recorded::new(Node::Source(Source::Step, 0));
    Opened { parameters: parameters.tree(), state: state.tree(), input: input.tree(), dt }
}

/// Closes the graph of a block.
fn close_step(
    opened: Opened,
    [name, help, type_name]: [&'static str; 3],
    [state, output]: [&mut dyn Numbers; 2],
) -> Step {
    let graph = close();
    assert_eq!(opened.state, state.tree(), "{name}: a step does not change the choices of its state");
    Step {
        name,
        help,
        type_name,
        parameters: opened.parameters,
        state: opened.state,
        input: opened.input,
        output: output.tree(),
        graph,
        new_state: state.ids(),
        results: output.ids(),
    }
}

/// The step of a block in a graph of its own, and the output, for its choices.
fn record_step<B: Block<Recorded>>(block: &B, state: &B::State, input: &B::Input) -> (Step, B::Output) {
    let (mut parameters, mut state, mut input) = (*block, *state, *input);
    let opened = open_step([&mut parameters, &mut state, &mut input]);
    let mut output = parameters.step(&mut state, input, opened.dt);
    let names = [B::NAME, B::HELP, std::any::type_name::<B>()];
    (close_step(opened, names, [&mut state, &mut output]), output)
}

/// The laws between the parameters of a block, in a graph of their own.
fn record_laws(block: &impl Fields<Recorded>) -> LawBook {
    open();
    let mut parameters = *block;
    take_from(&mut parameters, Source::Parameters);
    let laws = laws::collect(&parameters);
    LawBook { graph: close(), laws }
}

/// A block within another: a separate function, and a call of it.
///
/// The callee is recorded at each call and then compared with the existing ones: for any choices of the parameters,
/// equal steps are one function. This costs as many operations as the flat step has, but requires no key.
#[inline(never)]
pub(super) fn call<B: Block<Recorded>>(block: &B, state: &mut B::State, input: B::Input, dt: Recorded) -> B::Output {
    let (step, mut output) = record_step(block, state, &input);
    enter(step, [block, &input], dt, state, &mut output);
    output
}

/// Adds a call of a step to the current graph, and replaces state and output by its results.
fn enter(
    step: Step,
    [parameters, input]: [&dyn Numbers; 2],
    dt: Recorded,
    state: &mut dyn Numbers,
    output: &mut dyn Numbers,
) {
    let unchanged: Vec<bool> = (0..step.new_state.len()).map(|number| step.keeps(number)).collect();
    let function = recorder(|it| {
        it.steps.iter().position(|existing| *existing == step).unwrap_or_else(|| {
            it.steps.push(step);
            it.steps.len() - 1
        })
    });
    let call = Call { function, parameters: parameters.ids(), state: state.ids(), input: input.ids(), step: dt.id };
    let call = graph(|graph| graph.call(call));
    take_results(state, call, 0, &unchanged);
    take_results(output, call, unchanged.len(), &[]);
}

/// Records a block in the precision `F`. Choices in the parameters are fixed here; numbers stay variable.
pub fn record<B, F>(parameters: &B) -> Program
where
    F: Precision,
    B: Fields<f64>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    record_by(Real::of::<F>(), parameters)
}

/// [`record`], compiled once for both precisions.
fn record_by<B>(real: Real, parameters: &B) -> Program
where
    B: Fields<f64>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    let outer = begin(real);
    let mut values = Vec::new();
    let block = parameters.map(&mut constants(&mut values));
    let state = <B::With<Recorded> as Block<Recorded>>::State::default();
    let start = constant_values(&Numbers::ids(&state));
    let laws = record_laws(&block);
    let (top, _) = record_step(&block, &state, &Default::default());
    let (_, mut steps) = end(outer);
    steps.push(top);
    Program { steps, parameters: values, start, laws }
}

/// Recorded constants; their values are in `values`.
fn constants(values: &mut Vec<f64>) -> impl FnMut(f64) -> Recorded {
    |value| {
        values.push(value);
        constant(value, value)
    }
}

/// The values of numbers that are constants, 0 of others.
fn constant_values(ids: &[Id]) -> Vec<f64> {
    graph(|graph| ids.iter().map(|id| graph.constant(*id).unwrap_or(0.0)).collect())
}

/// Records a function of one number. Its argument is the first input.
pub(crate) fn record_function(real: Real, function: fn(Recorded) -> Recorded) -> (Graph, Id) {
    let (out, graph, _) = isolated(real, || function(Recorded::new(Node::Source(Source::Input, 0))).id);
    (graph, out)
}
