//! Design against SciPy and python-control (`tests/reference/design`), and its guards.

use crate::DesignError;
use nalgebra::{Complex, DMatrix, DVector};
use serde_json::Value;
use stickslip_core::block::Block;
use stickslip_core::control::{
    Cascade, ControllerInput, CurrentControl, Pid, VelocityObserver, VelocityObserverInput, VelocityObserverState,
};

use super::*;

/// Accuracy of double precision after a few matrix products for well-conditioned systems of order 5.
const DIGITS: f64 = 1e-9;

fn reference(name: &str) -> Vec<Value> {
    let numbers: Value = serde_json::from_str(include_str!("../../../tests/reference/design/design.json")).unwrap();
    numbers[name].as_array().unwrap().clone()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn vector(value: &Value) -> DVector<f64> {
    DVector::from_iterator(value.as_array().unwrap().len(), value.as_array().unwrap().iter().map(number))
}

fn matrix(value: &Value) -> DMatrix<f64> {
    let rows: Vec<_> = value.as_array().unwrap().iter().map(|row| vector(row).transpose()).collect();
    DMatrix::from_rows(&rows)
}

fn poles(value: &Value) -> Vec<Complex<f64>> {
    value.as_array().unwrap().iter().map(|pair| Complex::new(number(&pair[0]), number(&pair[1]))).collect()
}

fn assert_same(ours: &DMatrix<f64>, theirs: &DMatrix<f64>, what: &str) {
    let deviation = (ours - theirs).norm() / theirs.norm();
    assert!(deviation < DIGITS, "{what}: relative deviation {deviation:.1e}");
}

fn column(vector: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_column_slice(vector.len(), 1, vector.as_slice())
}

#[test]
fn discretisation_is_that_of_scipy() {
    for case in reference("zero_order_hold") {
        let (phi, gamma) = zero_order_hold(&matrix(&case["a"]), &matrix(&case["b"]), number(&case["dt"])).unwrap();
        assert_same(&phi, &matrix(&case["phi"]), "Φ");
        assert_same(&gamma, &matrix(&case["gamma"]), "Γ");
    }
}

#[test]
fn feedback_gains_are_those_of_python_control() {
    for case in reference("placement") {
        let gain = place_poles(&matrix(&case["a"]), &vector(&case["b"]), &poles(&case["poles"])).unwrap();
        assert_same(&column(&gain), &column(&vector(&case["gain"])), "k");
    }
}

#[test]
fn observer_gains_are_those_of_python_control() {
    for case in reference("observer") {
        let (a, c, targets) = (matrix(&case["a"]), vector(&case["c"]), poles(&case["poles"]));
        for (form, name) in [(ObserverForm::Predictor, "predictor"), (ObserverForm::Current, "current")] {
            let gain = observer_gain(&a, &c, &targets, form).unwrap();
            assert_same(&column(&gain), &column(&vector(&case[name])), name);
        }
    }
}

#[test]
fn covariances_are_those_of_scipy() {
    for case in reference("lyapunov") {
        let (a, q) = (matrix(&case["a"]), matrix(&case["q"]));
        let covariance = discrete_lyapunov(&a, &q).unwrap();
        assert_same(&covariance, &matrix(&case["p"]), "P");
        let radius = spectral_radius(&a).unwrap();
        assert!((radius - number(&case["radius"])).abs() < DIGITS, "{radius}");
    }
}

#[test]
fn the_velocity_observer_and_its_noise_are_those_of_python_control() {
    for case in reference("velocity_observer") {
        let (dt, poles) = (number(&case["dt"]), vector(&case["poles"]));
        let gains = velocity_observer([poles[0], poles[1], poles[2]], number(&case["lead"]), dt).unwrap();
        let theirs = vector(&case["gain"]);
        for (ours, theirs) in [gains.angle_gain, gains.velocity_gain, gains.offset_gain].iter().zip(&theirs) {
            // The three gains differ by orders of magnitude: each on its own.
            assert!((ours / theirs - 1.0).abs() < DIGITS, "{ours} instead of {theirs}");
        }
        let noise = velocity_noise(&gains, number(&case["counts"]), number(&case["acceleration_rms"]), dt).unwrap();
        assert!((noise / number(&case["velocity_rms"]) - 1.0).abs() < DIGITS, "{noise}");
    }
}

#[test]
fn the_closed_form_of_the_velocity_observer_is_ackermanns() {
    for (rates, dt) in [([250.0; 3], 250e-6), ([50.0, 500.0, 2000.0], 1e-4), ([250.0; 3], 1e-3)] {
        let gains = velocity_observer(rates, 5e-3, dt).unwrap();
        let ratio = gains.screw_ratio;
        let continuous = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, 0.0, 0.0, -ratio, 0.0, 0.0, 0.0]);
        let (a, _) = zero_order_hold(&continuous, &DMatrix::from_column_slice(3, 1, &[0.0, ratio, 0.0]), dt).unwrap();
        let c = DVector::from_column_slice(&[1.0, 0.0, 0.0]);
        let targets = rates.map(|rate| Complex::new((-rate * dt).exp(), 0.0));
        let gain = observer_gain(&a, &c, &targets, ObserverForm::Current).unwrap();
        for (closed, ackermann) in [gains.angle_gain, gains.velocity_gain, gains.offset_gain].iter().zip(&gain) {
            assert!((closed / ackermann - 1.0).abs() < DIGITS, "{closed} and {ackermann}");
        }
    }
}

