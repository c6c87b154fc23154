use crate::SweepError;
use stickslip_core::control::Cascade;
use stickslip_core::drive::TwoMass;
use stickslip_core::friction::{ElastoPlastic, LuGre};

use super::*;
use stickslip_simulate::integrator::{ElasticDrive, Scheme};

type Swept = Variant<ElastoPlastic<f64>, Cascade<f64>>;

/// A drive of the study in `docs/integrator.md`: what is not named, is as there.
fn variant(breakaway_torque: f64, stribeck_velocity: f64, position_gain: f64) -> Swept {
    let mut lugre = LuGre { bristle_stiffness: 5e3, bristle_damping: 1.0, ..LuGre::default() };
    lugre.sliding.breakaway_torque = breakaway_torque;
    lugre.sliding.kinetic_torque = 0.2;
    lugre.sliding.stribeck_velocity = stribeck_velocity;
    let mechanics = TwoMass {
        motor_inertia: 8e-4,
        load_inertia: 1.2e-3,
        coupling_stiffness: 100.0,
        coupling_damping: 0.01,
        ..TwoMass::default()
    };
    Variant {
        axis: IdealAxis {
            mechanics,
            motor_viscous: 0.0,
            load_viscous: 2e-3,
            bristle: ElastoPlastic { lugre, ..ElastoPlastic::default() },
        },
        law: Cascade { position_gain, velocity_gain: 0.12, integral_gain: 3.0, inertia: 0.0, torque_limit: 2.0 },
    }
}

/// Seconds of a sine of 0.2 rad and 1 Hz, sampled every millisecond.
fn plan(seconds: f64, tolerance: f64) -> Plan {
    let sine = |sample: usize| 0.2 * (std::f64::consts::TAU * 1e-3 * sample as f64).sin();
    let reference = (0..=(1e3 * seconds) as usize).map(sine).collect();
    Plan { sample_time: 1e-3, reference, tolerance, arithmetic: Arithmetic::Double, threads: 2 }
}

/// Spread over the ranges, the same in each run.
fn some(count: usize) -> Vec<Swept> {
    let part = |index: usize, step: f64| (0.5 + step * index as f64).fract();
    (0..count)
        .map(|k| {
            variant(0.22 + 0.18 * part(k, 0.618_034), 0.5 + 2.5 * part(k, 0.414_214), 10.0 + 20.0 * part(k, 0.732_051))
        })
        .collect()
}

fn courses(variants: &[Swept], plan: &Plan) -> Vec<Course> {
    let found = sweep(variants, plan, Course::clone).expect("a plan that can be run");
    found.into_iter().map(|course| course.expect("resolved")).collect()
}

/// Angles of the same variants on a rung that none is judged by.
fn exact(variants: &[Swept], plan: &Plan) -> Vec<Vec<f64>> {
    let rung = Rung { passes: 4, sliding: 60, presliding: 160 };
    let plan = Plan { arithmetic: Arithmetic::Double, ..plan.clone() };
    on_rung(variants, &plan, rung, |course| course.angle.clone()).expect("a plan that can be run")
}

#[test]
fn neither_neighbours_nor_order_nor_threads_show_in_a_course() {
    let variants = some(37);
    let plan = plan(0.4, 1e-4);
    let together = courses(&variants, &plan);
    let backwards: Vec<_> = variants.iter().rev().copied().collect();
    let mut turned = courses(&backwards, &Plan { threads: 1, ..plan.clone() });
    turned.reverse();
    assert_eq!(together, turned);
    for index in [0, 11, 36] {
        assert_eq!(courses(&variants[index..=index], &plan)[0], together[index], "alone, variant {index}");
    }
}

#[test]
fn the_stated_error_is_true() {
    let variants = some(33);
    for tolerance in [1e-3, 1e-4, 1e-5] {
        let plan = plan(1.0, tolerance);
        for ((course, exact), k) in courses(&variants, &plan).iter().zip(exact(&variants, &plan)).zip(0..) {
            let error = apart(&course.angle, &exact);
            assert!(course.error <= tolerance);
            // Twice what it says, since an error may change its sign from rung to rung.
            assert!(error <= 2.0 * course.error, "{k} at {tolerance:e}: {error:.1e}, stated {:.1e}", course.error);
        }
    }
}

#[test]
fn the_angle_is_that_of_an_explicit_method_with_a_thousand_steps_a_sample() {
    let variant = variant(0.3, 1.5, 20.0);
    let plan = plan(0.5, 1e-6);
    let course = &courses(&[variant], &plan)[0];
    let axis = variant.axis;
    let drive = ElasticDrive {
        mechanics: axis.mechanics,
        motor_viscous: axis.motor_viscous,
        load_viscous: axis.load_viscous,
        bristle: axis.bristle,
    };
    let (mut x, mut integral, mut angles) = ([0.0; 5], 0.0, Vec::new());
    for wanted in &plan.reference {
        angles.push(x[2]);
        let deviation = variant.law.position_gain * (wanted - x[2] - x[0]) - x[1];
        let torque = variant.law.velocity_gain * deviation + integral;
        integral += variant.law.integral_gain * deviation * plan.sample_time;
        assert!(torque.abs() <= variant.law.torque_limit, "the peer has no limit");
        for _ in 0..1000 {
            x = drive.step(Scheme::RungeKutta, &x, [torque; 3], 1e-6).expect("within the bound");
        }
    }
    let error = apart(&course.angle, &angles);
    assert!(error <= 2.0 * course.error, "{error:.1e}, stated {:.1e}", course.error);
}

