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
fn what_is_in_force_is_drawn_unless_something_else_is_in_hand() {
    let preset = preset();
    let seen = drawn(&sketch());
    assert_eq!(seen.desired, values(&preset.bench.desired));
    assert_eq!(
        (seen.curve[0], seen.own[0]),
        (preset.bench.desired.breakaway_torque, preset.model.own.breakaway_torque)
    );
    assert!(seen.renderable && seen.shortages.is_empty() && seen.margin.unwrap() > 1.0, "{seen:?}");
    // The paper's law renders nothing around standstill: there screw and friction wheel alone tell.
    let faded = |k: &usize| sketch().speeds[*k] < preset.bench.fade_velocity;
    assert!((0..400).filter(faded).all(|k| seen.least[k] == seen.own[k] && seen.largest[k] == seen.own[k]));
    assert!((0..400).filter(|k| !faded(k)).all(|k| seen.least[k] < seen.curve[k] && seen.curve[k] < seen.largest[k]));
    assert_eq!((seen.edges[0].limit.as_str(), seen.edges[1].limit.as_str()), ("wheel", "current"));
    let mut with_bristles = preset;
    with_bristles.bench.law = LawChoice::Bristle;
    assert_eq!(sketch().draw(&with_bristles).unwrap().edges[0].limit, "current");
    assert_eq!(seen.distance, None);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Wherever it goes, the curve follows the hand: it passes through it, as far as the parameter's range lets it.
    #[test]
    fn the_curve_follows_the_hand(
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

    /// No picture, however wild, makes a curve that a parameter file could not hold.
    #[test]
    fn a_hand_that_leaves_the_picture_stays_in_the_ranges(
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
fn the_line_is_moved_as_a_whole_and_stops_where_one_of_its_torques_does() {
    let before = drawn(&sketch());
    let [breakaway, kinetic, ..] = before.desired;
    let after = drawn(&Sketch { drag: drag(Handle::Line, 10.0, before.curve[50] + 0.05), ..sketch() });
    // The hand took hold of a curve of five digits.
    assert!((after.desired[0] - breakaway - 0.05).abs() < 1e-5 && (after.desired[1] - kinetic - 0.05).abs() < 1e-5);
    let down = drawn(&Sketch { drag: drag(Handle::Line, 10.0, -5.0), ..sketch() });
    let fall = breakaway - kinetic;
    assert!((down.desired[0] - down.desired[1] - fall).abs() < 1e-12, "{down:?}");
    assert!((down.desired[1] - down.grips[1].range[0]).abs() < 1e-12, "{down:?}");
}

#[test]
fn a_curve_is_laid_through_points_and_a_heavy_one_counts_more() {
    let at = |speed: f64, torque: f64, weight: f64| Reference { speed, torque, weight };
    let lay = |points: Vec<Reference>| drawn(&Sketch { points, fit: true, ..sketch() });
    let truth = with_values(&preset().bench.desired, [0.28, 0.15, 2.0, 4e-4]);
    let four = [0.0, 2.0, 16.0, 70.0].map(|speed| at(speed, truth.magnitude(speed), 1.0));
    let seen = lay(four.to_vec());
    assert!(seen.distance.unwrap() < 1e-4, "{seen:?}");
    assert!((seen.desired[2] / 2.0 - 1.0).abs() < 0.01, "{:?}", seen.desired);
    // Two points that contradict each other.
    let light = lay(vec![at(30.0, 0.2, 1.0), at(30.0, 0.3, 1.0)]);
    let heavy = lay(vec![at(30.0, 0.2, 1.0), at(30.0, 0.3, 9.0)]);
    assert!((light.curve[150] - 0.25).abs() < 2e-3, "{}", light.curve[150]);
    assert!((heavy.curve[150] - 0.29).abs() < 2e-3, "{}", heavy.curve[150]);
}

#[test]
fn with_a_hand_on_one_parameter_the_others_follow_the_points() {
    let truth = with_values(&preset().bench.desired, [0.28, 0.15, 2.0, 4e-4]);
    let points: Vec<_> = [0.0, 1.0, 2.0, 4.0, 16.0, 70.0]
        .map(|speed| Reference { speed, torque: truth.magnitude(speed), weight: 1.0 })
        .to_vec();
    let hand = Drag { handle: Handle::StribeckVelocity, speed: 2.5, torque: 0.0, refit: true };
    let held = drawn(&Sketch { points: points.clone(), drag: Some(hand), ..sketch() });
    assert_eq!(held.desired[2], 2.5);
    let alone = drawn(&Sketch { points, drag: Some(Drag { refit: false, ..hand }), ..sketch() });
    assert!(held.distance.unwrap() < 0.3 * alone.distance.unwrap(), "{:?} {:?}", held.distance, alone.distance);
}

#[test]
fn what_cannot_be_rendered_says_why_and_the_nearest_can() {
    let steep = Sketch { desired: Some([0.3, 0.12, 0.01, 1e-4]), ..sketch() };
    let seen = drawn(&steep);
    assert!(!seen.renderable && seen.margin.unwrap() < 1.0);
    let stretch = &seen.shortages[0];
    assert!(stretch.from < stretch.to && stretch.reason.starts_with("From "), "{stretch:?}");
    let said = |seen: &Drawn, part: &str| seen.remarks.iter().any(|remark| remark.contains(part));
    // In a hurry nothing is claimed about what would do.
    assert!(!said(&seen, "alone") && !said(&seen, "no single parameter"), "{:?}", seen.remarks);
    let thorough = drawn(&Sketch { thorough: true, ..steep.clone() });
    assert!(said(&thorough, "Stribeck velocity"), "{:?}", thorough.remarks);
    let near = drawn(&Sketch { nearest: true, ..steep.clone() });
    assert!(near.renderable, "{near:?}");
    assert!(near.margin.is_some_and(|margin| margin >= 1.02), "{:?}", near.margin);
    // Halfway back to what was wished it cannot.
    let farther: Vec<f64> = (0..4).map(|i| 0.5 * (near.desired[i] + steep.desired.unwrap()[i])).collect();
    let farther = Sketch { desired: farther.try_into().ok(), ..sketch() };
    assert!(!drawn(&farther).renderable);
}

#[test]
fn what_is_no_sketch_is_refused_with_the_reason() {
    let refusal = |sketch: Sketch| sketch.draw(&preset()).unwrap_err().to_string();
    let said = refusal(Sketch { desired: Some([0.3, -1.0, 1.0, 0.0]), ..sketch() });
    assert!(said.contains("kinetic torque M_K"), "{said}");
    let said = refusal(Sketch { desired: Some([f64::NAN, 0.1, 1.0, 0.0]), ..sketch() });
    assert!(said.contains("breakaway torque M_S"), "{said}");
    assert!(refusal(Sketch { drag: drag(Handle::Line, 1.0, f64::NAN), ..sketch() }).contains("torque"));
    assert!(refusal(Sketch { speeds: vec![0.0, -1.0], ..sketch() }).contains("-1"));
    assert!(refusal(Sketch { speeds: vec![0.0; 5000], ..sketch() }).contains("5000"));
    let none = Reference { speed: 1.0, torque: 0.2, weight: 0.0 };
    assert!(refusal(Sketch { points: vec![none], fit: true, ..sketch() }).contains("weight"));
}

#[test]
fn the_presliding_loop_has_the_slope_of_the_bristles_and_ends_at_breakaway() {
    let bristles = Some([500.0, 0.5, 0.6]);
    let seen = drawn(&Sketch { bristles, desired: Some([0.25, 0.15, 2.0, 1e-4]), ..sketch() });
    let Loop { angle, torque } = &seen.desired_loop;
    assert_eq!((angle.len(), torque.len(), &seen.own_loop.angle), (301, 301, angle));
    // Below the elastic limit a step bends the bristles by its whole way; the torque is that of its middle.
    let slope = (torque[4] - torque[3]) / (angle[4] - angle[3]);
    assert!((slope / 500.0 - 1.0).abs() < 1e-6, "{slope}");
    let largest = torque.iter().copied().fold(0.0, f64::max);
    assert!((largest / 0.25 - 1.0).abs() < 0.01, "{largest}");
    // Behind the first turn it repeats itself.
    assert!((torque[60] - torque[300]).abs() < 1e-3, "{} {}", torque[60], torque[300]);
    assert!(torque.iter().all(|torque| torque.abs() < 0.2501));
    let refused = Sketch { bristles: Some([0.0, 0.0, 0.5]), ..sketch() }.draw(&preset()).unwrap_err();
    assert!(refused.to_string().contains("stiffness"), "{refused}");
}