#[test]
fn the_default_observer_and_current_control_are_those_of_the_default_machine() {
    let designed = velocity_observer([250.0; 3], 5e-3, 250e-6).unwrap();
    let default = VelocityObserver::<f64>::default();
    for (a, b) in [
        (designed.screw_ratio, default.screw_ratio),
        (designed.angle_gain, default.angle_gain),
        (designed.velocity_gain, default.velocity_gain),
        (designed.offset_gain, default.offset_gain),
    ] {
        assert!((a / b - 1.0).abs() < 1e-14, "{a} instead of {b}");
    }
    let designed = current_control(CurrentControl::default(), 0.61, 0.42e-3, 250e-6).unwrap();
    let default = CurrentControl::<f64>::default();
    assert!((designed.proportional_gain / default.proportional_gain - 1.0).abs() < 1e-14);
    assert!((designed.integral_gain / default.integral_gain - 1.0).abs() < 1e-14);
}

/// Standard normals from sums of twelve uniform numbers of a small linear congruence.
fn normals(mut seed: u64) -> impl FnMut() -> f64 {
    let mut uniform = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

#[test]
fn the_predicted_velocity_noise_is_that_of_the_observer() {
    let (dt, counts, rms) = (250e-6, 10_000.0, 0.09);
    let observer = velocity_observer([250.0; 3], 5e-3, dt).unwrap();
    let predicted = velocity_noise(&observer, counts, rms, dt).unwrap();
    let mut state = VelocityObserverState { velocity: 37.0, ..VelocityObserverState::at(0.0) };
    let (mut noise, mut squares, samples) = (normals(7), 0.0, 200_000);
    for k in 0..samples {
        // 37 rad/s: 14.7 counts a sample, so that the quantisation is white.
        let angle = 37.0 * f64::from(k) * dt;
        let count = std::f64::consts::TAU / counts;
        let input = VelocityObserverInput { angle: (angle / count).round() * count, acceleration: rms * noise() };
        let out = observer.step(&mut state, input, dt);
        squares += (out.velocity - 37.0) * (out.velocity - 37.0);
    }
    let measured = (squares / f64::from(samples)).sqrt();
    // 200 000 samples of a correlation time near 20 samples: 0.7 % for one sigma; five of them.
    assert!((measured / predicted - 1.0).abs() < 0.04, "{measured} measured, {predicted} predicted");
}

#[test]
fn a_pid_by_bandwidth_has_a_triple_pole() {
    let (inertia, bandwidth) = (1e-3, 20.0);
    let pid = pid_by_bandwidth(Pid::default(), inertia, bandwidth).unwrap();
    // J·s³ + K_d·s² + K_p·s + K_i = J·(s + ω)³
    assert!((pid.derivative_gain - 0.06).abs() < 1e-15);
    assert!((pid.proportional_gain - 1.2).abs() < 1e-15);
    assert!((pid.integral_gain - 8.0).abs() < 1e-14);
}

#[test]
fn a_cascade_as_pid_has_the_same_torque() {
    let cascade = Cascade { position_gain: 22.0, velocity_gain: 0.3, integral_gain: 5.0, ..Cascade::<f64>::default() };
    let pid = cascade_as_pid(&cascade);
    // At t = 0 from rest the integrals are 0, and the cascade's ∫(ṙ − ω) = r − φ has not started: with r = φ both
    // agree.
    let input = ControllerInput {
        reference_position: 1.0,
        reference_velocity: 0.4,
        reference_acceleration: 0.0,
        measured_angle: 1.0,
        measured_velocity: 0.1,
        ..ControllerInput::default()
    };
    let (a, b) = (cascade.step(&mut Default::default(), input, 1e-3), pid.step(&mut Default::default(), input, 1e-3));
    assert!((a.torque - b.torque).abs() < 1e-15, "{a:?} {b:?}");
    assert_eq!((pid.proportional_gain, pid.integral_gain), (0.3 * 22.0 + 5.0, 110.0));
}

fn double_integrator() -> (DMatrix<f64>, DVector<f64>) {
    (DMatrix::from_row_slice(2, 2, &[1.0, 0.1, 0.0, 1.0]), DVector::from_column_slice(&[0.005, 0.1]))
}

fn real(poles: &[f64]) -> Vec<Complex<f64>> {
    poles.iter().map(|&pole| Complex::new(pole, 0.0)).collect()
}

#[test]
fn a_state_out_of_reach_is_refused_with_the_condition() {
    let a = DMatrix::from_row_slice(2, 2, &[0.9, 0.0, 0.0, 0.5]);
    let b = DVector::from_column_slice(&[1.0, 0.0]);
    let error = place_poles(&a, &b, &real(&[0.1, 0.2])).unwrap_err();
    assert!(matches!(error.of(), Some(DesignError::NotReachable { property: "controllable", .. })), "{error}");
    let error = observer_gain(&a, &b, &real(&[0.1, 0.2]), ObserverForm::Predictor).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("not observable") && text.contains("below 1.0e-12") && text.contains("Measure more"),
        "{text}"
    );
    let lost = DMatrix::from_row_slice(2, 2, &[0.0, 0.0, 0.0, 0.0]);
    assert!(matches!(
        observer_gain(&lost, &b, &real(&[0.1, 0.2]), ObserverForm::Current).as_ref().err().and_then(|error| error.of()),
        Some(DesignError::NotReachable { property: "observable", .. })
    ));
}

