//! The measured frequency response is that of the axis.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use stickslip::bench::{Bench, Command, VirtualBench};
use stickslip::experiment::{Answer, COHERENT, Line, Response, ResponsePlan, home, measure_response};
use stickslip::parameters::presets;
use stickslip::{Error, Preset, Watch};
use stickslip_core::friction::Model as FrictionModel;

fn homed(change: impl Fn(&mut Preset<f64>)) -> VirtualBench {
    let mut preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    change(&mut preset);
    let mut bench = VirtualBench::new(&preset, 1).unwrap();
    home(&mut bench, &Watch::silent()).unwrap();
    bench
}

fn measured(plan: ResponsePlan<f64>) -> Response {
    measure_response(&plan, &mut homed(|_| {}), &Watch::silent()).unwrap()
}

const TACHO: fn(&Line) -> Answer = |line| line.velocity;
const ENCODER: fn(&Line) -> Answer = |line| line.angle;

#[test]
fn sliding_it_is_that_of_the_axis_within_1_db_and_5_degrees_wherever_it_is_coherent() {
    let plan = ResponsePlan { periods: 32.0, ..ResponsePlan::default() };
    let response = measured(plan);
    assert!(response.complete && response.stuck == 0.0, "{:?}", response.warnings());
    // 32 periods do not fit on the stroke at once.
    assert!((response.duration / plan.duration([-157.0, 157.0]) - 1.0).abs() < 0.05, "{}", response.duration);
    // The load is hardly moved above the coupling's resonance: there the encoder shows counts only.
    for (sensor, least) in [(TACHO, 45), (ENCODER, 30)] {
        let ([magnitude, phase], coherent) = response.deviation(sensor);
        assert!(magnitude < 1.0 && phase < 5.0, "{magnitude} dB, {phase}°");
        assert!(coherent >= least, "{coherent} of {}", response.lines.len());
    }
    // The intervals are neither too narrow nor too wide. The machine reads its tacho half a step of 25 µs early.
    let early = |frequency: f64| 360.0 * frequency * 12.5e-6;
    let answers = response.lines.iter().flat_map(|line| [line.velocity, line.angle].map(|it| (line.frequency, it)));
    let coherent: Vec<(f64, Answer)> = answers.filter(|(_, answer)| answer.coherence > COHERENT).collect();
    let holds = |(frequency, answer): &&(f64, Answer)| {
        let ([by, turned], [magnitude, phase]) = (answer.deviation(), answer.interval());
        by.abs() <= magnitude && turned.abs() <= phase + early(*frequency)
    };
    let share = coherent.iter().filter(holds).count() as f64 / coherent.len() as f64;
    // Both at once: 0.95² of them.
    assert!(share > 0.85, "{share}");
    assert!(coherent.iter().all(|(_, answer)| answer.interval()[0] < 1.5));
}

#[test]
fn a_chirp_gives_the_same() {
    let response = measured(ResponsePlan { chirp: 1.0, ..ResponsePlan::default() });
    assert_eq!(response.lines.len(), 397);
    let coherent = response.lines.iter().map(TACHO).filter(|answer| answer.coherence > COHERENT);
    let off: Vec<f64> = coherent.map(|answer| answer.deviation()[0].abs()).collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    assert!(off.len() > 300 && mean < 0.3, "{mean} dB at {}", off.len());
}

#[test]
fn at_rest_it_is_that_of_the_load_on_its_bristles() {
    let still = |preset: &mut Preset<f64>| {
        preset.model.motor_friction.model = FrictionModel::Nothing;
        preset.plant.motor_friction = preset.model.motor_friction;
    };
    let plan = ResponsePlan { velocity: 0.0, periods: 32.0, ..ResponsePlan::default() };
    let response = measure_response(&plan, &mut homed(still), &Watch::silent()).unwrap();
    let ([magnitude, phase], coherent) = response.deviation(TACHO);
    assert!(magnitude < 1.0 && phase < 5.0, "{magnitude} dB, {phase}°");
    assert!(coherent >= 35, "{coherent}");
    // The angle changes by less than a count: it is not evaluated.
    assert_eq!(response.deviation(ENCODER).1, 0);
    assert!(response.warnings().iter().any(|warning| warning.starts_with("The encoder shows no response")));
    // With its own friction the motor differs from the modelled axis, and the report states the reason.
    let response = measured(ResponsePlan { velocity: 0.0, periods: 4.0, ..ResponsePlan::default() });
    assert!(response.warnings()[0].starts_with("The drive motor's own friction, 2"), "{:?}", response.warnings());
    assert!(response.deviation(TACHO).0[0] > 3.0);
}

#[test]
fn a_load_in_the_wrong_regime_gives_a_warning() {
    let short = ResponsePlan { periods: 3.0, ..ResponsePlan::default() };
    let response = measured(ResponsePlan { velocity: 2.0, ..short });
    assert!(response.warnings()[0].starts_with("The load was nearly at rest in "), "{:?}", response.warnings());
    let mut bench = homed(|preset| {
        preset.plant.wheel.preload = 0.0;
        preset.model.own.breakaway_torque *= 4.0;
    });
    let response =
        measure_response(&ResponsePlan { velocity: 0.0, share: 0.3, ..short }, &mut bench, &Watch::silent()).unwrap();
    assert!(response.warnings()[0].starts_with("The load at rest moved by "), "{:?}", response.warnings());
}

#[test]
fn invalid_plans_are_refused_before_any_motion() {
    let mut bench = homed(|_| {});
    let mut refused =
        |plan: ResponsePlan<f64>| measure_response(&plan, &mut bench, &Watch::silent()).unwrap_err().to_string();
    let plan = ResponsePlan::default();
    assert!(refused(ResponsePlan { highest_frequency: 1700.0, ..plan }).contains("plan.highest_frequency"));
    assert!(refused(ResponsePlan { velocity: 150.0, period: 2.0, ..plan }).contains("plan.period"));
    assert!(refused(ResponsePlan { velocity: 1e-6, ..plan }).contains("slides instead of creeping"));
    assert!(bench.step(Command::default()).unwrap().angle.abs() < 1.0);
    let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    let mut unhomed = VirtualBench::new(&preset, 1).unwrap();
    assert!(matches!(measure_response(&plan, &mut unhomed, &Watch::silent()), Err(Error::NotHomed)));
}

#[test]
fn a_cancelled_response_returns_its_periods_and_stops() {
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = cancelled.clone();
    // The stroke holds nine periods: the second pass is the first that starts after some.
    let watch = Watch::new(cancelled, move |_, done| flag.store(done > 0.0, Ordering::Relaxed));
    let mut bench = homed(|_| {});
    let response = measure_response(&ResponsePlan::default(), &mut bench, &watch).unwrap();
    assert!(!response.complete && (2..16).contains(&response.periods), "{}", response.periods);
    assert!(response.warnings().iter().any(|warning| warning.starts_with("Cancelled")));
    let [one, other] = [0, 1].map(|_| bench.step(Command::default()).unwrap().angle);
    assert!((one - other).abs() < 1e-3);
}
