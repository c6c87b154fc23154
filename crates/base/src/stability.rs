//! Largest stable step of the virtual machine.
//!
//! The step is exact for the linear part and exponential for sliding bristles, but explicit for a stuck bristle and for
//! viscous friction. For a mass J on an elastic bristle, with a = σ₀·h²/J and b = (σ₁ + b_viscous)·h/J, Jury's
//! conditions give the region of stability exactly:
//!
//! ```text
//! a + 4·b < 8,   a·(2 − b) < 4·b² − 4·b + 8,   a³ + 3·a²·b − 6·a·b² − 8·b³ + 32·b > 0
//! ```
//!
//! The triangle a + 2·b ≤ 4 lies within it and shares its corners (4, 0) and (0, 2). The triangle is also valid with a
//! second mass on the coupling, stuck or not, if a step is less than 0.5 rad of the coupling's free vibration, and in
//! sliding: a falling Stribeck branch keeps its physical instability, and no numerical one is added. An elastic arm
//! counts twice. Computed by `tests/reference/integrator/stability.py`; `docs/integrator.md` has the numbers.

use stickslip_core::drive::Arm;
use stickslip_core::fields::{ParameterError, at_most};
use stickslip_core::friction::Friction;
use stickslip_core::plant::Plant;

/// Largest phase of the coupling's free vibration in a step [rad].
const COUPLING_PHASE: f64 = 0.5;

/// Largest torque of a ringing coupling on the load, as a multiple of the motor's torque.
const OVERSHOOT: f64 = 2.0;

/// Stiffness and damping on a mass, each per inertia [1/s², 1/s].
#[derive(Clone, Copy)]
struct Stiff {
    stiffness: f64,
    damping: f64,
}

impl Stiff {
    /// The bristles of a contact that carries up to `load` [N m].
    fn of(friction: &Friction<f64>, preload: f64, load: f64, inertia: f64) -> Self {
        let (stiffness, damping) = friction.stiffest();
        let factor = preload * (1.0 + friction.load.sensitivity * load) / inertia;
        Stiff { stiffness: factor * stiffness, damping: factor * damping }
    }

    fn plus(self, other: Self) -> Self {
        Stiff { stiffness: self.stiffness + other.stiffness, damping: self.damping + other.damping }
    }

    /// The step at which a + 2·b = 4 [s]; very large without stiffness and damping.
    fn largest_step(self) -> f64 {
        let square = self.damping * self.damping + 4.0 * self.stiffness;
        4.0 / (self.damping + (square + f64::MIN_POSITIVE).sqrt())
    }
}

/// The largest stable step [s], and the remedy if it is too small.
fn step_bound(plant: &Plant<f64>) -> (f64, &'static str) {
    let drive = &plant.drive;
    let torque = plant.servo.torque_limit;
    let screw = Stiff::of(&plant.screw_friction, 1.0, OVERSHOOT * torque, drive.load_inertia);
    let wheel = Stiff::of(&plant.wheel.friction, plant.wheel.preload, OVERSHOOT * torque, drive.load_inertia);
    let arm = match plant.arm {
        Arm::Nothing => Stiff { stiffness: 0.0, damping: 0.0 },
        Arm::Elastic(arm) => {
            let twice = 2.0 * (1.0 / arm.inertia + 1.0 / drive.load_inertia);
            Stiff { stiffness: twice * arm.stiffness, damping: twice * arm.damping }
        }
    };
    let brush = Stiff::of(&plant.motor_friction, 1.0, torque, drive.motor_inertia);
    let coupling = drive.coupling_stiffness * (1.0 / drive.motor_inertia + 1.0 / drive.load_inertia);
    let bounds = [
        (
            screw.plus(wheel).plus(arm).largest_step(),
            "The load, stuck on its bristles, would ring and grow: take a smaller step, softer or less damped \
             bristles on screw, wheel and arm, or a larger load inertia.",
        ),
        (
            brush.largest_step(),
            "The motor, stuck on its bristles, would ring and grow: take a smaller step, softer or less damped \
             bristles of the motor, or a larger motor inertia.",
        ),
        (
            COUPLING_PHASE / coupling.sqrt(),
            "The step is too coarse for the vibration of the coupling: take a smaller step or a softer coupling.",
        ),
    ];
    let [first, others @ ..] = bounds;
    others.into_iter().fold(first, |least, bound| if bound.0 < least.0 { bound } else { least })
}

