//! Effect of compensation on a position controller at a reversal of friction.

use stickslip_core::control::Cascade;
use stickslip_core::control::reference::{Generator, Reference, Setpoint, Sine};
use stickslip_core::tick::Order;

use stickslip::design::{software, tune};
use stickslip::fast_bench::FastBench;
use stickslip::parameters::{self, presets};
use stickslip::workflow::position_loop::{as_cascade, as_state_feedback};
use stickslip::{
    AdaptiveChoice, AssumedFriction, CompensationChoice, ControllerChoice, CurveChoice, FeedforwardChoice,
    FrictionObserverChoice, FriedlandParkChoice, Preset, Settings, Watch,
};

/// The drive of the comparisons with nominal friction, its control at 1 kHz.
fn nominal() -> Preset<f64> {
    let text = presets::find("prototype").unwrap().text;
    let values = ["breakaway_torque", "kinetic_torque", "stribeck_velocity", "viscous_friction"]
        .into_iter()
        .zip(["0.45", "0.20", "1.0", "8e-3"])
        .flat_map(|(name, value)| {
            [format!("plant.screw_friction.model.lugre.sliding.{name}"), format!("model.own.{name}")]
                .map(|path| (path, value))
        })
        .collect::<Vec<_>>();
    let values: Vec<(&str, &str)> = values.iter().map(|(path, value)| (path.as_str(), *value)).collect();
    let text = parameters::set_all::<Preset<f64>>(&text, "t", &values).unwrap();
    parameters::read(&text, "t").unwrap()
}

/// The same with an automatically tuned controller of this kind.
fn tuned(controller: impl Fn(&ControllerChoice<f64>) -> ControllerChoice<f64>) -> Preset<f64> {
    let mut preset = nominal();
    let Preset { model, bench, .. } = &mut preset;
    bench.controller = tune(&controller(&bench.controller), model, bench, 10.0, &Watch::silent()).unwrap().controller;
    preset
}

/// The bench under control along a set-point for a time [s]; `see` gets time [s], set-point and true angle [rad].
pub(super) fn run(
    preset: &Preset<f64>,
    duration: f64,
    mut next: impl FnMut() -> Setpoint<f64>,
    mut see: impl FnMut(f64, f64, f64),
) {
    let settings = &preset.bench;
    let dt = settings.tick_time();
    let tick = software(&preset.model, settings).unwrap();
    let mut bench = FastBench::new(&preset.plant, tick, settings, settings.divider(), 7).unwrap();
    for cycle in 0..(duration / dt) as u64 {
        let reference = next();
        bench.tick(Order { control: 1.0, reference, ..Order::default() });
        see(cycle as f64 * dt, reference.position, bench.true_state().plant.machine.angle);
    }
}

/// Largest deviation of the screw [rad] about the reversals of a sine of 20 rad at 0.1 Hz, mean of two.
pub(super) fn reversal_peak(preset: &Preset<f64>, compensation: CompensationChoice<f64>) -> f64 {
    let preset = Preset { bench: Settings { compensation, ..preset.bench }, ..*preset };
    let sine = Sine { amplitude: 20.0, frequency: 0.1, fade_time: 0.0 };
    let mut setpoints = Generator::new(Reference::Sine(sine), preset.bench.tick_rate);
    let mut peaks = [0.0f64; 2];
    run(
        &preset,
        8.1,
        || setpoints.next(),
        |time, reference, angle| {
            // It turns at a quarter and at three quarters of its period.
            for (peak, reversal) in peaks.iter_mut().zip([2.5, 7.5]) {
                if (-0.02..0.5).contains(&(time - reversal)) {
                    *peak = peak.max((reference - angle).abs());
                }
            }
        },
    );
    0.5 * (peaks[0] + peaks[1])
}

