//! `stickslip identify`.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");

const MACHINE: &str = r#"
name = "axis"
axis = "linear"
sampling_period = { value = 1.0, unit = "ms" }
[columns]
time = { name = "t", unit = "s" }
position = { name = "q", unit = "mm" }
command = { name = "u", unit = "V" }
[drive]
gain = { value = 35.0, unit = "N/V" }
"#;

/// A folder with a machine file.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("machine.toml"), MACHINE).expect("the folder takes files");
    folder
}

/// Identifies from a recording of this text.
fn identify(folder: &Path, recording: &str) -> Output {
    std::fs::write(folder.join("axis.csv"), recording).expect("the folder takes files");
    Command::new(PROGRAM)
        .args(["identify", "axis.csv", "--machine", "machine.toml", "--out", "out"])
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

/// The only error of a run that writes no files.
fn refusal(folder: &Path, recording: &str) -> String {
    let output = identify(folder, recording);
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stdout.is_empty() && !folder.join("out").exists());
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    let errors: Vec<&str> = stderr.lines().filter_map(|line| line.strip_prefix("error: ")).collect();
    let [error] = errors.as_slice() else { panic!("{stderr}") };
    (*error).to_owned()
}

fn rows(rows: usize, cell: impl Fn(usize) -> String) -> String {
    let row = |i: usize| format!("{:.3},{},{}\n", i as f64 * 1e-3, cell(i), (i as f64 * 0.01).cos());
    "t,q,u\n".to_owned() + &(0..rows).map(row).collect::<String>()
}

#[test]
fn a_bad_recording_is_refused_with_file_line_and_remedy() {
    let folder = folder();
    let sine = |i: usize| format!("{}", (i as f64 * 0.01).sin());
    for (recording, parts) in [
        (rows(900, |i| if i == 40 { "lost".into() } else { sine(i) }), &["axis.csv", "42", "`q`", "lost"][..]),
        (rows(900, sine).replace("t,q,u", "t,pos,u"), &["axis.csv", "`q`", "t, pos, u"]),
        (
            rows(900, sine).replace("\n0.020,", "\n0.010,").replace("\n0.021,", "\n0.011,"),
            &["axis.csv", "22", "steps back"],
        ),
        (rows(900, sine) + "0.900,1\n", &["axis.csv", "902", "cells in this row: 2"]),
        (rows(300, sine), &["300", "700", "Record longer"]),
        (String::new(), &["axis.csv"]),
    ] {
        let error = refusal(folder.path(), &recording);
        assert!(parts.iter().all(|part| error.contains(part)), "{error}\nlacks one of {parts:?}");
    }
}

#[test]
fn a_missing_recording_is_named() {
    let output = Command::new(PROGRAM)
        .args(["identify", "absent.csv", "--machine", "machine.toml"])
        .current_dir(folder().path())
        .output()
        .expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr.contains("error: absent.csv: cannot read it"), "{stderr}");
}

fn emps(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/emps").join(file)
}

/// Starts the identification of the recorded EMPS.
fn emps_into(out: &Path) -> Command {
    let mut command = Command::new(PROGRAM);
    command.arg("identify").arg(emps("emps.csv.gz")).arg("--machine").arg(emps("emps-machine.toml"));
    command.arg("--out").arg(out);
    command
}

#[test]
fn a_recording_gives_a_report_whose_path_is_printed() {
    let folder = folder();
    let output = emps_into(folder.path()).output().expect("the program starts");
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let report = folder.path().join("report.html");
    assert!(stdout.contains("moving mass M") && stdout.contains(&report.display().to_string()), "{stdout}");
    let page = std::fs::read_to_string(report).expect("it was written");
    assert!(page.contains("<h1>EMPS: inertia and friction from emps.csv.gz</h1>"));
    assert!(page.contains("[published.symmetric]"), "the machine file is part of the report");
}

#[cfg(unix)]
#[test]
fn the_first_ctrl_c_cancels_the_fits() {
    use std::io::{BufRead, BufReader};
    let folder = folder();
    let out = folder.path().join("out");
    let mut child =
        emps_into(&out).arg("--progress").stderr(std::process::Stdio::piped()).spawn().expect("the program starts");
    let mut lines = BufReader::new(child.stderr.take().expect("it is piped")).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.starts_with("fit")), "the program ended before its fits");
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill is there");
    assert!(kill.success());
    assert_eq!(lines.last().as_deref(), Some("error: cancelled"));
    assert_eq!(child.wait().expect("it ended").code(), Some(130));
    assert!(!out.exists());
}
