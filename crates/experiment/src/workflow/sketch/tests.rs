use proptest::prelude::*;

use super::*;
use stickslip_base::parameters;

fn preset() -> Preset<f64> {
    parameters::presets::find("clm-bench").unwrap().read().unwrap()
}

fn sketch() -> Sketch {
    Sketch { speeds: (0..400).map(|k| 0.2 * f64::from(k)).collect(), ..Sketch::default() }
}

fn drawn(sketch: &Sketch) -> Drawn {
    sketch.draw(&preset()).unwrap()
}

fn drag(handle: Handle, speed: f64, torque: f64) -> Option<Drag> {
    Some(Drag { handle, speed, torque, refit: false })
}

#[test]
fn the_active_friction_is_drawn_by_default() {
    let preset = preset();
    let view = drawn(&sketch());
    assert_eq!(view.desired, values(&preset.bench.desired));
    assert_eq!(
        (view.curve[0], view.own[0]),
        (preset.bench.desired.breakaway_torque, preset.model.own.breakaway_torque)
    );
    assert!(view.renderable && view.shortages.is_empty() && view.margin.unwrap() > 1.0, "{view:?}");
    // The paper's law renders no torque around standstill: there screw and friction wheel alone act.
    let faded = |k: &usize| sketch().speeds[*k] < preset.bench.fade_velocity;
    assert!((0..400).filter(faded).all(|k| view.least[k] == view.own[k] && view.largest[k] == view.own[k]));
    assert!((0..400).filter(|k| !faded(k)).all(|k| view.least[k] < view.curve[k] && view.curve[k] < view.largest[k]));
    assert_eq!((view.edges[0].limit.as_str(), view.edges[1].limit.as_str()), ("wheel", "current"));
    let mut with_bristles = preset;
    with_bristles.bench.law = LawChoice::Bristle;
    assert_eq!(sketch().draw(&with_bristles).unwrap().edges[0].limit, "current");
    assert_eq!(view.distance, None);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// The curve passes through the pointer everywhere within the parameter's range.
    #[test]
    fn the_curve_follows_the_pointer(
        index in 0..4_usize,
        desired in (0.05..0.5, 0.05..0.5, 0.1..10.0, 1e-5..1e-3),
        torque in 0.06..0.6,
        speed in 0.1..40.0,
    ) {
        let desired = [desired.0, desired.1, desired.2, desired.3];
        let before = drawn(&Sketch { desired: Some(desired), ..sketch() });
        let grip = &before.grips[index];
        let speed = if index == 2 { speed } else { grip.speed };
        let after = drawn(&Sketch { desired: Some(desired), drag: drag(grip.handle, speed, torque), ..sketch() });
        let moved = &after.grips[index];
        prop_assert_eq!(moved.speed, speed);
        let at_the_end = moved.value == moved.range[0] || moved.value == moved.range[1];
        if index != 2 && !at_the_end {
            prop_assert!((moved.torque - torque).abs() < 1e-12, "{} for {}", moved.torque, torque);
        }
        // Nothing else moves.
        for other in (0..4).filter(|other| *other != index) {
            prop_assert_eq!(after.desired[other], desired[other]);
        }
        prop_assert!(after.curve.iter().all(|torque| torque.is_finite()));
    }

    /// No position of the pointer gives a curve outside the ranges of a parameter file.
    #[test]
    fn a_pointer_outside_the_figure_stays_in_the_ranges(
        index in 0..5_usize,
        speed in prop::num::f64::NORMAL,
        torque in prop::num::f64::NORMAL,
    ) {
        let handle = [HANDLES[0], HANDLES[1], HANDLES[2], HANDLES[3], Handle::Line][index];
        let after = drawn(&Sketch { drag: drag(handle, speed, torque), ..sketch() });
        for (value, grip) in after.desired.iter().zip(&after.grips) {
            prop_assert!((grip.range[0]..=grip.range[1]).contains(value), "{:?}", grip);
        }
    }
}

#[test]
fn the_line_is_moved_as_a_whole_until_one_of_its_torques_is_at_its_limit() {
    let before = drawn(&sketch());
    let [breakaway, kinetic, ..] = before.desired;
    let after = drawn(&Sketch { drag: drag(Handle::Line, 10.0, before.curve[50] + 0.05), ..sketch() });
    // The dragged curve has five digits.
    assert!((after.desired[0] - breakaway - 0.05).abs() < 1e-5 && (after.desired[1] - kinetic - 0.05).abs() < 1e-5);
    let down = drawn(&Sketch { drag: drag(Handle::Line, 10.0, -5.0), ..sketch() });
    let fall = breakaway - kinetic;
    assert!((down.desired[0] - down.desired[1] - fall).abs() < 1e-12, "{down:?}");
    assert!((down.desired[1] - down.grips[1].range[0]).abs() < 1e-12, "{down:?}");
}

