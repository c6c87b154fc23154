//! Design of a controller on a running bench.

use crate::LiveError;
use nalgebra::ComplexField as _;

use super::*;
use crate::protocol::{DraftKind, HuntingView, LoopDraft, LoopView, PoleDrag, TuneProgress};
use stickslip_base::ControllerChoice;
use stickslip_design::linear::Operating;
use stickslip_design::{PositionLoop, axis_control};
use stickslip_experiment::workflow::hunting::HuntingRun;
use stickslip_experiment::workflow::position_loop::LoopRun;

fn values(pairs: &[(&str, &str)]) -> BTreeMap<String, String> {
    pairs.iter().map(|(path, value)| ((*path).into(), (*value).into())).collect()
}

fn loop_view(live: &Live, draft: LoopDraft) -> LoopView {
    match live.call("looks", Call::Loop(draft)).unwrap() {
        Answer::Loop(view) => *view,
        other => panic!("{other:?}"),
    }
}

fn number(view: &LoopView, load: &str, key: &str) -> Option<f64> {
    let at = view.loads.iter().find(|at| at.load == load).unwrap();
    at.numbers.iter().find(|number| number.key == key).unwrap().value
}

/// All numbers of an answer are finite: others would become `null` in JSON.
fn whole(answer: &impl serde::Serialize, optional: &[&str]) {
    fn walk(value: &serde_json::Value, key: &str, optional: &[&str]) {
        match value {
            serde_json::Value::Null => assert!(optional.contains(&key), "{key} is null"),
            serde_json::Value::Array(all) => all.iter().for_each(|one| walk(one, key, optional)),
            serde_json::Value::Object(all) => all.iter().for_each(|(key, one)| walk(one, key, optional)),
            _ => {}
        }
    }
    walk(&serde_json::to_value(answer).unwrap(), "", optional);
}

/// Fields that may be `null` in an answer.
const OPTIONAL: [&str; 10] =
    ["value", "choice", "minimum", "maximum", "default", "grip", "verdict", "sensitivity", "kind", "overshoot"];

#[test]
fn a_draft_has_the_numbers_of_its_loop_and_changes_nothing() {
    let (live, _project) = live();
    let draft = LoopDraft {
        values: values(&[("bench.controller.velocity_gain", "0.05"), ("bench.controller.position_gain", "11")]),
        speed: Some(7.0),
        thorough: true,
        ..LoopDraft::default()
    };
    let view = loop_view(&live, draft.clone());
    assert_eq!(
        view.values,
        values(&[("bench.controller.velocity_gain", "0.05"), ("bench.controller.position_gain", "11.0"),])
    );
    let preset = live.shared.parameters.tuning().preset_with(&draft.values.into_iter().collect::<Vec<_>>()).unwrap();
    let control = axis_control(&preset.model, &preset.bench).unwrap();
    for (load, at) in [("sliding", Operating::Sliding(7.0)), ("stuck", Operating::Stuck)] {
        let closes = PositionLoop::new(control, &preset.model, &preset.bench, at).unwrap();
        let quality = closes.quality(&preset.model).unwrap();
        assert_eq!(number(&view, load, "sensitivity_peak"), Some(quality.margins.sensitivity.value));
        assert_eq!(number(&view, load, "gain_margin"), quality.margins.gain.map(|gain| 20.0 * gain.value.log10()));
        assert_eq!(number(&view, load, "noise_torque"), Some(quality.noise_torque));
        let at = view.loads.iter().find(|at| at.load == load).unwrap();
        assert_eq!((at.stable, at.poles.len()), (true, quality.poles.iter().filter(|z| z.modulus() > 1e-9).count()));
        // A pole is where its z is, and its damping is that of its place.
        let dt = closes.axis().dt.unwrap();
        for pole in at.poles.iter().filter(|pole| pole.real > -500.0) {
            let z = nalgebra::Complex::new(pole.real * dt, pole.imaginary * dt).exp();
            assert!(quality.poles.iter().any(|other| (other - z).modulus() < 1e-5), "{pole:?}");
            assert!((pole.damping + pole.real / pole.frequency).abs() < 1e-4);
        }
        assert!(at.frequency.len() <= 500 && at.frequency.is_sorted() && at.frequency.len() == at.phase.len());
        assert!(at.time.len() <= 400 && at.time.len() == at.setpoint.len() && at.time.len() == at.disturbed.len());
        // Where the phase margin is, the loop gain is 1.
        let phase = at.marks.iter().find(|mark| mark.name == "phase margin").unwrap();
        assert!(phase.decibels.abs() < 1e-3 && (phase.real.hypot(phase.imaginary) - 1.0).abs() < 1e-4, "{phase:?}");
    }
    let run = LoopRun::new(&preset, 7.0).unwrap();
    let verdict = view.verdict.as_ref().unwrap();
    assert_eq!(verdict.worst.sensitivity, Some(run.corners[0].sensitivity));
    assert_eq!(verdict.fair, run.is_fair() && run.is_quiet());
    whole(&view, &OPTIONAL);
    assert_eq!(status(&live).changed, 0);
}

