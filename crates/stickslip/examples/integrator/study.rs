//! The cases of the study, and the error of a scheme relative to SciPy's Radau.

use std::f64::consts::TAU;

use stickslip::Error;
use stickslip::integrator::{DriveState, ElasticDrive, Scheme, prepare};
use stickslip_core::block::Block;
use stickslip_core::drive::TwoMass;
use stickslip_core::friction::{DampingVelocity, ElastoPlastic, Fading, Friction, LuGre, Model, Static, Stribeck};
use stickslip_core::plant::{GlidingMachine, MachineInput, MachineState, Plant, PlantInput, PlantState};

/// Time between two samples of a reference [s].
const SAMPLE: f64 = 0.01;

/// A drive under M_M = A·sin(2π·t), with its reference.
pub(crate) struct Case {
    /// Amplitude of the motor torque [N m].
    pub(crate) amplitude: f64,
    /// The product's machine.
    pub(crate) plant: Plant<f64>,
    /// The same for the baselines, if it has one bristle only.
    pub(crate) drive: Option<ElasticDrive<ElastoPlastic<f64>>>,
    /// Load angle [rad] at each sample, by Radau.
    reference: Vec<f64>,
}

fn column(csv: &str, name: &str) -> Vec<f64> {
    let mut lines = csv.lines().map(|line| line.split(','));
    let index = lines.next().and_then(|mut names| names.position(|n| n == name)).expect("the column is in the file");
    lines.map(|mut row| row.nth(index).and_then(|v| v.parse().ok()).expect("a number in each row")).collect()
}

fn elasto_plastic(sliding: Stribeck<f64>, stiffness: f64, damping: f64, fading: Fading<f64>) -> ElastoPlastic<f64> {
    let lugre = LuGre { sliding, bristle_stiffness: stiffness, bristle_damping: damping, fading };
    ElastoPlastic { lugre, ..ElastoPlastic::default() }
}

fn curve(breakaway_torque: f64, kinetic_torque: f64, stribeck_velocity: f64, viscous_friction: f64) -> Stribeck<f64> {
    Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, ..Stribeck::default() }
}

fn friction(model: Model<f64>) -> Friction<f64> {
    Friction { model, ..Friction::default() }
}

/// A machine whose servo follows its input within its lag, and no load motor.
fn machine(mechanics: TwoMass<f64>) -> Plant<f64> {
    let mut plant = Plant { drive: mechanics, ..Plant::default() };
    plant.servo.torque_per_volt = 1.0;
    plant.servo.input_limit = 100.0;
    plant.servo.torque_limit = 100.0;
    plant.servo.supply_voltage = 800.0;
    plant.load_motor.winding.torque_constant = 0.0;
    plant
}

/// The drive of the prototype study with the desired friction, at a stiffness of 300, 3000 or 10000 N·m/rad.
pub(crate) fn prototype(stiffness: f64) -> Case {
    let csv = match stiffness {
        300.0 => include_str!("../../../../tests/reference/integrator/prototype-300.csv"),
        3000.0 => include_str!("../../../../tests/reference/integrator/prototype-3000.csv"),
        10_000.0 => include_str!("../../../../tests/reference/integrator/prototype-10000.csv"),
        _ => panic!("no reference for {stiffness} N m/rad"),
    };
    let mechanics = TwoMass {
        motor_inertia: 8e-4,
        load_inertia: 1.2e-3,
        coupling_stiffness: 120.0,
        coupling_damping: 0.02,
        ..TwoMass::default()
    };
    let sliding = curve(0.45, 0.20, 1.0, 8e-3);
    let bristle = elasto_plastic(sliding, stiffness, 1.0, Fading::Rational(DampingVelocity { velocity: 0.5 }));
    let mut plant = machine(mechanics);
    plant.screw_friction = friction(Model::ElastoPlastic(bristle));
    plant.wheel.preload = 0.0;
    // Without a level, the static model is its viscous part alone.
    plant.motor_friction = friction(Model::Static(Static { sliding: curve(0.0, 0.0, 1.0, 5e-4) }));
    let drive = ElasticDrive { mechanics, motor_viscous: 5e-4, load_viscous: sliding.viscous_friction, bristle };
    Case { amplitude: 0.9, plant, drive: Some(drive), reference: column(csv, "load_angle") }
}

/// The default bench: separate bristles in screw, wheel and motor.
pub(crate) fn clm_bench() -> Case {
    let csv = include_str!("../../../../tests/reference/integrator/clm-bench.csv");
    let mechanics = TwoMass {
        motor_inertia: 4.1e-4,
        load_inertia: 6.0e-4,
        coupling_stiffness: 60.0,
        coupling_damping: 9.6e-3,
        ..TwoMass::default()
    };
    let contact = |sliding, stiffness, damping| {
        let fading = Fading::Gaussian(DampingVelocity { velocity: 1.2 });
        friction(Model::ElastoPlastic(elasto_plastic(sliding, stiffness, damping, fading)))
    };
    let mut plant = machine(mechanics);
    plant.screw_friction = contact(curve(0.060, 0.040, 2.0, 2e-4), 60.0, 0.17);
    plant.wheel.preload = 1.0;
    plant.wheel.friction = contact(curve(0.240, 0.140, 3.23, 0.0), 240.0, 0.68);
    plant.motor_friction = contact(curve(0.010, 0.010, 1.0, 1.6e-5), 10.0, 0.028);
    Case { amplitude: 0.4, plant, drive: None, reference: column(csv, "load_angle") }
}

