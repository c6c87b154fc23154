//! Every example in the help runs, in the order of the help.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");

fn run(words: &[&str], folder: &Path) -> Output {
    let mut program = Command::new(PROGRAM);
    let program = program.args(words).current_dir(folder).stdin(Stdio::piped());
    let mut run = program.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
    // Empty answers accept the defaults; a program without questions may have ended before.
    let _ = run.stdin.take().expect("a pipe").write_all("\n".repeat(40).as_bytes());
    run.wait_with_output().expect("the program ends")
}

fn help(words: &[String]) -> String {
    let words: Vec<&str> = words.iter().map(String::as_str).chain(["--help"]).collect();
    String::from_utf8_lossy(&run(&words, Path::new(".")).stdout).into_owned()
}

/// The examples of a command and of all below it.
fn examples(command: &[String], found: &mut Vec<String>) {
    let help = help(command);
    // Lines of the help are wrapped: an example ends with its paragraph, or at the next example.
    let flat = help.split("Example: stickslip").skip(1);
    found.extend(flat.map(|example| {
        example.split("\n\n").next().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
    }));
    let commands = help.split("\nCommands:\n").nth(1).unwrap_or_default().split("\n\n").next().unwrap_or_default();
    for line in commands.lines() {
        let Some(name) = line.strip_prefix("  ").and_then(|line| line.split_whitespace().next()) else { continue };
        if !line.starts_with("   ") && name != "help" {
            examples(&[command, &[name.to_owned()]].concat(), found);
        }
    }
}

#[test]
fn every_example_in_the_help_runs() {
    let mut found = Vec::new();
    examples(&[], &mut found);
    assert!(found.len() >= 20, "{found:?}");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    // Files that the examples expect: a recording and a parameter file of the user.
    let table = "t [s],x [mm],force [N]\n0,0,1\n0.001,0.1,1\n0.002,0.3,1.5\n0.003,0.6,2\n";
    std::fs::write(folder.path().join("axis.csv"), table).expect("the folder takes files");
    std::fs::write(folder.path().join("my-bench.toml"), "[plant.drive]\nmotor_inertia = 4.2e-4\n")
        .expect("the folder takes files");
    found.sort();
    found.dedup();
    // Requires a second recording of the same machine.
    found.retain(|example| !example.starts_with("validate"));
    // Serves a machine until it is stopped; the tests of the remote bench cover it.
    found.retain(|example| !example.starts_with("plant"));
    // Needs devices at a network interface.
    found.retain(|example| !example.contains("ethercat"));
    // Minutes of work; the other examples of the same commands take seconds.
    found.retain(|example| example != "fidelity --quick" && example != "benchmark --quick");
    // There is neither a fault to acknowledge nor an external controller.
    found.retain(|example| !["bench acknowledge", "bench open-again"].contains(&example.as_str()));
    // The examples of the catalogue follow all others, whose runs they use.
    let (mut catalogued, rest): (Vec<String>, Vec<String>) = found.into_iter().partition(|it| it.starts_with("runs"));
    // Runs are shown before they are deleted.
    catalogued.sort_by_key(|example| ["delete", "restore"].iter().position(|last| example.contains(last)));
    let mut found = rest;
    let served = Served::start(folder.path());
    // Within a chain, commands use the files or the state of earlier ones; the chains are independent.
    let orders = "status bench-signals bench-operate bench-home bench-record-grease bench-stop bench-start bench-preload \
                  bench-move capture";
    let parameters = "params-set-live params-diff params-undo params-redo params-reset params-save params-load";
    let ends = "bench-halt bench-measure bench-report bench-record bench-off bench-arm bench-inject";
    let live: Vec<String> = [orders, parameters, ends].join(" ").split(' ').map(|o| o.replace('-', " ")).collect();
    let live: Vec<&str> = live.iter().map(String::as_str).collect();
    let chains =
        [&["demo", "report", "replay", "export", "recover"][..], &["measure", "fit", "design", "render"], &live];
    let rank = |example: &String| chains.concat().iter().position(|first| example.starts_with(first));
    found.sort_by_key(rank);
    let in_chain = |chain: &[&str], example: &str| chain.iter().any(|first| example.starts_with(first));
    std::thread::scope(|scope| {
        for chain in 0..=chains.len() {
            let belongs = move |example: &&String| match chains.get(chain) {
                Some(chain) => in_chain(chain, example),
                None => !in_chain(&chains.concat(), example),
            };
            let (found, folder, root) = (&found, folder.path(), &root);
            scope.spawn(move || found.iter().filter(belongs).for_each(|example| must_run(example, folder, root)));
        }
    });
    drop(served);
    assert!(catalogued.len() >= 9, "{catalogued:?}");
    catalogued.iter().for_each(|example| must_run(example, folder.path(), &root));
}

/// A running bench, which is stopped when dropped.
struct Served(std::process::Child);

impl Served {
    fn start(folder: &Path) -> Self {
        let words = ["serve", "--listen", "127.0.0.1:0"];
        let mut serve = Command::new(PROGRAM);
        let serve = serve.args(words).current_dir(folder).stdout(Stdio::null()).spawn().expect("the program starts");
        while !folder.join("stickslip-out/project/serve.json").exists() {
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        Served(serve)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn must_run(example: &str, folder: &Path, root: &Path) {
    if example.starts_with("report") {
        for place in ["stickslip-out/demo", "other/demo"] {
            copy(&folder.join("results"), &folder.join(place));
        }
    }
    // The redirection after > belongs to the shell.
    let line = example.split(" > ").next().unwrap_or_default();
    let words: Vec<String> = words(line).iter().map(|word| with_absolute_path(word, root)).collect();
    // A project has one bench, and that of this folder is already running.
    let apart = folder.join("apart");
    let folder = if example.starts_with("serve") { &*apart } else { folder };
    std::fs::create_dir_all(folder).expect("the folder takes folders");
    let output = run(&words.iter().map(String::as_str).collect::<Vec<_>>(), folder);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "stickslip {example}: {errors}");
    assert!(!output.stdout.is_empty() || line.contains("--out"), "stickslip {example} prints nothing");
}

/// The words of a line as a shell splits them: a text in quotes is one word.
fn words(line: &str) -> Vec<String> {
    let quote = line.find(['"', '\'']).map(|at| line.split_at(at));
    let Some((before, rest)) = quote else { return line.split_whitespace().map(Into::into).collect() };
    let quote = &rest[..1];
    let (quoted, after) = rest[1..].split_once(quote).expect("a quote is closed");
    let before = before.split_whitespace().map(Into::into);
    before.chain([quoted.to_owned()]).chain(words(after)).collect()
}

/// A word with an absolute path to data of the repository.
fn with_absolute_path(word: &str, root: &Path) -> String {
    if ["data/", "examples/"].iter().any(|folder| word.starts_with(folder)) {
        root.join(word).display().to_string()
    } else {
        word.to_owned()
    }
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("the folder takes folders");
    std::fs::copy(from.join("report.json"), to.join("report.json")).expect("the demo ran before");
}
