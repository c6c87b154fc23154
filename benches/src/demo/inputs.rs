//! The numbers that the peer in C gets: parameters, their changes, and the command of each tick.

use std::error::Error;

use stickslip::bench::tap::{ChangeKind, Changed, Sample, Stream};
use stickslip::{Preset, design};
use stickslip_core::control::PositionController;
use stickslip_core::estimate::MotionObserver;
use stickslip_core::friction::{ElastoPlastic, Fading, Friction, Model, Stribeck};
use stickslip_core::render::{DifferenceTorque, Law};
use stickslip_software::cycle::{Change, Parameters};

/// A run as the peer repeats it: numbers in the order of `bench.h`.
#[derive(Default)]
pub(super) struct Inputs {
    parameters: Vec<f64>,
    segments: Vec<Vec<f64>>,
    commands: Vec<[f64; 6]>,
    /// Signals of each tick that are compared: angle, estimated velocity, torque of the drive, of the load motor.
    pub(super) signals: Vec<[f64; 4]>,
}

impl Inputs {
    /// Reads the stream of a run until its end.
    pub(super) fn read(preset: &Preset<f64>, stream: &mut Stream) -> Result<Self, Box<dyn Error>> {
        let mut software = design::parameters(&preset.model, &preset.bench)?;
        let mut inputs = Inputs { parameters: parameters(preset, &software)?, ..Inputs::default() };
        let (rate, mut preload) = (preset.bench.tick_rate, preset.plant.wheel.preload);
        inputs.segments.push(segment(rate, 0, preload, &software)?);
        let mut changes: Vec<Changed> = Vec::new();
        loop {
            let last = stream.is_closed();
            while let Some(sample) = stream.sample() {
                inputs.tick(&sample);
            }
            changes.extend(std::iter::from_fn(|| stream.change()));
            if last {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        for Changed { cycle, what } in changes {
            match what {
                ChangeKind::Software(Change::Parameters(parameters), None) => software = parameters,
                ChangeKind::Preload(share) => preload = share,
                _ => continue,
            }
            inputs.segments.push(segment(rate, cycle, preload, &software)?);
        }
        // Of several changes in a tick the last one counts.
        inputs.segments.dedup_by(|later, before| {
            let same = later[0] == before[0];
            if same {
                std::mem::swap(later, before);
            }
            same
        });
        Ok(inputs)
    }

    fn tick(&mut self, sample: &Sample) {
        let (frame, command) = (&sample.frame, &sample.frame.command);
        let on = frame.safety.allows_torque();
        let flag = |set: bool| f64::from(u8::from(set && on));
        let zero = frame.signals.measured_angle - frame.angle;
        let setpoint = command.setpoint;
        self.commands.push([
            setpoint.position + zero,
            setpoint.velocity,
            setpoint.acceleration,
            flag(true) * command.added_torque,
            flag(command.control),
            flag(command.render),
        ]);
        let signals = &frame.signals;
        let torques = [signals.commanded_torque, signals.difference_torque];
        self.signals.push([signals.measured_angle, signals.estimated_velocity, torques[0], torques[1]]);
    }

    /// Number of ticks.
    pub(super) fn ticks(&self) -> usize {
        self.commands.len()
    }

    /// The file of the peer.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let sizes = [self.segments.len() as f64, self.commands.len() as f64];
        let numbers = self.parameters.iter().chain(&sizes).chain(self.segments.iter().flatten());
        numbers.chain(self.commands.iter().flatten()).flat_map(|number| number.to_ne_bytes()).collect()
    }
}

/// Parameters of machine and software that do not change in the run.
fn parameters(preset: &Preset<f64>, software: &Parameters<f64>) -> Result<Vec<f64>, Box<dyn Error>> {
    let (plant, tick) = (&preset.plant, &software.tick);
    let (drive, motor, servo) = (&plant.drive, &plant.motor, &plant.servo);
    let (winding, amplifier) = (&plant.load_motor.winding, &plant.load_motor.amplifier);
    let (encoder, tacho, accelerometer) = (&plant.encoder, &plant.tacho, &plant.accelerometer);
    let sensor = &plant.current_sensor;
    let mut all = vec![preset.bench.tick_rate, preset.bench.plant_steps().0 as f64, plant.start_angle];
    all.extend([drive.motor_inertia, drive.load_inertia, drive.coupling_stiffness, drive.coupling_damping]);
    all.extend([drive.screw_lead, motor.torque_constant, motor.resistance]);
    all.extend([servo.torque_per_volt, servo.input_limit, servo.lag, servo.torque_limit, servo.supply_voltage]);
    all.extend([winding.torque_constant, winding.resistance, winding.inductance]);
    all.extend([amplifier.gain, amplifier.supply_voltage, amplifier.current_limit]);
    for friction in [&plant.motor_friction, &plant.screw_friction, &plant.wheel.friction] {
        all.extend(contact(friction)?);
    }
    all.extend([encoder.counts_per_revolution, encoder.counter_range, encoder.index_angle]);
    all.extend([tacho.constant, tacho.ripple, tacho.ripple_periods, tacho.bandwidth, tacho.noise]);
    all.extend([accelerometer.sensitivity, accelerometer.offset, accelerometer.noise_density]);
    all.extend([accelerometer.bandwidth, accelerometer.damping, accelerometer.range]);
    all.extend([sensor.sensitivity, sensor.offset, sensor.noise, sensor.range]);
    all.extend([plant.inputs.bits, plant.inputs.range, plant.inputs.noise, plant.outputs.bits, plant.outputs.range]);
    let scaling = &tick.scaling;
    let MotionObserver::Accelerometer(observer) = &tick.observer else {
        return Err("the peer in C has an accelerometer".into());
    };
    all.extend([scaling.tacho, scaling.accelerometer, scaling.current_sensor]);
    all.extend([scaling.torque_per_volt, scaling.servo_limit]);
    all.extend([observer.screw_ratio, observer.angle_gain, observer.velocity_gain, observer.offset_gain]);
    Ok(all)
}

fn contact(friction: &Friction<f64>) -> Result<[f64; 8], Box<dyn Error>> {
    let Model::ElastoPlastic(ElastoPlastic { lugre, elastic_fraction }) = friction.model else {
        return Err("the peer in C has elasto-plastic contacts alone".into());
    };
    let Fading::Gaussian(fading) = lugre.fading else {
        return Err("the peer in C has the Gaussian fading alone".into());
    };
    let [breakaway, kinetic, velocity, viscous] = curve(&lugre.sliding);
    let (stiffness, damping) = (lugre.bristle_stiffness, lugre.bristle_damping);
    Ok([breakaway, kinetic, velocity, viscous, stiffness, damping, fading.velocity, elastic_fraction])
}

fn curve(curve: &Stribeck<f64>) -> [f64; 4] {
    [curve.breakaway_torque, curve.kinetic_torque, curve.stribeck_velocity, curve.viscous_friction]
}

/// Parameters that are active from a tick on.
fn segment(rate: f64, cycle: u64, preload: f64, software: &Parameters<f64>) -> Result<Vec<f64>, Box<dyn Error>> {
    let tick = &software.tick;
    let PositionController::Cascade(cascade) = tick.control.controller else {
        return Err("the peer in C has the cascade alone".into());
    };
    let law = match tick.law {
        Law::Off => DifferenceTorque { fade_velocity: f64::INFINITY, ..DifferenceTorque::default() },
        Law::Paper(law) => law,
        _ => return Err("the peer in C has the paper's law alone".into()),
    };
    let current = &tick.current;
    let mut all = vec![cycle as f64, preload, cascade.position_gain, cascade.velocity_gain, cascade.integral_gain];
    all.extend([cascade.inertia, cascade.torque_limit, (tick.control_period * rate).round()]);
    all.extend(curve(&law.desired).into_iter().chain(curve(&law.own)));
    all.extend([law.fade_velocity, law.torque_limit, current.proportional_gain, current.integral_gain]);
    all.extend([current.resistance, current.torque_constant, current.current_limit, current.voltage_limit]);
    all.extend([current.amplifier_gain, current.converter_limit]);
    Ok(all)
}
