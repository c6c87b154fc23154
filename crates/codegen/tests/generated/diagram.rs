//! The diagram of every block computes the results of the block, and shows all operations.

#[path = "../diagram/evaluate.rs"]
mod evaluate;

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::support::bench::{TICK, bench};
use super::support::blocks::{Holder, Lag, Nested, SlidingFriction};
use super::support::{assert_same, case, number};
use evaluate::{Given, evaluate};
use expect_test::expect_file;
use serde_json::Value;
use stickslip_codegen::diagram::{self, Diagram, Kind, Layout, Segment};
use stickslip_codegen::record::{self, Id, Program, Recorded};
use stickslip_core::block::Block;
use stickslip_core::control::{Cascade, CurrentControl, Pid, PositionController, VelocityObserver};
use stickslip_core::friction::{
    Dahl, Decay, ElastoPlastic, Exponent, Friction, FrictionElement, LuGre, Model, Position, Ripple, Static, Stribeck,
};
use stickslip_core::plant::Plant;
use stickslip_core::render::{DifferenceTorque, Law};
use stickslip_core::sensor::{Accelerometer, Encoder, EncoderFault, Pickups, Tacho};
use stickslip_core::tick::{Decoder, Tick};

const DT: f64 = 250e-6;

fn machine(model: Model<f64>) -> stickslip_core::plant::Machine<f64> {
    let mut plant = Plant::default();
    plant.screw_friction.model = model;
    plant.wheel.preload = 0.5;
    plant.prepare(10, 25e-6)
}

/// A visitor of the recordings of all blocks.
trait Visit {
    fn visit<B>(&mut self, name: &str, block: B, dt: f64)
    where
        B: Block<f64, Input: Default>,
        B::With<Recorded>: Block<Recorded, Input: Default>;
}

/// Only every n-th trajectory and a limited number of steps: an evaluation is slow, and equal paths are compared
/// elsewhere.
const EVERY: usize = 13;
const STEPS: usize = 24;

/// The blocks of the product and those for the tests.
fn each_block(visit: &mut impl Visit) {
    visit.visit("sliding_friction", SlidingFriction::default(), DT);
    visit.visit("lag", Lag::default(), DT);
    visit.visit("nested", Nested { holder: Holder::Sliding(SlidingFriction::default()), ..Nested::default() }, DT);
    visit.visit("cascade", Cascade::default(), DT);
    visit.visit("current_control", CurrentControl::default(), DT);
    visit.visit("pid", Pid::default(), DT);
    visit.visit("position_controller", PositionController::Pid(Pid::default()), DT);
    visit.visit("decoder", Decoder::default(), DT);
    visit.visit("difference_torque", DifferenceTorque::default(), DT);
    visit.visit("tick", Tick { law: Law::Paper(DifferenceTorque::default()), ..Tick::default() }, DT);
    visit.visit("velocity_observer", VelocityObserver::default(), DT);
    visit.visit("encoder", Encoder::default(), DT);
    visit.visit("frozen_encoder", Encoder { fault: EncoderFault::Frozen, ..Encoder::default() }, DT);
    visit.visit("pickups", Pickups::new(Tacho::default(), Accelerometer::default(), DT), DT);
    let power = Decay::Power(Exponent { exponent: 0.7 });
    visit.visit("stribeck", Stribeck { decay: power, ..Stribeck::default() }, DT);
    let model = Model::Lugre(LuGre::default());
    let friction = Friction { model, position: Position::Ripple(Ripple::default()), ..Friction::default() };
    visit.visit("friction_element", FrictionElement { friction }, DT);
    visit.visit("machine_static", machine(Model::Static(Static::default())), DT);
    visit.visit("machine_dahl", machine(Model::Dahl(Dahl::default())), DT);
    visit.visit("machine_lugre", machine(Model::Lugre(LuGre::default())), DT);
    visit.visit("machine", machine(Model::ElastoPlastic(ElastoPlastic::default())), DT);
    visit.visit("bench", bench(), TICK);
}

