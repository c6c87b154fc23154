//! Long steps: where they are taken, and their accuracy.

use super::*;
use crate::drive::ElasticArm;
use crate::friction::{ElastoPlastic, Model};
use crate::plant::Gap;
use crate::scalar::Lanes;

const STEP: f64 = 25e-6;
const STEPS: usize = 10;
const TICK: f64 = 250e-6;

fn plant() -> Plant<f64> {
    let mut plant = Plant::<f64>::default();
    for contact in [&mut plant.motor_friction, &mut plant.screw_friction, &mut plant.wheel.friction] {
        let mut model = ElastoPlastic::<f64>::default();
        model.lugre.sliding.breakaway_torque *= 0.3;
        model.lugre.sliding.kinetic_torque *= 0.3;
        contact.model = Model::ElastoPlastic(model);
    }
    plant
}

fn machine(plant: &Plant<f64>, steps: usize) -> GlidingMachine<f64> {
    let step = TICK / steps as f64;
    GlidingMachine::new(plant.prepare(steps, step), step)
}

/// Servo voltage in a tick: up, steady, through a reversal and back to rest, with noise.
fn voltage(tick: usize) -> f64 {
    let time = tick as f64 * TICK;
    let noise = libm::sin(37.0 * tick as f64) + libm::sin(91.7 * tick as f64);
    3.2 * libm::sin(9.0 * time) + 0.01 * noise
}

fn input(tick: usize) -> PlantInput<f64> {
    PlantInput { servo_voltage: voltage(tick), ..PlantInput::default() }
}

fn glides(machine: &GlidingMachine<f64>, state: &PlantState<f64>, tick: usize) -> bool {
    let drive = MachineInput { servo_voltage: voltage(tick), ..MachineInput::default() };
    machine.glide.is_steady(&machine.short.parts, &state.machine, drive)
}

/// Angles after each tick, and the number of ticks in long steps.
fn run(machine: &GlidingMachine<f64>, steps: usize) -> (std::vec::Vec<f64>, usize) {
    let (mut state, mut long) = (PlantState::default(), 0);
    let angle = |tick: usize| {
        long += usize::from(glides(machine, &state, tick));
        machine.take(steps, &mut state, input(tick), TICK / steps as f64);
        state.machine.angle
    };
    ((0..4000).map(angle).collect(), long)
}

#[test]
fn long_steps_are_as_accurate_as_short_ones() {
    let plant = plant();
    let exact = run(&machine(&plant, 500), 500).0;
    let range = exact.iter().fold(0.0f64, |most, angle| most.max(angle.abs()));
    let error = |angles: &[f64]| {
        let worst = angles.iter().zip(&exact).fold(0.0f64, |worst, (a, b)| worst.max((a - b).abs()));
        assert!(range > 1.0 && worst > 0.0, "{range} {worst}");
        worst / range
    };
    let (angles, long) = run(&machine(&plant, STEPS), STEPS);
    let short = GlidingMachine::in_short_steps(plant.prepare(STEPS, STEP), STEP);
    let (error, short) = (error(&angles), error(&run(&short, STEPS).0));
    std::println!("{long} of 4000 ticks; error {error:.1e}, in short steps {short:.1e}");
    assert!(long > 1500, "{long}");
    assert!(error < 1e-6, "{error}");
    assert!(error < 3.0 * short + 1e-7, "{error} {short}");
}

#[test]
fn a_machine_at_rest_in_presliding_or_near_a_reversal_takes_short_steps() {
    let machine = machine(&plant(), STEPS);
    let mut state = PlantState::default();
    assert!(!glides(&machine, &state, 0), "at rest");
    let (mut before, mut reversals) = (0.0, 0);
    for tick in 0..4000 {
        let long = glides(&machine, &state, tick);
        machine.take(STEPS, &mut state, input(tick), STEP);
        let velocity = state.machine.velocity;
        reversals += usize::from(velocity * before < 0.0);
        assert!(!(long && velocity * before <= 0.0), "tick {tick}: a reversal in a long step");
        before = velocity;
    }
    assert!(reversals >= 2, "{reversals}");
    // Steady motion whose bristles still bend.
    let velocity = 0.5;
    state.machine = MachineState { velocity, motor_velocity: velocity, ..MachineState::default() };
    assert!(!glides(&machine, &state, 0), "presliding");
}

