use std::path::PathBuf;
use std::sync::LazyLock;

use super::*;

fn data(file: &str) -> PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/xl330_pendulum").join(file)
}

fn machine() -> &'static Machine {
    static MACHINE: LazyLock<Machine> = LazyLock::new(|| Machine::read(&data("xl330-machine.toml")).unwrap());
    &MACHINE
}

fn runs() -> &'static [Run] {
    static RUNS: LazyLock<Vec<Run>> =
        LazyLock::new(|| machine().runs(&Recording::read(&data("logs.csv.gz")).unwrap()).unwrap());
    &RUNS
}

/// Two models of all runs for fitting.
fn found() -> &'static ServoIdentification {
    static FOUND: LazyLock<ServoIdentification> = LazyLock::new(|| {
        identify_runs(runs().to_vec(), &[Kind::Coulomb, Kind::Load], machine(), &Watch::silent()).unwrap()
    });
    &FOUND
}

#[test]
fn the_recorded_duty_is_that_of_the_controller_in_the_machine_file() {
    assert_eq!(runs().len(), 12);
    let held_out: Vec<f64> = runs().iter().filter(|run| run.held_out).map(|run| run.number).collect();
    assert_eq!(held_out, [13.0, 14.0, 15.0]);
    for run in runs() {
        // Fast runs are sampled up to a millisecond apart from their duty; a wrong divisor would be a factor of two.
        let slope = run.controller_slope().unwrap();
        assert!((0.95..1.01).contains(&slope), "run {}: {slope}", run.number);
        assert!(run.duty.iter().all(|duty| duty.abs() <= 1.0), "the sign of the register is lost");
    }
}

#[test]
fn friction_that_rises_with_the_load_predicts_unseen_runs_better_than_coulomb_and_published_parameters() {
    let [coulomb, load] = &found().candidates[..] else { panic!("two kinds") };
    assert_eq!(found().best().fitted.kind, Kind::Load);
    // 52 against 65 mrad: half of the gain must remain.
    assert!(load.held_out_rms < 0.9 * coulomb.held_out_rms, "{} {}", load.held_out_rms, coulomb.held_out_rms);
    for candidate in [coulomb, load] {
        assert!(candidate.held_out_rms < 0.5 * candidate.published.unwrap().1, "{candidate:?}");
    }
}

#[test]
fn steps_half_as_long_change_the_error_little() {
    let servo = &found().best().fitted.servo;
    let error = |step: f64| {
        let simulate = |run: &Run| servo.simulate_in_steps(Kind::Load, run, step, None, &Watch::silent()).unwrap();
        let square = |run: &Run| simulate(run).iter().zip(&run.position).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        found().held_out().map(square).sum::<f64>().sqrt()
    };
    let [whole, half] = [error(1e-3), error(0.5e-3)];
    assert!((whole / half - 1.0).abs() < 0.02, "{whole} {half}");
}

#[test]
fn a_mirrored_pendulum_has_the_same_parameters_and_the_opposite_offset() {
    let mirrored: Vec<Run> = runs()[..2]
        .iter()
        .cloned()
        .map(|mut run| {
            run.reference.iter_mut().chain(&mut run.position).for_each(|angle| *angle = -*angle);
            run
        })
        .collect();
    let fitted =
        |runs: &[Run]| values(&fit(Kind::Load, &runs.iter().collect::<Vec<_>>(), &[], &Watch::silent()).unwrap().servo);
    for ((field, one), other) in fields().iter().zip(fitted(&runs()[..2])).zip(fitted(&mirrored)) {
        let expected = if field.name == "offset" { -one } else { one };
        // Rounding differs where an offset changes its sign, and the search ends at 1e-6 of the sum of squares.
        assert!((other - expected).abs() <= 1e-3 * one.abs().max(1e-3), "{}: {one} {other}", field.name);
    }
}

#[test]
fn a_simulated_servo_is_identified_within_its_intervals() {
    let truth = Servo {
        torque_constant: 0.35,
        resistance: 3.0,
        source_resistance: 1.2,
        armature: 1.5e-3,
        offset: -0.02,
        delay: 4e-3,
        viscous: 4e-3,
        coulomb: 0.02,
        motor_load: 0.12,
        ..Servo::default()
    };
    let grid = machine().encoder_grid.unwrap();
    let synthetic: Vec<Run> = runs()
        .iter()
        .filter(|run| !run.held_out)
        .cloned()
        .map(|mut run| {
            run.position = truth.simulate(Kind::Load, &run, &Watch::silent()).unwrap();
            run.position.iter_mut().for_each(|angle| *angle = (*angle / grid).round() * grid);
            run
        })
        .collect();
    let fitted = fit(Kind::Load, &synthetic.iter().collect::<Vec<_>>(), &[], &Watch::silent()).unwrap();
    for (((field, truth), found), ci95) in
        fields().iter().zip(values(&truth)).zip(values(&fitted.servo)).zip(fitted.ci95)
    {
        if !Kind::Load.has(field.name) {
            assert_eq!(found, 0.0);
            continue;
        }
        let [low, high] = ci95.unwrap_or_else(|| panic!("{} is not determined", field.name));
        // The encoder step is the only noise: the interval contains the truth, and no value is 2 % off.
        assert!(low <= truth && truth <= high, "{}: {truth} outside {low} … {high}", field.name);
        assert!((found - truth).abs() < 0.02 * truth.abs(), "{}: {truth} {found}", field.name);
    }
}

