//! From a table of measured values to a validated model, by commands.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use stickslip::Watch;
use stickslip::identify::{Loop, Motion, read_model, validate};
use stickslip::machine::Machine;
use stickslip::recording::Recording;

fn emps(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/emps").join(file)
}

fn recording() -> Recording {
    Recording::read(&emps("emps.csv.gz")).expect("it is part of the repository")
}

/// Starts the program in a folder, with answers to its questions.
fn stickslip(folder: &Path, arguments: &[&str], answers: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_stickslip"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    // Ignored: the program may end before it reads an answer.
    let _ = child.stdin.take().expect("it is piped").write_all(answers.as_bytes());
    child.wait_with_output().expect("it ends")
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn succeeded(output: Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}\n{}", stdout(&output), stderr(&output));
    stdout(&output)
}

/// A value of a summary.
fn value(folder: &Path, name: &str) -> f64 {
    let text = std::fs::read_to_string(folder.join("summary.json")).expect("it was written");
    let (_, rest) = text.split_once(&format!("\"{name}\": {{")).expect(name);
    let number = rest.split_once("\"value\": ").and_then(|(_, rest)| rest.split([',', '\n']).next());
    number.and_then(|text| text.trim().parse().ok()).expect("a number")
}

/// The EMPS recording as exported by a spreadsheet: other names, millimetres, semicolons, decimal commas.
fn spreadsheet(recording: &Recording) -> String {
    let column = |name: &str| &recording.column(name).expect("it is there").values;
    let [t, q, r, u] = ["t", "qm", "qg", "vir"].map(column);
    let mut text = "Zeit;Istposition;Sollposition;Stellgröße\ns;mm;mm;V\n".to_owned();
    for i in 0..recording.rows() {
        let row = format!("{};{};{};{}\n", t[i], q[i] * 1e3, r[i] * 1e3, u[i]);
        text.push_str(&row.replace('.', ","));
    }
    text
}

#[test]
fn a_spreadsheet_and_eleven_answers_give_the_mass() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("achse.csv"), spreadsheet(&recording())).expect("the folder takes files");
    let init = ["machine", "init", "achse.csv"];
    // Enter for name, time, its unit, position, its unit, axis, reference, command and its unit.
    let answers = "\n".repeat(9) + "35,15065188248547 N/V\nunknown\n";
    let printed = succeeded(stickslip(folder.path(), &init, &answers));
    assert!(
        printed.contains("Column of the measured position [Istposition]") && printed.contains("achse-machine.toml")
    );
    let second = stickslip(folder.path(), &init, &answers);
    assert_eq!(second.status.code(), Some(1));
    assert!(stderr(&second).contains("file exists") && stderr(&second).contains("--force"), "{}", stderr(&second));
    succeeded(stickslip(folder.path(), &[&init[..], &["--force"]].concat(), &answers));
    let identify = ["identify", "achse.csv", "--machine", "achse-machine.toml", "--out", "out"];
    let printed = succeeded(stickslip(folder.path(), &identify, ""));
    assert!(printed.contains("moving mass M"), "{printed}");
    let mass = value(&folder.path().join("out"), "inertia.mass");
    // As from the original file, except for rounding to millimetres.
    assert!((mass / 94.69 - 1.0).abs() < 2e-3, "{mass}");
    let feedforward = std::fs::read_to_string(folder.path().join("out/feedforward.csv")).expect("it was written");
    assert!(feedforward.starts_with("velocity [mm/s],force [N],command [V]\n-1.2"), "{feedforward:.60}");
}

#[test]
fn defaults_are_accepted_with_yes_and_too_few_answers_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("a.csv"), spreadsheet(&recording().rows_of(0..900))).expect("it takes files");
    let ends = stickslip(folder.path(), &["machine", "init", "a.csv", "--out", "m.toml"], "\n\n");
    assert_eq!(ends.status.code(), Some(1));
    assert!(stderr(&ends).contains("one answer a line") && !folder.path().join("m.toml").exists());
    let wrong = stickslip(folder.path(), &["machine", "init", "a.csv", "--out", "m.toml"], "\nWeg\n");
    assert_eq!(wrong.status.code(), Some(1));
    assert!(stderr(&wrong).contains("\"Weg\" is not valid"), "{}", stderr(&wrong));
    let init = ["machine", "init", "a.csv", "--out", "m.toml", "--yes"];
    let invented = stickslip(folder.path(), &init, "");
    assert!(
        stderr(&invented).contains("--answer gain=") && !folder.path().join("m.toml").exists(),
        "{}",
        stderr(&invented)
    );
    let unknown = stickslip(folder.path(), &[&init[..], &["--answer", "gian=36 N/V"]].concat(), "");
    assert!(stderr(&unknown).contains("unknown question \"gian\"; names: name, time,"), "{}", stderr(&unknown));
    let unused = [&init[..], &["--answer", "gain=36 N/V", "--answer", "period=1 ms"]].concat();
    assert!(stderr(&stickslip(folder.path(), &unused, "")).contains("leave no question of this name"));
    let printed = succeeded(stickslip(folder.path(), &[&init[..], &["--answer", "gain=36 N/V"]].concat(), ""));
    assert!(printed.contains("Guessed by machine init and not checked: time, time-unit, position,"), "{printed}");
    let machine = Machine::read(&folder.path().join("m.toml")).expect("it loads");
    assert_eq!((machine.columns.position.name.as_str(), machine.gain), ("Istposition", 36.0));
}

