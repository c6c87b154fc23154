//! The linearised axis has the response of the virtual bench for small deviations.

mod hunting;
mod learning;
mod network;
mod responses;
mod reversals;

use stickslip::linear::{Operating, StateSpace, axis, axis_under_control, port};
use stickslip::parameters::presets;
use stickslip::{Preset, design, integrator};
use stickslip_core::block::Block as _;
use stickslip_core::friction::Model as FrictionModel;
use stickslip_core::plant::{MachineInput, VirtualMachine};
use stickslip_core::tick::{BenchInput, BenchState, VirtualBench};

/// Torque by which the bench is disturbed [N m].
const SMALL: f64 = 1e-6;

/// A bench equal to its model, without counts, converters and noise.
fn ideal(at: Operating) -> Preset<f64> {
    let mut preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    let Preset { plant, model, bench } = &mut preset;
    plant.start_angle = 0.0;
    plant.wheel.preload = 0.0;
    plant.screw_friction = model.own_bristles.under(model.own);
    if at == Operating::Stuck {
        model.motor_friction.model = FrictionModel::Nothing;
    }
    plant.motor_friction = model.motor_friction;
    plant.tacho.ripple = 0.0;
    plant.accelerometer.offset = 0.0;
    model.servo_lag = plant.servo.lag;
    model.drive_lag = plant.servo.lag + 1.0 / (std::f64::consts::TAU * plant.tacho.bandwidth);
    for counts in [&mut plant.encoder.counts_per_revolution, &mut model.encoder.counts_per_revolution] {
        *counts = 1e15;
    }
    for range in [&mut plant.encoder.counter_range, &mut model.encoder.counter_range] {
        *range = 1e17;
    }
    // The machine reads its tacho at the end of a step, half a step early: 4e-3 of the answer with steps of 25 µs.
    bench.plant_step = 5e-7;
    for converter in [&mut plant.inputs, &mut plant.outputs] {
        converter.bits = 52.0;
    }
    preset
}

/// Outputs of a sample of the bench: angle and tacho.
type Outputs = [f64; 2];

/// The virtual bench about its operating point, under a step of torque at the command or against the load.
fn simulated(preset: &Preset<f64>, at: Operating, [torque, load]: [f64; 2], ticks: usize) -> Vec<Outputs> {
    let (steps, step) = preset.bench.plant_steps();
    let machine = VirtualMachine { parts: integrator::prepare(&preset.plant, steps, step).unwrap() };
    let bench = VirtualBench {
        machine,
        delays: preset.bench.input_delays(&preset.plant).unwrap(),
        tick: design::software(&preset.model, &preset.bench).unwrap(),
    };
    let mut state = BenchState::default();
    let mut holding_torque = 0.0;
    if let Operating::Sliding(velocity) = at {
        let constant = preset.model.load_motor.torque_constant;
        let amplifier_voltage = -constant * velocity / preset.model.load_amplifier.gain;
        // Bristles deflect until they slide.
        for _ in 0..100_000 {
            let input = MachineInput { amplifier_voltage, ..MachineInput::default() };
            bench.machine.parts.step(&mut state.plant.machine, input, step);
            let now = &mut state.plant.machine;
            (now.velocity, now.motor_velocity, now.load_current, now.angle) = (velocity, velocity, 0.0, 0.0);
            now.twist = now.load_resistance / preset.plant.drive.coupling_stiffness;
            holding_torque = now.load_resistance + now.motor_resistance;
            now.motor_torque = holding_torque;
        }
        state.amplifier_voltage = amplifier_voltage;
        state.servo_voltage = holding_torque / preset.model.scaling.torque_per_volt;
        state.delays.servo_voltages.fill(state.servo_voltage);
        state.delays.amplifier_voltages.fill(amplifier_voltage);
        state.tick.observer.velocity = velocity;
        state.plant.pickups.tacho = velocity * preset.plant.tacho.constant;
    }
    state.tick.observer.started = 1.0;
    // The first readings, of the same instant.
    let noise = Default::default();
    state.measurement = bench.machine.take(0, &mut state.plant, stickslip_core::plant::PlantInput::default(), step);
    state.measurement.tacho_voltage = state.tick.observer.velocity * preset.model.scaling.tacho;
    let mut outputs = Vec::new();
    for _ in 0..ticks {
        let mut input = BenchInput { external_torque: -load, noise, ..BenchInput::default() };
        input.order.added_torque = holding_torque + torque;
        let out = bench.step(&mut state, input, preset.bench.tick_time());
        outputs.push([out.measured_angle, out.measured_motor_velocity]);
    }
    outputs
}