#[test]
fn a_curve_is_fitted_to_points_by_their_weights() {
    let at = |speed: f64, torque: f64, weight: f64| Reference { speed, torque, weight };
    let lay = |points: Vec<Reference>| drawn(&Sketch { points, fit: true, ..sketch() });
    let exact = with_values(&preset().bench.desired, [0.28, 0.15, 2.0, 4e-4]);
    let four = [0.0, 2.0, 16.0, 70.0].map(|speed| at(speed, exact.magnitude(speed), 1.0));
    let view = lay(four.to_vec());
    assert!(view.distance.unwrap() < 1e-4, "{view:?}");
    assert!((view.desired[2] / 2.0 - 1.0).abs() < 0.01, "{:?}", view.desired);
    // Two points that contradict each other.
    let light = lay(vec![at(30.0, 0.2, 1.0), at(30.0, 0.3, 1.0)]);
    let heavy = lay(vec![at(30.0, 0.2, 1.0), at(30.0, 0.3, 9.0)]);
    assert!((light.curve[150] - 0.25).abs() < 2e-3, "{}", light.curve[150]);
    assert!((heavy.curve[150] - 0.29).abs() < 2e-3, "{}", heavy.curve[150]);
}

#[test]
fn while_one_parameter_is_dragged_the_others_follow_the_points() {
    let exact = with_values(&preset().bench.desired, [0.28, 0.15, 2.0, 4e-4]);
    let points: Vec<_> = [0.0, 1.0, 2.0, 4.0, 16.0, 70.0]
        .map(|speed| Reference { speed, torque: exact.magnitude(speed), weight: 1.0 })
        .to_vec();
    let hand = Drag { handle: Handle::StribeckVelocity, speed: 2.5, torque: 0.0, refit: true };
    let held = drawn(&Sketch { points: points.clone(), drag: Some(hand), ..sketch() });
    assert_eq!(held.desired[2], 2.5);
    let alone = drawn(&Sketch { points, drag: Some(Drag { refit: false, ..hand }), ..sketch() });
    assert!(held.distance.unwrap() < 0.3 * alone.distance.unwrap(), "{:?} {:?}", held.distance, alone.distance);
}

#[test]
fn a_curve_that_cannot_be_rendered_has_a_reason_and_the_nearest_one_can_be_rendered() {
    let steep = Sketch { desired: Some([0.3, 0.12, 0.01, 1e-4]), ..sketch() };
    let view = drawn(&steep);
    assert!(!view.renderable && view.margin.unwrap() < 1.0);
    let range = &view.shortages[0];
    assert!(range.from < range.to && range.reason.starts_with("From "), "{range:?}");
    let has = |view: &Drawn, part: &str| view.remarks.iter().any(|remark| remark.contains(part));
    // A quick view has no remedies.
    assert!(!has(&view, "only one parameter") && !has(&view, "no single parameter"), "{:?}", view.remarks);
    let thorough = drawn(&Sketch { thorough: true, ..steep.clone() });
    assert!(has(&thorough, "Stribeck velocity"), "{:?}", thorough.remarks);
    let near = drawn(&Sketch { nearest: true, ..steep.clone() });
    assert!(near.renderable, "{near:?}");
    assert!(near.margin.is_some_and(|margin| margin >= AIR), "{:?}", near.margin);
    assert!(near.nearest.as_ref().is_some_and(|nearest| nearest.left > CAUTION), "{:?}", near.nearest);
    assert!(view.nearest.is_some_and(|nearest| nearest.left == 0.0));
    // Halfway back to the desired one it cannot be rendered.
    let farther: Vec<f64> = (0..4).map(|i| 0.5 * (near.desired[i] + steep.desired.unwrap()[i])).collect();
    let farther = Sketch { desired: farther.try_into().ok(), ..sketch() };
    assert!(!drawn(&farther).renderable);
}

