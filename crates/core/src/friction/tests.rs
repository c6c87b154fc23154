//! Properties of the friction models.
//!
//! Parameters are drawn over decades, with and without a Stribeck drop, and only such as the checks accept.

mod conditions;
mod derivative;
mod maxwell_slip;
mod modifiers;
mod passivity;

use core::f64::consts::FRAC_PI_2;
use std::vec::Vec;

use proptest::array::uniform4;
use proptest::collection::vec;
use proptest::prelude::*;

use super::*;

/// Uniform over the decades between two positive numbers.
fn decades(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.log10()..=high.log10()).prop_map(move |exponent| 10_f64.powf(exponent).clamp(low, high))
}

/// Curves with M_K from 0.2 to 3 times M_S.
fn curve() -> impl Strategy<Value = Stribeck<f64>> {
    let decay = prop_oneof![
        Just(Decay::Exponential),
        Just(Decay::Gaussian),
        (0.1..4.0).prop_map(|exponent| Decay::Power(Exponent { exponent })),
    ];
    let viscous = prop_oneof![Just(0.0), decades(1e-5, 1e-1)];
    (decades(1e-3, 10.0), 0.2..3.0, decades(1e-2, 1e2), viscous, decay).prop_map(
        |(breakaway_torque, ratio, stribeck_velocity, viscous_friction, decay)| Stribeck {
            breakaway_torque,
            kinetic_torque: ratio * breakaway_torque,
            stribeck_velocity,
            viscous_friction,
            decay,
        },
    )
}

/// LuGre with v_c at a share of its passive bound.
fn lugre(
    stiffness: impl Strategy<Value = f64>,
    share: impl Strategy<Value = f64>,
) -> impl Strategy<Value = LuGre<f64>> {
    (curve(), stiffness, decades(1e-3, 1.0), any::<bool>(), share).prop_map(
        |(sliding, bristle_stiffness, bristle_damping, gaussian, share)| {
            let fading = |velocity| {
                let fading = DampingVelocity { velocity };
                if gaussian { Fading::Gaussian(fading) } else { Fading::Rational(fading) }
            };
            let model = LuGre { sliding, bristle_stiffness, bristle_damping, fading: fading(1.0) };
            LuGre { fading: fading(share * model.passive_damping_velocity()), ..model }
        },
    )
}

fn elasto_plastic(stiffness: impl Strategy<Value = f64>) -> impl Strategy<Value = ElastoPlastic<f64>> {
    (lugre(stiffness, 0.05..=1.0), 0.0..=0.95)
        .prop_map(|(lugre, elastic_fraction)| ElastoPlastic { lugre, elastic_fraction })
}

fn dahl(stiffness: impl Strategy<Value = f64>) -> impl Strategy<Value = Dahl<f64>> {
    (decades(1e-3, 10.0), decades(1e-5, 1e-1), stiffness).prop_map(
        |(kinetic_torque, viscous_friction, bristle_stiffness)| Dahl {
            kinetic_torque,
            viscous_friction,
            bristle_stiffness,
        },
    )
}

/// Any model with friction; the bristles' stiffness between two numbers [N m/rad].
fn model(low: f64, high: f64) -> impl Strategy<Value = Model<f64>> {
    prop_oneof![
        1 => curve().prop_map(|sliding| Model::Static(Static { sliding })),
        3 => bristles(low, high),
    ]
}

fn bristles(low: f64, high: f64) -> impl Strategy<Value = Model<f64>> {
    prop_oneof![
        dahl(decades(low, high)).prop_map(Model::Dahl),
        lugre(decades(low, high), 0.05..=1.0).prop_map(Model::Lugre),
        elasto_plastic(decades(low, high)).prop_map(Model::ElastoPlastic),
        maxwell_slip(low, high).prop_map(Model::MaxwellSlip),
    ]
}

