//! Measure, fit, design, render by commands: the files of one step are the input of the next.

use std::path::Path;
use std::process::{Command, Output};

use stickslip::{Preset, parameters};

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");

fn stickslip(arguments: &str, folder: &Path) -> Output {
    Command::new(PROGRAM).args(arguments.split(' ')).current_dir(folder).output().expect("the program starts")
}

/// The output of a command that must succeed.
fn output(arguments: &str, folder: &Path) -> String {
    let result = stickslip(arguments, folder);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(result.status.success() && result.stderr.is_empty(), "{arguments}: {}", text(&result.stderr));
    text(&result.stdout)
}

/// The error of a command that must fail with this code.
fn error(code: i32, arguments: &str, folder: &Path) -> String {
    let output = stickslip(arguments, folder);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments}: {text}");
    text
}

/// Value and half width of a result of a summary.
fn result(folder: &Path, summary: &str, name: &str) -> (f64, f64) {
    let text = std::fs::read_to_string(folder.join(summary).join("summary.json")).expect("a command leaves a summary");
    let at = text.find(&format!("\"{name}\": {{")).unwrap_or_else(|| panic!("{summary}: no {name}"));
    let entry = &text[at..at + text[at..].find('}').expect("an entry ends")];
    let numbers: Vec<f64> =
        entry.split([':', ',', '[', ']', '\n']).filter_map(|word| word.trim().parse().ok()).collect();
    match numbers[..] {
        [value] => (value, 0.0),
        [value, low, high] => (value, 0.5 * (high - low)),
        _ => panic!("{entry}"),
    }
}

#[test]
fn measure_fit_design_render_gives_the_numbers_of_the_demo() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    output("demo --seed 5 --out demo", at);
    for linings in ["released", "pressed"] {
        output(&format!("measure friction --seed 5 --linings {linings} --out {linings}"), at);
        output(&format!("fit {linings} --out fit-{linings}"), at);
    }
    output("design --from fit-pressed/fit.toml --out design", at);
    let text = output("render --seed 5 --own fit-pressed/fit.toml --desired design/desired.toml --out render", at);
    assert!(text.contains("outside the fade-out       0."), "{text}");

    for key in ["breakaway_torque", "kinetic_torque", "stribeck_velocity", "viscous_friction"] {
        let [demo, single] = [("demo", "measure.released"), ("fit-released", "fit")]
            .map(|(summary, prefix)| result(at, summary, &format!("{prefix}.{key}")));
        // The first measurement of the demo: the same ticks, noise and bits, read back from a file.
        assert_eq!(single, demo, "{key}");
        // The later measurements of the demo have other noise: equal within the intervals of both, widened from 95 % to
        // 4 standard errors.
        let (demo, demo_width) = result(at, "demo", &format!("measure.pressed.{key}"));
        let (single, width) = result(at, "fit-pressed", &format!("fit.{key}"));
        assert!((single - demo).abs() <= 2.0 * width.hypot(demo_width), "{key}: {single} and {demo}");
    }
    for name in ["fade_velocity", "velocity_noise"] {
        let name = format!("render.{name}");
        assert_eq!(result(at, "render", &name), result(at, "demo", &name));
    }
    for name in ["rms_error_over_breakaway", "rms_error_inside_fade_over_breakaway", "step_at_fade"] {
        let name = format!("render.{name}");
        let (demo, single) = (result(at, "demo", &name).0, result(at, "render", &name).0);
        // Other noise: 6 % at seed 1. Over three seeds the demo alone varies by 15 %.
        assert!((single / demo - 1.0).abs() < 0.25, "{name}: {single} and {demo}");
    }
}

#[test]
fn a_dry_run_prints_the_duration_and_writes_no_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (arguments, expected) in [
        (
            "measure friction --dry-run",
            "Friction at 15 speeds from 0.1 to 50 rad/s in both directions, linings at 1.00: 44 s on the bench.\n",
        ),
        (
            "measure friction --dry-run --plan thorough --linings released",
            "Friction at 24 speeds from 0.05 to 50 rad/s in both directions, linings at 0.00: 144 s on the bench.\n",
        ),
        (
            "measure breakaway --dry-run --set plan.angles=2",
            "Breakaway from rest, 3 ramps of 0.1 N·m/s at 2 angles in both directions, linings at 1.00: 46 s on the bench.\n",
        ),
    ] {
        assert_eq!(output(arguments, folder.path()), expected);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn stdout_has_the_summary_with_json_and_is_empty_with_quiet() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let design = "design --from clm-bench --point 0=0.3 --point 2=0.2 --out out";
    let json = output(&format!("{design} --json"), folder.path());
    assert_eq!(json, std::fs::read_to_string(folder.path().join("out/summary.json")).unwrap());
    assert!(json.starts_with("{\n  \"schema\": \"stickslip.summary/1\",\n  \"command\": \"design\""));
    assert_eq!(output(&format!("{design} --quiet"), folder.path()), "");
    error(2, &format!("{design} --quiet --json"), folder.path());
}

