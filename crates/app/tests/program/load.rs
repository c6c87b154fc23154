//! The examples in C, compiled and loaded as their comments describe, and generated FMUs.

use std::path::Path;
use std::process::{Command, Output};

fn run(program: &str, words: &[&str], folder: &Path) -> Output {
    Command::new(program).args(words).current_dir(folder).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Compiles the example in a folder by the command in its comments.
fn compile(folder: &Path, options: &[&str]) {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/controller/p_pi.c");
    std::fs::copy(example, folder.join("p_pi.c")).expect("the folder takes files");
    assert!(run(env!("CARGO_BIN_EXE_stickslip"), &["load", "--header", "."], folder).status.success());
    let words = [&["-O2", "-shared", "-fPIC", "-I.", "-o", "p_pi.so", "p_pi.c"], options].concat();
    let compiled = run("cc", &words, folder);
    assert!(compiled.status.success(), "{}", text(&compiled.stderr));
}

#[test]
fn the_example_is_ranked_with_the_built_in_controllers() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    compile(folder, &[]);
    let all =
        "benchmark --quick --controller pid --controller ./p_pi.so --friction nominal --manoeuvre sine_0.5hz --out out";
    let words: Vec<&str> = all.split(' ').collect();
    let ranked = || {
        let ranked = run(env!("CARGO_BIN_EXE_stickslip"), &words, folder);
        assert!(ranked.status.success(), "{}{}", text(&ranked.stdout), text(&ranked.stderr));
        text(&ranked.stdout)
    };
    let printed = ranked();
    assert!(
        printed.contains("./p_pi.so") && !printed.contains("stopped by the supervision") && !printed.contains("failed"),
        "{printed}"
    );
    let alone = run(env!("CARGO_BIN_EXE_stickslip"), &["serve", "--trust"], folder);
    assert!(!alone.status.success() && text(&alone.stderr).contains("--controller FILE"), "{}", text(&alone.stderr));
    let cells = || std::fs::read_dir(folder.join("out/cells")).expect("it wrote some");
    let cell = cells()
        .map(|it| it.expect("a file").path())
        .find(|path| path.to_string_lossy().ends_with("__p_pi_so_nominal_exact_model.json"))
        .expect("its");
    let before = std::fs::read_to_string(&cell).expect("text");
    // Deviation and torque noise are those of the example.
    let runs = serde_json::from_str::<serde_json::Value>(&before).expect("JSON")["runs"].clone();
    let measures = runs[0][1].as_array().expect("it ran to the end").clone();
    assert!(measures.len() == 2 && measures.iter().all(|it| it.as_f64().is_some_and(|it| it > 1e-6)), "{measures:?}");
    assert_eq!(ranked(), printed, "from the stored results");

    // With other gains it is another controller; without them the stored results are used.
    let both = "benchmark --quick --controller ./p_pi.so --controller ./p_pi.so,position_gain=15 --friction nominal \
                 --manoeuvre sine_0.5hz --out out";
    let two = run(env!("CARGO_BIN_EXE_stickslip"), &both.split_whitespace().collect::<Vec<_>>(), folder);
    assert!(two.status.success(), "{}", text(&two.stderr));
    let deviation = |name: &str| {
        let ending = format!("{name}_nominal_exact_model.json");
        let path = cells().map(|it| it.expect("a file").path()).find(|path| path.to_string_lossy().ends_with(&ending));
        let cell = std::fs::read_to_string(path.expect("its")).expect("text");
        serde_json::from_str::<serde_json::Value>(&cell).expect("JSON")["runs"][0][1][0].as_f64()
    };
    let [as_it_is, softer] =
        ["__p_pi_so", "__p_pi_so_position_gain_15"].map(|name| deviation(name).expect("a deviation"));
    assert!(softer > 1.5 * as_it_is, "{as_it_is} {softer} rad");
    // The name of a file may contain a comma.
    std::fs::copy(folder.join("p_pi.so"), folder.join("p,pi.so")).expect("it can be copied");
    let comma = ["benchmark", "--controller", "p,pi.so,position_gian=1"];
    let opened = text(&run(env!("CARGO_BIN_EXE_stickslip"), &comma, folder).stderr);
    assert!(opened.contains("position_gain"), "{opened}");
    for (set, message) in [("position_gain=soft", "position_gain=soft"), ("position_gian=15", "position_gain")] {
        let refused = format!("benchmark --controller ./p_pi.so,{set} --out out");
        let refused = run(env!("CARGO_BIN_EXE_stickslip"), &refused.split(' ').collect::<Vec<_>>(), folder);
        assert!(!refused.status.success() && text(&refused.stderr).contains(message), "{}", text(&refused.stderr));
    }

    // Another file of the same name is another controller. A controller that fails is named, the others are ranked.
    compile(folder, &["-Dstickslip_step=elsewhere"]);
    let missing = text(&run(env!("CARGO_BIN_EXE_stickslip"), &words, folder).stderr);
    assert!(missing.contains("p_pi.so") && missing.contains("no function stickslip_step"), "{missing}");
    let source = std::fs::read_to_string(folder.join("p_pi.c")).expect("text");
    let fails = source.replace(
        "    return 0;\n}\n\nvoid stickslip_end",
        "    return sample->time > 1.0 ? 7 : 0;\n}\n\nvoid stickslip_end",
    );
    assert_ne!(fails, source);
    std::fs::write(folder.join("fails.c"), fails).expect("the folder takes files");
    assert!(run("cc", &["-O2", "-shared", "-fPIC", "-I.", "-o", "p_pi.so", "fails.c"], folder).status.success());
    let printed = ranked();
    assert!(printed.contains("./p_pi.so failed; first fault: ") && printed.contains("(code 7)"), "{printed}");
    assert_ne!(std::fs::read_to_string(&cell).expect("text"), before, "the stored results were those of another file");
}