#[test]
fn an_arm_play_or_a_stiff_coupling_excludes_long_steps() {
    let count = |plant: &Plant<f64>| run(&machine(plant, STEPS), STEPS).1;
    let arm = Plant { arm: Arm::Elastic(ElasticArm::default()), ..plant() };
    let play = Plant { backlash: Backlash::Gap(Gap::default()), ..plant() };
    let mut stiff = plant();
    // 0.5 rad of vibration in 125 µs are 4000 1/s.
    stiff.drive.coupling_stiffness = 4500.0;
    let mut viscous = plant();
    let Model::ElastoPlastic(model) = &mut viscous.screw_friction.model else { panic!("the model of `plant`") };
    model.lugre.sliding.viscous_friction = 3.0;
    assert_eq!([&arm, &play, &stiff, &viscous].map(count), [0; 4]);
    assert!(count(&plant()) > 0);
}

#[test]
fn a_tick_of_another_length_ends_with_short_steps() {
    let (long, mut state) = (machine(&plant(), STEPS), PlantState::default());
    let mut tick = 0;
    while !glides(&long, &state, tick) {
        long.take(STEPS, &mut state, input(tick), STEP);
        tick += 1;
    }
    for steps in [1, 4, 5, 13] {
        let [mut a, mut b] = [state; 2];
        long.take(steps, &mut a, input(tick), STEP);
        long.short.take(steps, &mut b, input(tick), STEP);
        let way = (a.machine.angle - state.machine.angle).abs();
        assert!((a.machine.angle - b.machine.angle).abs() < 1e-6 * way, "{steps} steps");
        assert_eq!(a.machine == b.machine, steps < 5, "{steps} steps");
    }
}

#[test]
fn lanes_of_long_and_short_steps_have_the_bits_of_each_alone() {
    let one = machine(&plant(), STEPS);
    let lanes = one.map(&mut |value| Lanes([value; 2]));
    let mut alone = [PlantState::default(); 2];
    let mut both = PlantState::<Lanes<f64, 2>>::default();
    let mut mixed = 0;
    for tick in 0..3000 {
        // The second lane is ahead by 125 ms.
        let inputs = [input(tick), input(tick + 500)];
        mixed += usize::from(glides(&one, &alone[0], tick) != glides(&one, &alone[1], tick + 500));
        for (state, input) in alone.iter_mut().zip(inputs) {
            one.take(STEPS, state, input, STEP);
        }
        let servo_voltage = Lanes(inputs.map(|input| input.servo_voltage));
        lanes.take(STEPS, &mut both, PlantInput { servo_voltage, ..PlantInput::default() }, Lanes([STEP; 2]));
        for (lane, state) in alone.iter().enumerate() {
            assert_eq!(both.map(&mut |value| value.0[lane]), *state, "tick {tick}");
        }
    }
    assert!(mixed > 100, "{mixed}");
}

#[test]
fn long_steps_give_the_lag_of_the_tacho_exactly() {
    // A ramp of about 10 rad/s²: the tacho shows the velocity one lag ago.
    let mut plant = Plant::<f64>::default();
    plant.tacho.ripple = 0.0;
    plant.load_motor.winding.torque_constant = 0.0;
    let machine = machine(&plant, STEPS);
    let lag = 1.0 / (TAU * plant.tacho.bandwidth);
    let servo_voltage = plant.outputs.write(10.0 * plant.drive.inertia() / plant.servo.torque_per_volt);
    let drive = MachineInput { servo_voltage, ..MachineInput::default() };
    let turning = MachineState { motor_velocity: 30.0, velocity: 30.0, ..MachineState::default() };
    let mut state = PlantState { machine: turning, ..PlantState::default() };
    let (mut before, mut long) = (0.0, 0);
    for _ in 0..4000 {
        before = state.machine.motor_velocity;
        long += usize::from(machine.glide.is_steady(&machine.short.parts, &state.machine, drive));
        machine.take(STEPS, &mut state, PlantInput { servo_voltage, ..PlantInput::default() }, STEP);
    }
    assert!(long > 3900, "{long}");
    let now = state.machine.motor_velocity;
    let seen = (now - state.pickups.tacho / plant.tacho.constant) / (now - before) * TICK;
    assert!((seen - lag).abs() < 1e-4 * lag, "{seen} instead of {lag}");
}

#[test]
fn the_preload_acts_in_short_and_long_steps() {
    let mut released = machine(&plant(), STEPS);
    released.set_preload(0.0);
    let mut plant = plant();
    plant.wheel.preload = 0.0;
    assert_eq!(released, machine(&plant, STEPS));
}
