//! The law that a bench picks by itself, before it renders.
//!
//! It has no machine to compare with, so it simulates one: the machine that it believes in, off by what may be wrong with
//! that belief. On it every law is compared as the benchmark does, and the one with the least error is taken. The
//! errors that this predicts are part of the answer.

use std::f64::consts::TAU;

use stickslip_core::drive::Servo;
use stickslip_core::friction::{Friction, Position, Ripple};
use stickslip_core::plant::{LoadMotor, Plant};
use stickslip_core::render::Law;
use stickslip_core::sensor::{Accelerometer, CurrentSensor, Encoder, Tacho};

use super::bed::{bristles_mut, sliding_mut};
use super::law::{LAWS, badness, has_width};
use super::plan::processors;
use super::scenario::CLOSED_LOOP;
use super::{Cell, Mismatch, Role, Runs, Score, scores};
use crate::preset::{LawChoice, Model, Settings};
use crate::{Error, Preset, Watch, design};

/// Seeds of the simulations, which no comparison uses.
const SEEDS: [u64; 2] = [2001, 2002];

/// What may be wrong with a belief that was measured well: friction lower by 4 % with a ripple of 4 % at the pitch,
/// bristles softer by a quarter, drive torque 0.4 % less.
const DOUBT: Mismatch = Mismatch {
    name: "doubt",
    machine: |plant| plant.servo.torque_per_volt *= 0.996,
    own: |friction| {
        if let Some(sliding) = sliding_mut(friction) {
            sliding.breakaway_torque *= 0.96;
            sliding.kinetic_torque *= 0.96;
        }
        if let Some(bristles) = bristles_mut(friction) {
            bristles.bristle_stiffness *= 0.75;
        }
        friction.position = Position::Ripple(Ripple { amplitude: 0.04, periods: 1.0, phase: 2.0 });
    },
};

/// A law that was picked, and why.
#[derive(Clone, Debug)]
pub struct Pick {
    /// Its stable name.
    pub name: &'static str,
    /// The law.
    pub law: LawChoice<f64>,
    /// What every law is predicted to do, by name.
    pub predicted: Vec<(&'static str, Vec<Score>)>,
}

/// The law for what is believed of the machine and how the bench runs: two minutes of simulated bench time a law, a few
/// seconds on a laptop. The same belief gives the same law.
///
/// # Errors
/// What the design of the software and the integrator refuse.
pub fn pick_law(model: &Model<f64>, settings: &Settings<f64>) -> Result<Pick, Error> {
    let watch = Watch::silent();
    let cell = believed(model, settings);
    let candidates: Vec<_> = LAWS.iter().filter(|(name, _)| !has_width(name)).collect();
    let simulate = |cell: &Cell, role| Runs::simulate(cell, role, CLOSED_LOOP, &SEEDS, processors(), &watch);
    let (a, a0) = (simulate(&cell, Role::Desired)?, simulate(&cell, Role::Own)?);
    let mut predicted = Vec::new();
    for (name, law) in candidates {
        let mut cell = cell.clone();
        cell.preset.bench.law = *law;
        cell.law = design::rendering_law(model, &cell.preset.bench)?;
        predicted.push((*name, scores(&simulate(&cell, Role::Rendered)?, &a, &a0)));
    }
    let sum = |scores: &[Score]| scores.iter().map(badness).sum::<f64>();
    let best = predicted.iter().min_by(|(_, a), (_, b)| sum(a).total_cmp(&sum(b))).map(|(name, _)| *name);
    let &(name, law) = LAWS.iter().find(|(name, _)| Some(*name) == best).unwrap_or(&LAWS[0]);
    Ok(Pick { name, law, predicted })
}

/// The machine that is believed in, as one to simulate, off by [`DOUBT`].
fn believed(model: &Model<f64>, settings: &Settings<f64>) -> Cell {
    let scaling = &model.scaling;
    let tacho_lag = (model.drive_lag - model.servo_lag).max(1e-5);
    let mut plant = Plant {
        drive: model.drive,
        motor: model.motor,
        servo: Servo {
            torque_per_volt: scaling.torque_per_volt,
            input_limit: scaling.servo_limit,
            lag: model.servo_lag,
            torque_limit: scaling.torque_per_volt * scaling.servo_limit,
            ..Servo::default()
        },
        motor_friction: model.motor_friction,
        screw_friction: model.own_bristles.under(model.own),
        load_motor: LoadMotor { winding: model.load_motor, amplifier: model.load_amplifier, ..LoadMotor::default() },
        encoder: Encoder { counts_per_revolution: model.encoder.counts_per_revolution, ..Encoder::default() },
        tacho: Tacho {
            constant: scaling.tacho,
            bandwidth: 1.0 / (TAU * tacho_lag),
            noise: model.tacho_noise,
            ripple: model.tacho_ripple,
            ..Tacho::default()
        },
        accelerometer: Accelerometer {
            sensitivity: scaling.accelerometer,
            noise_density: model.accelerometer_noise,
            bandwidth: model.accelerometer_bandwidth,
            damping: model.accelerometer_damping,
            ..Accelerometer::default()
        },
        current_sensor: CurrentSensor { sensitivity: scaling.current_sensor, ..CurrentSensor::default() },
        ..Plant::default()
    };
    plant.wheel.preload = 0.0;
    plant.wheel.friction = Friction::default();
    let preset = Preset { plant, model: *model, bench: *settings };
    let desired = settings.desired_bristles.under(settings.desired);
    Cell { preset, desired, mismatch: DOUBT, law: Law::Off }
}
