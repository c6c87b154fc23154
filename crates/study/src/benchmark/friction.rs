//! Compensated frictions, and errors of the modelled friction.

use stickslip_core::friction::{Friction, Position, Ripple, Stribeck};

use stickslip_base::preset::Preset;

/// A friction, as shares of the drive's torque, so that it scales with the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionCase {
    /// Stable name.
    pub name: &'static str,
    /// Breakaway and kinetic torque over the largest torque of the drive, Stribeck velocity [rad/s], viscous friction over
    /// that torque [s/rad].
    shares: [f64; 4],
}

/// All frictions.
pub const FRICTIONS: [FrictionCase; 3] = [
    FrictionCase { name: "mild", shares: [0.225, 0.18, 4.0, 1e-3] },
    FrictionCase { name: "nominal", shares: [0.225, 0.10, 1.0, 4e-3] },
    FrictionCase { name: "vicious", shares: [0.225, 0.10, 0.2, 1e-3] },
];

impl FrictionCase {
    /// The friction of a bench whose drive has this largest torque [N m].
    pub(super) fn of_curve(name: &'static str, curve: &Stribeck<f64>, torque: f64) -> Self {
        let Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, .. } = *curve;
        let shares = [breakaway_torque / torque, kinetic_torque / torque, stribeck_velocity, viscous_friction / torque];
        FrictionCase { name, shares }
    }

    /// The curve on a drive with this largest torque [N m].
    pub fn curve(&self, torque: f64) -> Stribeck<f64> {
        let [breakaway, kinetic, stribeck_velocity, viscous] = self.shares;
        Stribeck {
            breakaway_torque: breakaway * torque,
            kinetic_torque: kinetic * torque,
            stribeck_velocity,
            viscous_friction: viscous * torque,
            ..Stribeck::default()
        }
    }

    /// A machine with this friction and an exact model of it.
    pub(super) fn on(&self, preset: &Preset<f64>) -> Preset<f64> {
        let mut preset = *preset;
        let curve = self.curve(preset.bench.controller.torque_limit());
        preset.model.own = curve;
        let plant = &mut preset.plant;
        plant.screw_friction = preset.model.own_bristles.under(curve);
        plant.wheel.preload = 0.0;
        plant.wheel.friction = Friction::default();
        plant.start_angle = 0.0;
        preset
    }
}

/// A difference between machine and model.
#[derive(Clone, Copy, Debug)]
pub struct Variation {
    /// Stable name.
    pub name: &'static str,
    change: fn(&mut Preset<f64>),
}

/// All variations; the first is none.
pub const VARIATIONS: [Variation; 9] = [
    Variation { name: "exact model", change: |_| {} },
    Variation { name: "model friction −30 %", change: |preset| scale_model(preset, 0.7) },
    Variation { name: "model friction +30 %", change: |preset| scale_model(preset, 1.3) },
    Variation {
        name: "ripple 10 %",
        change: |preset| {
            let ripple = Ripple { amplitude: 0.1, periods: 1.0, phase: 0.0 };
            preset.plant.screw_friction.position = Position::Ripple(ripple);
        },
    },
    Variation {
        name: "under load +20 %",
        change: |preset| {
            // 20 % more friction where the coupling carries all of the drive's torque.
            preset.plant.screw_friction.load.sensitivity = 0.2 / preset.bench.controller.torque_limit();
        },
    },
    Variation { name: "load inertia −20 %", change: |preset| preset.plant.drive.load_inertia *= 0.8 },
    Variation { name: "load inertia +25 %", change: |preset| preset.plant.drive.load_inertia *= 1.25 },
    Variation { name: "coupling −20 %", change: |preset| preset.plant.drive.coupling_stiffness *= 0.8 },
    Variation { name: "coupling +25 %", change: |preset| preset.plant.drive.coupling_stiffness *= 1.25 },
];

impl Variation {
    /// A preset with this difference.
    pub(super) fn of(&self, preset: &Preset<f64>) -> Preset<f64> {
        let mut preset = *preset;
        (self.change)(&mut preset);
        preset
    }
}

fn scale_model(preset: &mut Preset<f64>, factor: f64) {
    preset.model.own.breakaway_torque *= factor;
    preset.model.own.kinetic_torque *= factor;
}
