//! The picture does not lie: the diagram of every block computes what the block computes, and shows all of it.

#[path = "diagram/evaluate.rs"]
mod evaluate;
mod support;

use std::collections::HashSet;

use evaluate::{Given, evaluate};
use stickslip_codegen::diagram::{Diagram, Kind, Page};
use stickslip_codegen::record::{self, Id, Node, Program, Recorded, Source};
use stickslip_core::block::Block;
use stickslip_core::control::{Cascade, CurrentControl, Pid, PositionController, VelocityObserver};
use stickslip_core::fields::Fields;
use stickslip_core::friction::{Dahl, ElastoPlastic, LuGre, Model, Static};
use stickslip_core::plant::Plant;
use stickslip_core::render::{DifferenceTorque, Law};
use stickslip_core::sensor::{Accelerometer, Encoder, EncoderFault, Pickups, Tacho};
use stickslip_core::tick::{Decoder, Tick};
use support::bench::{PLANT_STEP, bench};
use support::blocks::{Holder, Lag, Nested, SlidingFriction};
use support::{assert_same, case, number};

const DT: f64 = 250e-6;

fn machine(model: Model<f64>) -> stickslip_core::plant::Machine<f64> {
    let mut plant = Plant::default();
    plant.screw_friction.model = model;
    plant.wheel.preload = 0.5;
    plant.prepare(10, 25e-6)
}

/// What is done with the recording of each block.
trait Visit {
    fn visit<B>(&mut self, name: &str, block: B, dt: f64)
    where
        B: Block<f64, Input: Default>,
        B::With<Recorded<f64>>: Block<Recorded<f64>, Input: Default>;
}

/// The blocks of the product and those made for the tests.
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
    visit.visit("machine_static", machine(Model::Static(Static::default())), DT);
    visit.visit("machine_dahl", machine(Model::Dahl(Dahl::default())), DT);
    visit.visit("machine_lugre", machine(Model::Lugre(LuGre::default())), DT);
    visit.visit("machine", machine(Model::ElastoPlastic(ElastoPlastic::default())), DT);
    visit.visit("bench", bench(), PLANT_STEP);
}

/// Of the trajectories every so many: an evaluation is slow, and equal paths are compared elsewhere.
const EVERY: usize = 13;

struct Computes;

impl Visit for Computes {
    fn visit<B>(&mut self, name: &str, block: B, dt: f64)
    where
        B: Block<f64, Input: Default>,
        B::With<Recorded<f64>>: Block<Recorded<f64>, Input: Default>,
    {
        let program = record::record::<B, f64>(&block);
        let diagram = Diagram::of(&program, name);
        // The last one of each group goes its way to the end, the others are short.
        let mut trajectories: Vec<_> = case::trajectories(&block, dt).into_iter().step_by(EVERY).collect();
        trajectories.iter_mut().for_each(|t| t.inputs.truncate(24));
        let drawn: Vec<Vec<f64>> = trajectories
            .iter()
            .map(|trajectory| {
                let mut state = program.start.clone();
                let step = |input: &Vec<f64>| {
                    let given = Given { parameters: &trajectory.parameters, state: &state, input, dt };
                    let (new, mut row) = evaluate(&diagram, diagram.pages.len() - 1, &given);
                    row.extend(&new);
                    state = new;
                    row
                };
                trajectory.inputs.iter().flat_map(step).collect()
            })
            .collect();
        let computed: Vec<Vec<f64>> =
            trajectories.iter().flat_map(|t| number::run(&block, std::slice::from_ref(t))).collect();
        assert_same(name, &computed, &drawn);
    }
}

#[test]
fn every_diagram_computes_the_bits_of_its_block() {
    each_block(&mut Computes);
}
