//! The catalogue of runs: runs of commands are found, renamed, replayed by number and deleted.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

fn program(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stickslip"));
    command.args(line.split(' ')).current_dir(folder);
    command
}

fn run(folder: &Path, line: &str) -> Output {
    program(folder, line).output().expect("the program starts")
}

/// The output of a command that must succeed.
fn stdout_of(folder: &Path, line: &str) -> String {
    let result = run(folder, line);
    assert!(result.status.success(), "{line}: {}", String::from_utf8_lossy(&result.stderr));
    String::from_utf8_lossy(&result.stdout).into_owned()
}

/// The error of a command that must fail.
fn error(folder: &Path, line: &str) -> String {
    let output = run(folder, line);
    assert!(!output.status.success(), "{line} succeeded");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const MEASURE: &str = "measure breakaway --quiet --set plan.angles=1 --set plan.repetitions=2";
const DESIGN: &str = "design --quiet --from clm-bench --point 0=0.3 --point 2=0.17 --point 12=0.13";

#[test]
fn a_run_is_found_renamed_replayed_by_number_deleted_and_restored() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let here = folder.path();
    assert_eq!(stdout_of(here, "runs"), "No runs.\n");
    stdout_of(here, &format!("{MEASURE} --record --preset clm-soft"));
    stdout_of(here, &format!("{DESIGN} --out designs/steep"));
    let list = stdout_of(here, "runs");
    let lines: Vec<&str> = list.lines().collect();
    assert!(lines.len() == 2 && lines[0].contains("design") && lines[1].contains("breakaway"), "{list}");
    assert!(stdout_of(here, "runs law:paper preset:soft").contains("run 1"), "{list}");
    assert_eq!(stdout_of(here, "runs desired.breakaway_torque>9"), "No runs.\n");
    assert!(stdout_of(here, "runs M_S>").contains("Note: M_S>"));
    assert!(stdout_of(here, "runs rename 1 loose").contains("loose"));
    assert!(stdout_of(here, "runs tag 1 +good -bad").contains("+good"));
    let shown = stdout_of(here, "runs show 1");
    for part in ["loose", "clm-soft", "stickslip-out/measure-breakaway", "run.mf4", "measure.breakaway_torque"] {
        assert!(shown.contains(part), "{part} in {shown}");
    }
    assert!(stdout_of(here, "replay 1").contains("every bit is the same"));
    stdout_of(here, "export 1 --out run.csv --until 0.01");
    assert!(stdout_of(here, "report 1 --out page.html").contains("page.html"));

    let json: serde_json::Value = serde_json::from_str(&stdout_of(here, "runs tag:good --json")).expect("JSON");
    assert_eq!((&json["of"], &json["runs"][0]["number"]), (&1.into(), &1.into()));
    stdout_of(here, "runs delete 1");
    assert!(error(here, "replay 1").contains("`stickslip runs restore`"));
    assert!(stdout_of(here, "runs is:deleted").contains("in the bin"));
    stdout_of(here, "runs restore 1");
    assert!(stdout_of(here, "replay 1").contains("every bit is the same"));
    assert!(error(here, "replay 9").contains("there is no run 9"));

    // The catalogue is lost and rebuilt from the folders.
    std::fs::remove_dir_all(here.join("stickslip-out/catalogue")).expect("it can be removed");
    std::fs::rename(here.join("designs/steep"), here.join("designs/flat")).expect("it moves");
    assert_eq!(stdout_of(here, "runs --rebuild"), "2 runs in the catalogue, 0 of them new to it.\n");
    assert!(stdout_of(here, "runs loose tag:good").contains("+good"));
    assert!(stdout_of(here, "runs show 2").contains("designs/flat"));
}

#[test]
fn many_programs_at_the_same_time_enter_all_their_runs() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let start = |k: u32| -> Child {
        let line = format!("{DESIGN} --out d{k}");
        program(folder.path(), &line).stderr(Stdio::piped()).spawn().expect("the program starts")
    };
    let many: Vec<Child> = (0..8).map(start).collect();
    for child in many {
        let output = child.wait_with_output().expect("it ends");
        assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let json: serde_json::Value = serde_json::from_str(&stdout_of(folder.path(), "runs --json")).expect("JSON");
    let numbers: Vec<i64> =
        json["runs"].as_array().expect("a list").iter().filter_map(|r| r["number"].as_i64()).collect();
    assert_eq!(numbers, [8, 7, 6, 5, 4, 3, 2, 1]);
}

#[test]
fn a_catalogue_that_cannot_be_written_is_a_warning() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("stickslip-out"), "").expect("the folder takes files");
    let output = run(folder.path(), &format!("{DESIGN} --out results"));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && message.contains("the run is not in the catalogue"), "{message}");
    assert!(folder.path().join("results/summary.json").exists());
    // A damaged catalogue.
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir_all(folder.path().join("stickslip-out/catalogue")).expect("the folder takes folders");
    std::fs::write(folder.path().join("stickslip-out/catalogue/last"), "many").expect("a file");
    let output = run(folder.path(), &format!("{DESIGN} --out results"));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && message.contains("stickslip runs --rebuild"), "{message}");
    assert_eq!(stdout_of(folder.path(), "runs --rebuild"), "1 runs in the catalogue, 1 of them new to it.\n");
}

#[test]
fn results_outside_the_working_folder_are_not_in_the_catalogue() {
    let (here, elsewhere) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
    stdout_of(here.path(), &format!("{DESIGN} --out {}", elsewhere.path().join("d").display()));
    assert!(!here.path().join("stickslip-out").exists());
    assert!(!elsewhere.path().join("d/run.json").exists());
}
