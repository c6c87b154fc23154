//! Drive with backlash: comparison with a reference, energy, rest, and a gap of no width.

use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::block::Block as _;
use crate::friction::{ElastoPlastic, Friction, Model};
use crate::plant::{MachineInput, MachineState, Plant};

const STEP: f64 = 25e-6;

/// A drive with play and one contact, on the load.
fn plant(backlash: Backlash<f64>, friction: Model<f64>) -> Plant<f64> {
    let contact = |model| Friction { model, ..Friction::default() };
    let motor_friction = contact(Model::Nothing);
    let mut plant = Plant { backlash, motor_friction, screw_friction: contact(friction), ..Plant::default() };
    plant.wheel.preload = 0.0;
    plant
}

fn gap(half_width: f64) -> Backlash<f64> {
    Backlash::Gap(Gap { half_width })
}

/// Largest deviation of the angles of load and motor from the reference at its samples, over the range of each.
fn errors(backlash: Backlash<f64>, step: f64) -> [f64; 2] {
    const NUMBERS: &str = include_str!("../../../../../tests/reference/backlash/drive.csv");
    let row = |line: &str| {
        let mut numbers = line.split(',').map(|number| number.parse().expect("a number"));
        core::array::from_fn(|_| numbers.next().expect("three columns"))
    };
    let rows: Vec<[f64; 3]> = NUMBERS.lines().skip(1).map(row).collect();
    let machine = plant(backlash, Model::Nothing).prepare(10, step);
    let mut state = MachineState::default();
    let (mut worst, mut range) = ([0.0_f64; 2], [[0.0_f64; 2]; 2]);
    for pair in rows.windows(2) {
        // The external torque changes its sign every 50 ms.
        let pushes = ((pair[0][0] / 0.05 + 1e-9) as u32).is_multiple_of(2);
        let external_torque = if pushes { 0.1 } else { -0.1 };
        for _ in 0..((pair[1][0] - pair[0][0]) / step).round() as u32 {
            machine.step(&mut state, MachineInput { external_torque, ..MachineInput::default() }, step);
        }
        for (k, angle) in [state.angle, state.angle + state.twist].into_iter().enumerate() {
            let expected = pair[1][k + 1];
            worst[k] = worst[k].max((angle - expected).abs());
            range[k] = [range[k][0].min(expected), range[k][1].max(expected)];
        }
    }
    core::array::from_fn(|k| worst[k] / (range[k][1] - range[k][0]))
}

#[test]
fn a_drive_that_rattles_follows_the_reference() {
    // Flanks meet or part 65 times, and the damping torque jumps somewhere in a step: its impulse is off by up to
    // d·δ̇·h each time, either way. Measured: at most 2e-4 at any of these steps.
    for step in [25e-6, 5e-6, 1e-6] {
        let errors = errors(gap(2e-3), step);
        assert!(errors.iter().all(|error| *error <= 4e-4), "{step}: {errors:?}");
    }
    let tight = errors(Backlash::Nothing, STEP);
    assert!(tight.iter().all(|error| *error >= 5e-3), "a tight coupling is another machine: {tight:?}");
}

/// Energy of a drive whose coupling is a spring beyond the gap [J].
fn energy(plant: &Plant<f64>, half_width: f64, state: &MachineState<f64>) -> f64 {
    let stretch = (state.twist.abs() - half_width).max(0.0);
    0.5 * (plant.drive.motor_inertia * state.motor_velocity.powi(2)
        + plant.drive.load_inertia * state.velocity.powi(2)
        + plant.drive.coupling_stiffness * stretch * stretch)
}

