//! The command line of the program: parameters, exit codes, errors.

use std::path::Path;
#[cfg(unix)]
use std::process::Stdio;
use std::process::{Command, Output};

fn stickslip(arguments: &[&str], folder: &Path) -> Output {
    let program = env!("CARGO_BIN_EXE_stickslip");
    Command::new(program).args(arguments).current_dir(folder).output().expect("the program starts")
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder with a file of the values that are not default, and one with two errors.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("the temporary folder takes files");
    for (name, text) in [
        ("mine.toml", "# Mine.\n[plant.drive]\nmotor_inertia = 5e-4 # disc\n"),
        ("wrong.toml", "[plant.drive]\nmotor_inertia = -5e-4\nload_inertai = 1\n"),
    ] {
        std::fs::write(folder.path().join(name), text).expect("the temporary folder takes files");
    }
    folder
}

#[test]
fn a_valid_file_is_reported_as_valid() {
    let output = stickslip(&["params", "check", "mine.toml"], folder().path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).starts_with("mine.toml: ") && stderr(&output).is_empty());
}

#[test]
fn every_preset_is_listed_and_valid() {
    let folder = folder();
    let list = stdout(&stickslip(&["params", "list"], folder.path()));
    let names: Vec<_> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.contains(&"clm-bench"), "{list}");
    let output = stickslip(&[&["params", "check"], &names[..]].concat(), folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(stdout(&output).lines().count(), names.len());
}

#[test]
fn all_errors_of_all_files_are_on_stderr() {
    let output = stickslip(&["params", "check", "wrong.toml", "mine.toml", "absent.toml"], folder().path());
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).starts_with("mine.toml: "));
    let lines: Vec<_> = stderr(&output).lines().map(str::to_string).collect();
    let [sign, name, absent] = lines.as_slice() else { panic!("{lines:?}") };
    assert_eq!(
        sign,
        "error: plant.drive.motor_inertia = -5e-4 kg m^2 is outside 1e-7 … 1 kg m^2 (wrong.toml:2). \
         It is a magnitude; drop the sign."
    );
    assert_eq!(
        name,
        "error: unknown parameter plant.drive.load_inertai (wrong.toml:3). Did you mean plant.drive.load_inertia?"
    );
    assert!(absent.starts_with("error: absent.toml: cannot read it"), "{absent}");
}

#[test]
fn a_value_is_set_in_place_and_shows_in_the_difference() {
    let folder = folder();
    let set = ["params", "set", "mine.toml", "plant.drive.motor_inertia", "6e-4"];
    assert_eq!(stdout(&stickslip(&set, folder.path())), "# Mine.\n[plant.drive]\nmotor_inertia = 6e-4 # disc\n");
    let output = stickslip(&[&set[..], &["--out", "new.toml"]].concat(), folder.path());
    assert_eq!((output.status.code(), stdout(&output)), (Some(0), String::new()));
    let difference = stickslip(&["params", "diff", "mine.toml", "new.toml"], folder.path());
    assert_eq!(stdout(&difference), "plant.drive.motor_inertia: 5e-4 kg m^2 → 6e-4 kg m^2\n");
    let output = stickslip(
        &["params", "set", "new.toml", "plant.drive.motor_inertia", "-1", "--out", "new.toml"],
        folder.path(),
    );
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(
        stdout(&stickslip(&set, folder.path())),
        std::fs::read_to_string(folder.path().join("new.toml")).unwrap()
    );
}

#[test]
fn a_complete_file_reads_back_without_difference() {
    let folder = folder();
    let written = stickslip(&["params", "write", "mine.toml"], folder.path());
    std::fs::write(folder.path().join("full.toml"), &written.stdout).unwrap();
    let difference = stickslip(&["params", "diff", "mine.toml", "full.toml"], folder.path());
    assert_eq!((difference.status.code(), stdout(&difference)), (Some(0), String::new()));
    let list = stdout(&stickslip(&["params", "list", "full.toml"], folder.path()));
    assert!(list.contains("plant.drive.motor_inertia = 5e-4 kg m^2\n"), "{list}");
}

#[test]
fn a_parameter_is_described_and_a_wrong_name_gets_the_right_one() {
    let folder = folder();
    let output = stdout(&stickslip(&["params", "describe", "plant.drive.motor_inertia"], folder.path()));
    assert!(output.starts_with("plant.drive.motor_inertia\n    J_M [kg m^2], 1e-7 … 1"), "{output}");
    let output = stickslip(&["params", "describe", "plant.drive.motor_intertia"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(
        stderr(&output),
        "error: unknown parameter plant.drive.motor_intertia. Did you mean plant.drive.motor_inertia?\n"
    );
}

#[test]
fn an_invalid_command_line_has_exit_code_2() {
    let folder = folder();
    for arguments in [&["parms"][..], &["params"], &["params", "check"], &["params", "list", "a", "b"]] {
        let output = stickslip(arguments, folder.path());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{arguments:?}");
    }
    assert_eq!(stickslip(&["--version"], folder.path()).status.code(), Some(0));
    let output = stickslip(&["params", "check", "clm-bensh"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).starts_with("error: unknown preset clm-bensh. Did you mean clm-bench?"),
        "{}",
        stderr(&output)
    );
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_not_an_error() {
    // `describe` writes more than the pipe can hold, and the reader is closed.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let program = env!("CARGO_BIN_EXE_stickslip");
    let output =
        Command::new(program).args(["params", "describe"]).stdout(writer).stderr(Stdio::piped()).output().unwrap();
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_stdout_is_an_error() {
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let program = env!("CARGO_BIN_EXE_stickslip");
    let output = Command::new(program).args(["params", "write"]).stdout(full).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).starts_with("error: standard output: cannot write it"), "{}", stderr(&output));
}

#[cfg(unix)]
#[test]
fn without_a_command_the_demo_runs_and_then_the_server_until_ctrl_c() {
    use std::io::{BufRead as _, BufReader};
    // The default port is in use, by this test or another program.
    let _listener = std::net::TcpListener::bind("127.0.0.1:9740");
    let folder = folder();
    let mut program = Command::new(env!("CARGO_BIN_EXE_stickslip"));
    let mut served = program.current_dir(folder.path()).stdout(Stdio::piped()).spawn().expect("the program starts");
    let mut lines = BufReader::new(served.stdout.take().expect("it is piped")).lines().map_while(Result::ok);
    let report = lines.find(|line| line.starts_with("Report with figures")).expect("the demo ends with it");
    assert!(report.ends_with("stickslip-out/demo/report.html"), "{report}");
    let address = lines.find(|line| line.starts_with("http://127.0.0.1:")).expect("the bench has an address");
    assert!(!address.contains(":9740/"), "{address}");
    let status = stickslip(&["status", "--json"], folder.path());
    assert!(stdout(&status).contains(r#""state":"off""#), "{}{}", stdout(&status), stderr(&status));
    let kill = Command::new("kill").args(["-INT", &served.id().to_string()]).status().expect("kill is there");
    assert!(kill.success());
    assert!(lines.any(|line| line.contains("timing, µs")), "the timing report follows");
    assert_eq!(served.wait().expect("it runs").code(), Some(0));
}