impl Case {
    /// Largest deviation of the load angle, over its range.
    fn error(&self, angles: &[f64]) -> f64 {
        let (low, high) = self.reference.iter().fold((0.0f64, 0.0f64), |(low, high), v| (low.min(*v), high.max(*v)));
        let worst = angles.iter().zip(&self.reference).fold(0.0f64, |worst, (a, b)| {
            // Not `max` alone: a NaN must not vanish.
            if (a - b).is_nan() { f64::INFINITY } else { worst.max((a - b).abs()) }
        });
        worst / (high - low)
    }

    /// Error of the product's machine with steps of `dt` [s], a divisor of 10 ms.
    pub(crate) fn well_balanced(&self, dt: f64) -> Result<f64, Error> {
        let steps = (SAMPLE / dt).round() as usize;
        let machine = prepare(&self.plant, steps, dt)?;
        let lag = self.plant.servo.lag;
        let mut state = MachineState::default();
        let mut angles = vec![0.0];
        for sample in 1..self.reference.len() {
            for step in 0..steps {
                let t = ((sample - 1) * steps + step) as f64 * dt + 0.5 * dt;
                // M + τ·Ṁ leaves the lag as M; it is held over the step at its middle value.
                let aim = self.amplitude * ((TAU * t).sin() + lag * TAU * (TAU * t).cos());
                machine.step(&mut state, MachineInput { servo_voltage: aim, ..MachineInput::default() }, dt);
            }
            angles.push(state.angle);
        }
        Ok(self.error(&angles))
    }

    /// Error of the product's machine in ticks of 250 µs of ten steps, in which its inputs are held: in short steps only,
    /// and with long steps in steady sliding, as the bench runs it. Relative to steps of 1 µs, whose error is below 1e-9.
    pub(crate) fn in_ticks(&self) -> Result<[f64; 2], Error> {
        const TICK: f64 = 250e-6;
        let machine = |steps: usize| -> Result<_, Error> {
            let step = TICK / steps as f64;
            Ok(GlidingMachine::new(prepare(&self.plant, steps, step)?, step))
        };
        let (exact, product) = (machine(250)?, machine(10)?);
        let mut states = [PlantState::<f64>::default(); 3];
        let (mut worst, mut range) = ([0.0f64; 2], 0.0f64);
        for tick in 0..(2.0 / TICK) as usize {
            let torque = self.amplitude * (TAU * (tick as f64 + 0.5) * TICK).sin();
            let input = PlantInput { servo_voltage: torque, ..PlantInput::default() };
            let servo_voltage = self.plant.outputs.write(torque);
            for (state, steps, machine) in [(0, 250, &exact), (1, 10, &product)] {
                for _ in 0..steps {
                    let held = MachineInput { servo_voltage, ..MachineInput::default() };
                    machine.short.parts.step(&mut states[state].machine, held, TICK / f64::from(steps));
                }
            }
            product.take(10, &mut states[2], input, TICK / 10.0);
            let [exact, rest @ ..] = states.map(|state| state.machine.angle);
            range = range.max(exact.abs());
            worst = std::array::from_fn(|i| worst[i].max((rest[i] - exact).abs()));
        }
        Ok(worst.map(|worst| worst / range))
    }

    /// Error of a baseline with steps of `dt` [s], a divisor of 10 ms; `Err` if it refuses a step.
    pub(crate) fn baseline(&self, scheme: Scheme, dt: f64) -> Result<f64, Error> {
        let drive = self.drive.expect("the case has one bristle");
        let steps = (SAMPLE / dt).round() as usize;
        let torque = |t: f64| self.amplitude * (TAU * t).sin();
        let mut x = DriveState::default();
        let mut angles = vec![0.0];
        for sample in 1..self.reference.len() {
            for step in 0..steps {
                let t = ((sample - 1) * steps + step) as f64 * dt;
                x = drive.step(scheme, &x, [torque(t), torque(t + 0.5 * dt), torque(t + dt)], dt)?;
            }
            angles.push(x[2]);
        }
        Ok(self.error(&angles))
    }
}

/// Creep of the load [rad] in `seconds`, at rest under a mean torque on the motor with a vibration on it [N m];
/// after a settling time of 2 s, sampled at whole periods.
pub(crate) fn creep(
    case: &Case,
    scheme: Option<Scheme>,
    mean: f64,
    vibration: f64,
    frequency: f64,
    seconds: f64,
    dt: f64,
) -> Result<f64, Error> {
    let torque = |t: f64| mean * (t / 0.5).min(1.0) + vibration * (TAU * frequency * t).sin();
    let settled = (2.0 / dt).round() as u64;
    let steps = settled + (seconds / dt).round() as u64;
    let mut start = 0.0;
    if let Some(scheme) = scheme {
        let drive = case.drive.expect("the case has one bristle");
        let mut x = DriveState::default();
        for step in 0..steps {
            if step == settled {
                start = x[2];
            }
            let t = step as f64 * dt;
            x = drive.step(scheme, &x, [torque(t), torque(t + 0.5 * dt), torque(t + dt)], dt)?;
        }
        return Ok((x[2] - start).abs());
    }
    let machine = prepare(&case.plant, 1, dt)?;
    let mut state = MachineState::default();
    let mut before = state;
    for step in 0..steps {
        if step == settled {
            start = state.angle;
        }
        let servo_voltage = torque((step as f64 + 0.5) * dt);
        machine.step(&mut state, MachineInput { servo_voltage, ..MachineInput::default() }, dt);
        // The step is a pure function: once a state recurs under a constant load, the rest repeats (Brent 1980).
        if step > settled && vibration == 0.0 {
            if state == before {
                break;
            }
            if step.is_power_of_two() {
                before = state;
            }
        }
    }
    Ok((state.angle - start).abs())
}