/// The largest step [s] at which no bristle, viscous friction, arm or coupling is numerically unstable.
pub fn largest_step(plant: &Plant<f64>) -> f64 {
    step_bound(plant).0
}

/// `Err` if a step [s] is beyond [`largest_step`], with what bounds it.
pub fn check_step(plant: &Plant<f64>, step: f64) -> Result<(), ParameterError> {
    let (bound, remedy) = step_bound(plant);
    at_most("plant_step", step, bound, remedy).check()
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_core::drive::ElasticArm;
    use stickslip_core::friction::{ElastoPlastic, Load, LuGre, Model, Static, Stribeck};

    const STEP: f64 = 25e-6;

    fn friction(stiffness: f64, damping: f64) -> Friction<f64> {
        let lugre = LuGre { bristle_stiffness: stiffness, bristle_damping: damping, ..LuGre::default() };
        Friction { model: Model::ElastoPlastic(ElastoPlastic { lugre, ..Default::default() }), ..Friction::default() }
    }

    #[test]
    fn the_default_machine_may_take_the_default_step() {
        assert!(check_step(&Plant::default(), STEP).is_ok());
    }

    #[test]
    fn a_bristle_too_stiff_or_too_damped_for_the_step_is_refused() {
        for (stiffness, damping) in [(1e7, 1.0), (300.0, 1e3)] {
            let mut on_load = Plant { screw_friction: friction(stiffness, damping), ..Plant::default() };
            let error = check_step(&on_load, STEP).expect_err("beyond a + 2·b = 4");
            assert_eq!((error.field, error.value, error.bound), ("plant_step", STEP, largest_step(&on_load)));
            assert!(error.remedy.contains("load"), "{}", error.remedy);
            // A step at the bound, a + 2·b = 4 without the bristles of the wheel, is accepted.
            on_load.wheel.preload = 0.0;
            let step = largest_step(&on_load);
            let (stiffness, damping) = on_load.screw_friction.stiffest();
            let reached = (stiffness * step * step + 2.0 * damping * step) / on_load.drive.load_inertia;
            assert!((reached - 4.0).abs() <= 1e-12, "{reached}");
            assert!(check_step(&on_load, step).is_ok());
            let on_motor = Plant { motor_friction: friction(stiffness, damping), ..Plant::default() };
            assert!(check_step(&on_motor, STEP).expect_err("the motor rings").remedy.contains("motor"));
        }
    }

    #[test]
    fn viscous_friction_bounds_the_step_as_well() {
        let sliding = Stribeck { viscous_friction: 50.0, ..Stribeck::default() };
        let friction = Friction { model: Model::Static(Static { sliding }), ..Friction::default() };
        assert!(check_step(&Plant { screw_friction: friction, ..Plant::default() }, STEP).is_err());
    }

    #[test]
    fn load_dependent_friction_counts_with_the_largest_load() {
        let mut plant = Plant { screw_friction: friction(3000.0, 1.0), ..Plant::default() };
        let light = largest_step(&plant);
        plant.screw_friction.load = Load { sensitivity: 10.0 };
        assert!(largest_step(&plant) < 0.1 * light);
    }

    #[test]
    fn a_coupling_or_an_arm_too_stiff_for_the_step_is_refused() {
        let mut plant = Plant::default();
        plant.drive.coupling_stiffness = 5000.0;
        plant.drive.motor_inertia = 1e-6;
        assert!(check_step(&plant, STEP).expect_err("71 000 1/s").remedy.contains("coupling"));
        let arm = ElasticArm { inertia: 1e-8, stiffness: 1e4, damping: 0.0, rigid_inertia: 0.0 };
        let plant = Plant { arm: Arm::Elastic(arm), ..Plant::default() };
        assert!(check_step(&plant, STEP).expect_err("1e6 1/s").remedy.contains("arm"));
    }

    #[test]
    fn a_non_finite_step_is_refused() {
        assert!(check_step(&Plant::default(), f64::NAN).is_err());
    }
}