/// Shares and stiffnesses over a decade each; the level lags from a microsecond to a second.
fn maxwell_slip(low: f64, high: f64) -> impl Strategy<Value = MaxwellSlip<f64>> {
    (curve(), uniform4(decades(0.1, 1.0)), decades(low, high), uniform4(decades(0.1, 1.0)), decades(1e-6, 1.0))
        .prop_map(|(sliding, shares, stiffness, softer, lag)| {
            let [first_share, second_share, third_share, _] = shares.map(|share| share / shares.iter().sum::<f64>());
            let [first_stiffness, second_stiffness, third_stiffness, fourth_stiffness] =
                softer.map(|softer| (softer * stiffness).max(1e-3));
            MaxwellSlip {
                attraction: (sliding.breakaway_torque / lag).clamp(1e-3, 1e6),
                sliding,
                first_share,
                second_share,
                third_share,
                first_stiffness,
                second_stiffness,
                third_stiffness,
                fourth_stiffness,
            }
        })
}

fn direction() -> impl Strategy<Value = Direction<f64>> {
    (-0.95..0.95, -0.95..0.95, -0.1..0.1).prop_map(|(asymmetry, viscous_asymmetry, offset)| Direction {
        asymmetry,
        viscous_asymmetry,
        offset,
    })
}

fn position() -> impl Strategy<Value = Position<f64>> {
    (0.0..0.9, 1..20, -7.0..7.0).prop_map(|(amplitude, periods, phase)| {
        Position::Ripple(Ripple { amplitude, periods: f64::from(periods), phase })
    })
}

fn load() -> impl Strategy<Value = Load<f64>> {
    (0.0..10.0).prop_map(|sensitivity| Load { sensitivity })
}

fn rest() -> impl Strategy<Value = Rest<f64>> {
    (0.0..2.0, decades(1e-3, 1e2), decades(1e-6, 1e-1))
        .prop_map(|(rise, time, way)| Rest::Rising(Rising { rise, time, way }))
}

fn temperature() -> impl Strategy<Value = Temperature<f64>> {
    (-30.0..60.0, -0.01..0.01, -0.02..0.02).prop_map(|(temperature, fall, viscous_fall)| {
        Temperature::Exponential(Warming { temperature, fall, viscous_fall })
    })
}

/// Any model, with or without each of its dependences.
fn friction(low: f64, high: f64) -> impl Strategy<Value = Friction<f64>> {
    let direction = prop_oneof![Just(Direction::default()), direction()];
    let position = prop_oneof![Just(Position::Constant), position()];
    let load = prop_oneof![Just(Load::default()), load()];
    let rest = prop_oneof![Just(Rest::Constant), rest()];
    let temperature = prop_oneof![Just(Temperature::Constant), temperature()];
    (model(low, high), direction, position, load, rest, temperature).prop_map(
        |(model, direction, position, load, rest, temperature)| Friction {
            model,
            direction,
            position,
            load,
            rest,
            temperature,
        },
    )
}

fn plain(model: Model<f64>) -> Friction<f64> {
    Friction { model, ..Friction::default() }
}

/// A contact driven at a velocity by an unlimited torque.
fn driven(velocity: f64) -> Contact<f64> {
    Contact { velocity, arrest: velocity.signum() * 1e9, ..Contact::default() }
}

/// Deflection [rad] of steady sliding at a speed; of a Maxwell slip that of the element with the largest one; 0 for the
/// static model.
fn steady_deflection(model: &Model<f64>, speed: f64) -> f64 {
    fn of(model: &impl Bristle<f64>, speed: f64) -> f64 {
        model.sliding(speed) / model.stiffness()
    }
    match model {
        Model::Nothing | Model::Static(_) => 0.0,
        Model::Dahl(model) => of(model, speed),
        Model::Lugre(model) => of(model, speed),
        Model::ElastoPlastic(model) => of(model, speed),
        Model::MaxwellSlip(model) => {
            let elements = model.shares().into_iter().zip(model.stiffnesses());
            elements.map(|(share, stiffness)| share * model.sliding.level(speed) / stiffness).fold(0.0, f64::max)
        }
    }
}

/// Length [s] and number of the steps after which bristles, lag and age are settled at a speed.
fn settling(friction: &Friction<f64>, speed: f64) -> (f64, u32) {
    let steady = steady_deflection(&friction.model, speed);
    let quick = if steady > 0.0 { steady / speed } else { 4e-3 };
    let mut slowest = quick;
    if let Rest::Rising(rising) = friction.rest {
        slowest = slowest.max(rising.way / speed);
    }
    if let Model::MaxwellSlip(model) = friction.model {
        // Exact at any step.
        let lag = model.sliding.level(speed) / model.attraction;
        return (0.25 * slowest.max(lag), 400);
    }
    // Over a hundred steady deflections: e^-100 of the initial state is left.
    (0.25 * quick, (400.0 * slowest / quick) as u32)
}

