//! Laws of the rendering laws.

use super::*;
use crate::drive::{TwoMass, Winding};
use crate::estimate::{AccelerationSensor, DriveModel, DriveObserver, ObserverGains};
use crate::fields::Fields as _;
use crate::friction::{Bristles, Friction, Stribeck};

const DT: f64 = 250e-6;

fn own() -> Stribeck<f64> {
    Stribeck::default()
}

fn desired() -> Stribeck<f64> {
    Stribeck { kinetic_torque: 0.12, stribeck_velocity: 1.5, ..Stribeck::default() }
}

/// An observer with gains of the size that a design gives.
fn observer() -> DriveObserver<f64> {
    let friction = Bristles::default().under(own());
    let model =
        DriveModel::new(TwoMass::default(), Winding::default(), 0.32e-3, Friction::default(), friction, 0.5 * DT);
    let gains = ObserverGains {
        angle: [0.03, 0.0, 0.0],
        velocity: [3.7, 0.07, 0.0],
        tacho: [2.3, 0.14, 0.0],
        ..Default::default()
    };
    DriveObserver { model, steps: 2, tacho_share: 0.2, accelerometer: AccelerationSensor::default(), gains }
}

fn laws() -> [(&'static str, Law<f64>); 5] {
    let (desired, own, torque_limit) = (desired(), own(), 1.0);
    let rendered = Bristles::default().under(desired);
    let paper = DifferenceTorque { desired, own, fade_velocity: 0.1, torque_limit };
    [
        ("paper", Law::Paper(paper)),
        ("smooth", Law::Smooth(SmoothDifference { desired, own, smoothing_velocity: 0.01, torque_limit })),
        ("Karnopp", Law::Karnopp(Karnopp { desired, own, band: 0.1, torque_limit, ..Karnopp::default() })),
        (
            "bristle",
            Law::Bristle(BristleDifference { observer: observer(), desired: rendered, ahead: (0, 3), torque_limit }),
        ),
        (
            "admittance",
            Law::Admittance(Admittance {
                observer: observer(),
                desired: rendered,
                bandwidth: 250.0,
                ahead: (0, 3),
                torque_limit,
            }),
        ),
    ]
}

/// What the instruments of a drive at constant speed show, with the torque that keeps it there under the law.
fn steady(velocity: f64, tick: u32, load_torque: f64) -> LawInput<f64> {
    LawInput {
        estimated_velocity: velocity,
        angle: velocity * f64::from(tick) * DT,
        motor_velocity: velocity,
        acceleration: 0.0,
        current: load_torque / Winding::<f64>::default().torque_constant,
        motor_torque: own().torque(velocity) + load_torque,
    }
}

/// The torque after half a second at constant speed; the load motor follows at once.
fn settled(law: &Law<f64>, state: &mut LawState<f64>, velocity: f64) -> f64 {
    let mut torque = 0.0;
    for tick in 0..2000 {
        torque = tick_of(law, state, velocity, tick);
    }
    torque
}

fn tick_of(law: &Law<f64>, state: &mut LawState<f64>, velocity: f64, tick: u32) -> f64 {
    let input = steady(velocity, tick, state.torque);
    let output = law.render(state, input, DT);
    let winding = Winding::<f64>::default();
    state.motor_torque = input.motor_torque;
    state.torque = output.torque;
    state.voltage = winding.resistance * output.torque / winding.torque_constant - winding.torque_constant * velocity;
    output.torque
}

#[test]
fn a_law_without_an_observer_renders_the_difference_at_constant_speed() {
    for (name, law) in laws().into_iter().take(3) {
        for velocity in [-20.0, -2.0, 2.0, 20.0] {
            let torque = settled(&law, &mut LawState::default(), velocity);
            let wanted = desired().torque(velocity) - own().torque(velocity);
            // The smooth sign lacks little at 200 times its velocity.
            assert!((torque - wanted).abs() < 0.02 * wanted.abs(), "{name} at {velocity}: {torque}, not {wanted}");
        }
    }
}

#[test]
fn a_law_begins_with_the_torque_of_the_one_before_and_lets_go_of_it() {
    for (before, first) in laws() {
        for (after, second) in laws() {
            let mut state = LawState::default();
            let torque = settled(&first, &mut state, 2.0);
            state.swapped = 1.0;
            let begun = tick_of(&second, &mut state, 2.0, 2000);
            assert!((begun - torque).abs() < 1e-12, "{before} to {after}: {torque} steps to {begun}");
            for tick in 2001..4000 {
                tick_of(&second, &mut state, 2.0, tick);
            }
            assert_eq!(state.bump.abs() < 1e-9, true, "{before} to {after}: {} is left", state.bump);
        }
    }
    // The guard fires: without it the torque steps.
    let [(_, paper), .., (_, admittance)] = laws();
    let mut state = LawState::default();
    let torque = settled(&paper, &mut state, 2.0);
    let stepped = tick_of(&admittance, &mut state, 2.0, 2000);
    assert!((stepped - torque).abs() > 1e-3, "{torque} to {stepped}");
}

#[test]
fn what_is_no_number_reaches_neither_the_motor_nor_the_state() {
    for (name, law) in laws() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for place in 0..5 {
                let mut state = LawState::default();
                settled(&law, &mut state, 2.0);
                let mut input = steady(2.0, 2000, state.torque);
                let fields = [
                    &mut input.estimated_velocity,
                    &mut input.angle,
                    &mut input.motor_velocity,
                    &mut input.acceleration,
                    &mut input.current,
                ];
                *fields.into_iter().nth(place).expect("five of them") = bad;
                let output = law.render(&mut state, input, DT);
                assert!(output.torque.abs() <= 1.0, "{name}, {bad} at {place}: {}", output.torque);
                state.map(&mut |number: f64| {
                    assert!(number.is_finite(), "{name}, {bad} at {place}: {state:?}");
                    number
                });
            }
        }
    }
}

#[test]
fn karnopps_load_at_rest_takes_up_what_own_friction_does_not() {
    let Law::Karnopp(law) = laws()[2].1 else { panic!("the third law is Karnopp's") };
    let stronger = Karnopp { desired: Stribeck { breakaway_torque: 0.5, ..desired() }, ..law };
    let at_rest = |motor_torque| {
        let input = LawInput { motor_torque, ..LawInput::default() };
        stronger.step(&mut LawState::default(), input, DT).torque
    };
    // Own friction holds 0.3 N m, the desired one 0.5.
    assert_eq!((at_rest(0.2), at_rest(-0.2)), (0.0, 0.0));
    assert!((at_rest(0.4) - 0.1).abs() < 1e-12 && (at_rest(0.9) - 0.2).abs() < 1e-12);
}