proptest! {
    #[test]
    fn energy_never_grows_through_the_gap(
        half_width in 0.0..5e-3, speed in prop_oneof![-100.0..-0.1, 0.1..100.0],
        damping in prop_oneof![Just(0.0), 0.0..0.1], fast in any::<bool>(), share in 0.2..0.8,
    ) {
        let mut plant = plant(gap(half_width), Model::Nothing);
        plant.load_motor.winding.torque_constant = 0.0;
        plant.drive.coupling_damping = damping;
        plant.drive.motor_inertia = 1e-3 * share;
        plant.drive.load_inertia = 1e-3 * (1.0 - share);
        let step = if fast { 5e-6 } else { STEP };
        let machine = plant.prepare(10, step);
        let mut state = MachineState { motor_velocity: speed, ..MachineState::default() };
        let start = energy(&plant, half_width, &state);
        let elasticity = 1.0 / plant.drive.motor_inertia + 1.0 / plant.drive.load_inertia;
        let a_hit = 0.25 * plant.drive.coupling_stiffness * elasticity * step * step;
        let (mut flank, mut hits) = (0.0, 0);
        for _ in 0..20_000 {
            machine.step(&mut state, MachineInput::default(), step);
            let now = if state.twist.abs() < half_width { 0.0 } else { state.twist.signum() };
            // A narrow gap is crossed within a step.
            hits += (now - std::mem::replace(&mut flank, now)).abs() as u32;
            // The instant at which flanks meet or part is not located within a step: the energy changes by a part of
            // (ω·h)² each time, at most a fifth measured. Without damping the changes can have the same sign.
            let grown = energy(&plant, half_width, &state) / start - 1.0;
            prop_assert!(grown <= a_hit * f64::from(hits) + 1e-9, "grown by {grown} in {hits}");
        }
        let momentum = plant.drive.motor_inertia * state.motor_velocity + plant.drive.load_inertia * state.velocity;
        let kept = momentum / (plant.drive.motor_inertia * speed);
        prop_assert!((kept - 1.0).abs() < 1e-9, "no torque from outside: {kept}");
    }
}

#[test]
fn at_rest_nothing_creeps_in_contact_or_between() {
    let mut plant = plant(gap(2e-3), Model::ElastoPlastic(ElastoPlastic::default()));
    // In the gap the step leaves (ω·h)²/12 = 1e-5 of the coupling's spring; the brushes hold the motor against it.
    plant.motor_friction.model = Model::ElastoPlastic(ElastoPlastic::default());
    let machine = plant.prepare(10, STEP);
    // The motor gives 0.9 of the torque that both contacts hold; the load gets its share through the flank.
    let torque = 0.9 * 0.3;
    let input = MachineInput { servo_voltage: 2.0 * torque / plant.servo.torque_per_volt, ..MachineInput::default() };
    let mut state = MachineState::default();
    let run = |seconds: f64, input: MachineInput<f64>, state: &mut MachineState<f64>| {
        for _ in 0..(seconds / STEP) as u32 {
            machine.step(state, input, STEP);
        }
    };
    run(5.0, input, &mut state);
    let carried = plant.drive.coupling_stiffness * (state.twist - 2e-3);
    let (load_friction, motor_friction) =
        (state.load_resistance - state.lost_torque, state.motor_resistance + state.lost_torque);
    assert!(
        carried > 0.2 && (load_friction - carried).abs() < 1e-9,
        "{carried} through the flank, {load_friction} held"
    );
    assert!((motor_friction + carried - 2.0 * torque).abs() < 1e-9, "{motor_friction} by the brushes");
    let before = state;
    run(20.0, input, &mut state);
    assert!((state.angle - before.angle).abs() <= 1e-9 && (state.twist - before.twist).abs() <= 1e-9, "{state:?}");

    // Within the gap there is no torque between motor and load: the load holds against the external torque alone, at
    // any angle of the motor.
    let mut state = MachineState { twist: 1e-3, ..MachineState::default() };
    let outside = MachineInput { external_torque: torque, ..MachineInput::default() };
    run(5.0, outside, &mut state);
    let before = state;
    run(20.0, outside, &mut state);
    assert!((state.angle - before.angle).abs() <= 1e-9 && (state.twist - before.twist).abs() <= 1e-9, "{state:?}");
    assert!(state.twist.abs() < 2e-3 && (state.load_resistance - state.lost_torque).abs() < 1e-9, "{state:?}");
}

#[test]
fn a_gap_of_no_width_is_a_coupling_that_cannot_pull() {
    let lost = |twist, slip| gap(0.0).lost(&TwoMass::default(), twist, slip);
    // Flanks that press carry as a tight coupling does: nothing is lost.
    assert_eq!((lost(1e-3, 0.5), lost(-1e-3, -0.5), lost(1e-3, -0.5)), (0.0, 0.0, 0.0));
    // They part at once: the whole torque with which the damping would pull is lost.
    let tight = |twist: f64, slip: f64| 60.0 * twist + 9.6e-3 * slip;
    assert_eq!((lost(1e-6, -0.5), lost(-1e-6, 0.5)), (tight(1e-6, -0.5), tight(-1e-6, 0.5)));
    assert_eq!(Backlash::Nothing.lost(&TwoMass::default(), 1e-6, -0.5), 0.0);
}