#[test]
fn an_unstable_loop_has_no_steps_and_is_reported_as_such() {
    let (live, _project) = live();
    let view = loop_view(
        &live,
        LoopDraft {
            values: values(&[("bench.controller.velocity_gain", "5")]),
            thorough: true,
            ..LoopDraft::default()
        },
    );
    let sliding = &view.loads[0];
    assert!(!sliding.stable && sliding.setpoint.is_empty() && number(&view, "sliding", "noise_torque").is_none());
    assert!(sliding.poles.iter().any(|pole| pole.damping < 0.0));
    let verdict = view.verdict.as_ref().unwrap();
    assert!(!verdict.fair && verdict.sentences[0].contains("unstable"), "{verdict:?}");
    whole(&view, &OPTIONAL);
}

#[test]
fn a_cascade_is_converted_to_pid_and_the_poles_of_a_state_feedback_can_be_dragged() {
    let (live, _project) = live();
    let pid = loop_view(&live, LoopDraft { kind: Some(DraftKind::Pid), ..LoopDraft::default() });
    let preset = live.shared.parameters.preset();
    let ControllerChoice::Cascade(cascade) = preset.bench.controller else { panic!("a cascade by default") };
    let expected = stickslip_design::cascade_as_pid(&cascade);
    assert_eq!(pid.kind, "pid");
    let entered =
        live.shared.parameters.tuning().preset_with(&pid.values.clone().into_iter().collect::<Vec<_>>()).unwrap();
    assert_eq!(entered.bench.controller, ControllerChoice::Pid(expected));
    assert!(pid.items.iter().all(|item| item.path.starts_with("bench.controller.")));

    let poles = LoopDraft {
        values: values(&[("bench.controller.kind", "state-feedback"), ("bench.controller.regulator.kind", "poles")]),
        ..LoopDraft::default()
    };
    let before = loop_view(&live, poles.clone()).grip.unwrap();
    assert!((before.bandwidth.hypot(0.0) - before.real.hypot(before.imaginary)).abs() < 1e-9);
    let drag = PoleDrag { real: -30.0, imaginary: -40.0 };
    let dragged = loop_view(&live, LoopDraft { drag: Some(drag), ..poles.clone() });
    let grip = dragged.grip.unwrap();
    assert_eq!((grip.bandwidth, grip.damping), (50.0, 0.6));
    assert_eq!(dragged.values["bench.controller.regulator.bandwidth"], "50.0");
    // The closed loop has poles near the specified ones: the modelled axis has friction that the design neglects.
    let near = |pole: &crate::protocol::LoopPole| (pole.real + 30.0).hypot(pole.imaginary - 40.0) < 15.0;
    assert!(dragged.loads[0].poles.iter().any(near), "{:?}", dragged.loads[0].poles);
    // A position in the right half plane gives the smallest damping ratio.
    let drag = Some(PoleDrag { real: 10.0, imaginary: 60.0 });
    assert_eq!(loop_view(&live, LoopDraft { drag, ..poles }).grip.unwrap().damping, 0.1);
}

#[test]
fn a_dragged_pole_of_any_controller_becomes_that_of_a_state_feedback() {
    let (live, _project) = live();
    for kind in ["cascade", "pid", "state-feedback", "predictive"] {
        let draft = LoopDraft { values: values(&[("bench.controller.kind", kind)]), ..LoopDraft::default() };
        let grip = loop_view(&live, draft.clone()).grip.unwrap();
        assert!(grip.converts && grip.bandwidth > 0.0, "{kind}: {grip:?}");
        let drag = Some(PoleDrag { real: -30.0, imaginary: 40.0 });
        let dragged = loop_view(&live, LoopDraft { drag, ..draft });
        let grip = dragged.grip.unwrap();
        assert_eq!((&*dragged.kind, grip.bandwidth, grip.damping, grip.converts), ("state-feedback", 50.0, 0.6, false));
        assert_eq!(dragged.values["bench.controller.regulator.kind"], "poles", "{kind}");
    }
}

#[test]
fn a_lower_set_point_weight_limits_the_overshoot_and_keeps_the_margins() {
    let (live, _project) = live();
    let draft = LoopDraft {
        values: values(&[("bench.controller.position_gain", "40"), ("bench.controller.velocity_gain", "0.05")]),
        ..LoopDraft::default()
    };
    let before = loop_view(&live, draft.clone());
    assert!(before.loads[0].overshoot.unwrap() > 0.15, "{:?}", before.loads[0].overshoot);
    let after = loop_view(&live, LoopDraft { overshoot: Some(0.15), ..draft.clone() });
    assert_eq!(after.kind, "pid");
    assert!(after.loads[0].overshoot.unwrap() <= 0.15, "{:?}", after.loads[0].overshoot);
    // The conversion of the cascade changes the margins a little, the weight does not.
    let pid = LoopDraft { kind: Some(DraftKind::Pid), ..draft };
    let converted = loop_view(&live, pid.clone());
    for key in ["gain_margin", "phase_margin", "sensitivity_peak"] {
        let [one, other] = [&converted, &after].map(|view| number(view, "sliding", key).unwrap());
        assert!((one - other).abs() <= 1e-9 * one.abs(), "{key}: {one} and {other}");
    }
    // A loop that already overshoots less is unchanged.
    let unchanged = loop_view(&live, LoopDraft { overshoot: Some(1.0), ..pid.clone() });
    assert_eq!(unchanged.values, loop_view(&live, pid).values);
}

