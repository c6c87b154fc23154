//! The page on files lists each file that a command writes, each column with its unit, each result and each key.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use stickslip::machine::Machine;
use stickslip::recording::Recording;

use super::markdown::{Page, Table};
use super::{BENCH, LESSON, LOOP, MICROCONTROLLER, RECORDING};

/// The tables below headings that start with `stickslip COMMAND`.
fn of_command(page: &Page, command: &str) -> Vec<Table> {
    let start = format!("stickslip {command}");
    let own = |heading: &str| heading == start || heading.starts_with(&format!("{start}:"));
    page.tables().into_iter().filter(|table| own(&table.heading)).collect()
}

/// Errors in the description of a folder that a command has written.
fn wrong(page: &Page, command: &str, folder: &Path) -> Vec<String> {
    let summary = std::fs::read_to_string(folder.join("summary.json")).expect("the command wrote it");
    let summary: Value = serde_json::from_str(&summary).expect("it is JSON");
    let mut wrong = Vec::new();
    let tables = of_command(page, command);
    let mut differ = |what: String, described: BTreeSet<String>, written: BTreeSet<String>| {
        wrong.extend(described.difference(&written).map(|name| format!("{what}: {name} does not exist")));
        wrong.extend(written.difference(&described).map(|name| format!("{what}: {name} is not on the page")));
    };

    let listed = |name: &str| -> BTreeSet<String> {
        tables.iter().filter_map(|table| table.column(name)).flatten().map(String::from).collect()
    };
    let files = summary["files"].as_array().into_iter().flatten().filter_map(Value::as_str).map(String::from);
    differ(command.into(), listed("file"), files.chain(["summary.json".into()]).collect());

    for table in &tables {
        let Some(described) = table.columns(["column", "unit"]) else { continue };
        let described = described.iter().map(|[name, unit]| format!("{name} [{}]", ascii(unit))).collect();
        let file = table.heading.rsplit(' ').next().unwrap_or_default();
        let recording = Recording::read(&folder.join(file)).unwrap_or_else(|error| panic!("{error}"));
        let unit = |column: &stickslip::recording::Column| ascii(column.unit.as_deref().unwrap_or("1"));
        let written = recording.columns().iter().map(|column| format!("{} [{}]", column.name, unit(column))).collect();
        differ(file.into(), described, written);
    }

    let results = summary["results"].as_object().expect("a summary has results");
    let described: Vec<[&str; 2]> =
        tables.iter().filter_map(|table| table.columns(["result", "unit"])).flatten().collect();
    for [pattern, unit] in &described {
        let named = || results.iter().filter(|(name, _)| matches(pattern, name));
        if named().next().is_none() {
            wrong.push(format!("{command}: no result is called {pattern}"));
        }
        for (name, value) in named().filter(|(_, value)| value["unit"].as_str().map(ascii) != Some(ascii(unit))) {
            wrong.push(format!("{command}: {name} is not in {unit} but in {}", value["unit"]));
        }
    }
    let unnamed = results.keys().filter(|name| !described.iter().any(|[pattern, _]| matches(pattern, name)));
    wrong.extend(unnamed.map(|name| format!("{command}: the result {name} is not on the page")));
    wrong
}

/// Whether a name is the pattern, with any word for a word in capitals.
fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<_>, Vec<_>) = (pattern.split('.').collect(), name.split('.').collect());
    let same = |(p, n): (&&str, &&str)| p == n || p.chars().all(char::is_uppercase);
    pattern.len() == name.len() && pattern.iter().zip(&name).all(same)
}

fn ascii(unit: &str) -> String {
    unit.replace('·', " ").replace('²', "^2")
}

#[test]
fn files_of_demo_are_described() {
    assert_eq!(wrong(&Page::read("files.md"), "demo", &LESSON.path().join("stickslip-out/demo")), [] as [String; 0]);
}

#[test]
fn files_of_identify_and_validate_are_described() {
    let (page, out) = (Page::read("files.md"), RECORDING.path().join("stickslip-out"));
    assert_eq!(wrong(&page, "identify", &out.join("identify")), [] as [String; 0]);
    assert_eq!(wrong(&page, "validate", &out.join("validate")), [] as [String; 0]);
}

