//! Jog and moves to a position.

use super::*;

fn jog(velocity: f64, press: u64) -> Call {
    Call::Jog { velocity, press, render: false }
}

/// A homed bench with torque.
fn running() -> (Live, tempfile::TempDir) {
    let (live, project) = live();
    live.call(ANN, Call::Home {}).unwrap();
    ended(&live);
    while status(&live).state != "running" {
        thread::sleep(Duration::from_millis(5));
    }
    (live, project)
}

/// Repeats the call of a held button, as the page does.
fn hold(live: &Live, velocity: f64, press: u64, duration: Duration) {
    let begin = std::time::Instant::now();
    while begin.elapsed() < duration {
        live.call(ANN, jog(velocity, press)).unwrap();
        thread::sleep(Duration::from_millis(60));
    }
}

/// Angle at rest.
fn resting_angle(live: &Live) -> f64 {
    ended(live);
    thread::sleep(Duration::from_millis(300));
    let now = status(live);
    assert!(now.velocity.abs() < 0.5 && now.state == "running", "{now:?}");
    now.angle
}

#[test]
fn a_held_button_moves_the_axis_until_it_is_released() {
    let (live, _project) = running();
    let begin = status(&live).angle;
    hold(&live, 10.0, 1, Duration::from_millis(1000));
    let now = status(&live);
    assert!(
        (now.velocity - 10.0).abs() < 2.0 && now.doing.as_ref().is_some_and(|doing| doing.what == "jog"),
        "{now:?}"
    );
    live.call(ANN, jog(0.0, 1)).unwrap();
    assert_eq!(ended(&live), Ended { what: "jog".into(), error: None, folder: None });
    let moved = resting_angle(&live) - begin;
    assert!((6.0..14.0).contains(&moved), "{moved}");
    // A call that the release has overtaken does not start it again.
    assert!(live.call(ANN, jog(10.0, 1)).unwrap_err().to_string().contains("press one again"));
    assert!(status(&live).doing.is_none());
}

#[test]
fn without_calls_the_axis_comes_to_rest_and_a_late_call_does_not_move_it() {
    let (live, _project) = running();
    hold(&live, 10.0, 7, Duration::from_millis(500));
    // The page is closed, or its connection is lost.
    let silent = std::time::Instant::now();
    let end = ended(&live);
    assert!(silent.elapsed() < Duration::from_millis(1500), "{:?}", silent.elapsed());
    assert!(end.error.as_deref().is_some_and(|error| error.contains("no signal for 0.3 s")), "{end:?}");
    let angle = resting_angle(&live);
    assert!(live.call(ANN, jog(10.0, 7)).is_err());
    thread::sleep(Duration::from_millis(200));
    assert!((status(&live).angle - angle).abs() < 0.1);
    // Another press moves it.
    hold(&live, -10.0, 8, Duration::from_millis(400));
    live.call(ANN, jog(0.0, 8)).unwrap();
    assert!(resting_angle(&live) < angle - 1.0);
}

#[test]
fn a_stop_ends_the_press_and_viewers_cannot_jog() {
    let (live, _project) = running();
    hold(&live, 10.0, 1, Duration::from_millis(300));
    let refused = live.call("bob", jog(5.0, 9)).unwrap_err();
    assert!(matches!(refused.of(), Some(LiveError::Operated { .. })), "{refused}");
    assert!(live.call(ANN, jog(5.0, 2)).unwrap_err().to_string().contains("another button is held"));
    live.call("bob", Call::Stop {}).unwrap();
    ended(&live);
    while status(&live).state != "ready" {
        thread::sleep(Duration::from_millis(5));
    }
    let refused = live.call(ANN, jog(10.0, 1)).unwrap_err().to_string();
    assert!(refused.contains("no torque"), "{refused}");
    live.call(ANN, Call::Start {}).unwrap();
    while status(&live).state != "running" {
        thread::sleep(Duration::from_millis(5));
    }
    assert!(live.call(ANN, jog(10.0, 1)).is_err(), "the press ended with the stop");
    assert!(live.call(ANN, jog(1e6, 3)).unwrap_err().to_string().contains("outside -350 … 350 rad/s"));
}

#[test]
fn the_axis_goes_to_a_position_within_its_travel() {
    let (live, _project) = running();
    let go_to = |position: f64, speed: Option<f64>| live.call(ANN, Call::GoTo { position, speed, render: false });
    go_to(6.0, Some(20.0)).unwrap();
    assert_eq!(ended(&live), Ended { what: "go to".into(), error: None, folder: None });
    assert!((resting_angle(&live) - 6.0).abs() < 0.1);
    let refused = |position: f64, speed: Option<f64>| go_to(position, speed).unwrap_err().to_string();
    assert!(refused(200.0, None).contains("outside -156.5 … 156.5 rad"), "{}", refused(200.0, None));
    assert!(refused(f64::NAN, None).contains("travel") && refused(0.0, Some(0.0)).contains("speed"));
    assert!((status(&live).angle - 6.0).abs() < 0.1);
}