#[test]
fn compensation_reduces_the_reversal_peaks() {
    let preset = tuned(as_cascade);
    let peak = |compensation| 1e3 * reversal_peak(&preset, compensation);
    let assumed = |share| AssumedFriction { desired: 0.0, share };
    let fed_forward = |share| CompensationChoice::Feedforward(FeedforwardChoice { belief: assumed(share) });
    let adaptive_from =
        |share| CompensationChoice::Adaptive(AdaptiveChoice { belief: assumed(share), ..AdaptiveChoice::default() });
    let alone = peak(CompensationChoice::Nothing);
    let curve = peak(CompensationChoice::Curve(CurveChoice::default()));
    let bristles = peak(fed_forward(1.0));
    let half = peak(fed_forward(0.5));
    let adaptive = peak(adaptive_from(1.0));
    let half_adaptive = peak(adaptive_from(0.5));
    let estimated = peak(CompensationChoice::FriedlandPark(FriedlandParkChoice::default()));
    let observed = peak(CompensationChoice::FrictionObserver(FrictionObserverChoice::default()));
    let all = format!(
        "{alone:.1} alone; {curve:.1} curve, {bristles:.1} bristles, {adaptive:.1} adaptive, {estimated:.1} estimated, \
         {observed:.1} observed; \
         half of it: {half:.1} bristles, {half_adaptive:.1} adaptive"
    );
    // A third remains for any shape, also with an estimate that started 50 % off.
    for compensated in [curve, bristles, adaptive, half_adaptive, estimated] {
        assert!(compensated < 0.4 * alone, "{all}");
    }
    // It uses the reversal of the drive, not that of the set-point.
    assert!(observed < 0.2 * alone, "{all}");
    assert!(half > 1.5 * bristles && half < 0.8 * alone, "{all}");
}

#[test]
fn a_state_feedback_has_a_smaller_reversal_peak_at_the_same_margins() {
    let [cascade, full] = [tuned(as_cascade), tuned(as_state_feedback)].map(|preset| {
        [
            CompensationChoice::Nothing,
            CompensationChoice::Feedforward(FeedforwardChoice::default()),
            CompensationChoice::FrictionObserver(FrictionObserverChoice::default()),
        ]
        .map(|compensation| 1e3 * reversal_peak(&preset, compensation))
    });
    let all = format!("cascade {cascade:.1?}, state feedback {full:.1?}: alone, fed forward, observed");
    assert!(full[0] < 0.2 * cascade[0] && full[1] < 0.6 * full[0] && full[2] < 0.4 * full[0], "{all}");
}

#[test]
fn a_step_far_beyond_the_torque_does_not_wind_a_state_feedback_up() {
    for name in ["clm-bench", "prototype"] {
        let mut preset: Preset<f64> = presets::find(name).unwrap().read().unwrap();
        preset.bench.controller = as_state_feedback(&preset.bench.controller);
        // From two counts to a turn, which requires ten times the torque at once: it overshoots no more than a small
        // one.
        for height in [1e-3, 0.02, 0.3, 1.26, 6.0] {
            let (mut peak, mut late) = (0.0f64, 0.0f64);
            let there = || Setpoint { position: height, ..Setpoint::default() };
            run(&preset, 3.0, there, |time, _, angle| {
                peak = peak.max(angle);
                late = if time > 2.0 { late.max((angle - height).abs()) } else { 0.0 };
            });
            assert!(peak < 2.0 * height + 5e-3 && late < 5e-3, "{name} {height}: peak {peak}, late {late}");
        }
    }
}

#[test]
fn the_peaks_are_those_of_an_independent_simulation() {
    // In C, with other integrators: 36.5 mrad alone, 8.1 and 7.7 mrad with the curve and with its bristles, 3.8 mrad with
    // the whole friction estimated by an observer.
    let mut preset = nominal();
    let gains = Cascade { position_gain: 63.7, velocity_gain: 0.183, integral_gain: 5.16, ..Cascade::default() };
    let ControllerChoice::Cascade(cascade) = &mut preset.bench.controller else { panic!("a cascade") };
    *cascade = Cascade { inertia: cascade.inertia, torque_limit: cascade.torque_limit, ..gains };
    let share = 1.0 / (1.0 - preset.model.doubt.friction);
    let exact = FrictionObserverChoice { share, ..FrictionObserverChoice::default() };
    for (compensation, expected) in [
        (CompensationChoice::Nothing, 36.5),
        (CompensationChoice::Curve(CurveChoice::default()), 8.1),
        (CompensationChoice::Feedforward(FeedforwardChoice::default()), 7.7),
        (CompensationChoice::FrictionObserver(exact), 3.8),
    ] {
        let peak = 1e3 * reversal_peak(&preset, compensation);
        assert!((peak / expected - 1.0).abs() < 0.2, "{compensation:?}: {peak} instead of {expected} mrad");
    }
}
