//! The drive of W1 and W2, as this program has it.

use std::error::Error;

use stickslip_core::Fields;
use stickslip_core::control::Cascade;
use stickslip_core::drive::TwoMass;
use stickslip_core::fields::Fields as _;
use stickslip_core::friction::{Bristle, DampingVelocity, ElastoPlastic, Fading, LuGre, Release, Stribeck};
use stickslip_core::ideal::IdealAxis;
use stickslip_core::scalar::{Lanes, Scalar};
use stickslip_sweep::{Arithmetic, Plan, SweptFriction, Variant};

use super::peers::Case;

/// Which bristles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bristles {
    /// LuGre with a damping that does not fade, as the workload is defined: not passive, a benchmark only.
    Constant,
    /// The product's default.
    ElastoPlastic,
}

/// LuGre bristles whose damping does not fade.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(super) struct Constant<T> {
    /// The bristles.
    pub(super) lugre: LuGre<T>,
}

impl<T: Scalar> Bristle<T> for Constant<T> {
    #[inline(always)]
    fn sliding(&self, speed: T) -> T {
        self.lugre.sliding(speed)
    }

    #[inline(always)]
    fn release(&self, _deflection: T, _velocity: T, _level: T) -> Release<T> {
        Release::sliding()
    }

    #[inline(always)]
    fn damping(&self, _velocity: T) -> T {
        self.lugre.bristle_damping
    }

    #[inline(always)]
    fn stiffness(&self) -> T {
        self.lugre.bristle_stiffness
    }
}

impl SweptFriction for Constant<f64> {
    type Over<T: Scalar> = Constant<T>;
    type Singles = Lanes<f32, 64>;

    fn over<T: Scalar>(&self) -> Constant<T> {
        self.map(&mut T::of)
    }
}

/// The product's default around the same bristles.
pub(super) fn elasto_plastic(lugre: LuGre<f64>) -> ElastoPlastic<f64> {
    ElastoPlastic { lugre, elastic_fraction: 0.7 }
}

/// W1's case, or W2's thousand: 10 values of each axis.
pub(super) fn cases(one: bool) -> Vec<Case> {
    let point = |index: usize, low: f64, high: f64| low + (high - low) * index as f64 / 9.0;
    let of = |index: usize| Case {
        breakaway: point(index % 10, 0.22, 0.40),
        stribeck: point(index / 10 % 10, 0.5, 3.0),
        gain: point(index / 100, 10.0, 30.0),
        substeps: 0,
    };
    if one {
        vec![Case { breakaway: 0.3, stribeck: 1.5, gain: 20.0, substeps: 0 }]
    } else {
        (0..1000).map(of).collect()
    }
}

/// The same for a sweep.
pub(super) fn variants<B>(cases: &[Case], bristle: impl Fn(LuGre<f64>) -> B) -> Vec<Variant<B, Cascade<f64>>> {
    let of = |case: &Case| {
        let lugre = LuGre {
            sliding: Stribeck {
                breakaway_torque: case.breakaway,
                kinetic_torque: 0.2,
                stribeck_velocity: case.stribeck,
                viscous_friction: 2e-3,
                ..Stribeck::default()
            },
            bristle_stiffness: 5e3,
            bristle_damping: 1.0,
            fading: Fading::Rational(DampingVelocity { velocity: 1.2 }),
        };
        let mechanics = TwoMass {
            motor_inertia: 8e-4,
            load_inertia: 1.2e-3,
            coupling_stiffness: 100.0,
            coupling_damping: 0.01,
            ..TwoMass::default()
        };
        let axis = IdealAxis { mechanics, motor_viscous: 0.0, load_viscous: 2e-3, bristle: bristle(lugre) };
        let law = Cascade {
            position_gain: case.gain,
            velocity_gain: 0.12,
            integral_gain: 3.0,
            inertia: 0.0,
            torque_limit: 2.0,
        };
        Variant { axis, law }
    };
    cases.iter().map(of).collect()
}

/// 0.2 rad at 1 Hz on one core.
pub(super) fn plan(samples: usize, tolerance: f64, arithmetic: Arithmetic) -> Plan {
    let reference = (0..samples).map(|k| 0.2 * (std::f64::consts::TAU * 1e-3 * k as f64).sin()).collect();
    Plan { sample_time: 1e-3, reference, tolerance, arithmetic, threads: 1 }
}

/// Processor time of this thread [s].
pub(super) fn cpu_seconds() -> Result<f64, Box<dyn Error>> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    let nanoseconds: u64 = text.split_whitespace().next().ok_or("an empty schedstat")?.parse()?;
    Ok(nanoseconds as f64 * 1e-9)
}