#[test]
fn a_smaller_tolerance_takes_a_finer_rung() {
    let variants = some(4);
    let work = |tolerance| -> usize {
        courses(&variants, &plan(0.5, tolerance)).iter().map(|course| course.rung.passes * course.rung.presliding).sum()
    };
    assert!(work(1e-2) < work(1e-4) && work(1e-4) < work(1e-6));
}

#[test]
fn what_no_rung_resolves_is_refused_and_the_rest_is_not() {
    // Far beyond stability the torque jumps from limit to limit, and the smallest cause decides when.
    let mut wild = variant(0.3, 1.5, 20.0);
    wild.law.velocity_gain = 100.0;
    let found = sweep(&[variant(0.3, 1.5, 20.0), wild], &plan(0.5, 1e-4), |course| course.error).expect("runs");
    assert!(found[0].is_ok());
    let refused = found[1].as_ref().expect_err("it is not resolved");
    let Some(SweepError::Unresolved { index: 1, error, .. }) = refused.of() else { panic!("{refused}") };
    assert!(*error > 1e-4);
    // What is no number is never resolved.
    let mut broken = variant(0.3, 1.5, 20.0);
    broken.axis.mechanics.load_inertia = f64::NAN;
    let found = sweep(&[broken], &plan(0.1, 1e-4), |course| course.error).expect("runs");
    assert!(
        matches!(found[0].as_ref().err().and_then(|error| error.of()), Some(SweepError::Unresolved { error, .. }) if error.is_nan()),
        "{:?}",
        found[0]
    );
}

#[test]
fn it_is_refused_as_soon_as_no_rung_can_bring_its_estimate_within_the_tolerance() {
    for error in [1.1e-4, 3.9e-4, 4.1e-4, 9.25e-3, 1.0] {
        for rungs in 1..RUNGS.len() {
            let least = (0..rungs).fold(error, |error, _| ladder::estimate(0.0, Some(error)));
            assert_eq!(hopeless(error, rungs, 1e-4), least > 1e-4, "{error} and {rungs} more");
        }
    }
    assert!(!hopeless(f64::NAN, 1, 1e-4), "finer steps may give a number");
}

#[test]
fn what_single_precision_does_not_resolve_is_resolved_in_double() {
    let variants = some(33);
    let plan = plan(1.0, 1e-5);
    let single = courses(&variants, &Plan { arithmetic: Arithmetic::Single, ..plan.clone() });
    let exact = exact(&variants, &plan);
    let double = |course: &Course| RUNGS[DOUBLE..].contains(&course.rung);
    assert!(single.iter().any(double) && !single.iter().all(double), "both occur");
    for (course, exact) in single.iter().zip(&exact).filter(|(course, _)| double(course)) {
        assert!(apart(&course.angle, exact) <= 1e-5);
    }
}

#[test]
fn on_a_rung_the_bits_are_those_of_the_ladder_and_no_error_is_claimed() {
    let variants = some(5);
    let plan = plan(0.3, 1e-4);
    for (index, course) in courses(&variants, &plan).into_iter().enumerate() {
        let alone = on_rung(&variants[index..=index], &plan, course.rung, Course::clone).expect("runs");
        assert_eq!(alone[0], Course { error: f64::INFINITY, ..course });
    }
}

#[test]
fn single_precision_says_what_it_is_worth() {
    let variants = some(33);
    let plan = Plan { arithmetic: Arithmetic::Single, ..plan(1.0, 1e-4) };
    for (course, exact) in courses(&variants, &plan).iter().zip(exact(&variants, &plan)) {
        let error = apart(&course.angle, &exact);
        assert!(error <= 2.0 * course.error, "{error:.1e}, stated {:.1e}", course.error);
    }
    // Alone as together, in these numbers too.
    assert_eq!(courses(&variants[5..6], &plan)[0], courses(&variants, &plan)[5]);
}

#[test]
fn a_plan_that_cannot_be_run_is_refused() {
    let refused = |plan: Plan| {
        let outcome = sweep(&some(1), &plan, |_| ());
        assert!(matches!(outcome, Err(Error::OutOfRange { .. })), "{plan:?}");
    };
    let good = Plan { reference: vec![0.0; 10], ..plan(0.1, 1e-4) };
    refused(Plan { sample_time: 0.0, ..good.clone() });
    refused(Plan { sample_time: f64::NAN, ..good.clone() });
    refused(Plan { tolerance: 0.0, ..good.clone() });
    refused(Plan { tolerance: 1e-7, arithmetic: Arithmetic::Single, ..good.clone() });
    refused(Plan { reference: vec![0.0], ..good.clone() });
    refused(Plan { reference: vec![0.0, f64::NAN, 0.0], ..good });
}
