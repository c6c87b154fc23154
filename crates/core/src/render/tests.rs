//! Properties of the rendering laws.

use super::*;
use crate::drive::{TwoMass, Winding};
use crate::estimate::{
    AccelerationSensor, DriveModel, DriveModelInput, DriveObserver, DriveObserverInput, DriveObserverState, DriveState,
    ObserverGains,
};
use crate::fields::Fields as _;
use crate::friction::{Bristles, Friction, Stribeck};

const DT: f64 = 250e-6;

fn own() -> Stribeck<f64> {
    Stribeck::default()
}

fn desired() -> Stribeck<f64> {
    Stribeck { kinetic_torque: 0.12, stribeck_velocity: 1.5, ..Stribeck::default() }
}

/// An observer with gains of typical size.
fn observer() -> DriveObserver<f64> {
    let friction = Bristles::default().under(own());
    let model =
        DriveModel::new(TwoMass::default(), Winding::default(), 0.32e-3, Friction::default(), friction, 0.5 * DT);
    // Gains of a stationary Kalman filter at this tick, without the accelerometer.
    let gains = ObserverGains {
        angle: [0.1, 4e-5, 0.0],
        twist: [-0.028, 4e-6, 0.0],
        motor_velocity: [15.0, 0.029, 0.0],
        velocity: [23.0, 0.011, 0.0],
        torque: [-2.1, -2e-3, 0.0],
        tacho: [13.0, 0.028, 0.0],
        ..Default::default()
    };
    let fast_gains = ObserverGains { tacho: [20.0, 1e-3, 0.0], ..gains };
    let accelerometer = AccelerationSensor::default();
    DriveObserver {
        model,
        steps: 2,
        tacho_share: 0.2,
        accelerometer,
        gains,
        fast_gains,
        ripple_velocity: 2.0,
        ..DriveObserver::default()
    }
}