#[test]
fn invalid_drafts_are_refused_in_words() {
    let (live, _project) = live();
    let refused = |draft: LoopDraft| live.call("looks", Call::Loop(draft)).unwrap_err().to_string();
    let with = |path: &str, value: &str| LoopDraft { values: values(&[(path, value)]), ..LoopDraft::default() };
    assert!(refused(with("bench.controller.velocity_gian", "1")).contains("velocity_gain"));
    assert!(refused(with("bench.controller.velocity_gain", "-1")).contains("outside"));
    assert!(refused(with("bench.controller.velocity_gain", "a lot")).contains("velocity_gain"));
    for speed in [0.0, f64::NAN, 1e9] {
        assert!(refused(LoopDraft { speed: Some(speed), ..LoopDraft::default() }).contains("slides"));
    }
    let drag = Some(PoleDrag { real: -1.0, imaginary: 1.0 });
    assert!(refused(LoopDraft { drag, ..with("bench.controller.kind", "linear") }).contains("matrices"));
    let overshoot = Some(0.1);
    assert!(refused(LoopDraft { overshoot, ..with("bench.controller.kind", "state-feedback") }).contains("weight"));
    assert!(refused(LoopDraft { overshoot: Some(-1.0), ..LoopDraft::default() }).contains("overshoot"));
    assert!(refused(LoopDraft { overshoot, ..with("bench.controller.velocity_gain", "5") }).contains("unstable"));
    assert!(Call::from_json(serde_json::json!({ "call": "loop", "valves": {} })).is_err());
}

#[test]
fn the_prediction_of_hunting_is_that_of_the_command_line() {
    let (live, _project) = live();
    let hunting = |values: BTreeMap<String, String>, desired: bool| -> HuntingView {
        let draft = LoopDraft { values, ..LoopDraft::default() };
        match live.call("looks", Call::Hunting { draft, desired }).unwrap() {
            Answer::Hunting(view) => *view,
            other => panic!("{other:?}"),
        }
    };
    for (desired, changed) in [(false, BTreeMap::new()), (true, values(&[("bench.controller.integral_gain", "2")]))] {
        let view = hunting(changed.clone(), desired);
        let mut preset = live.shared.parameters.tuning().preset_with(&changed.into_iter().collect::<Vec<_>>()).unwrap();
        if desired {
            (preset.model.own, preset.model.own_bristles) = (preset.bench.desired, preset.bench.desired_bristles);
        }
        let expected = HuntingRun::new(&preset, &stickslip_design::HuntingPlan::default(), &Watch::silent()).unwrap();
        let expected = expected.prediction.hunting;
        assert_eq!((view.hunts, view.amplitude), (expected.is_some(), expected.map(|it| it.amplitude)));
        assert_eq!((view.desired, view.interval), (desired, expected.map(|it| it.interval)));
        assert!(!view.time.is_empty() && view.time.len() <= 601 && view.time.len() == view.deviation.len());
        whole(&view, &["amplitude", "counts", "interval"]);
    }
}

fn tuned(live: &Live) -> TuneProgress {
    match live.call("looks", Call::Tuned {}).unwrap() {
        Answer::Tuned(progress) => progress,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_tuning_runs_in_the_background_only_its_client_can_end_it_and_a_viewer_changes_nothing() {
    let (live, _project) = live();
    live.call(ANN, Call::Operate {}).unwrap();
    let pid = LoopDraft { kind: Some(DraftKind::Pid), ..LoopDraft::default() };
    live.call("looks", Call::Tune(pid.clone())).unwrap();
    let refused = live.call(ANN, Call::Tune(pid.clone())).unwrap_err().to_string();
    assert!(refused.contains("a tuning started by looks is running"), "{refused}");
    assert!(live.call(ANN, Call::EndTuning {}).is_err());
    // Other calls are answered meanwhile.
    assert!(status(&live).doing.is_none() && !tuned(&live).ended);
    live.call("looks", Call::EndTuning {}).unwrap();
    while !tuned(&live).ended {
        thread::sleep(Duration::from_millis(5));
    }
    let ended = tuned(&live);
    assert_eq!((ended.values, ended.sentence.as_deref()), (None, Some("cancelled")));

    let set = live.call("looks", set(GAIN, "11")).unwrap_err();
    assert!(matches!(set.of(), Some(LiveError::Operated { .. })), "{set}");
}
