//! Stability, weights and predicted noise of the observer.

use super::*;
use stickslip_base::Preset;
use stickslip_base::parameters::presets;
use stickslip_core::block::Block as _;
use stickslip_core::control::{CurrentControlInput, CurrentControlState};
use stickslip_core::estimate::{DriveObserverInput, DriveObserverState};
use stickslip_core::fields::Fields as _;

/// Largest magnitude of a pole of the observer's error with the gains of a speed over the ripple velocity.
fn slowest_pole(linear: &Linear, observer: &DriveObserver<f64>, ratio: f64) -> f64 {
    let share = 1.0 / (1.0 + ratio * ratio);
    let gains = observer.gains.merge(&observer.fast_gains, &mut |slow, fast| fast + share * (slow - fast));
    let rows = [
        gains.angle,
        gains.twist,
        gains.motor_velocity,
        gains.velocity,
        gains.torque,
        gains.offset,
        gains.tacho,
        gains.acceleration,
        gains.acceleration_rate,
    ];
    let gain = DMatrix::from_fn(STATES, 3, |row, column| rows[row][column]);
    let error = &linear.phi * (DMatrix::identity(STATES, STATES) - gain * &linear.outputs);
    error.complex_eigenvalues().iter().map(|pole| libm::hypot(pole.re, pole.im)).fold(0.0, f64::max)
}

#[test]
fn the_error_dies_out_at_every_speed() {
    for name in ["clm-bench", "prototype", "clm-real"] {
        let mut preset: Preset<f64> = presets::find(name).expect("a preset").read().expect("a sound one");
        preset.model.tacho_ripple = 0.02;
        for rate in [1000.0, 4000.0, 10_000.0] {
            preset.bench.tick_rate = rate;
            let (model, dt, trust) = (&preset.model, 1.0 / rate, Trust { missing_torque: 0.1, ..Trust::default() });
            let linear = Linear::new(model, dt, &trust).expect("a linear drive");
            let observer = drive_observer(model, &preset.bench, &trust).expect("an observer");
            for ratio in [0.0, 0.3, 1.0, 3.0, 10.0, 1e6] {
                let pole = slowest_pole(&linear, &observer, ratio);
                assert!(pole < 1.0, "{name} at {rate} Hz, {ratio} of the ripple velocity: {pole}");
            }
            // The guard fires: an observer without encoder is not stable.
            let deaf = ObserverGains::default();
            let deaf = DriveObserver { gains: deaf, fast_gains: deaf, ..observer };
            assert!(slowest_pole(&linear, &deaf, 0.0) > 0.999_999);
        }
    }
}

#[test]
fn without_instruments_the_encoder_alone_corrects_a_stable_error() {
    for name in ["clm-bench", "prototype", "clm-real"] {
        let mut preset: Preset<f64> = presets::find(name).expect("a preset").read().expect("a sound one");
        let trust = DriveModelTrust::default();
        preset.bench.observer = ObserverChoice::Model(trust);
        for rate in [1000.0, 4000.0, 10_000.0] {
            preset.bench.tick_rate = rate;
            let observer = motion_observer(&preset.model, &preset.bench).expect("an observer");
            let MotionObserver::Model(observer) = observer else { panic!("{observer:?}") };
            let gains = observer.gains;
            for row in [gains.angle, gains.motor_velocity, gains.velocity, gains.torque] {
                assert!(row[0] != 0.0 && row[1..] == [0.0; 2], "{name}: {gains:?}");
            }
            let trust = Trust { missing_torque: trust.missing_torque, ..Trust::default() };
            let linear = Linear::new(&preset.model, 1.0 / rate, &trust).expect("a linear drive");
            let Linear { phi, outputs, .. } = linear.part(Sensors::Encoder);
            let error = (DMatrix::identity(5, 5) - encoder_gain(&gains) * outputs) * phi;
            let slowest =
                error.complex_eigenvalues().iter().map(|pole| libm::hypot(pole.re, pole.im)).fold(0.0, f64::max);
            assert!(slowest < 1.0, "{name} at {rate} Hz: {slowest}");
        }
    }
}