/// One step as in the plant, with the release at the deflection of the middle.
fn midpoint(friction: &Friction<f64>, memory: &mut Memory<f64>, contact: Contact<f64>, dt: f64) -> f64 {
    let mut middle = *memory;
    friction.correct(&mut middle, memory.deflection, contact, 0.5 * dt);
    friction.correct(memory, middle.deflection, contact, dt)
}

/// One step from bent bristles: the deflection at the end [rad] and the torque [N m].
fn from_bent(friction: &Friction<f64>, deflection: f64, contact: Contact<f64>, dt: f64) -> (f64, f64) {
    let mut memory = Memory::bent(deflection);
    let torque = friction.correct(&mut memory, deflection, contact, dt);
    (memory.deflection, torque)
}

proptest! {
    #[test]
    fn any_model_settles_on_its_curve_in_both_directions(
        friction in friction(1e-3, 1e7), speed in decades(1e-3, 1e3), start in -1.0..1.0f64,
        angle in -10.0..10.0f64, load in -1.0..1.0f64,
    ) {
        let mut friction = friction;
        let bends = steady_deflection(&friction.model, 0.0).max(steady_deflection(&friction.model, 1e9));
        if let Rest::Rising(rising) = &mut friction.rest {
            // If the age decays over less than the deflection of the bristles, the contact sticks and slips by itself.
            rising.way = if bends > 0.0 { 4.0 * (1.0 + rising.rise) * bends } else { rising.way };
            // Below this speed the age is that of a contact at rest.
            prop_assume!(speed > 1e-6 * rising.way);
        }
        for velocity in [speed, -speed] {
            let contact = Contact { angle, load, ..driven(velocity) };
            let (dt, steps) = settling(&friction, speed);
            let mut memory = Memory::bent(start * steady_deflection(&friction.model, speed));
            let mut torque = 0.0;
            for _ in 0..steps {
                torque = midpoint(&friction, &mut memory, contact, dt);
            }
            let expected = friction.steady_torque(velocity, angle, load);
            let scale = (expected - friction.direction.offset).abs();
            prop_assert!((torque - expected).abs() <= 1e-9 * scale, "{torque}, expected {expected}");
        }
    }

    #[test]
    fn friction_without_direction_is_odd_to_the_bit(
        friction in friction(1e-3, 1e7), deflection in -2.0..2.0f64, probe in -2.0..2.0f64, velocity in -1e2..1e2f64,
        angle in -10.0..10.0f64, load in -1.0..1.0f64, arrest in -10.0..10.0f64, dt in decades(1e-9, 1.0),
        lag in -0.5..0.5f64, age in 0.0..10.0f64,
    ) {
        let friction = Friction { direction: Direction::default(), ..friction };
        let steady = steady_deflection(&friction.model, velocity.abs());
        let probe = probe * steady;
        let contact = Contact { velocity, angle, load, arrest };
        let mirrored = Contact { velocity: -velocity, arrest: -arrest, load: -load, ..contact };
        let bent = |deflection| Memory { lag, age, ..Memory::bent(deflection) };
        let (mut memory, mut mirror) = (bent(deflection * steady), bent(-deflection * steady));
        let torque = friction.correct(&mut memory, probe, contact, dt);
        prop_assert_eq!(friction.correct(&mut mirror, -probe, mirrored, dt), -torque);
        prop_assert_eq!((mirror.lag, mirror.age), (memory.lag, memory.age));
        prop_assert_eq!((mirror.deflection, mirror.elements), (-memory.deflection, memory.elements.map(|z| -z)));
    }

    #[test]
    fn bristles_stay_bounded_at_any_step_velocity_and_stiffness(
        model in model(1e-3, 1e7), start in -10.0..10.0f64, dt in decades(1e-9, 1.0),
        velocities in vec((decades(1e-9, 1e3), any::<bool>()), 1..30),
    ) {
        let friction = plain(model);
        let mut memory = Memory::bent(start * steady_deflection(&model, 0.0));
        // A lagging level may have any value between those of the curve.
        let lagging = match model {
            Model::MaxwellSlip(_) => steady_deflection(&model, 0.0).max(steady_deflection(&model, 1e9)),
            _ => 0.0,
        };
        for (speed, forward) in velocities {
            let velocity = if forward { speed } else { -speed };
            let before = memory.deflection;
            let torque = midpoint(&friction, &mut memory, driven(velocity), dt);
            let end = memory.deflection;
            let bound = before.abs().max(steady_deflection(&model, speed)).max(lagging) * (1.0 + 1e-9);
            prop_assert!(end.abs() <= bound, "{end} after {before} at {velocity}, bound {bound}");
            prop_assert!(torque.is_finite());
        }
    }

    #[test]
    fn nan_stays_nan_and_infinity_does_no_harm(
        friction in friction(1e-3, 1e7), deflection in -2.0..2.0f64, velocity in -1e2..1e2f64, dt in decades(1e-9, 1.0),
    ) {
        let deflection = deflection * steady_deflection(&friction.model, 0.0);
        let contact = driven(velocity);
        let step = |deflection, contact| {
            let mut memory = Memory::bent(deflection);
            let torque = midpoint(&friction, &mut memory, contact, dt);
            (memory, torque)
        };
        let torque = |deflection, contact| step(deflection, contact).1;
        let mut broken = std::vec![
            torque(deflection, driven(f64::NAN)),
            torque(deflection, Contact { load: f64::NAN, ..contact }),
            step(f64::NAN, contact).0.deflection,
        ];
        if let Rest::Rising(_) = friction.rest {
            broken.push(friction.correct(&mut Memory { age: f64::NAN, ..Memory::bent(deflection) }, deflection, contact, dt));
            broken.push(step(deflection, driven(f64::NAN)).0.age);
        }
        if let Model::MaxwellSlip(_) = friction.model {
            broken.push(friction.correct(&mut Memory { lag: f64::NAN, ..Memory::bent(deflection) }, deflection, contact, dt));
        }
        broken.push(match friction.model {
            Model::Static(_) => torque(0.0, Contact { arrest: f64::NAN, ..contact }),
            _ => torque(f64::NAN, contact),
        });
        if let Position::Ripple(_) = friction.position {
            broken.push(torque(deflection, Contact { angle: f64::NAN, ..contact }));
        }
        prop_assert!(broken.iter().all(|value| value.is_nan()), "{broken:?}");
        for infinite in [f64::INFINITY, f64::NEG_INFINITY] {
            torque(deflection, driven(infinite));
            torque(infinite, contact);
        }
    }

    #[test]
    fn the_contact_releases_between_the_elastic_limit_and_the_steady_deflection(
        model in elasto_plastic(decades(1e-3, 1e7)), velocity in decades(1e-6, 1e3), share in 0.0..1.0f64,
    ) {
        let steady = model.sliding(velocity) / model.stiffness();
        let elastic = (model.elastic_fraction * model.lugre.sliding.breakaway_torque / model.stiffness()).min(0.95 * steady);
        let between = elastic + share * (steady - elastic);
        for side in [1.0, -1.0] {
            let release = |deflection: f64| model.release(side * deflection, side * velocity, model.sliding(velocity.abs()));
            let constant = |share| Release { share, slope: 0.0 };
            prop_assert_eq!(release(share * elastic), constant(0.0), "elastic zone");
            prop_assert_eq!(release(steady * (1.0 + share)), constant(1.0), "sliding");
            prop_assert_eq!(release(-2.0 * between), constant(0.0), "receding");
            // Half a sine over the zone between: slope at most π/2 over its width. Rounding of u: 20 ε at 0.95.
            let (Release { share: here, slope }, Release { share: next, .. }) = (release(between), release(between + 1e-6 * steady));
            prop_assert!((0.0..=1.0).contains(&here));
            let expected = (FRAC_PI_2 * share).sin().powi(2);
            prop_assert!((here - expected).abs() <= 1e-13, "{here}, expected {expected}");
            prop_assert!((next - here).abs() <= FRAC_PI_2 * 1e-6 * steady / (steady - elastic) + 1e-13);
            let rising = FRAC_PI_2 * (2.0 * FRAC_PI_2 * share).sin() * between / (steady - elastic);
            prop_assert!((slope - rising).abs() <= 1e-11, "slope {slope}, expected {rising}");
        }
    }

    #[test]
    fn true_stick_holds_exactly_what_is_needed_and_slides_above(
        sliding in curve(), share in -1.0..1.0f64, excess in 1.0..10.0f64,
    ) {
        let friction = plain(Model::Static(Static { sliding }));
        let torque = |arrest| from_bent(&friction, 0.0, Contact { arrest, ..Contact::default() }, 25e-6).1;
        let needed = share * sliding.breakaway_torque;
        prop_assert_eq!(torque(needed), needed);
        prop_assert_eq!(torque(excess * sliding.breakaway_torque), sliding.level(0.0));
        prop_assert_eq!(torque(-excess * sliding.breakaway_torque), -sliding.level(0.0));
    }

    #[test]
    fn true_stick_stops_a_free_mass_and_never_turns_it_back(
        sliding in curve(), direction in direction(), start in -10.0..10.0f64, inertia in decades(1e-5, 1e-1),
    ) {
        let dt = 25e-6;
        let direction = Direction { offset: 0.0, ..direction };
        // Viscous friction is explicit in the step: alone, it must not reverse the velocity.
        let viscous_friction = sliding.viscous_friction.min(0.5 * inertia / dt);
        let model = Model::Static(Static { sliding: Stribeck { viscous_friction, ..sliding } });
        let friction = Friction { direction, ..plain(model) };
        let mut velocity = start;
        let slowest = 0.05 * sliding.smallest_level() * dt / inertia;
        for _ in 0..1000 {
            let contact = Contact { velocity, arrest: velocity * inertia / dt, ..Contact::default() };
            let after = velocity - from_bent(&friction, 0.0, contact, dt).1 * dt / inertia;
            // The arresting torque is divided by factors and multiplied again: a few roundings.
            let rounding = 8.0 * f64::EPSILON * velocity.abs();
            prop_assert!(after * start.signum() >= -rounding, "turned from {velocity} to {after}");
            prop_assert!(after.abs() <= (velocity.abs() - slowest).max(rounding), "from {velocity} to {after}");
            velocity = after;
            if velocity.abs() <= rounding {
                break;
            }
        }
    }
}