#[test]
fn poles_that_are_unstable_unpaired_or_too_few_are_refused() {
    let (a, b) = double_integrator();
    let text = place_poles(&a, &b, &real(&[0.5, -1.25])).unwrap_err().to_string();
    assert!(text.contains("-1.25") && text.contains("magnitude 1.25") && text.contains("at most 1"), "{text}");
    assert!(matches!(
        place_poles(&a, &b, &real(&[0.5, f64::NAN])).as_ref().err().and_then(|error| error.of()),
        Some(DesignError::UnstablePole { .. })
    ));
    let alone = [Complex::new(0.5, 0.2), Complex::new(0.5, 0.3)];
    let text = place_poles(&a, &b, &alone).unwrap_err().to_string();
    assert!(text.contains("0.5 + 0.2i has no partner"), "{text}");
    let error = place_poles(&a, &b, &real(&[0.5])).unwrap_err();
    assert!(matches!(error, Error::Dimension { found: 1, expected: 2, .. }), "{error}");
}

#[test]
fn an_unstable_system_has_no_covariance() {
    let (a, _) = double_integrator();
    let text = discrete_lyapunov(&a, &DMatrix::identity(2, 2)).unwrap_err().to_string();
    assert!(text.contains("spectral radius is 1") && text.contains("needs less than"), "{text}");
    let growing = DMatrix::from_row_slice(1, 1, &[1.5]);
    assert!(matches!(
        discrete_lyapunov(&growing, &growing).as_ref().err().and_then(|error| error.of()), Some(DesignError::Unstable { spectral_radius, .. }) if (spectral_radius - 1.5).abs() < 1e-12));
    let nilpotent = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, 0.0]);
    assert_eq!(spectral_radius(&nilpotent).unwrap(), 0.0);
}