#[test]
fn files_of_measure_fit_design_and_render_are_described() {
    let (page, out) = (Page::read("files.md"), BENCH.path().join("stickslip-out"));
    for (command, folder) in [
        ("measure friction", "measure-friction"),
        ("measure breakaway", "measure-breakaway"),
        ("measure presliding", "measure-presliding"),
        ("fit", "fit"),
        ("design", "design"),
        ("render", "render"),
    ] {
        assert_eq!(wrong(&page, command, &out.join(folder)), [] as [String; 0]);
    }
}

#[test]
fn files_of_loop_and_measure_response_are_described() {
    let (page, out) = (Page::read("files.md"), LOOP.path().join("stickslip-out"));
    assert_eq!(wrong(&page, "loop", &out.join("loop")), [] as [String; 0]);
    assert_eq!(wrong(&page, "measure response", &out.join("measure-response")), [] as [String; 0]);
}

/// Runs a command and returns the errors in the description of its files.
fn wrong_after(command: &str, options: &str) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = format!("{command} {options} --quiet --out .");
    let program = env!("CARGO_BIN_EXE_stickslip");
    let status = Command::new(program).args(arguments.split_whitespace()).current_dir(&folder).status();
    assert!(status.expect("the program starts").success(), "{arguments}");
    wrong(&Page::read("files.md"), command, folder.path())
}

#[test]
fn files_of_calibrate_are_described() {
    assert_eq!(
        wrong_after("calibrate", "--preset prototype --set plan.duration=1 --set plan.rest_duration=1"),
        [] as [String; 0]
    );
}

#[test]
fn files_of_learning_hunting_and_benchmark_are_described() {
    // This controller hunts.
    let hunts = "--set model.own.breakaway_torque=0.45 --set model.own.kinetic_torque=0.2 \
                 --set model.own.stribeck_velocity=0.5";
    for (command, options) in [
        ("measure learning", "--set plan.repetitions=3"),
        ("measure tracking", "--set plan.speeds=2 --set plan.frequencies=2 --set plan.lowest_frequency=1"),
        ("hunting", &format!("--preset prototype {hunts}")),
        ("friction", "dc-servo --onto prototype"),
        ("benchmark", "--quick --controller pid --friction nominal --manoeuvre reversal --seeds 1"),
    ] {
        assert_eq!(wrong_after(command, options), [] as [String; 0], "{command}");
    }
}

#[test]
fn files_of_study_are_described() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("study.toml");
    let study = "manoeuvres = [\"sine_2hz\"]\n[[axis]]\npath = \"plant.drive.load_inertia\"\nvalues = [1e-3, 1.2e-3]\n";
    std::fs::write(&file, study).expect("the folder takes files");
    assert_eq!(wrong_after("study", &file.display().to_string()), [] as [String; 0]);
}

#[test]
fn the_study_on_its_page_is_the_example() {
    let example = include_str!("../../../../../examples/study/model.toml");
    // Without the comment at its start, which the page explains.
    let example = example.split_once("\n\n").map_or(example, |(_, below)| below);
    assert!(Page::read("studies.md").text.contains(example), "{example}");
}

#[test]
fn the_rust_program_on_its_page_is_the_example() {
    let page = Page::read("external.md");
    let blocks: Vec<String> = page.blocks().iter().map(|block| block.lines.join("\n") + "\n").collect();
    for (file, text) in [
        ("feedforward.rs", include_str!("../../../../stickslip/examples/feedforward.rs")),
        ("feedforward.txt", include_str!("../../../../stickslip/examples/feedforward.txt")),
    ] {
        assert!(blocks.iter().any(|block| block == text), "external.md: copy {file} of the examples into its block");
    }
}

#[test]
fn files_of_generate_are_described() {
    let out = MICROCONTROLLER.path().join("observer");
    assert_eq!(wrong(&Page::read("files.md"), "generate c", &out), [] as [String; 0]);
}

#[test]
fn files_of_generate_a2l_are_described() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let command = "generate a2l bench --quiet --out .";
    let status = Command::new(env!("CARGO_BIN_EXE_stickslip")).args(command.split(' ')).current_dir(&folder).status();
    assert!(status.expect("the program starts").success());
    assert_eq!(wrong(&Page::read("files.md"), "generate a2l", folder.path()), [] as [String; 0]);
}