#[test]
fn the_predicted_noise_without_instruments_is_that_of_the_observer() {
    let preset: Preset<f64> = presets::find("clm-bench").expect("a preset").read().expect("a sound one");
    let (model, dt, trust) = (&preset.model, 250e-6, Trust { missing_torque: 0.3, ..Trust::default() });
    let predicted = encoder_noise(model, dt, &trust).expect("a noise");
    // The error of the estimate, driven by the noise of one count.
    let linear = Linear::new(model, dt, &trust).expect("a linear drive");
    let gains = linear.gains(model, 0.0, Sensors::Encoder).expect("gains");
    let gain = encoder_gain(&gains);
    let Linear { phi, outputs, .. } = linear.part(Sensors::Encoder);
    let normals = stickslip_base::noise::Normals::new(1);
    let (mut state, mut sum, count) = (DMatrix::zeros(5, 1), 0.0, 100_000);
    for k in 0..count {
        let ahead = &phi * &state;
        let error = count_noise(model) * normals.pair(0, k)[0] - (&outputs * &ahead)[(0, 0)];
        state = ahead + &gain * error;
        sum += state[(VELOCITY, 0)].powi(2);
    }
    let simulated = (sum / count as f64).sqrt();
    assert!((simulated / predicted - 1.0).abs() < 0.03, "{simulated} rad/s, predicted {predicted}");
}

#[test]
fn the_tacho_has_less_weight_where_it_ripples() {
    let mut preset: Preset<f64> = presets::find("prototype").expect("a preset").read().expect("a sound one");
    let observer =
        |preset: &Preset<f64>| drive_observer(&preset.model, &preset.bench, &Trust::default()).expect("an observer");
    preset.model.tacho_ripple = 0.0;
    let smooth = observer(&preset);
    assert_eq!(smooth.gains, smooth.fast_gains);
    preset.model.tacho_ripple = 0.01;
    let rippled = observer(&preset);
    assert_eq!(rippled.gains, smooth.gains);
    let [slow, fast] = [rippled.gains, rippled.fast_gains].map(|gains| gains.motor_velocity[1].abs());
    assert!(fast < 0.05 * slow, "{fast} against {slow}");
}

#[test]
fn behind_an_amplifier_that_takes_a_torque_the_observed_current_follows_its_reference() {
    let mut preset: Preset<f64> = presets::find("clm-bench").expect("a preset").read().expect("a sound one");
    preset.bench.observer = ObserverChoice::Model(DriveModelTrust::default());
    preset.bench.torque_amplifier = 1.0;
    let tick = crate::parameters(&preset.model, &preset.bench).expect("parameters").tick;
    let MotionObserver::Model(observer) = tick.observer else { panic!("{:?}", tick.observer) };
    let demand = CurrentControlInput { reference_current: 2.0, ..CurrentControlInput::default() };
    let voltage = tick.current.step(&mut CurrentControlState::default(), demand, 250e-6).voltage;
    let mut state = DriveObserverState { started: 1.0, ..DriveObserverState::default() };
    for tick in 0..40 {
        // Turning fast, so that a back-EMF would show; the measured current stays out.
        state.drive.velocity = 50.0;
        let input = DriveObserverInput {
            voltage,
            current: state.drive.load_current,
            angle: state.drive.angle,
            ..DriveObserverInput::default()
        };
        observer.follow(&mut state, &input, 250e-6, |_, _| {});
        let share = state.drive.load_current / 2.0;
        let expected = -libm::expm1(-250e-6 * f64::from(tick + 1) / preset.model.servo_lag);
        assert!((share - expected).abs() < 1e-3, "{share} instead of {expected} after {tick}");
    }
}