/// The outputs and states of a block, by its diagram and by the block.
fn compared<B>(block: &B, program: &Program, diagram: &Diagram, dt: f64) -> [Vec<Vec<f64>>; 2]
where
    B: Block<f64, Input: Default>,
{
    let mut trajectories: Vec<_> = case::trajectories(block, dt).into_iter().step_by(EVERY).collect();
    trajectories.iter_mut().for_each(|t| t.inputs.truncate(STEPS));
    let drawn = |trajectory: &case::Trajectory| {
        let mut state = program.start.clone();
        let step = |input: &Vec<f64>| {
            let given = Given { parameters: &trajectory.parameters, state: &state, input, dt };
            let (new, mut row) = evaluate(diagram, diagram.pages.len() - 1, &given);
            row.extend(&new);
            state = new;
            row
        };
        trajectory.inputs.iter().flat_map(step).collect()
    };
    let computed = trajectories.iter().flat_map(|t| number::run(block, std::slice::from_ref(t)));
    [computed.collect(), trajectories.iter().map(drawn).collect()]
}

struct Computes;

impl Visit for Computes {
    fn visit<B>(&mut self, name: &str, block: B, dt: f64)
    where
        B: Block<f64, Input: Default>,
        B::With<Recorded>: Block<Recorded, Input: Default>,
    {
        let program = record::record::<B, f64>(&block);
        let [computed, drawn] = compared(&block, &program, &Diagram::of(&program, name), dt);
        assert_same(name, &computed, &drawn);
    }
}

#[test]
fn every_diagram_computes_the_bits_of_its_block() {
    each_block(&mut Computes);
}

#[test]
fn a_wrong_diagram_is_detected() {
    let block = CurrentControl::<f64>::default();
    let program = record::record::<_, f64>(&block);
    let right = Diagram::of(&program, "block");
    let changes: [fn(&mut Kind); 4] = [
        |kind| {
            if let Kind::Sum(minus) = kind {
                minus[1] = !minus[1];
            }
        },
        |kind| {
            if let Kind::Gain(factors) = kind {
                factors.pop();
            }
        },
        |kind| {
            if let Kind::Saturation { low, high } = kind {
                std::mem::swap(low, high);
            }
        },
        |kind| {
            if *kind == Kind::Or {
                *kind = Kind::And;
            }
        },
    ];
    for (number, change) in changes.iter().enumerate() {
        let mut wrong = right.clone();
        wrong.pages[0].nodes.iter_mut().for_each(|node| change(&mut node.kind));
        let [computed, drawn] = compared(&block, &program, &wrong, DT);
        assert!(catch_unwind(|| assert_same("a wrong diagram", &computed, &drawn)).is_err(), "change {number}");
    }
    let mut cut = right;
    cut.pages[0].wires.pop();
    assert!(catch_unwind(AssertUnwindSafe(|| compared(&block, &program, &cut, DT))).is_err(), "a wire is missing");
}

struct Complete;