#[test]
fn reversals_in_steps_longer_than_the_elastic_zone_do_not_bend_the_bristles_further_and_further() {
    let friction = plain(Model::ElastoPlastic(ElastoPlastic::default()));
    let (steady, elastic) = (1e-3, 0.95 * 0.6 * 1e-3);
    let (mut memory, mut side) = (Memory::<f64>::default(), 1.0);
    for _ in 0..50 {
        // At 1000 rad/s, where g is M_K, the middle of each step is just within the elastic zone after the reversal.
        let way = 2.0 * (memory.deflection.abs() + elastic) * (1.0 - 1e-9);
        midpoint(&friction, &mut memory, driven(side * 1e3), way / 1e3);
        side = -side;
    }
    assert!(memory.deflection.abs() <= steady, "{memory:?}");
}

#[test]
fn a_curve_in_steps_of_the_smallest_speeds_stays_between_its_torques() {
    for exponent in [0.1, 0.5, 1.0, 2.0, 4.0] {
        let curve = Stribeck { decay: Decay::Power(Exponent { exponent }), ..Stribeck::default() };
        let speeds: Vec<f64> = (-1074..1000).map(|power| 2_f64.powi(power)).collect();
        for pair in speeds.windows(2) {
            let (slow, fast) = (curve.level(pair[0]), curve.level(pair[1]));
            assert!((0.18..=0.3).contains(&fast) && fast <= slow, "{slow}, {fast} at {}", pair[1]);
        }
    }
}

#[test]
fn the_release_does_not_jump_the_bristles_at_a_reversal() {
    let model = ElastoPlastic::<f64>::default();
    let deflection = 0.9 * model.sliding(0.0) / model.stiffness();
    let change = |velocity| rate(&model, deflection, velocity).0;
    // At Ω = 0 α jumps from 0 to its value, but it is a factor of |Ω|: ż is continuous.
    let level = model.sliding(1e-9);
    assert!(model.release(deflection, 1e-9, level).share > 0.5 && model.release(deflection, -1e-9, level).share == 0.0);
    assert!((change(1e-9) - change(-1e-9)).abs() <= 2e-9);
}