#[test]
fn matrices_of_inconsistent_sizes_or_with_non_finite_numbers_are_refused() {
    let (a, b) = double_integrator();
    let tall = DMatrix::from_element(3, 2, 1.0);
    let broken = DMatrix::from_element(2, 2, f64::NAN);
    let identity = DMatrix::identity(2, 2);
    assert!(matches!(zero_order_hold(&tall, &tall, 1e-3), Err(Error::Dimension { found: 2, expected: 3, .. })));
    assert!(matches!(zero_order_hold(&a, &tall, 1e-3), Err(Error::Dimension { found: 3, expected: 2, .. })));
    assert!(matches!(zero_order_hold(&broken, &a, 1e-3), Err(Error::NotFinite { .. })));
    assert!(matches!(zero_order_hold(&(&a * 1e9), &a, 1.0), Err(Error::NotFinite { .. })), "e^(1e9) is not finite");
    assert!(matches!(discrete_lyapunov(&broken, &identity), Err(Error::NotFinite { .. })));
    assert!(matches!(discrete_lyapunov(&(identity * 0.5), &tall.transpose()), Err(Error::Dimension { .. })));
    let three = DVector::from_element(3, 1.0);
    assert!(matches!(place_poles(&a, &three, &real(&[0.1, 0.2])), Err(Error::Dimension { found: 3, expected: 2, .. })));
    assert!(matches!(place_poles(&a, &(b * f64::NAN), &real(&[0.1, 0.2])), Err(Error::NotFinite { .. })));
}

#[test]
fn invalid_numbers_of_a_machine_are_refused_with_both_values() {
    let refused = [
        velocity_observer([250.0, -1.0, 250.0], 5e-3, 250e-6).unwrap_err(),
        velocity_observer([250.0, 250.0, 1e5], 5e-3, 250e-6).unwrap_err(),
        velocity_observer([250.0; 3], 5.0, 250e-6).unwrap_err(),
        velocity_observer([250.0; 3], 5e-3, 4000.0).unwrap_err(),
        velocity_noise(&VelocityObserver::default(), 0.0, 0.1, 250e-6).unwrap_err(),
        velocity_noise(&VelocityObserver::default(), 1e4, f64::NAN, 250e-6).unwrap_err(),
        current_control(CurrentControl::default(), 0.0, 0.42e-3, 250e-6).unwrap_err(),
        current_control(CurrentControl::default(), 0.61, f64::NAN, 250e-6).unwrap_err(),
        pid_by_bandwidth(Pid::default(), -1e-3, 20.0).unwrap_err(),
        pid_by_bandwidth(Pid::default(), 1e-3, f64::INFINITY).unwrap_err(),
    ];
    for error in &refused {
        assert!(matches!(error, Error::OutOfRange { .. }), "{error}");
    }
    let text = refused[2].to_string();
    assert_eq!(text, "the screw lead = 5 m is outside 0.0001 … 1 m. Give metres per revolution: 5 mm are 0.005.");
}