impl Visit for Complete {
    fn visit<B>(&mut self, name: &str, block: B, _dt: f64)
    where
        B: Block<f64, Input: Default>,
        B::With<Recorded>: Block<Recorded, Input: Default>,
    {
        let program = record::record::<B, f64>(&block);
        let text = diagram::json(&program, name);
        assert_eq!(text, diagram::json(&program, name), "the same block gives the same text");
        let data: Value = serde_json::from_str(&text).expect("JSON");
        let pages = data["pages"].as_array().expect("pages");
        for (page, step) in pages.iter().zip(&program.steps) {
            shows_all(page, step);
            wires_connect(page);
        }
        assert_eq!(pages.len(), program.steps.len());
    }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// The operations that the results of a step require.
fn live(step: &record::Step) -> BTreeSet<u64> {
    let mut visited = BTreeSet::new();
    let mut open: Vec<Id> = step.new_state.iter().chain(&step.results).copied().collect();
    while let Some(id) = open.pop() {
        if visited.insert(u64::from(id.0)) {
            open.extend(step.graph.node(id).operands());
            if let record::Node::Result(call, _) = step.graph.node(id) {
                let call = &step.graph.calls[call as usize];
                open.extend(call.parameters.iter().chain(&call.state).chain(&call.input).chain([&call.step]));
            }
        }
    }
    visited
}

/// Each operation is listed, and each that depends on a signal is drawn, once.
fn shows_all(page: &Value, step: &record::Step) {
    let number = |value: &Value| value.as_u64().expect("a number");
    let listed: BTreeSet<u64> = list(&page["operations"]).iter().map(|operation| number(&operation[0])).collect();
    assert_eq!(listed, live(step), "{}", page["name"]);
    let mut of_signals = BTreeSet::new();
    for operation in list(&page["operations"]) {
        let (id, what) = (number(&operation[0]), operation[1].as_str().expect("a word"));
        let source = matches!(what, "input" | "state" | "result");
        let known = matches!(what, "parameter" | "step" | "constant" | "truth");
        if source || !known && list(&operation[2]).iter().any(|operand| of_signals.contains(&number(operand))) {
            of_signals.insert(id);
        }
    }
    let mut drawn = Vec::new();
    list(&page["nodes"]).iter().for_each(|node| drawn.extend(list(&node["operations"]).iter().map(number)));
    // An unchanged state or input requires no operation.
    let count = drawn.len();
    let drawn: BTreeSet<u64> = drawn.into_iter().collect();
    assert_eq!(drawn.len(), count, "{}: an operation is drawn twice", page["name"]);
    let missing: Vec<_> = of_signals.difference(&drawn).collect();
    let unchanged = |id: &u64| step.new_state.iter().any(|new| u64::from(new.0) == *id);
    assert!(missing.iter().all(|id| unchanged(id)), "{}: {missing:?} are not drawn", page["name"]);
    assert!(drawn.is_subset(&of_signals), "{}: expressions without signals are texts, not nodes", page["name"]);
}

/// One wire ends at each input; it has the values of the output.
fn wires_connect(page: &Value) {
    let nodes = list(&page["nodes"]);
    let mut ends = BTreeSet::new();
    for wire in list(&page["wires"]) {
        let end = |end: &Value, side: &str| {
            let place = [&end[0], &end[1]].map(|number| number.as_u64().expect("a number") as usize);
            (place, &nodes[place[0]][side][place[1]]["numbers"])
        };
        let ((_, from), (to, into)) = (end(&wire["from"], "outputs"), end(&wire["to"], "inputs"));
        assert!(from.is_array() && from == into, "{wire} connects {from} with {into}");
        assert!(ends.insert(to), "{wire} ends at the same port as another one");
    }
    let inputs: usize = nodes.iter().map(|node| list(&node["inputs"]).len()).sum();
    assert_eq!(ends.len(), inputs, "{}: a wire ends at each input", page["name"]);
}

#[test]
fn the_data_show_every_operation_once_and_every_wire_has_its_ends() {
    each_block(&mut Complete);
}

struct Tidy;

impl Visit for Tidy {
    fn visit<B>(&mut self, name: &str, block: B, _dt: f64)
    where
        B: Block<f64, Input: Default>,
        B::With<Recorded>: Block<Recorded, Input: Default>,
    {
        let program = record::record::<B, f64>(&block);
        let diagram = Diagram::of(&program, name);
        for (number, page) in diagram.pages.iter().enumerate() {
            let layout = diagram::layout(&diagram, number);
            let faults = faults(&layout);
            assert!(faults.is_empty(), "{name}, {}: {faults:#?}", page.label);
            // Boxes of other blocks are never combined, nor the operations between them.
            let calls = page.nodes.iter().filter(|node| matches!(node.kind, Kind::Call { .. })).count();
            let boxes = layout.boxes.len();
            println!("{}: {} nodes in {boxes} boxes, {} wires", page.label, page.nodes.len(), layout.links.len());
            assert!(boxes <= 40 + calls, "{name}, {}: {boxes} boxes are hard to read", page.label);
        }
    }
}

/// Faults of a layout for readers.
fn faults(layout: &Layout) -> Vec<String> {
    let mut out = Vec::new();
    for (i, a) in layout.boxes.iter().enumerate() {
        for (j, b) in layout.boxes[..i].iter().enumerate() {
            if a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3] {
                out.push(format!("boxes {i} and {j} overlap"));
            }
        }
    }
    let span = |segment: &Segment, axis: usize| {
        let (a, b) = (segment.from[axis], segment.to[axis]);
        (a.min(b), a.max(b))
    };
    for segment in &layout.segments {
        let (x, y) = (span(segment, 0), span(segment, 1));
        for (number, [left, top, right, bottom]) in layout.boxes.iter().enumerate() {
            if x.0 < *right && x.1 > *left && y.0 < *bottom && y.1 > *top {
                out.push(format!("wire {:?} runs through box {number}", segment.wire));
            }
        }
        let others = layout.segments.iter().filter(|other| other.wire > segment.wire);
        for other in others {
            for axis in [0, 1] {
                let (along, across) = (span(segment, axis), span(segment, 1 - axis));
                let (other_along, other_across) = (span(other, axis), span(other, 1 - axis));
                let flat = across.0 == across.1 && other_across.0 == other_across.1;
                // Lines closer than their width would look like one.
                if flat && (across.0 - other_across.0).abs() < 2.0 && along.0 < other_along.1 && other_along.0 < along.1
                {
                    out.push(format!("wires {:?} and {:?} coincide: {segment:?} {other:?}", segment.wire, other.wire));
                }
            }
        }
    }
    let key = |at: [f64; 2]| at.map(|v| (v * 10.0).round() as i64);
    for link in &layout.links {
        let mut next: BTreeMap<[i64; 2], Vec<[i64; 2]>> = BTreeMap::new();
        for segment in layout.segments.iter().filter(|segment| segment.wire == link.from) {
            next.entry(key(segment.from)).or_default().push(key(segment.to));
            next.entry(key(segment.to)).or_default().push(key(segment.from));
        }
        let begin = key(layout.ports[link.from.0][1][link.from.1]);
        let end = key(layout.ports[link.to.0][0][link.to.1]);
        let (mut visited, mut open) = (BTreeSet::new(), vec![begin]);
        while let Some(at) = open.pop() {
            if visited.insert(at) {
                open.extend(next.get(&at).into_iter().flatten());
            }
        }
        if !visited.contains(&end) {
            out.push(format!("wire {:?} does not arrive at {:?}", link.from, link.to));
        }
    }
    out
}

