//! `stickslip report`.

use std::path::Path;
use std::process::{Command, Output};

use stickslip::quantity::Estimate;
use stickslip::report::{Provenance, Report};

fn stickslip(arguments: &[&str], folder: &Path) -> Output {
    let program = env!("CARGO_BIN_EXE_stickslip");
    Command::new(program).arg("report").args(arguments).current_dir(folder).output().expect("the program runs")
}

/// Two results and a folder without one.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("the temporary folder takes files");
    for (name, torque) in [("old", 0.18), ("new", 0.2)] {
        let directory = folder.path().join(name);
        std::fs::create_dir(&directory).expect("the temporary folder takes files");
        let report = Report::new(format!("The {name} axis"), Provenance::new("stickslip demo", Some(1), ""))
            .key("kinetic torque M_K", Estimate::new(torque, "N m"));
        report.write(&directory).expect("the temporary folder takes files");
    }
    std::fs::create_dir(folder.path().join("empty")).expect("the temporary folder takes files");
    folder
}

#[test]
fn a_deleted_page_is_written_again_with_the_same_bytes() {
    let folder = folder();
    let page = folder.path().join("old/report.html");
    let before = std::fs::read(&page).unwrap();
    std::fs::remove_file(&page).unwrap();
    let output = stickslip(&["old"], folder.path());
    assert!(output.status.success(), "{output:?}");
    assert_eq!(std::fs::read(&page).unwrap(), before);
    assert!(String::from_utf8(output.stdout).unwrap().contains("old/report.html"));
}

#[test]
fn several_results_are_compared_on_one_page() {
    let folder = folder();
    let output = stickslip(&["old", "new", "--out", "deep/both.html"], folder.path());
    assert!(output.status.success(), "{output:?}");
    let page = std::fs::read_to_string(folder.path().join("deep/both.html")).unwrap();
    for part in ["<h1>Comparison of old, new</h1>", "old: The old axis", "new: The new axis", "0.1800", "0.2000"] {
        assert!(page.contains(part), "{part}");
    }
    assert!(stickslip(&["old", "new"], folder.path()).status.success());
    assert!(folder.path().join("stickslip-out/comparison.html").exists());
}

#[test]
fn all_invalid_folders_are_reported_with_a_remedy_and_no_page_is_written() {
    let folder = folder();
    std::fs::write(folder.path().join("new/report.json"), "{\"schema\": \"stickslip.report/1\",\n \"title\": 3}")
        .unwrap();
    let output = stickslip(&["old", "empty", "new", "--out", "both.html"], folder.path());
    let errors = String::from_utf8(output.stderr).unwrap();
    let lines: Vec<_> = errors.lines().collect();
    assert_eq!((output.status.code(), lines.len()), (Some(1), 2), "{errors}");
    assert!(lines[0].starts_with("error: empty/report.json: cannot read it"), "{errors}");
    assert!(lines[1].starts_with("error: new/report.json:2:") && lines[1].contains("Repeat the command"), "{errors}");
    assert!(!folder.path().join("both.html").exists());
}
