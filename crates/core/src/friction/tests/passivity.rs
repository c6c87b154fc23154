//! Passivity: from rest, the work ∫ M dφ is not negative for any motion.

use core::f64::consts::{FRAC_1_SQRT_2, TAU};

use proptest::array::uniform3;

use super::*;
use crate::fields::{Field, Fields, Laws, ParameterError, Relation};

/// Elastic energy of the bristles [J], without direction, position and load.
fn stored(model: &Model<f64>, memory: &Memory<f64>) -> f64 {
    springs(model, memory).map(|(stiffness, deflection)| 0.5 * stiffness * deflection * deflection).sum()
}

/// Stiffness [N m/rad] and deflection [rad] of each spring in a contact.
fn springs(model: &Model<f64>, memory: &Memory<f64>) -> impl Iterator<Item = (f64, f64)> {
    let stiffness = match model {
        Model::Nothing | Model::Static(_) => 0.0,
        Model::Dahl(model) => model.bristle_stiffness,
        Model::Lugre(model) => model.bristle_stiffness,
        Model::ElastoPlastic(model) => model.lugre.bristle_stiffness,
        Model::MaxwellSlip(model) => return model.stiffnesses().into_iter().zip(memory.elements),
    };
    [stiffness, 0.0, 0.0, 0.0].into_iter().zip([memory.deflection, 0.0, 0.0, 0.0])
}

/// Harmonics of a periodic motion: sine and cosine of each.
type Harmonics = ([f64; 3], [f64; 3]);

fn harmonics() -> impl Strategy<Value = Harmonics> {
    (uniform3(-1.0..1.0), uniform3(-1.0..1.0))
}

fn angle((sines, cosines): &Harmonics, phase: f64) -> f64 {
    let harmonic = |k: usize| {
        let phase = phase * (k + 1) as f64;
        sines[k] * phase.sin() + cosines[k] * (phase.cos() - 1.0)
    };
    (0..3).map(harmonic).sum()
}

proptest! {
    #[test]
    fn in_every_step_the_bristles_take_at_least_what_they_store_at_any_age(
        model in model(1e-3, 1e7), rest in prop_oneof![Just(Rest::Constant), rest()], start in -1.0..1.0f64, dt in decades(1e-9, 1.0),
        velocities in vec((decades(1e-6, 1e3), any::<bool>()), 1..30),
    ) {
        let friction = Friction { rest, ..plain(model) };
        let mut memory = Memory::bent(start * steady_deflection(&model, 0.0));
        for (speed, forward) in velocities {
            let velocity = if forward { speed } else { -speed };
            let before = stored(&model, &memory);
            let torque = midpoint(&friction, &mut memory, driven(velocity), dt);
            // The torque is the mean over the step: this is the work, not an approximation.
            let work = torque * velocity * dt;
            let after = stored(&model, &memory);
            let rounding = 1e-12 * (work.abs() + after + before);
            prop_assert!(work - (after - before) >= -rounding, "{work} J for {} J", after - before);
        }
    }

    #[test]
    fn closed_cycles_of_any_size_take_energy_whatever_friction_depends_on(
        friction in friction(1.0, 1e6), cycle in harmonics(), size in decades(1e-2, 1e3), period in decades(1e-3, 10.0),
        load in -1.0..1.0f64,
    ) {
        let scale = match steady_deflection(&friction.model, 0.0) {
            0.0 => size * 1e-3,
            steady => (size * steady).min(1.0),
        };
        let (cycles, steps) = (10, 400);
        let dt = period / f64::from(steps);
        let (mut memory, mut work, mut turnover, mut swings) = (Memory::default(), 0.0, 0.0, 0.0);
        // The factor of the angle is taken in the middle of a step: f·z is off by f′·z′/12 of the way squared.
        let slope = if let Position::Ripple(ripple) = friction.position { ripple.amplitude * ripple.periods } else { 0.0 };
        let slope = slope * friction.stiffest().0 * (1.0 + friction.load.sensitivity * load.abs());
        let way = |step: i32| scale * angle(&cycle, TAU * f64::from(step % steps) / f64::from(steps));
        for step in 0..cycles * steps {
            let (from, to) = (way(step), way(step + 1));
            let contact = Contact { angle: 0.5 * (from + to), load, ..driven((to - from) / dt) };
            let before = memory;
            let torque = midpoint(&friction, &mut memory, contact, dt);
            work += torque * (to - from);
            turnover += (torque * (to - from)).abs();
            swings += slope * (to - from).abs().powi(3) / 12.0;
            // Where a bristle changes its side, the factor of one side holds for the whole step: at most a quarter of
            // the energy of the step has the wrong factor. Ripple (below 1.9), load and temperature multiply it.
            let factor = 1.9 * (1.0 + friction.load.sensitivity * load.abs()) * friction.temperature.factors().0;
            for ((stiffness, from), (_, to)) in springs(&friction.model, &before).zip(springs(&friction.model, &memory)) {
                if from * to < 0.0 {
                    let energy = 0.5 * stiffness * (to - from).powi(2);
                    swings += 0.5 * factor * friction.direction.asymmetry.abs() * energy;
                }
            }
        }
        // The rest is the rounding of the sums.
        prop_assert!(work >= -1e-9 * turnover - swings, "{work} J of {turnover} J");
    }

    #[test]
    fn the_passive_bound_is_where_the_damping_reaches_four_times_the_smallest_level(
        model in lugre(decades(1e-3, 1e7), Just(1.0)),
    ) {
        let (Fading::Gaussian(fading) | Fading::Rational(fading)) = model.fading;
        // 4000 points per factor e of the speed: the peak is flat, and the squared distance to the next point is 1e-8.
        let largest = (-12_000..12_000)
            .map(|i| f64::exp(f64::from(i) / 4000.0) * fading.velocity)
            .map(|speed| model.damping(speed) * speed)
            .fold(0.0, f64::max);
        let expected = 4.0 * model.sliding.smallest_level();
        prop_assert!((largest / expected - 1.0).abs() <= 1e-7, "{largest} instead of {expected}");
    }
}