#[test]
fn a_recording_with_wraps_and_dropouts_is_corrected_and_the_printed_command_can_be_pasted() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let whole = recording();
    let column = |name: &str| &whole.column(name).expect("it is there").values;
    let [t, q, u] = ["t", "qm", "vir"].map(column);
    let mut text = "t,pos [mm],u [V]\n".to_owned();
    for i in 0..whole.rows() {
        let position = if i % 4000 == 2100 { 0.0 } else { (q[i] * 1e3).rem_euclid(50.0) };
        text += &format!("{},{position},{}\n", t[i], u[i]);
    }
    let name = "Achse 1 + Prüflauf (kalt).csv";
    std::fs::write(folder.path().join(name), text).expect("the folder takes files");
    let init = ["machine", "init", name, "--yes", "--answer", "gain=35.15065188248547 N/V"];
    let printed = succeeded(stickslip(folder.path(), &init, ""));
    let next =
        printed.lines().last().and_then(|line| line.trim().strip_prefix("stickslip ")).expect("the next command");
    let shell = format!("{} {next} --out out", env!("CARGO_BIN_EXE_stickslip"));
    let pasted = Command::new("sh").arg("-c").arg(shell).current_dir(folder.path()).output().expect("a shell");
    let printed = succeeded(pasted);
    let summary = std::fs::read_to_string(folder.path().join("out/summary.json")).expect("it was written");
    let report = std::fs::read_to_string(folder.path().join("out/report.html")).expect("it was written");
    for finding in ["counts modulo 50", "(dropouts): they were interpolated", "Guessed by machine init"] {
        assert!([&printed, &summary, &report].iter().all(|text| text.contains(finding)), "{finding}: {printed}");
    }
    let mass = value(&folder.path().join("out"), "inertia.mass");
    assert!((mass / 94.69 - 1.0).abs() < 5e-3, "{mass}");
}

#[test]
fn a_model_of_the_first_half_is_validated_on_the_second_as_the_library_does() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let whole = recording();
    let middle = whole.rows() / 2;
    // The time keeps its offset: only its steps matter.
    let write = |name: &str, rows: std::ops::Range<usize>| {
        let half = whole.rows_of(rows);
        let mut text = half.columns().iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(",") + "\n";
        for i in 0..half.rows() {
            let cells: Vec<String> = half.columns().iter().map(|c| c.values[i].to_string()).collect();
            text += &(cells.join(",") + "\n");
        }
        std::fs::write(folder.path().join(name), text).expect("the folder takes files");
    };
    write("first.csv", 0..middle);
    write("second.csv", middle..whole.rows());
    let machine_file = emps("emps-machine.toml");
    let machine_path = machine_file.to_str().expect("a path of letters");
    let identify = ["identify", "first.csv", "--machine", machine_path, "--out", "model"];
    succeeded(stickslip(folder.path(), &identify, ""));
    let model = "model/model.toml";
    let arguments = ["validate", "second.csv", "--model", model, "--machine", machine_path, "--out", "out"];
    let printed = succeeded(stickslip(folder.path(), &arguments, ""));
    assert!(printed.contains("predicts the recorded command with an error of"), "{printed}");

    let machine = Machine::read(&machine_file).expect("it loads");
    let identified = read_model(&folder.path().join(model)).expect("it loads");
    let second = Recording::read(&folder.path().join("second.csv")).expect("it was written");
    let signals = machine.signals(&second).expect("it is even");
    let motion = Motion::of(&signals, &machine).expect("it is long enough");
    let closed_loop = Loop::of(&signals, &motion, &machine).expect("the controller is known");
    let run = closed_loop
        .simulate(&identified.model, 2..motion.samples(), &Watch::silent())
        .expect("the run is not cancelled");
    let comparison = closed_loop.compare(&run, 48);
    let out = folder.path().join("out");
    assert_eq!(value(&out, "prediction.voltage_error"), comparison.voltage_error);
    assert_eq!(value(&out, "prediction.position_rms"), comparison.position_rms);
    assert!(comparison.voltage_error < 0.03 && comparison.position_rms < 1e-6, "{comparison:?}");
    let page = std::fs::read_to_string(out.join("report.html")).expect("it was written");
    assert!(page.contains("the identified model on second.csv") && page.contains("Position of the axis"));
    validate(&second, &identified, &machine, &Watch::silent()).expect("as at the command line");

    // The model is also a preset.
    let printed = succeeded(stickslip(folder.path(), &["params", "check", model], ""));
    assert!(printed.contains("all in order"), "{printed}");
    let no_model = ["validate", "second.csv", "--model", machine_path, "--machine", machine_path];
    let refused = stickslip(folder.path(), &no_model, "");
    assert!(stderr(&refused).contains("missing table [identified]"), "{}", stderr(&refused));
}
