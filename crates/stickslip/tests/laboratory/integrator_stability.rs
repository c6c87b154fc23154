//! The stability bound of the plant's step, checked against the step itself on random stuck machines.

use stickslip::SimulateError;
use stickslip::integrator::prepare;
use stickslip::stability::largest_step;
use stickslip_core::block::Block;
use stickslip_core::friction::{ElastoPlastic, Friction, LuGre, Memory, Model, Stribeck};
use stickslip_core::plant::{MachineInput, MachineState, Plant};

/// Numbers in 0 … 1 that fill up to six dimensions evenly: additive recurrence with the root of x⁷ = x + 1.
fn uniform(case: usize, dimension: i32) -> f64 {
    const ROOT: f64 = 1.112_775_684_278_705_5;
    (0.5 + case as f64 / ROOT.powi(dimension + 1)).fract()
}

/// 10 to a power between two.
fn decades(low: f64, high: f64, share: f64) -> f64 {
    10f64.powf(low + (high - low) * share)
}

/// Bristles that hold 1 N·m, without viscous friction.
fn bristles(stiffness: f64, damping: f64) -> Friction<f64> {
    let sliding = Stribeck { breakaway_torque: 1.0, kinetic_torque: 0.9, viscous_friction: 0.0, ..Stribeck::default() };
    let lugre = LuGre { sliding, bristle_stiffness: stiffness, bristle_damping: damping, ..LuGre::default() };
    Friction { model: Model::ElastoPlastic(ElastoPlastic { lugre, ..Default::default() }), ..Friction::default() }
}

/// Jury's conditions of a stuck mass, a = σ₀·h²/J > 0, b = σ₁·h/J ≥ 0.
fn stable(a: f64, b: f64) -> bool {
    let cubic = a.powi(3) + 3.0 * a * a * b - 6.0 * a * b * b - 8.0 * b.powi(3) + 32.0 * b;
    a + 4.0 * b < 8.0 && a * (2.0 - b) < 4.0 * b * b - 4.0 * b + 8.0 && cubic > 0.0
}

/// A stuck load alone, and a step for it: the motor is heavy and the coupling next to nothing.
fn alone(case: usize, a: f64, b: f64) -> (Plant<f64>, f64) {
    let step = decades(-6.0, -4.0, uniform(case, 1));
    let inertia = decades(-5.0, -2.0, uniform(case, 2));
    let screw_friction = bristles(a * inertia / (step * step), b * inertia / step);
    let mut plant = Plant { screw_friction, ..Plant::default() };
    plant.drive.load_inertia = inertia;
    plant.drive.motor_inertia = 1.0;
    plant.drive.coupling_stiffness = 1e-9;
    plant.drive.coupling_damping = 0.0;
    plant.load_motor.winding.torque_constant = 0.0;
    plant.wheel.preload = 0.0;
    (plant, step)
}

/// Largest torque of the bristles [N m] in the first tenth of a run and in its last, started at 1e-9 N·m.
fn ring(plant: &Plant<f64>, step: f64, steps: usize) -> (f64, f64) {
    let machine = plant.prepare(1, step);
    let (load, _) = plant.screw_friction.stiffest();
    let (motor, _) = plant.motor_friction.stiffest();
    let deflection = |stiffness: f64| if stiffness > 0.0 { 1e-9 / stiffness } else { 0.0 };
    let mut state = MachineState {
        screw_memory: Memory::bent(deflection(load)),
        motor_memory: Memory::bent(-deflection(motor)),
        ..MachineState::default()
    };
    let (mut first, mut last) = (0.0f64, 0.0f64);
    for count in 0..steps {
        machine.step(&mut state, MachineInput::default(), step);
        let torque = (load * state.screw_memory.deflection).abs() + (motor * state.motor_memory.deflection).abs();
        // Grown a hundred thousand times, still well within the elastic zone; or no longer finite.
        if torque.is_nan() || torque > 1e-4 {
            return (first, f64::INFINITY);
        }
        if count < steps / 10 {
            first = first.max(torque);
        } else if count >= steps - steps / 10 {
            last = last.max(torque);
        }
    }
    (first, last)
}

#[test]
fn a_stuck_load_comes_to_rest_just_inside_the_bound() {
    for case in 0..100 {
        let b = 2.0 * (0.05 + 0.9 * uniform(case, 0));
        let (plant, step) = alone(case, 4.0 - 2.0 * b, b);
        // The bound found from the parameters is the step at which a + 2·b = 4.
        let bound = largest_step(&plant);
        assert!((bound / step - 1.0).abs() < 1e-12, "{bound} {step}");
        assert!(prepare(&plant, 1, 0.98 * bound).is_ok());
        let (first, last) = ring(&plant, 0.98 * bound, 4000);
        assert!(last < 0.01 * first, "b = {b}: {first} … {last} N m");
    }
}

#[test]
fn a_stuck_load_grows_just_outside_the_region_and_is_refused() {
    for case in 0..100 {
        // A ray from the origin at any angle, followed to where Jury's conditions first fail.
        let (a, b) = (uniform(case, 0), 0.5 * (1.0 - uniform(case, 0)) + 1e-6);
        let edge = (1..).map(|k| 1e-3 * f64::from(k)).find(|s| !stable(s * a, s * b)).expect("the region is bounded");
        assert!(edge * (a + 2.0 * b) > 3.99, "the triangle is within the region");
        let (plant, step) = alone(case, 1.02 * edge * a, 1.02 * edge * b);
        let (first, last) = ring(&plant, step, 4000);
        assert!(last > 10.0 * first, "a = {a}, b = {b}, edge {edge}: {first} … {last} N m");
        let refused = prepare(&plant, 1, step);
        assert!(
            matches!(refused.as_ref().err().and_then(|error| error.of()), Some(SimulateError::StepTooLarge { step: s, largest, .. }) if *s == step && *largest < step)
        );
    }
}

#[test]
fn two_stuck_masses_on_a_coupling_do_not_grow_at_the_bound() {
    for case in 0..100 {
        let [load, motor] = [1, 2].map(|i| decades(-5.0, -2.0, uniform(case, i)));
        let mut plant = Plant::default();
        plant.drive.load_inertia = load;
        plant.drive.motor_inertia = motor;
        plant.drive.coupling_stiffness = decades(0.0, 3.7, uniform(case, 3));
        plant.drive.coupling_damping = 0.0;
        plant.load_motor.winding.torque_constant = 0.0;
        plant.wheel.preload = 0.0;
        let stiffness = [4, 5].map(|i| decades(2.0, 5.0, uniform(case, i)));
        // 1 to 30 ms of bristle damping, as in usual bristles.
        let time = decades(-3.0, -1.5, uniform(case, 0));
        plant.screw_friction = bristles(stiffness[0], time * stiffness[0]);
        plant.motor_friction = bristles(stiffness[1], time * stiffness[1]);
        let (first, last) = ring(&plant, largest_step(&plant), 4000);
        assert!(last <= first, "case {case}: {first} … {last} N m");
    }
}
