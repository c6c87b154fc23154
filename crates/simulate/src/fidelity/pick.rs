//! Automatic selection of a bench's law before rendering.
//!
//! Without a machine for comparison it simulates four: the bench's model with each number changed by its uncertainty to
//! one side or the other. Every law is compared on them as in the benchmark, and the law with the least error is
//! selected. The predicted errors are part of the result.

use std::f64::consts::{FRAC_PI_2, TAU};

use stickslip_core::drive::Servo;
use stickslip_core::friction::{Friction, Position, Ripple};
use stickslip_core::plant::{LoadMotor, Plant};
use stickslip_core::render::Law;
use stickslip_core::sensor::{Accelerometer, CurrentSensor, Encoder, Tacho};

use super::cell::Machine;
use super::law::{LAWS, badness, has_width};
use super::mismatch::{bristles_mut, sliding_mut};
use super::scenario::CLOSED_LOOP;
use super::{Cell, Mismatch, Role, Runs, Score, scores};
use stickslip_base::preset::{LawChoice, Model, Settings};
use stickslip_base::{Error, Preset};

/// The machines around the model.
const AROUND: [Off; 4] = [
    Off { sides: [1.0, 1.0, 1.0], phase: 0.5 },
    Off { sides: [1.0, -1.0, -1.0], phase: 0.5 + FRAC_PI_2 },
    Off { sides: [-1.0, 1.0, -1.0], phase: 0.5 + 2.0 * FRAC_PI_2 },
    Off { sides: [-1.0, -1.0, 1.0], phase: 0.5 + 3.0 * FRAC_PI_2 },
];

/// Seed of the noise of each, not used by any comparison.
const SEEDS: [[u64; 1]; 4] = [[2001], [2002], [2003], [2004]];

/// Deviations of one of them: a design at two levels, in which each pair of uncertainties has the same sign as often as
/// the opposite.
struct Off {
    /// Signs for torque and stiffness of the drive, for friction, and for inertia and bristles.
    sides: [f64; 3],
    /// Phase of the ripple [rad].
    phase: f64,
}

/// A selected law, with the predictions for all laws.
#[derive(Clone, Debug)]
pub struct Pick {
    /// Its stable name.
    pub name: &'static str,
    /// The law.
    pub law: LawChoice<f64>,
    /// Predictions for every law.
    pub predicted: Vec<Prediction>,
}

/// Prediction for a law.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// The law's stable name.
    pub law: &'static str,
    /// The comparisons on each machine around the model.
    around: Vec<Vec<Score>>,
}

impl Prediction {
    /// Mean difference over these machines in a measure, as [`Score::difference`]; NaN if one is unstable or the
    /// measure is not predicted.
    pub fn difference(&self, measure: &str) -> f64 {
        let of = |scores: &Vec<Score>| {
            scores.iter().find(|score| score.measure == measure).map_or(f64::NAN, |score| score.difference)
        };
        self.around.iter().map(of).sum::<f64>() / self.around.len() as f64
    }

    /// Without the counts: one breakaway more or less by chance would outweigh the differences between the laws.
    fn badness(&self) -> f64 {
        self.around.iter().flatten().filter(|score| !score.measure.ends_with("count")).map(badness).sum()
    }
}

/// The law for the model of the machine and the settings of the bench: four minutes of simulated bench time for each
/// law, some seconds on a laptop. The same model gives the same law.
///
/// # Errors
/// Errors of the software's design and of the integrator.
pub fn pick_law(model: &Model<f64>, settings: &Settings<f64>) -> Result<Pick, Error> {
    let carries = |law: &LawChoice<f64>| Preset::bears_arm(law, &settings.arm);
    let laws = || LAWS.iter().filter(|(name, law)| !has_width(name) && carries(law));
    let around = AROUND.each_ref().map(|off| simulated_machine(model, settings, off));
    let mut cells = around.to_vec();
    for (_, law) in laws() {
        let named = Settings { law: *law, ..*settings };
        let designed = crate::rendering_law(model, &named)?;
        cells.extend(around.iter().map(|cell| Cell {
            preset: Preset { bench: named, ..cell.preset },
            law: designed,
            ..cell.clone()
        }));
    }
    // A and A0 of each machine, then B under each law.
    let of = |role| move |(k, cell): (usize, _)| Machine { cell, role, seeds: &SEEDS[k % AROUND.len()][..] };
    let machines: Vec<Machine<'_>> = (around.iter().enumerate().map(of(Role::Desired)))
        .chain(around.iter().enumerate().map(of(Role::Own)))
        .chain(cells.iter().enumerate().skip(AROUND.len()).map(of(Role::Rendered)))
        .collect();
    let runs = Runs::of_all(&machines, CLOSED_LOOP, stickslip_base::parallel::processors(), &|| Ok(()))?;
    let (references, rendered) = runs.split_at(2 * AROUND.len());
    let (a, a0) = references.split_at(AROUND.len());
    let score = |(k, b): (usize, &Runs)| scores(b, &a[k], &a0[k]);
    let predict = |((law, _), b): (&(&'static str, _), &[Runs])| Prediction {
        law,
        around: b.iter().enumerate().map(score).collect(),
    };
    let predicted: Vec<Prediction> = laws().zip(rendered.chunks(AROUND.len())).map(predict).collect();
    let best = predicted.iter().min_by(|a, b| a.badness().total_cmp(&b.badness())).map(|best| best.law);
    let &(name, law) = LAWS.iter().find(|(name, _)| Some(*name) == best).unwrap_or(&LAWS[0]);
    Ok(Pick { name, law, predicted })
}

/// The modelled machine for a simulation, changed by its uncertainty. A still has the desired friction.
fn simulated_machine(model: &Model<f64>, settings: &Settings<f64>, off: &Off) -> Cell {
    let (scaling, doubt) = (&model.scaling, &model.doubt);
    let [of_drive, of_friction, of_load] = off.sides;
    let tacho_lag = (model.drive_lag - model.servo_lag).max(1e-5);
    let mut plant = Plant {
        drive: model.drive,
        motor: model.motor,
        servo: Servo {
            torque_per_volt: scaling.torque_per_volt,
            input_limit: scaling.servo_limit,
            lag: model.servo_lag,
            delay: model.servo_delay,
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
    plant.servo.torque_per_volt *= 1.0 + of_drive * doubt.drive_torque;
    plant.drive.load_inertia *= 1.0 + of_load * doubt.load_inertia;
    plant.drive.coupling_stiffness *= 1.0 + of_drive * doubt.coupling_stiffness;
    let own = &mut plant.screw_friction;
    if let Some(sliding) = sliding_mut(own) {
        sliding.breakaway_torque *= 1.0 + of_friction * doubt.friction;
        sliding.kinetic_torque *= 1.0 + of_friction * doubt.friction;
    }
    if let Some(bristles) = bristles_mut(own) {
        // A quarter less or a third more: the uncertainty is a factor.
        bristles.bristle_stiffness *= libm::pow(1.0 - doubt.bristle_stiffness, -of_load);
    }
    own.position = Position::Ripple(Ripple { amplitude: doubt.ripple, periods: 1.0, phase: off.phase });
    let preset = Preset { plant, model: *model, bench: *settings };
    let desired = settings.desired_bristles.under(settings.desired);
    Cell { preset, desired, mismatch: Mismatch::PERFECT, law: Law::Off, correct: None }
}