#[test]
fn a_pendulum_held_below_breakaway_does_not_creep() {
    let mut run = runs()[0].clone();
    run.enabled.fill(0.0);
    run.position.fill(0.05);
    let holds = |coulomb: f64| {
        let servo = Servo { offset: 0.0, coulomb, ..Servo::default() };
        servo.simulate(Kind::Coulomb, &run, &Watch::silent()).unwrap().iter().all(|angle| *angle == 0.05)
    };
    // The weight at 0.05 rad is 0.0240 N m.
    assert!(holds(0.0241) && !holds(0.0239));
}

#[test]
fn directions_differ_only_in_directional_models_and_the_square_acts_only_on_opposing_torques() {
    let servo = Servo::<f64> { weight_load: 0.3, motor_load: 0.1, coulomb: 1.0, ..Servo::default() };
    assert!((servo.gear(Kind::Load, 2.0, -1.0).kinetic_torque - 1.3).abs() < 1e-15);
    assert!((servo.gear(Kind::Directional, 2.0, -1.0).kinetic_torque - 1.5).abs() < 1e-15);
    let rest = |kind, motor, weight| servo.gear(kind, motor, weight).breakaway_torque;
    let square = |motor, weight| rest(Kind::Quadratic, motor, weight) - rest(Kind::Directional, motor, weight);
    assert!((square(2.0, -1.0) - servo.weight_load_quadratic).abs() < 1e-15);
    assert!((square(1.0, -2.0) - servo.motor_load_quadratic).abs() < 1e-15);
    assert_eq!(square(2.0, 1.0), 0.0);
}

#[test]
fn a_run_without_a_row_and_a_file_without_keys_of_a_servo_are_refused() {
    let recording = Recording::read(&data("logs.csv.gz")).unwrap();
    let text = std::fs::read_to_string(data("xl330-machine.toml")).unwrap();
    let refusal = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        let machine = Machine::parse(&data("xl330-machine.toml"), &text.replace(from, to)).unwrap();
        machine.runs(&recording).unwrap_err().to_string()
    };
    for (from, to, expected) in [
        ("held_out = [13, 14, 15]", "held_out = []", "runs held out"),
        ("run = { name = \"log\" }", "", "columns.run is missing"),
        ("run = { name = \"log\" }", "run = { name = \"samples\" }", "samples"),
        ("length = { name = \"length\", unit = \"m\" }", "length = { name = \"length\", unit = \"kg\" }", "kg"),
    ] {
        let error = refusal(from, to);
        assert!(error.contains(expected), "{error}\nlacks {expected}");
    }
    let columns = ["log", "t", "goal", "position", "load", "enabled"];
    let values = |name: &str| if name == "log" { vec![99.0; 3] } else { vec![0.0, 1.0, 2.0] };
    let unknown = Recording::from_columns(
        "logs",
        columns.iter().map(|name| stickslip_recording::Column::new(name, values(name))).collect(),
    );
    let error = machine().runs(&unknown).unwrap_err().to_string();
    assert!(error.contains("no row for run 99"), "{error}");
}

#[test]
fn the_documented_names_exist_and_every_model_has_a_row() {
    let folder = tempfile::tempdir().unwrap();
    let recording = Recording::read(&data("logs.csv.gz")).unwrap();
    let summary = write(found(), machine(), &recording, "stickslip identify", folder.path()).unwrap();
    for name in ["prediction.position_rms", "inertia.armature", "friction.coulomb", "friction.motor_load"] {
        assert!(summary.value(name).is_some(), "{name}");
    }
    let written: serde_json::Value = serde_json::from_str(&summary.to_json()).unwrap();
    assert_eq!(written["rows"][1]["model"], "load");
    assert_eq!(written["rows"][1]["position_rms"], summary.value("prediction.position_rms").unwrap());
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("Not identifiable from these runs") && page.contains("Load-dependent, best"));
}