/// Loads the example of a role for two speeds.
fn load_as(role: &str, source: &str, folder: &Path) -> String {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(role).join(format!("{source}.c"));
    std::fs::copy(example, folder.join(format!("{source}.c"))).expect("the folder takes files");
    assert!(run(env!("CARGO_BIN_EXE_stickslip"), &["load", "--header", "."], folder).status.success());
    let (library, source) = (format!("{source}.so"), format!("{source}.c"));
    let compiled = run("cc", &["-O2", "-shared", "-fPIC", "-I.", "-o", &library, &source, "-lm"], folder);
    assert!(compiled.status.success(), "{}", text(&compiled.stderr));
    let law = "bench.law.kind=residual";
    let words = ["load", &library, "--as", role, "--preset-set", law, "--duration", "1", "--out", role];
    let loaded = run(env!("CARGO_BIN_EXE_stickslip"), &words, folder);
    let (printed, errors) = (text(&loaded.stdout), text(&loaded.stderr));
    assert!(loaded.status.success(), "{printed}{errors}");
    let replayed = run(env!("CARGO_BIN_EXE_stickslip"), &["replay", role], folder);
    assert!(text(&replayed.stdout).contains("every bit is the same"), "{}", text(&replayed.stderr));
    printed
}

#[test]
fn the_examples_of_a_friction_and_a_law_are_rendered_and_replayed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let printed = load_as("friction", "maxwell_slip", folder);
    for part in [
        "Maxwell slip, SHA-256 ",
        "Deviation from the friction of the file: ",
        "of the file",
        "stiffness = 100 N m/rad",
    ] {
        assert!(printed.contains(part), "{part}: {printed}");
    }
    let summary = std::fs::read_to_string(folder.join("friction/summary.json")).expect("it wrote one");
    assert!(summary.contains("rendered.largest") && summary.contains("\"kind\": \"friction\""), "{summary}");
    let printed = load_as("law", "difference", folder);
    for part in ["difference torque, SHA-256 ", "Deviation from the desired friction: ", "Under the preset's law: "] {
        assert!(printed.contains(part), "{part}: {printed}");
    }

    let refused = |words: &[&str]| {
        let refused = run(env!("CARGO_BIN_EXE_stickslip"), words, folder);
        assert!(!refused.status.success(), "{words:?}");
        text(&refused.stderr)
    };
    let unknown = refused(&["load", "maxwell_slip.so", "--as", "brake"]);
    assert!(unknown.contains("controller, friction, law"), "{unknown}");
    let follows =
        refused(&["load", "maxwell_slip.so", "--as", "friction", "--preset-set", "bench.law.kind=admittance"]);
    assert!(follows.contains("the admittance law") && follows.contains("bench.law.kind"), "{follows}");
    let both = refused(&["serve", "--friction", "maxwell_slip.so", "--law", "difference.so"]);
    assert!(both.contains("--friction and --law: one file at a time") && both.contains("Leave one"), "{both}");
    let nothing = refused(&["serve", "--loaded-set", "stiffness=1"]);
    assert!(nothing.contains("--friction FILE"), "{nothing}");
}