#[test]
fn boxes_stand_apart_and_wires_run_between_them_from_port_to_port() {
    each_block(&mut Tidy);
}

#[test]
fn a_wrong_layout_is_detected() {
    let block = CurrentControl::<f64>::default();
    let program = record::record::<_, f64>(&block);
    let right = diagram::layout(&Diagram::of(&program, "block"), 0);
    let found = |spoil: fn(&mut Layout)| {
        let mut wrong = right.clone();
        spoil(&mut wrong);
        faults(&wrong).join(", ")
    };
    assert!(found(|layout| layout.boxes[1] = layout.boxes[0]).contains("overlap"));
    assert!(found(|layout| layout.boxes[0] = [0.0, 0.0, 1e4, 1e4]).contains("runs through"));
    assert!(found(|layout| layout.segments.truncate(3)).contains("does not arrive"));
    let doubled = |layout: &mut Layout| {
        let first = layout.segments[0];
        layout.segments.push(Segment { wire: (99, 0), ..first });
    };
    assert!(found(doubled).contains("coincide"));
}

#[test]
fn the_diagram_of_a_lag_is_as_recorded() {
    let program = record::record::<_, f64>(&Lag::<f64>::default());
    let pages = diagram::pages(&program, "lag");
    assert_eq!(pages.iter().map(|page| page.0.as_str()).collect::<Vec<_>>(), ["lag.svg"]);
    expect_file!["../golden/lag.svg"].assert_eq(&pages[0].1);
    expect_file!["../golden/lag.json"].assert_eq(&diagram::json(&program, "lag"));
}

#[test]
fn a_box_links_to_the_page_inside_it() {
    let program = record::record::<_, f64>(&bench());
    let pages: BTreeMap<_, _> = diagram::pages(&program, "bench").into_iter().collect();
    let links = |svg: &str| -> BTreeSet<String> {
        svg.split("<a href=\"").skip(1).filter_map(|rest| rest.split('"').next()).map(String::from).collect()
    };
    let all: BTreeSet<String> = pages.values().flat_map(|svg| links(svg)).collect();
    let inside: BTreeSet<String> = pages.keys().filter(|file| *file != "bench.svg").cloned().collect();
    assert_eq!(all, inside);
    assert!(links(&pages["bench.svg"]).contains("bench.tick.svg"));
}

#[test]
fn a_formula_reads_as_the_equation_of_its_block() {
    let program = record::record::<_, f64>(&SlidingFriction::<f64>::default());
    let step = &program.steps[0];
    let input = |id: Id| {
        let is_input = matches!(step.graph.node(id), record::Node::Source(record::Source::Input, _));
        is_input.then(|| "Ω".to_string())
    };
    let text = diagram::formula(step, step.results[0], &input);
    assert_eq!(text, "(M_K + (M_S − M_K)·exp(−|Ω|/Ω_Strib))·sgn(Ω) + b·Ω");
}