#[test]
fn a_stray_point_is_marked_and_explained_and_the_edge_names_the_drive() {
    let exact = with_values(&preset().bench.desired, [0.28, 0.15, 2.0, 4e-4]);
    let at = |speed: f64, torque: f64| Reference { speed, torque, weight: 1.0 };
    let mut points: Vec<_> = [0.0, 2.0, 16.0, 70.0].map(|speed| at(speed, exact.magnitude(speed))).to_vec();
    points.push(at(0.8, 1.3));
    let view = drawn(&Sketch { points: points.clone(), fit: true, ..sketch() });
    assert_eq!(view.strays, [4]);
    assert!((view.desired[0] / 0.28 - 1.0).abs() < 0.01 && view.distance.unwrap() < 1e-3, "{view:?}");
    assert!(view.remarks.iter().any(|remark| remark.starts_with("Reference point 5 at ")), "{:?}", view.remarks);
    // The same without a fit, when the finished curve is drawn again.
    let again = drawn(&Sketch { points, desired: Some(view.desired), thorough: true, ..sketch() });
    assert_eq!((again.strays, again.desired), (view.strays, view.desired));
    assert!(view.edges.iter().any(|edge| edge.largest && edge.limit == "drive"), "{:?}", view.edges);
}

#[test]
fn an_invalid_sketch_is_refused_with_the_reason() {
    let refusal = |sketch: Sketch| sketch.draw(&preset()).unwrap_err().to_string();
    let message = refusal(Sketch { desired: Some([0.3, -1.0, 1.0, 0.0]), ..sketch() });
    assert!(message.contains("kinetic torque M_K"), "{message}");
    let message = refusal(Sketch { desired: Some([f64::NAN, 0.1, 1.0, 0.0]), ..sketch() });
    assert!(message.contains("breakaway torque M_S"), "{message}");
    assert!(refusal(Sketch { drag: drag(Handle::Line, 1.0, f64::NAN), ..sketch() }).contains("torque"));
    assert!(refusal(Sketch { speeds: vec![0.0, -1.0], ..sketch() }).contains("-1"));
    assert!(refusal(Sketch { speeds: vec![0.0; 5000], ..sketch() }).contains("5000"));
    let none = Reference { speed: 1.0, torque: 0.2, weight: 0.0 };
    assert!(refusal(Sketch { points: vec![none], fit: true, ..sketch() }).contains("weight"));
}

#[test]
fn the_presliding_loop_has_the_slope_of_the_bristles_and_ends_at_breakaway() {
    let bristles = Some([500.0, 0.5, 0.6]);
    let view = drawn(&Sketch { bristles, desired: Some([0.25, 0.15, 2.0, 1e-4]), ..sketch() });
    let Loop { angle, torque } = &view.desired_loop;
    assert_eq!((angle.len(), torque.len(), &view.own_loop.angle), (301, 301, angle));
    // Below the elastic limit a step deflects the bristles by its whole way; the torque is that of its middle.
    let slope = (torque[4] - torque[3]) / (angle[4] - angle[3]);
    assert!((slope / 500.0 - 1.0).abs() < 1e-6, "{slope}");
    let largest = torque.iter().copied().fold(0.0, f64::max);
    assert!((largest / 0.25 - 1.0).abs() < 0.01, "{largest}");
    // After the first reversal it repeats.
    assert!((torque[60] - torque[300]).abs() < 1e-3, "{} {}", torque[60], torque[300]);
    assert!(torque.iter().all(|torque| torque.abs() < 0.2501));
    let refused = Sketch { bristles: Some([0.0, 0.0, 0.5]), ..sketch() }.draw(&preset()).unwrap_err();
    assert!(refused.to_string().contains("stiffness"), "{refused}");
}

#[test]
fn a_shortened_number_is_the_nearest_of_five_digits() {
    let mut generator = 0x9e37_79b9_7f4a_7c15_u64;
    for _ in 0..20_000 {
        generator = generator.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let value = (generator >> 11) as f64 * 10f64.powi((generator % 31) as i32 - 30);
        let (short, five) = (super::short(value), format!("{value:.4e}").parse::<f64>().unwrap());
        assert!(
            short == five || (short - value).abs() <= (five - value).abs() * (1.0 + 1e-9),
            "{value:e}: {short:e}, {five:e}"
        );
        assert_eq!(short, format!("{short:.4e}").parse::<f64>().unwrap(), "{value:e}");
    }
    for value in [0.0, -0.0, 1e-300, f64::INFINITY, f64::NAN] {
        assert_eq!(super::short(value).to_bits(), value.to_bits());
    }
}
