//! Every block gives the same bits as `f64`, in lanes, as the value of a dual and as generated C.

mod support;

use stickslip_core::control::{Cascade, CurrentControl, Pid, PositionController, VelocityObserver};
use stickslip_core::friction::{
    Dahl, Decay, ElastoPlastic, Exponent, Fading, Friction, FrictionElement, LuGre, Model, Position, Ripple, Static,
    Stribeck,
};
use stickslip_core::plant::{Machine, Plant};
use stickslip_core::render::{DifferenceTorque, Law};
use stickslip_core::sensor::{Accelerometer, Encoder, EncoderFault, Pickups, Tacho};
use stickslip_core::tick::{Decoder, Tick};
use support::blocks::{Holder, Lag, Nested, SlidingFriction};
use support::{bits_agree, slopes_agree};

const DT: f64 = 250e-6;

/// A test: a block, then parameters for each run.
macro_rules! agree {
    ($test:ident, $Block:ident $(, $parameters:expr)+ $(,)?) => {
        #[test]
        fn $test() {
            $(
                bits_agree::<$Block<f64>>($parameters, DT);
                slopes_agree::<$Block<f64>>($parameters, DT);
            )+
        }
    };
}

fn machine(model: Model<f64>) -> Machine<f64> {
    let mut plant = Plant::default();
    plant.screw_friction.model = model;
    plant.wheel.preload = 0.5;
    plant.prepare(10, 25e-6)
}

fn element(model: Model<f64>) -> FrictionElement<f64> {
    let position = Position::Ripple(Ripple::default());
    FrictionElement { friction: Friction { model, position, ..Friction::default() } }
}

// What a block may consist of.
agree!(no_state, SlidingFriction, SlidingFriction::default());
agree!(one_state, Lag, Lag::default());
agree!(
    nested,
    Nested,
    Nested::default(),
    Nested { holder: Holder::Sliding(SlidingFriction::default()), ..Nested::default() }
);

// The blocks of the product.
agree!(cascade, Cascade, Cascade::default());
agree!(current_control, CurrentControl, CurrentControl::default());
agree!(pid, Pid, Pid::default(), Pid { use_tacho: 0.0, ..Pid::default() });
agree!(
    position_controller,
    PositionController,
    PositionController::Pid(Pid::default()),
    PositionController::Cascade(Cascade::default())
);
agree!(decoder, Decoder, Decoder::default());
agree!(difference_torque, DifferenceTorque, DifferenceTorque::default());
agree!(tick, Tick, Tick { law: Law::Paper(DifferenceTorque::default()), ..Tick::default() });
agree!(
    stribeck,
    Stribeck,
    Stribeck::default(),
    Stribeck { decay: Decay::Gaussian, ..Stribeck::default() },
    Stribeck { decay: Decay::Power(Exponent { exponent: 0.7 }), ..Stribeck::default() },
);
agree!(
    friction_element_with_each_model,
    FrictionElement,
    element(Model::Static(Static::default())),
    element(Model::Dahl(Dahl::default())),
    element(Model::Lugre(LuGre::default())),
    element(Model::ElastoPlastic(ElastoPlastic::default())),
);
agree!(velocity_observer, VelocityObserver, VelocityObserver::default());
agree!(encoder, Encoder, Encoder::default(), Encoder { fault: EncoderFault::Frozen, ..Encoder::default() });
agree!(pickups, Pickups, Pickups::new(Tacho::default(), Accelerometer::default(), DT));
agree!(
    machine_with_each_friction,
    Machine,
    machine(Model::Nothing),
    machine(Model::Static(Static::default())),
    machine(Model::Dahl(Dahl::default())),
    machine(Model::Lugre(LuGre { fading: Fading::Rational(Default::default()), ..LuGre::default() })),
    machine(Model::ElastoPlastic(ElastoPlastic::default())),
);

/// The names behind a marker in a text.
fn names_behind<'a>(text: &'a str, marker: &str) -> Vec<&'a str> {
    let name = |rest: &'a str| rest.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
    text.split(marker).skip(1).map(name).collect()
}

#[test]
fn no_block_is_forgotten() {
    let core = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/src");
    let mut blocks = Vec::new();
    let mut folders = vec![core];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("the source of the core lies beside this crate") {
            let path = entry.expect("a readable folder").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = std::fs::read_to_string(&path).expect("readable source");
                blocks.extend(names_behind(&text, " Block<T> for ").into_iter().map(String::from));
            }
        }
    }
    // Converters have no slopes to compare: these two are driven in `bench.rs`.
    blocks.retain(|block| !["VirtualMachine", "VirtualBench"].contains(&block.as_str()));
    assert!(blocks.len() >= 13, "only {blocks:?} were found: has the way to write them changed?");
    assert_eq!(forgotten(&blocks, include_str!("agree.rs")), Vec::<&str>::new(), "these have no agree! line here");
}

/// The blocks that no agree! line of a text names.
fn forgotten<'a>(blocks: &'a [String], text: &str) -> Vec<&'a str> {
    let listed: Vec<&str> =
        text.split("\nagree!(").skip(1).filter_map(|line| line.split(',').nth(1)).map(str::trim).collect();
    blocks.iter().map(String::as_str).filter(|block| !listed.contains(block)).collect()
}

#[test]
fn a_block_without_a_line_is_noticed() {
    let blocks = ["Pid".to_string(), "Cascade".to_string()];
    assert_eq!(forgotten(&blocks, "\nagree!(pid, Pid, Pid::default());\n"), ["Cascade"]);
}