#[test]
fn files_of_fidelity_are_described() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let small = "fidelity --seeds 1 --law paper --mismatch perfect --mismatch own+10% --rate 4000 --preset prototype \
                 --scenario sine_2hz --scenario hunting --quiet --out .";
    let status =
        Command::new(env!("CARGO_BIN_EXE_stickslip")).args(small.split_whitespace()).current_dir(&folder).status();
    assert!(status.expect("the program starts").success());
    let page = Page::read("files.md");
    assert_eq!(wrong(&page, "fidelity", folder.path()), [] as [String; 0]);

    let summary = std::fs::read_to_string(folder.path().join("summary.json")).expect("the command wrote it");
    let summary: Value = serde_json::from_str(&summary).expect("it is JSON");
    let described: Vec<Table> =
        page.tables().into_iter().filter(|table| table.heading == "stickslip fidelity: a row").collect();
    let described: BTreeSet<String> = described[0]
        .column("cell")
        .expect("its cells")
        .iter()
        .flat_map(|cell| cell.split(", "))
        .map(|cell| cell.replace('`', ""))
        .collect();
    let written: BTreeSet<String> = summary["rows"][0].as_object().expect("a row").keys().cloned().collect();
    assert_eq!(described, written, "left: the page, right: the file");
}

#[test]
fn errors_in_a_description_are_found() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let summary = r#"{"results": {"a.b": {"value": 1, "unit": "N m"}, "c": {"value": 1, "unit": "1"}},
                      "files": ["t.csv", "u.csv"]}"#;
    std::fs::write(folder.path().join("summary.json"), summary).expect("it takes files");
    std::fs::write(folder.path().join("t.csv"), "v [m/s],f [N]\n1,2\n").expect("it takes files");
    let text = "## stickslip x\n| file |\n|-|\n| t.csv |\n| w.csv |\n| summary.json |\n\n### stickslip x: t.csv\n\
                | column | unit |\n|-|-|\n| v | mm/s |\n| f | N |\n\n### stickslip x: results\n\
                | result | unit |\n|-|-|\n| a.NAME | N |\n| d | 1 |\n";
    let found = wrong(&Page { name: "a.md".into(), text: text.into() }, "x", folder.path()).join("\n");
    for part in
        ["w.csv does not exist", "u.csv is not on", "v [mm/s] does not", "v [m/s] is not on", "a.b is not in N but"]
    {
        assert!(found.contains(part), "{part}:\n{found}");
    }
    assert!(found.contains("no result is called d") && found.contains("result c is not on"), "{found}");
}

/// The keys that a table of the machine file may have, from the error for an unknown key.
fn keys(text: &str) -> BTreeSet<String> {
    let refusal = Machine::parse(Path::new("axis.toml"), text).expect_err("the key is unknown").to_string();
    let (_, list) = refusal.split_once("expected ").unwrap_or_else(|| panic!("{refusal}"));
    list.split('`').skip(1).step_by(2).map(String::from).collect()
}

#[test]
fn every_key_of_the_machine_file_is_described() {
    let position = "name = \"a\"\naxis = \"linear\"\nsampling_period = { value = 1, unit = \"ms\" }\n[columns]\n";
    let columns = format!("{position}position = {{ name = \"q\" }}\ncommand = {{ name = \"u\" }}\n");
    let page = Page::read("files.md");
    let described: Vec<Table> = page.tables().into_iter().filter(|table| table.column("key").is_some()).collect();
    for (heading, text) in [
        ("Machine file: the axis", "nothing = 1".to_owned()),
        ("Machine file: [columns]", format!("{position}nothing = 1")),
        ("Machine file: a column", format!("{position}position = {{ nothing = 1 }}")),
        ("Machine file: [drive]", format!("{columns}[drive]\nnothing = 1")),
        ("Machine file: [controller]", format!("{columns}[drive]\n[controller]\nkind = \"p-p\"\nnothing = 1")),
        ("Machine file: [recipe]", format!("{columns}[drive]\n[recipe]\nnothing = 1")),
        ("Machine file: [pendulum]", format!("{columns}[pendulum]\nnothing = 1")),
    ] {
        let table = described.iter().find(|table| table.heading == heading).unwrap_or_else(|| panic!("{heading}"));
        let described: BTreeSet<String> = table.column("key").into_iter().flatten().map(String::from).collect();
        let mut written = keys(&text);
        if heading.contains("controller") {
            written.insert("kind".into());
        }
        assert_eq!(described, written, "{heading}");
    }
}