/// Violated laws of a parameter set.
#[derive(Default)]
struct Objections(Vec<ParameterError>);

impl Laws<f64> for Objections {
    fn enter(&mut self, _field: &'static Field) {}
    fn leave(&mut self) {}
    fn state(&mut self, law: Relation<f64>) {
        self.0.extend(law.check().err());
    }
}

fn objections(model: &LuGre<f64>) -> Vec<ParameterError> {
    let mut objections = Objections::default();
    model.laws(&mut objections);
    objections.0
}

/// Work [J] of ten cycles from rest: the bristles are bent slowly up to the breakaway torque, then moved on at `speed`;
/// then the same backwards.
fn bursts(model: LuGre<f64>, speed: f64) -> f64 {
    let friction = plain(Model::Lugre(model));
    let bend = model.sliding.breakaway_torque / model.bristle_stiffness;
    let (mut memory, mut work) = (Memory::default(), 0.0);
    for cycle in 0..20 {
        let side = if cycle % 2 == 0 { 1.0 } else { -1.0 };
        for (way, speed) in [(4.0 * bend, 1e-3), (bend, speed)] {
            for _ in 0..100 {
                let step = way / 100.0;
                let probe = memory.deflection;
                let torque = friction.correct(&mut memory, probe, driven(side * speed), step / speed);
                work += torque * side * step;
            }
        }
    }
    work
}

#[test]
fn beyond_its_passive_bound_lugre_makes_energy_and_is_refused() {
    type Shape = fn(DampingVelocity<f64>) -> Fading<f64>;
    // σ₁(Ω)·Ω peaks at v_c/√2 in the Gaussian form, at v_c in the rational one.
    for (fading, peak) in [(Fading::Gaussian as Shape, FRAC_1_SQRT_2), (Fading::Rational, 1.0)] {
        let model = |velocity| LuGre { fading: fading(DampingVelocity { velocity }), ..LuGre::default() };
        let bound = model(1.0).passive_damping_velocity();
        assert!(bursts(model(bound), peak * bound) > 0.0 && objections(&model(bound)).is_empty());
        let beyond = 10.0 * bound;
        let work = bursts(model(beyond), peak * beyond);
        assert!(work < 0.0, "ten cycles make energy: {work} J");
        let [error] = &objections(&model(beyond))[..] else { panic!("one law is broken") };
        assert_eq!((error.field, error.value, error.bound), ("fading", beyond, bound));
        assert!(!objections(&model(1.001 * bound)).is_empty());
    }
}

#[test]
fn a_load_that_changes_while_the_bristles_are_bent_does_work_on_them() {
    let model = ElastoPlastic::<f64>::default();
    let friction = Friction { load: Load { sensitivity: 1.0 }, ..plain(Model::ElastoPlastic(model)) };
    let dt = 1e-3;
    let bend = 0.5 * model.elastic_fraction * steady_deflection(&friction.model, 0.0);
    let cycle = |pressed: f64| {
        let (mut memory, mut work) = (Memory::default(), 0.0);
        for (velocity, load) in [(bend / dt, 0.0), (-bend / dt, pressed)] {
            let probe = memory.deflection;
            let torque = friction.correct(&mut memory, probe, Contact { load, ..driven(velocity) }, dt);
            work += torque * velocity * dt;
        }
        work
    };
    let bent = stored(&friction.model, &Memory::bent(bend));
    // Damping and viscous friction dissipate; with twice the stiffness, ½·σ₀·z² more comes back than was stored.
    let resistance = model.damping(bend / dt) + model.lugre.sliding.viscous_friction;
    let damped = |factor: f64| (1.0 + factor) * resistance * bend * bend / dt;
    assert!((cycle(0.0) - damped(1.0)).abs() <= 1e-12 * bent);
    assert!((cycle(1.0) - (damped(2.0) - bent)).abs() <= 1e-12 * bent);
}
