//! The dual's derivative is that of the function.

use std::vec::Vec;

use proptest::prelude::*;

use super::{dahl, decades, elasto_plastic, lugre};
use crate::fields::Fields;
use crate::friction::{Bristle, rate};
use crate::scalar::{Dual, Scalar};

/// Deflection, velocity and at most nine parameters.
const VARIABLES: usize = 11;

/// The deflection and the velocity, then the parameters in the order of the fields, each as a separate variable.
fn variables<M: Fields<f64>>(model: &M, at: [f64; 2]) -> (M::With<Dual<VARIABLES>>, [Dual<VARIABLES>; 2]) {
    let mut index = 1;
    let parameters = model.map(&mut |value| {
        index += 1;
        Dual::variable(value, index)
    });
    (parameters, [Dual::variable(at[0], 0), Dual::variable(at[1], 1)])
}

/// The same as plain numbers, with the chosen one multiplied by a factor.
fn scaled<M: Fields<f64>>(model: &M, mut at: [f64; 2], chosen: usize, by: f64) -> (M::With<f64>, [f64; 2]) {
    let mut index = 1;
    let parameters = model.map(&mut |value| {
        index += 1;
        if index == chosen { value * by } else { value }
    });
    if let Some(value) = at.get_mut(chosen) {
        *value *= by;
    }
    (parameters, at)
}

fn parameters<M: Fields<f64>>(model: &M) -> Vec<f64> {
    let mut values = Vec::new();
    model.map(&mut |value: f64| {
        values.push(value);
        value
    });
    values
}

/// Bristle torque [N m].
fn torque<T: Scalar>(model: &impl Bristle<T>, deflection: T, velocity: T) -> T {
    rate(model, deflection, velocity).1
}

/// Compares the derivatives of the torque with five-point differences, all per relative change of the variable.
///
/// Steps of 1e-4 leave 3e-18 of the fifth derivative (3e-9 where half a sine rises within a twentieth of the
/// deflection), rounding 1e-11.
macro_rules! assert_derivatives {
    ($model:expr, $at:expr) => {{
        let (model, at) = ($model, $at);
        let (duals, [deflection, velocity]) = variables(&model, at);
        let dual = torque(&duals, deflection, velocity);
        prop_assert_eq!(dual.value, torque(&model, at[0], at[1]));
        for (index, value) in at.into_iter().chain(parameters(&model)).enumerate() {
            let at = |by: f64| {
                let (model, [deflection, velocity]) = scaled(&model, at, index, by);
                torque(&model, deflection, velocity)
            };
            let h = 1e-4;
            let difference = (8.0 * (at(1.0 + h) - at(1.0 - h)) - (at(1.0 + 2.0 * h) - at(1.0 - 2.0 * h))) / (12.0 * h);
            let derivative = dual.gradient[index] * value;
            let parts = model.stiffness() * $at[0].abs() + model.damping($at[1]) * $at[1].abs();
            let scale = parts + derivative.abs();
            prop_assert!((derivative - difference).abs() <= 1e-6 * scale, "{index}: {derivative}, {difference}");
        }
    }};
}

proptest! {
    #[test]
    fn derivatives_of_dahl_are_exact(
        model in dahl(decades(1e-3, 1e7)), share in -2.0..2.0f64, speed in decades(1e-3, 1e2),
    ) {
        let deflection = share * model.kinetic_torque / model.bristle_stiffness;
        for velocity in [speed, -speed] {
            assert_derivatives!(model, [deflection, velocity]);
        }
    }

    #[test]
    fn derivatives_of_lugre_are_exact(
        model in lugre(decades(1e-3, 1e7), 0.05..=1.0), share in -2.0..2.0f64, speed in decades(1e-3, 1e2),
    ) {
        let deflection = share * model.sliding.breakaway_torque / model.bristle_stiffness;
        for velocity in [speed, -speed] {
            assert_derivatives!(model, [deflection, velocity]);
        }
    }

    #[test]
    fn derivatives_of_elasto_plastic_friction_are_exact_away_from_its_kinks(
        model in elasto_plastic(decades(1e-3, 1e7)), share in 0.05..0.95f64, speed in decades(1e-3, 1e2),
    ) {
        let steady = model.sliding(speed) / model.stiffness();
        let limit = model.elastic_fraction * model.lugre.sliding.breakaway_torque / model.stiffness();
        // Another kink: where the elastic limit reaches its upper bound.
        prop_assume!((limit / (0.95 * steady) - 1.0).abs() > 1e-2);
        let elastic = limit.min(0.95 * steady);
        for deflection in [share * elastic, elastic + share * (steady - elastic), (1.0 + share) * steady] {
            for velocity in [speed, -speed] {
                assert_derivatives!(model, [deflection, velocity]);
                assert_derivatives!(model, [-deflection, velocity]);
            }
        }
    }
}