fn laws() -> [(&'static str, Law<f64>); 5] {
    let (desired, own, torque_limit) = (desired(), own(), 1.0);
    let rendered = Bristles::default().under(desired);
    let paper = DifferenceTorque { desired, own, fade_velocity: 0.1, torque_limit };
    [
        ("paper", Law::Paper(paper)),
        ("smooth", Law::Smooth(SmoothDifference { desired, own, smoothing_velocity: 0.01, torque_limit })),
        ("Karnopp", Law::Karnopp(Karnopp { desired, own, band: 0.1, torque_limit, ..Karnopp::default() })),
        (
            "bristle",
            Law::Bristle(BristleDifference { observer: observer(), desired: rendered, ahead: (0, 3), torque_limit }),
        ),
        (
            "admittance",
            Law::Admittance(Admittance {
                observer: observer(),
                desired: rendered,
                bandwidth: 250.0,
                ahead: (0, 3),
                torque_limit,
            }),
        ),
    ]
}

/// A drive at a held speed, exactly as in the model of the laws.
#[derive(Default)]
struct Rig {
    drive: DriveState<f64>,
    law: LawState<f64>,
}

impl Rig {
    /// After half a second at this speed [rad/s].
    fn settled(law: &Law<f64>, speed: f64) -> Rig {
        let drive = DriveState { velocity: speed, motor_velocity: speed, ..DriveState::default() };
        let mut rig = Rig { drive, ..Rig::default() };
        for _ in 0..2000 {
            rig.tick(law, speed);
        }
        rig
    }

    fn input_at(&self, speed: f64) -> LawInput<f64> {
        let DriveState { angle, velocity, motor_velocity, load_current: current, .. } = self.drive;
        let motor_torque = desired().torque(speed) + 0.1 * (speed - motor_velocity);
        LawInput { estimated_velocity: velocity, angle, motor_velocity, acceleration: 0.0, current, motor_torque }
    }

    /// Torque of the law; advances the drive by one tick.
    fn tick(&mut self, law: &Law<f64>, speed: f64) -> f64 {
        let input = self.input_at(speed);
        let torque = law.render(&mut self.law, input, DT).torque;
        let DriveObserver { model, steps, .. } = observer();
        let voltage = model.winding.resistance * torque / model.winding.torque_constant
            - model.winding.torque_constant * self.drive.velocity;
        let held = DriveModelInput { motor_torque: input.motor_torque, voltage, resistance: 0.0 };
        for _ in 0..steps {
            model.run(&mut self.drive, held, DT / steps as f64);
        }
        self.law = LawState { motor_torque: input.motor_torque, voltage, torque, ..self.law };
        torque
    }
}

#[test]
fn every_law_renders_the_difference_at_constant_speed() {
    for (name, law) in laws() {
        for speed in [-20.0, -2.0, 2.0, 20.0] {
            let mut rig = Rig::settled(&law, speed);
            let (torque, speed) = (rig.tick(&law, speed), rig.drive.velocity);
            let wanted = desired().torque(speed) - own().torque(speed);
            // The smooth sign is close to 1 at 200 times its velocity.
            assert!((torque - wanted).abs() < 0.002 * wanted.abs(), "{name} at {speed}: {torque}, not {wanted}");
        }
    }
}

#[test]
fn a_law_starts_with_the_torque_of_the_previous_one_and_fades_it_out() {
    for (before, first) in laws() {
        for (after, second) in laws() {
            let mut rig = Rig::settled(&first, 2.0);
            let torque = rig.law.torque;
            rig.law.swapped = 1.0;
            let begun = rig.tick(&second, 2.0);
            assert!((begun - torque).abs() < 1e-12, "{before} to {after}: {torque} steps to {begun}");
            for _ in 0..2000 {
                rig.tick(&second, 2.0);
            }
            assert!(rig.law.bump.abs() < 1e-9, "{before} to {after}: {} is left", rig.law.bump);
        }
    }
    // Without the fading the torque steps.
    let [(_, paper), .., (_, admittance)] = laws();
    let mut rig = Rig::settled(&paper, 2.0);
    let torque = rig.law.torque;
    let stepped = rig.tick(&admittance, 2.0);
    assert!((stepped - torque).abs() > 1e-3, "{torque} to {stepped}");
}

#[test]
fn a_non_finite_number_reaches_neither_the_motor_nor_the_state() {
    for (name, law) in laws() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for place in 0..5 {
                let mut rig = Rig::settled(&law, 2.0);
                let mut input = rig.input_at(2.0);
                let fields = [
                    &mut input.estimated_velocity,
                    &mut input.angle,
                    &mut input.motor_velocity,
                    &mut input.acceleration,
                    &mut input.current,
                ];
                *fields.into_iter().nth(place).expect("five of them") = bad;
                let output = law.render(&mut rig.law, input, DT);
                assert!(output.torque.abs() <= 1.0, "{name}, {bad} at {place}: {}", output.torque);
                let after = rig.law;
                rig.law.map(&mut |number: f64| {
                    assert!(number.is_finite(), "{name}, {bad} at {place}: {after:?}");
                    number
                });
            }
        }
    }
}

#[test]
fn a_diverging_observer_restarts_before_it_overflows() {
    let stable = observer();
    let gains = stable.gains.map(&mut |gain: f64| -30.0 * gain);
    let unstable = DriveObserver { gains, fast_gains: gains, ..stable };
    let mut state = DriveObserverState::default();
    let mut begun = 0;
    for _ in 0..5000 {
        let input = DriveObserverInput { angle: 1.0, motor_velocity: 1.0, ..DriveObserverInput::default() };
        unstable.follow(&mut state, &input, DT, |_, _| ());
        begun += u32::from(state.drive.angle == 1.0);
        state.map(&mut |number: f64| {
            assert!(number.is_finite(), "{state:?}");
            number
        });
    }
    assert!(begun > 2, "it restarted {begun} times");
}

#[test]
fn at_rest_karnopps_law_adds_the_holding_torque_that_own_friction_lacks() {
    let Law::Karnopp(law) = laws()[2].1 else { panic!("the third law is Karnopp's") };
    let stronger = Karnopp { desired: Stribeck { breakaway_torque: 0.5, ..desired() }, ..law };
    let at_rest = |motor_torque| {
        let input = LawInput { motor_torque, ..LawInput::default() };
        stronger.step(&mut LawState::default(), input, DT).torque
    };
    // Own friction holds 0.3 N m, the desired one 0.5.
    assert_eq!((at_rest(0.2), at_rest(-0.2)), (0.0, 0.0));
    assert!((at_rest(0.4) - 0.1).abs() < 1e-12 && (at_rest(0.9) - 0.2).abs() < 1e-12);
}