/// Largest deviation of the linear answer to a step from that of the bench, over the largest answer.
fn deviation(preset: &Preset<f64>, at: Operating, input: usize, output: usize) -> f64 {
    const TICKS: usize = 200;
    let linear: StateSpace = axis(&preset.model, &preset.bench, at).unwrap();
    let expected = linear.channel(input, output).unwrap().step_response(TICKS, 0.0).unwrap();
    let mut torques = [0.0; 2];
    torques[input] = SMALL;
    let [moved, still] = [torques, [0.0; 2]].map(|torques| simulated(preset, at, torques, TICKS));
    let largest = expected.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    (0..TICKS)
        .map(|k| ((moved[k][output] - still[k][output]) / SMALL - expected[k]).abs() / largest)
        .fold(0.0, f64::max)
}

#[test]
fn sliding_and_stuck_the_linear_axis_is_the_bench_for_small_deviations() {
    for at in [Operating::Stuck, Operating::Sliding(10.0), Operating::Sliding(-2.0)] {
        let preset = ideal(at);
        for input in [port::TORQUE, port::LOAD] {
            for output in [port::ANGLE, port::TACHO] {
                let deviation = deviation(&preset, at, input, output);
                // A deviation of 1e-6 N m bends the friction curve by as little; counts of 1e-15 turns are the rest.
                assert!(deviation < 2e-4, "{at:?}, input {input}, output {output}: {deviation:.1e}");
            }
        }
    }
}

#[test]
fn the_linear_axis_has_the_delays_of_both_drives() {
    for at in [Operating::Stuck, Operating::Sliding(10.0)] {
        let mut preset = ideal(at);
        let Preset { plant, model, .. } = &mut preset;
        // 2.4 and 1.6 ticks.
        (plant.servo.delay, plant.load_motor.amplifier.delay) = (0.6e-3, 0.4e-3);
        (model.servo_delay, model.load_amplifier.delay) = (0.6e-3, 0.4e-3);
        for input in [port::TORQUE, port::LOAD] {
            let deviation = deviation(&preset, at, input, port::TACHO);
            assert!(deviation < 2e-4, "{at:?}, input {input}: {deviation:.1e}");
        }
        preset.model.servo_delay = 0.0;
        let unknown = deviation(&preset, at, port::TORQUE, port::TACHO);
        assert!(unknown > 1e-2, "{at:?}: {unknown:.1e} without the delay in the model");
    }
}

#[test]
fn the_coupling_resonates_at_the_frequency_of_the_formula() {
    let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    let drive = preset.model.drive;
    let formula = (drive.coupling_stiffness * drive.inertia() / (drive.motor_inertia * drive.load_inertia)).sqrt();
    let linear = axis_under_control(&preset.model, &preset.bench, Operating::Sliding(10.0)).unwrap();
    let dt = linear.dt.unwrap();
    let rates = linear.poles().unwrap().into_iter().map(|pole| pole.im.atan2(pole.re) / dt);
    let nearest = rates.map(|rate| (rate / formula - 1.0).abs()).fold(f64::INFINITY, f64::min);
    // The load motor's current and friction pull at it a little.
    assert!(nearest < 0.02, "{nearest}");
}

#[test]
fn a_load_that_creeps_too_slowly_to_bend_its_bristles_is_refused() {
    let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    let refused = axis(&preset.model, &preset.bench, Operating::Sliding(1e-7)).unwrap_err().to_string();
    assert!(refused.contains("slides instead of creeping"), "{refused}");
}