#[test]
fn a_desired_curve_beyond_the_drive_motor_is_reported() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = output("design --from clm-bench --set desired.viscous_friction=0.05", folder.path());
    let drive = "at 80.00 rad/s the load motor adds 3.924 N·m; own friction, motor friction and acceleration at 200.0 \
                 rad/s² leave 0.9907 N·m of the 1.400 N·m of the drive motor.";
    assert!(text.contains(drive), "{text}");
    let file = std::fs::read_to_string(folder.path().join("stickslip-out/design/desired.toml")).unwrap();
    let preset: Preset<f64> = parameters::read(&file, "desired.toml").unwrap();
    assert_eq!(preset.bench.desired.viscous_friction, 0.05);
    let (renderable, _) = result(folder.path(), "stickslip-out/design", "region.renderable");
    assert_eq!(renderable, 0.0);
    let render = "render --own clm-bench --desired stickslip-out/design/desired.toml";
    let text = error(1, render, folder.path());
    // The remedy for the speeds of the plan, which end below those of the design.
    assert!(text.contains("or change only one parameter: viscous friction b = 0.0213 N·m·s/rad."), "{text}");
    assert!(!folder.path().join("stickslip-out/render").exists());
}

#[test]
fn curves_of_other_benches_are_fitted_and_undetermined_results_are_reported() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/direct_drive_joint/friction_curve.csv");
    let text = output(&format!("fit {} --side each", data.display()), folder.path());
    assert!(text.contains("Stribeck curve through 20 points, joint 2 negative:"), "{text}");
    assert!(text.contains("There is no Stribeck effect in this data"), "{text}");
    assert!(text.contains("No fit.toml: a parameter file has one curve for both directions"), "{text}");
    let rows = "speed [mm/s],friction [N]\n1,20\n2,19\n5,17\n10,16\n50,16.5\n100,18\n200,21\n";
    std::fs::write(folder.path().join("linear.csv"), rows).unwrap();
    let text = output("fit linear.csv --out linear", folder.path());
    assert!(text.contains("breakaway force F_S") && text.contains("N·s/m") && !text.contains("rad"), "{text}");
    assert!(text.contains("No fit.toml: a parameter file requires a rotary axis"), "{text}");
}

#[test]
fn invalid_input_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("taken"), "").unwrap();
    std::fs::write(folder.path().join("few.csv"), "velocity,torque\n1,2\n2,3\n").unwrap();
    for (code, arguments, message) in [
        (1, "measure friction --preset clm-bensh", "unknown preset clm-bensh. Did you mean clm-bench?"),
        (1, "measure friction --set plan.speeds=1", "speeds = 1 is outside 2 … 200"),
        (1, "measure friction --set plan.sped=1", "unknown parameter sped. Did you mean speeds?"),
        (1, "measure friction --set plant.drive.motor_intertia=1", "Did you mean plant.drive.motor_inertia?"),
        (2, "measure friction --set plan.speeds", "write it as PATH=VALUE"),
        (2, "measure", "Usage: stickslip measure"),
        (1, "fit taken/nothing", "cannot read it"),
        (1, "fit few.csv", "required"),
        (1, "design --from absent.toml", "absent.toml: cannot read it"),
        (1, "design --from clm-bench --point 1=-2", "Friction brakes"),
        (2, "design --from clm-bench --point 1", "write it as SPEED=TORQUE"),
        (1, "design --from clm-bench --out taken/design", "taken/design: cannot create it"),
        (2, "completions csh", "possible values: bash"),
    ] {
        let text = error(code, arguments, folder.path());
        assert!(text.contains(message), "{arguments}: {text}");
    }
}

#[test]
fn every_shell_gets_completions_of_every_command() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let text = output(&format!("completions {shell}"), folder.path());
        for word in ["measure", "presliding", "validate", "linings"] {
            assert!(text.contains(word), "{shell}: {word}");
        }
    }
}

/// Ctrl-C during a measurement, at a progress that is read from a pipe.
#[cfg(unix)]
#[test]
fn a_cancelled_measurement_writes_complete_files_that_are_marked() {
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;

    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut run = Command::new(PROGRAM)
        .args(["measure", "friction", "--progress", "--out", "out", "--set", "plan.speeds=200", "--plan", "thorough"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut progress = BufReader::new(run.stderr.take().expect("a pipe")).lines().map_while(Result::ok);
    assert!(progress.any(|line| line == "friction at constant speeds 20 %"));
    let interrupt = Command::new("kill").args(["-INT", &run.id().to_string()]).status().expect("kill runs");
    assert!(interrupt.success());
    let rest: Vec<String> = progress.collect();
    assert!(rest.last().is_some_and(|line| line.starts_with("error: cancelled; partial results are in")), "{rest:?}");
    assert_eq!(run.wait().expect("it ends").code(), Some(130));

    let out = folder.path().join("out");
    let (complete, _) = result(folder.path(), "out", "measure.complete");
    let (plateaus, _) = result(folder.path(), "out", "measure.plateaus");
    assert!(complete == 0.0 && (5.0..395.0).contains(&plateaus), "{complete} {plateaus}");
    let curve = stickslip::curve_file::read_curves(&out.join("curve.csv"), &Default::default()).unwrap();
    assert_eq!(curve.curves[0].points.len() as f64, plateaus);
    assert!(stickslip::recording::Recording::read(&out.join("curve.parquet")).is_ok());
    assert!(std::fs::read_to_string(out.join("report.html")).unwrap().contains("(incomplete)"));
    let hidden =
        |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().file_name().to_string_lossy().starts_with('.');
    assert!(!std::fs::read_dir(&out).unwrap().any(hidden), "a temporary file was not removed");
}
