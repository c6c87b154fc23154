//! Linear systems against SciPy and python-control (`tests/reference/linear`), and the guards.

use nalgebra::{Complex, DMatrix};
use serde_json::Value;

use super::spectrum::size;
use super::*;
use crate::{continuous_regulator, kalman_bucy_filter, kalman_filter, linear_quadratic_regulator};

/// Accuracy of double precision for well-conditioned systems of order 10.
const DIGITS: f64 = 1e-9;

fn cases() -> Vec<Value> {
    let numbers: Value = serde_json::from_str(include_str!("../../../../tests/reference/linear/linear.json")).unwrap();
    numbers["cases"].as_array().unwrap().clone()
}

fn list(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn matrix(value: &Value) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(list).collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

fn points(value: &Value) -> Vec<Complex<f64>> {
    value.as_array().unwrap().iter().map(|pair| Complex::new(list(pair)[0], list(pair)[1])).collect()
}

fn system(case: &Value) -> StateSpace {
    let [a, b, c, d] = ["a", "b", "c", "d"].map(|name| matrix(&case[name]));
    StateSpace::new(a, b, c, d, case["dt"].as_f64()).unwrap()
}

fn assert_close(ours: &DMatrix<f64>, theirs: &DMatrix<f64>, what: &str) {
    let deviation = (ours - theirs).norm() / theirs.norm();
    assert!(deviation < DIGITS, "{what}: relative deviation {deviation:.1e}");
}

/// Both lists have the same points.
fn assert_same_points(mut ours: Vec<Complex<f64>>, theirs: &[Complex<f64>], what: &str) {
    assert_eq!(ours.len(), theirs.len(), "{what}: {ours:?} for {theirs:?}");
    for their in theirs {
        let nearest = (0..ours.len()).min_by(|&i, &j| size(ours[i] - their).total_cmp(&size(ours[j] - their))).unwrap();
        let our = ours.swap_remove(nearest);
        assert!(size(our - their) < DIGITS * size(*their).max(1.0), "{what}: {our} for {their}");
    }
}

#[test]
fn poles_zeros_and_responses_are_those_of_scipy() {
    let cases = cases();
    assert!(cases.len() >= 40);
    for (number, case) in cases.iter().enumerate() {
        let system = system(case);
        let what = |name: &str| format!("{name} of case {number}, order {}", system.order());
        assert_same_points(system.poles().unwrap(), &points(&case["poles"]), &what("poles"));
        assert_same_points(system.zeros().unwrap(), &points(&case["zeros"]), &what("zeros"));
        assert!(system.is_stable().unwrap());
        for (frequency, theirs) in list(&case["frequencies"]).into_iter().zip(case["response"].as_array().unwrap()) {
            let ours = system.at_frequency(frequency).unwrap().transpose();
            for (our, their) in ours.iter().zip(points(theirs)) {
                assert!(size(our - their) < DIGITS * size(their), "{}: {our} for {their}", what("response"));
            }
        }
    }
}

#[test]
fn many_frequencies_at_once_have_the_responses_of_each_alone() {
    for case in cases() {
        let system = system(&case);
        let frequencies = [1e-3, 0.3, 1.0, 2.5, 3.0];
        for (frequency, batch) in frequencies.iter().zip(system.responses(&frequencies)) {
            let (batch, expected) = (batch.unwrap(), system.at_frequency(*frequency).unwrap());
            for (one, other) in batch.iter().zip(&expected) {
                assert!(size(one - other) < 1e-9 * expected.norm(), "{case} at {frequency}: {batch} {expected}");
            }
        }
    }
    // There is no response on a pole.
    let integrator = StateSpace::new(matrix_of(0.0), matrix_of(1.0), matrix_of(1.0), matrix_of(0.0), None).unwrap();
    assert!(integrator.responses(&[0.0]).next().unwrap().is_none());
    assert!(integrator.response(&[0.0])[0].re.is_infinite());
}

fn matrix_of(value: f64) -> DMatrix<f64> {
    DMatrix::from_element(1, 1, value)
}

#[test]
fn margins_are_those_of_python_control() {
    for (number, case) in cases().iter().enumerate().filter(|(_, case)| !case["margins"].is_null()) {
        let loop_gain = StateSpace { c: matrix(&case["loop_c"]), d: matrix(&case["loop_d"]), ..system(case) };
        let ours = loop_gain.margins().unwrap();
        let value = |peak: Option<Peak>| peak.map(|peak| peak.value);
        for (name, our) in [
            ("gain", value(ours.gain)),
            ("gain_reduction", value(ours.gain_reduction)),
            ("phase", value(ours.phase)),
            ("delay", value(ours.delay)),
            ("sensitivity", Some(ours.sensitivity.value)),
            ("complementary", Some(ours.complementary.value)),
        ] {
            let their = case["margins"][name].as_f64();
            let close = match (our, their) {
                (Some(our), Some(their)) => (our - their).abs() < DIGITS * their.abs(),
                (None, None) => true,
                _ => false,
            };
            assert!(close, "{name} of case {number}: {our:?} for {their:?}");
        }
    }
}

#[test]
fn gains_and_discretisations_are_those_of_scipy() {
    for case in &cases() {
        let system = system(case);
        if let Some(weight) = case["weight"].as_f64() {
            let states = DMatrix::identity(system.order(), system.order());
            let ports = DMatrix::identity(system.b.ncols(), system.b.ncols()) * weight;
            let cross = matrix(&case["cross"]);
            let regulator = linear_quadratic_regulator(&system.a, &system.b, &states, &ports, Some(&cross)).unwrap();
            assert_close(&regulator.gain, &matrix(&case["regulator"]), "regulator");
            let filter = kalman_filter(&system.a, &system.c, &states, &ports).unwrap();
            assert_close(&filter.gain, &matrix(&case["filter"]), "filter");
        } else {
            let held = system.sampled(0.05).unwrap();
            assert_close(&held.a, &matrix(&case["held_a"]), "Φ");
            assert_close(&held.b, &matrix(&case["held_b"]), "Γ");
            let states = DMatrix::identity(system.order(), system.order());
            let ports = DMatrix::identity(system.b.ncols(), system.b.ncols()) * 0.7;
            let regulator = continuous_regulator(&system.a, &system.b, &states, &ports).unwrap();
            assert_close(&regulator.gain, &matrix(&case["continuous_regulator"]), "continuous regulator");
            let filter = kalman_bucy_filter(&system.a, &system.c, &states, &ports).unwrap();
            assert_close(&filter.gain, &matrix(&case["continuous_filter"]), "continuous filter");
        }
    }
}

/// 1/(s + rate).
fn lag(rate: f64) -> StateSpace {
    let [a, one] = [-rate, 1.0].map(|value| DMatrix::from_element(1, 1, value));
    StateSpace::new(a, one.clone(), one, DMatrix::zeros(1, 1), None).unwrap()
}

#[test]
fn connected_systems_have_the_connected_response() {
    let (one, other) = (lag(1.0), lag(3.0));
    let close = |system: &StateSpace, expected: Complex<f64>| {
        let response = system.at_frequency(2.0).unwrap()[(0, 0)];
        assert!(size(response - expected) < 1e-14, "{response} for {expected}");
    };
    let [g, h] = [&one, &other].map(|system| system.at_frequency(2.0).unwrap()[(0, 0)]);
    close(&one.then(&other).unwrap(), g * h);
    close(&one.plus(&other).unwrap(), g + h);
    close(&one.feedback(&other).unwrap(), g / (g * h + 1.0));
    let sampled = one.sampled(0.1).unwrap();
    let late = Complex::new(0.4f64.cos(), -(0.4f64.sin())) * sampled.at_frequency(2.0).unwrap()[(0, 0)];
    close(&sampled.delayed(2).unwrap(), late);
}

#[test]
fn responses_to_steps_and_impulses_are_those_of_the_formula() {
    let system = lag(2.0);
    let (step, impulse) = (system.step_response(20, 0.1).unwrap(), system.impulse_response(20, 0.1).unwrap());
    for k in 0..20 {
        let decayed = (-0.2 * k as f64).exp();
        assert!((step[k] - 0.5 * (1.0 - decayed)).abs() < 1e-14);
        assert!((impulse[k] - decayed).abs() < 1e-14);
    }
    assert!((system.dc_gain().unwrap()[0] - 0.5).abs() < 1e-15);
    let sampled = system.sampled(0.1).unwrap();
    let slower = system.sampled(0.4).unwrap();
    assert!((&sampled.slower(4).unwrap().b - &slower.b).norm() < 1e-15);
    let answers = sampled.impulse_response(3, 0.1).unwrap();
    assert_eq!((answers[0], answers[1]), (0.0, sampled.b[0]));
}

#[test]
fn states_without_effect_are_trimmed() {
    // Two lags; only the first is an output, and the second does not act on it.
    let mut system = lag(1.0).plus(&lag(5.0)).unwrap();
    system.c[(0, 1)] = 0.0;
    let trimmed = system.trimmed();
    assert_eq!(trimmed.order(), 1);
    assert_eq!(trimmed.at_frequency(2.0), lag(1.0).at_frequency(2.0));
}

#[test]
fn inconsistent_systems_are_refused() {
    let (one, sampled) = (lag(1.0), lag(1.0).sampled(0.1).unwrap());
    let wide = DMatrix::zeros(1, 2);
    let refused = StateSpace::new(one.a.clone(), wide, one.c.clone(), one.d.clone(), None).unwrap_err().to_string();
    assert!(refused.contains("columns of the feedthrough"), "{refused}");
    let refused = one.then(&sampled).unwrap_err().to_string();
    assert!(refused.contains("Sample both at the same rate first."), "{refused}");
    assert!(sampled.sampled(0.1).is_err() && one.delayed(1).is_err() && one.slower(2).is_err() && one.noise().is_err());
    assert!(sampled.slower(0).is_err() && one.channel(1, 0).is_err());
    let direct = StateSpace::gain(DMatrix::from_element(1, 1, -1.0), None).unwrap();
    let refused = direct.feedback(&StateSpace::gain(DMatrix::identity(1, 1), None).unwrap()).unwrap_err().to_string();
    assert!(refused.contains("its direct gain is −1"), "{refused}");
    let silent = StateSpace { c: DMatrix::zeros(1, 1), ..one };
    assert!(silent.zeros().is_ok_and(|zeros| zeros.is_empty()) || silent.zeros().is_err());
}
