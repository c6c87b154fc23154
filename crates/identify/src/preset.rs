//! The identified axis as a preset of the virtual bench: everything on the screw, no wheel, no load motor.

use std::f64::consts::{PI, TAU};

use stickslip_core::control::Cascade;
use stickslip_core::friction::{DampingVelocity, Decay, Fading, LuGre, Model, Static, Stribeck};

use super::Identification;
use super::axis::AxisModel;
use crate::machine::{Controller, Machine};
use stickslip_base::units::Dimension;
use stickslip_base::{ControllerChoice, Preset};

/// Lead for a linear axis without one: only the referred numbers depend on it [m].
const ANY_LEAD: f64 = 10e-3;
/// Natural frequency of a stiff coupling, with which the axis moves as one mass [Hz], and its usual damping (share of
/// critical damping).
const RIGID: (f64, f64) = (675.0, 0.04);
/// Closed velocity loop of an unknown controller [1/s].
const BANDWIDTH: f64 = 150.0;

/// The preset. An axis outside the ranges of the virtual bench is reported by the check of the preset.
pub(super) fn preset(result: &Identification, machine: &Machine) -> Preset<f64> {
    let mut preset = Preset::default();
    let model = &result.best().model;
    let (lead, metres) = match result.axis.position() {
        Dimension::Length => machine.screw_lead.map_or((ANY_LEAD, ANY_LEAD / TAU), |lead| (lead, lead / TAU)),
        _ => (preset.model.drive.screw_lead, 1.0),
    };
    let inertia = model.inertia * metres * metres;
    let (motor, load) = (inertia / 3.0, inertia * 2.0 / 3.0);
    let drive = &mut preset.plant.drive;
    (drive.motor_inertia, drive.load_inertia, drive.screw_lead) = (motor, load, lead);
    let omega = 2.0 * PI * RIGID.0;
    drive.coupling_stiffness = (omega * omega * motor * load / inertia).clamp(1.0, 5000.0);
    drive.coupling_damping = (2.0 * RIGID.1 * drive.coupling_stiffness / omega).min(0.1);
    preset.model.drive = preset.plant.drive;

    let (own, asymmetry) = friction(&mut preset, model, metres);
    servo(&mut preset, result, machine, metres);
    let strongest = own.breakaway_torque.max(own.kinetic_torque) * (1.0 + asymmetry.abs());
    let torque_limit = preset.plant.servo.torque_limit.max(strongest);
    let (position_gain, velocity_gain, integral_gain, feedforward) = match machine.controller {
        Controller::Cascade(cascade) if machine.gain > 0.0 => {
            (cascade.position_gain, cascade.velocity_gain * machine.gain * metres * metres, 0.0, 0.0)
        }
        _ => (0.1 * BANDWIDTH, BANDWIDTH * inertia, 20.0 * BANDWIDTH * inertia, inertia),
    };
    preset.bench.controller = ControllerChoice::Cascade(Cascade {
        position_gain,
        velocity_gain,
        integral_gain,
        inertia: feedforward,
        torque_limit,
    });
    preset.bench.tick_rate = (1.0 / machine.sampling_period).round().max(1000.0);
    preset.bench.desired = own;
    preset.model.own = own;

    let ends = result.motion.position.iter().fold([0.0f64; 2], |[low, high], q| [low.min(*q), high.max(*q)]);
    let room = (ends[1] - ends[0]) * 0.1;
    let safety = &mut preset.bench.safety;
    [safety.lower_end, safety.upper_end] = [(ends[0] - room) / metres, (ends[1] + room) / metres];
    preset
}

/// Friction of both directions as mean and asymmetry. Returns the mean curve and the asymmetry.
fn friction(preset: &mut Preset<f64>, model: &AxisModel<f64>, metres: f64) -> (Stribeck<f64>, f64) {
    let (p, n) = (&model.positive, &model.negative);
    let mean = |value: fn(&Stribeck<f64>) -> f64| 0.5 * (value(p) + value(n));
    let share = |value: fn(&Stribeck<f64>) -> f64| (value(p) - value(n)) / (value(p) + value(n));
    let own = Stribeck {
        breakaway_torque: mean(|s| s.breakaway_torque) * metres,
        kinetic_torque: mean(|s| s.kinetic_torque) * metres,
        stribeck_velocity: mean(|s| s.stribeck_velocity) / metres,
        viscous_friction: mean(|s| s.viscous_friction) * metres * metres,
        decay: Decay::Exponential,
    };
    let asymmetry = share(|s| s.kinetic_torque);
    let friction = &mut preset.plant.screw_friction;
    friction.direction.asymmetry = asymmetry;
    friction.direction.viscous_asymmetry = share(|s| s.viscous_friction);
    friction.direction.offset = model.offset * metres;
    friction.model = match &model.bristles {
        None => Model::Static(Static { sliding: own }),
        Some(bristles) => {
            let mut lugre = LuGre {
                sliding: own,
                bristle_stiffness: bristles.stiffness * metres * metres,
                bristle_damping: bristles.damping * metres * metres,
                fading: Fading::Rational(DampingVelocity { velocity: bristles.damping_velocity / metres }),
            };
            // Where directions differ, the weaker one is the limit.
            let passive = lugre.passive_damping_velocity() * (1.0 - asymmetry.abs());
            let velocity = (bristles.damping_velocity / metres).min(passive);
            lugre.fading = Fading::Rational(DampingVelocity { velocity });
            Model::Lugre(lugre)
        }
    };
    preset.plant.wheel.preload = 0.0;
    preset.plant.motor_friction.model = Model::Nothing;
    preset.model.motor_friction.model = Model::Nothing;
    preset.plant.load_motor.winding.torque_constant = 0.0;
    preset.model.load_motor.torque_constant = 0.0;
    (own, asymmetry)
}

/// Servo amplifier and encoder. A drive whose command is not a voltage gets 10 V for the largest recorded force.
fn servo(preset: &mut Preset<f64>, result: &Identification, machine: &Machine, metres: f64) {
    let volts = machine.drive.command == Dimension::Voltage;
    let limit = match machine.controller {
        Controller::Cascade(cascade) if volts => cascade.limit,
        _ => 10.0,
    };
    let largest = result.motion.force.iter().fold(0.0f64, |most, f| most.max((f + result.motion.offset).abs()));
    let servo = &mut preset.plant.servo;
    servo.torque_per_volt = if volts { machine.gain.abs() * metres } else { largest * metres / limit };
    servo.input_limit = limit;
    servo.torque_limit = servo.torque_per_volt * limit;
    servo.lag = result.best().model.lag.clamp(2e-5, 2e-2);
    preset.model.scaling.torque_per_volt = servo.torque_per_volt;
    preset.model.scaling.servo_limit = limit;
    if let Some(grid) = machine.encoder_grid {
        let counts = (TAU * metres / grid).round();
        preset.plant.encoder.counts_per_revolution = counts;
        preset.model.encoder.counts_per_revolution = counts;
    }
}