#[test]
fn the_example_is_compiled_loaded_and_replayed_without_its_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let stickslip = |words: &[&str]| run(env!("CARGO_BIN_EXE_stickslip"), words, folder);
    compile(folder, &[]);
    let words = ["load", "p_pi.so", "--set", "position_gain=50", "--duration", "1", "--out", "there"];
    let loaded = stickslip(&words);
    let (printed, errors) = (text(&loaded.stdout), text(&loaded.stderr));
    assert!(loaded.status.success(), "{printed}{errors}");
    for part in ["P-PI cascade, SHA-256 ", "position_gain = 50 1/s", "sine_0.5hz", "A call took ", "of 5"] {
        assert!(printed.contains(part), "{part}: {printed}");
    }
    // The recording identifies the file by its hash.
    let hash = printed.split("SHA-256 ").nth(1).and_then(|rest| rest.get(..64)).expect("64 digits");
    let record = std::fs::read(folder.join("there/run.mf4")).expect("it wrote one");
    assert!(
        String::from_utf8_lossy(&record).contains(&format!("stickslip load (controller P-PI cascade, SHA-256 {hash})"))
    );
    let summary = std::fs::read_to_string(folder.join("there/summary.json")).expect("it wrote one");
    assert!(summary.contains("controller.sine_0.5hz.rms") && summary.contains("call.over_budget"), "{summary}");
    // In real time it may be late on a busy computer, which is reported. The example prints its real-time priority.
    let source = std::fs::read_to_string(folder.join("p_pi.c")).expect("text");
    let end = "    return 0;\n}\n\nvoid stickslip_end";
    let print = "    struct sched_param own;\n    static int printed;\n    \
                if (sample->time > 0.2 && !printed++ && !sched_getparam(0, &own)) {\n        \
                fprintf(stderr, \"priority %d.\", own.sched_priority);\n    }\n";
    let with_print =
        format!("#include <sched.h>\n#include <stdio.h>\n{}", source.replace(end, &(print.to_owned() + end)));
    assert!(with_print.contains(print));
    std::fs::write(folder.join("prints.c"), with_print).expect("the folder takes files");
    assert!(run("cc", &["-O2", "-shared", "-fPIC", "-I.", "-o", "p_pi.so", "prints.c"], folder).status.success());
    let in_real_time = stickslip(&["load", "p_pi.so", "--real-time", "--duration", "1", "--out", "clocked"]);
    let (printed, errors) = (text(&in_real_time.stdout), text(&in_real_time.stderr));
    assert!(in_real_time.status.success() || errors.contains("ms after the start of its sample"), "{printed}{errors}");
    for part in ["In real time its torque was ready after ", "allowed: 750.00 µs", "from the deadline to the start"] {
        assert!(printed.contains(part), "{part}: {printed}{errors}");
    }
    // Below the priority of the loop, if the loop has a real-time priority and there is a second processor.
    let ordinary = printed.contains("refuses real-time priority 80")
        || std::thread::available_parallelism().is_ok_and(|it| it.get() < 2);
    let priority = if ordinary { "priority 0." } else { "priority 79." };
    assert!(errors.contains(priority) || !in_real_time.status.success(), "{errors}{printed}");
    let summary = std::fs::read_to_string(folder.join("clocked/summary.json")).expect("it wrote one");
    for name in ["response.p99", "response.late", "own.sine_0.5hz.rms", "timing.lateness.p99"] {
        assert!(summary.contains(name), "{name}: {summary}");
    }
    std::fs::remove_file(folder.join("p_pi.so")).expect("it is there");
    let replayed = stickslip(&["replay", "clocked"]);
    assert!(text(&replayed.stdout).contains("every bit is the same"), "{}", text(&replayed.stderr));
    let replayed = stickslip(&["replay", "there"]);
    assert!(text(&replayed.stdout).contains("every bit is the same"), "{}", text(&replayed.stderr));
    let gone = stickslip(&words);
    assert_eq!(gone.status.code(), Some(1));
    assert!(text(&gone.stderr).contains("p_pi.so: cannot read it"), "{}", text(&gone.stderr));
    let source = stickslip(&["load", "p_pi.c", "--trust"]);
    assert!(text(&source.stderr).contains("cc -shared -fPIC"), "{}", text(&source.stderr));
}

#[test]
fn a_generated_fmu_is_loaded_and_replayed_without_its_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let stickslip = |words: &[&str]| run(env!("CARGO_BIN_EXE_stickslip"), words, folder);
    assert!(stickslip(&["generate", "fmu", "position_controller", "--out", "fmu"]).status.success());
    let file = "fmu/position_controller-fmi3.fmu";
    let mapped = "measured_velocity=input.measured_velocity";
    let words = ["load", file, "--map", mapped, "--set", "input.integrates=0", "--duration", "1", "--out", "there"];
    let loaded = stickslip(&words);
    let (printed, errors) = (text(&loaded.stdout), text(&loaded.stderr));
    assert!(loaded.status.success(), "{printed}{errors}");
    for part in ["FMU 3.0 by stickslip ", "torque is output.torque [N.m]", "input.integrates = 0", "A call took "] {
        assert!(printed.contains(part), "{part}: {printed}");
    }
    let summary = std::fs::read_to_string(folder.join("there/summary.json")).expect("it wrote one");
    assert!(summary.contains("input.measured_angle") && summary.contains("FMU 3.0"), "{summary}");
    std::fs::remove_dir_all(folder.join("fmu")).expect("it is there");
    let replayed = stickslip(&["replay", "there"]);
    assert!(text(&replayed.stdout).contains("every bit is the same"), "{}", text(&replayed.stderr));
    std::fs::write(folder.join("no.fmu"), "text").expect("the folder takes files");
    let refused = stickslip(&["load", "no.fmu"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("no.fmu: not an FMU"), "{}", text(&refused.stderr));
}
