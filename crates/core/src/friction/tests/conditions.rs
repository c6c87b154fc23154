//! Time at rest and temperature.

use super::*;

fn rising() -> Rising<f64> {
    Rising { rise: 0.4, time: 2.0, way: 1e-3 }
}

fn aged(model: Model<f64>) -> Friction<f64> {
    Friction { rest: Rest::Rising(rising()), ..plain(model) }
}

proptest! {
    #[test]
    fn the_holding_torque_rises_with_the_time_at_rest(rest in decades(1e-2, 1e3), sliding in curve()) {
        let friction = aged(Model::Static(Static { sliding }));
        let mut memory = friction.steady_memory(10.0);
        for _ in 0..1000 {
            friction.correct(&mut memory, 0.0, Contact::default(), rest / 1000.0);
        }
        let held = friction.correct(&mut memory, 0.0, Contact { arrest: 1e3, ..Contact::default() }, 1e-6);
        // From sliding at 10 rad/s: an age of 0.1 ms.
        let age = 1e-4 + rest;
        let expected = sliding.breakaway_torque * (1.0 + 0.4 * age / (age + 2.0));
        prop_assert!((held / expected - 1.0).abs() <= 1e-12, "{held}, expected {expected}");
    }

    #[test]
    fn the_age_is_the_time_at_rest_and_decays_over_the_sliding_distance(
        age in 0.0..100.0f64, rest in decades(1e-3, 1e3), speed in decades(1e-3, 1e2),
    ) {
        let friction = aged(Model::Static(Static::default()));
        let mut memory = Memory { age, ..Memory::default() };
        for _ in 0..100 {
            friction.correct(&mut memory, 0.0, Contact::default(), rest / 100.0);
        }
        prop_assert!((memory.age - age - rest).abs() <= 1e-13 * (age + rest) * 100.0);
        // After twice the distance φ_c, in 2000 steps, e^-2 of the difference is left; the error by the step is 0.1 %.
        let (before, steady) = (memory.age, rising().way / speed);
        for _ in 0..2000 {
            friction.correct(&mut memory, 0.0, driven(speed), 1e-3 * rising().way / speed);
        }
        let left = (memory.age - steady) / (before - steady);
        prop_assert!((left / (-2.0f64).exp() - 1.0).abs() <= 2e-3, "{left} is left");
        prop_assert!((friction.rest.steady_age(speed) - steady).abs() <= 1e-15 * steady);
    }

    #[test]
    fn a_contact_that_ages_does_not_move_a_load_on_its_bristles(
        model in bristles(1.0, 1e6), rest in rest(), share in -0.9..0.9f64, age in 0.0..1.0f64, dt in decades(1e-6, 1.0),
    ) {
        let friction = Friction { rest, ..plain(model) };
        let bent = share * match model {
            Model::MaxwellSlip(model) => {
                // Deflection at which the first element slips.
                let elements = model.shares().into_iter().zip(model.stiffnesses());
                let ways = elements.map(|(share, stiffness)| share * model.sliding.breakaway_torque / stiffness);
                ways.fold(f64::INFINITY, f64::min)
            }
            _ => steady_deflection(&model, 0.0),
        };
        let mut memory = Memory { age, ..Memory::bent(bent) };
        let before = friction.correct(&mut memory, bent, Contact::default(), 1e-9);
        let age = memory.age;
        for _ in 0..100 {
            let torque = friction.correct(&mut memory, bent, Contact::default(), dt);
            prop_assert!((torque - before).abs() <= 1e-14 * before.abs(), "{before} N m become {torque} N m");
        }
        prop_assert!(memory.age > age);
    }

    #[test]
    fn vibrating_bristles_continue_to_age(share in 0.05..0.6f64, hertz in 1.0..100.0f64) {
        let model = ElastoPlastic::<f64>::default();
        let friction = aged(Model::ElastoPlastic(model));
        let amplitude = share * model.lugre.sliding.breakaway_torque / model.lugre.bristle_stiffness;
        let dt = 25e-6;
        let mut memory = Memory::default();
        let way = |step: i32| amplitude * (core::f64::consts::TAU * hertz * dt * f64::from(step)).sin();
        for step in 0..4000 {
            midpoint(&friction, &mut memory, driven((way(step + 1) - way(step)) / dt), dt);
        }
        // Elastic to rounding: 4000 times 1e-16 of 1e-3 rad over the way of 1e-3 rad.
        prop_assert!((memory.age - 0.1).abs() <= 1e-9, "{} s", memory.age);
    }

    #[test]
    fn temperature_multiplies_viscous_friction_and_the_rest_each_by_its_own_factor(
        model in model(1e-3, 1e7), temperature in -50.0..100.0f64, fall in -0.01..0.01f64, viscous_fall in -0.02..0.02f64,
        velocity in decades(1e-2, 1e2),
    ) {
        let warming = Warming { temperature, fall, viscous_fall };
        let friction = Friction { temperature: Temperature::Exponential(warming), ..plain(model) };
        let (cold, warm) = (plain(model), |part: fn(&Warming<f64>) -> f64| (-part(&warming) * temperature).exp());
        let viscous = cold.steady_torque(velocity, 0.0, 0.0) - cold.level(velocity);
        let expected = warm(|w| w.fall) * cold.level(velocity) + warm(|w| w.viscous_fall) * viscous;
        let torque = friction.steady_torque(velocity, 0.0, 0.0);
        prop_assert!((torque - expected).abs() <= 1e-12 * expected, "{torque}, expected {expected}");
        let (stiffness, _) = friction.stiffest();
        prop_assert!((stiffness - warm(|w| w.fall) * cold.stiffest().0).abs() <= 1e-12 * stiffness);
    }

    #[test]
    fn at_the_reference_temperature_and_without_a_rise_every_bit_is_unchanged(
        model in model(1e-3, 1e7), direction in direction(), position in position(), deflection in -1.0..1.0f64,
        velocity in -1e2..1e2f64, arrest in -1.0..1.0f64,
    ) {
        let without = Friction { direction, position, ..plain(model) };
        let with = Friction {
            rest: Rest::Rising(Rising { rise: 0.0, ..Rising::default() }),
            temperature: Temperature::Exponential(Warming { temperature: 0.0, ..Warming::default() }),
            ..without
        };
        let deflection = deflection * steady_deflection(&model, velocity.abs());
        let contact = Contact { velocity, arrest, ..Contact::default() };
        let step = |friction| from_bent(friction, deflection, contact, 25e-6);
        prop_assert_eq!(step(&with), step(&without));
        prop_assert_eq!(with.predict(&Memory::bent(deflection), contact, 25e-6), without.predict(&Memory::bent(deflection), contact, 25e-6));
    }
}

#[test]
fn friction_falls_by_the_share_per_kelvin_that_is_stated() {
    let at = |temperature| Friction {
        temperature: Temperature::Exponential(Warming { temperature, ..Warming::default() }),
        ..plain(Model::Static(Static::default()))
    };
    let change = |friction: fn(&Friction<f64>) -> f64| friction(&at(0.1)) / friction(&at(0.0)) - 1.0;
    // At 0.1 K: -0.1 % and -0.5 % per kelvin, to first order.
    assert!((change(|f| f.steady_torque(0.0 + 1e-9, 0.0, 0.0)) + 1e-4).abs() <= 1e-8);
    let viscous = |f: &Friction<f64>| f.steady_torque(1e9, 0.0, 0.0);
    assert!((change(viscous) + 5e-4).abs() <= 2e-7);
}
