//! Differences between the machine and the software's model.

use stickslip_core::friction::{Decay, Friction, LuGre, Model, Position, Ripple, Stribeck};
use stickslip_core::plant::{Backlash, Gap, MotorRipple, Plant, RippledMotor};

/// A difference of the machine from the unchanged model.
#[derive(Clone, Copy, Debug)]
pub struct Mismatch {
    /// Its stable name.
    pub name: &'static str,
    /// Changes the machine: in A, A0 and B alike.
    pub(super) machine: fn(&mut Plant<f64>),
    /// Changes a contact of the machine's own friction: in A0 and B, for A has the desired friction instead.
    pub(super) own: fn(&mut Friction<f64>),
}

impl Mismatch {
    /// The mismatch of a name.
    pub fn find(name: &str) -> Option<Mismatch> {
        MISMATCHES.iter().copied().find(|mismatch| mismatch.name == name)
    }

    /// None.
    pub const PERFECT: Mismatch = machine("perfect", |_| {});

    /// Residual errors after a careful identification: friction 3 % higher with a 5 % ripple at the pitch, softer
    /// bristles, half a percent of drive torque.
    pub const REAL: Mismatch = Mismatch {
        name: "real",
        machine: |plant| plant.servo.torque_per_volt *= 1.005,
        own: |friction| {
            raise(friction, 1.03);
            ripple(friction, 0.05);
            soften(friction, 0.7);
        },
    };
}

/// All of them.
pub const MISMATCHES: &[Mismatch] = &[
    Mismatch::PERFECT,
    Mismatch::REAL,
    own("own+10%", |friction| raise(friction, 1.1)),
    own("own-10%", |friction| raise(friction, 0.9)),
    own("own+20%", |friction| raise(friction, 1.2)),
    own("own-20%", |friction| raise(friction, 0.8)),
    own("ripple10%", |friction| ripple(friction, 0.1)),
    own("gaussian", |friction| {
        if let Some(sliding) = sliding_mut(friction) {
            sliding.decay = Decay::Gaussian;
        }
    }),
    own("stiffness-30%", |friction| soften(friction, 0.7)),
    machine("kt+2%", |plant| plant.servo.torque_per_volt *= 1.02),
    machine("kt-2%", |plant| plant.servo.torque_per_volt *= 0.98),
    machine("inertia+5%", |plant| plant.drive.load_inertia *= 1.05),
    machine("inertia-5%", |plant| plant.drive.load_inertia *= 0.95),
    machine("coupling+20%", |plant| plant.drive.coupling_stiffness *= 1.2),
    machine("coupling-20%", |plant| plant.drive.coupling_stiffness *= 0.8),
    machine("noise_x4", |plant| {
        plant.accelerometer.noise_density *= 4.0;
        plant.tacho.noise *= 4.0;
        plant.current_sensor.noise *= 4.0;
    }),
    machine("offset_drift", |plant| {
        // Offsets of `clm-real`; the drift of 2 mg/K with a quick warm-up of 1 K in 2 s.
        plant.accelerometer.offset = 0.45;
        plant.accelerometer.drift = 0.01;
        plant.current_sensor.offset = 0.02;
    }),
    machine("load_motor_ripple", |plant| plant.load_motor.ripple = MotorRipple::Rippled(RippledMotor::default())),
    // Of the coupling: 4 mrad of play, six counts of the encoder.
    machine("backlash", |plant| plant.backlash = Backlash::Gap(Gap { half_width: 2e-3 })),
    // A plain thread on a busy computer: 4 % of a tick at 4 kHz.
    machine("jitter", |plant| plant.tick_jitter = 10e-6),
];

const fn own(name: &'static str, own: fn(&mut Friction<f64>)) -> Mismatch {
    Mismatch { name, machine: |_| {}, own }
}

const fn machine(name: &'static str, machine: fn(&mut Plant<f64>)) -> Mismatch {
    Mismatch { name, machine, own: |_| {} }
}

/// Breakaway and kinetic torque by a factor; viscous friction is unchanged.
fn raise(friction: &mut Friction<f64>, factor: f64) {
    if let Some(sliding) = sliding_mut(friction) {
        sliding.breakaway_torque *= factor;
        sliding.kinetic_torque *= factor;
    }
}

fn soften(friction: &mut Friction<f64>, factor: f64) {
    if let Some(bristles) = bristles_mut(friction) {
        bristles.bristle_stiffness *= factor;
    }
}

fn ripple(friction: &mut Friction<f64>, amplitude: f64) {
    friction.position = Position::Ripple(Ripple { amplitude, periods: 1.0, phase: 0.0 });
}

/// The sliding curve of a friction, if it has one.
pub fn sliding_mut(friction: &mut Friction<f64>) -> Option<&mut Stribeck<f64>> {
    match &mut friction.model {
        Model::Static(model) => Some(&mut model.sliding),
        Model::Lugre(model) => Some(&mut model.sliding),
        Model::ElastoPlastic(model) => Some(&mut model.lugre.sliding),
        Model::MaxwellSlip(model) => Some(&mut model.sliding),
        Model::Nothing | Model::Dahl(_) => None,
    }
}

/// The bristles of a friction, if it has bristles with a Stribeck curve.
pub(super) fn bristles_mut(friction: &mut Friction<f64>) -> Option<&mut LuGre<f64>> {
    match &mut friction.model {
        Model::Lugre(model) => Some(model),
        Model::ElastoPlastic(model) => Some(&mut model.lugre),
        Model::Nothing | Model::Static(_) | Model::Dahl(_) | Model::MaxwellSlip(_) => None,
    }
}
