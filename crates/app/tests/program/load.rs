//! The examples in C, as their heads say that they are compiled and loaded, and FMUs of the program itself.

use std::path::Path;
use std::process::{Command, Output};

fn run(program: &str, words: &[&str], folder: &Path) -> Output {
    Command::new(program).args(words).current_dir(folder).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The example in a folder, as its head says that it is compiled.
fn compile(folder: &Path, options: &[&str]) {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/controller/p_pi.c");
    std::fs::copy(example, folder.join("p_pi.c")).expect("the folder takes files");
    assert!(run(env!("CARGO_BIN_EXE_stickslip"), &["load", "--header", "."], folder).status.success());
    let words = [&["-O2", "-shared", "-fPIC", "-I.", "-o", "p_pi.so", "p_pi.c"], options].concat();
    let compiled = run("cc", &words, folder);
    assert!(compiled.status.success(), "{}", text(&compiled.stderr));
}

#[test]
fn the_example_is_ranked_among_the_controllers_of_the_house() {
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
    let said = ranked();
    assert!(said.contains("./p_pi.so") && !said.contains("would have stopped") && !said.contains("failed"), "{said}");
    let alone = run(env!("CARGO_BIN_EXE_stickslip"), &["serve", "--trust"], folder);
    assert!(!alone.status.success() && text(&alone.stderr).contains("--controller FILE"), "{}", text(&alone.stderr));
    let cells = || std::fs::read_dir(folder.join("out/cells")).expect("it wrote some");
    let cell = cells()
        .map(|it| it.expect("a file").path())
        .find(|path| path.to_string_lossy().ends_with("__p_pi_so_nominal_as_believed.json"))
        .expect("its");
    let before = std::fs::read_to_string(&cell).expect("text");
    // Deviation and torque noise: the torque is its own.
    let runs = serde_json::from_str::<serde_json::Value>(&before).expect("JSON")["runs"].clone();
    let measures = runs[0][1].as_array().expect("it came to the end").clone();
    assert!(measures.len() == 2 && measures.iter().all(|it| it.as_f64().is_some_and(|it| it > 1e-6)), "{measures:?}");
    assert_eq!(ranked(), said, "from what is kept");

    // The same with other gains is another one; without them it is that from before, to the digit.
    let both = "benchmark --quick --controller ./p_pi.so --controller ./p_pi.so,position_gain=15 --friction nominal \
                 --manoeuvre sine_0.5hz --out out";
    let two = run(env!("CARGO_BIN_EXE_stickslip"), &both.split_whitespace().collect::<Vec<_>>(), folder);
    assert!(two.status.success(), "{}", text(&two.stderr));
    let deviation = |name: &str| {
        let ending = format!("{name}_nominal_as_believed.json");
        let path = cells().map(|it| it.expect("a file").path()).find(|path| path.to_string_lossy().ends_with(&ending));
        let cell = std::fs::read_to_string(path.expect("its")).expect("text");
        serde_json::from_str::<serde_json::Value>(&cell).expect("JSON")["runs"][0][1][0].as_f64()
    };
    let [as_it_is, softer] =
        ["__p_pi_so", "__p_pi_so_position_gain_15"].map(|name| deviation(name).expect("a deviation"));
    assert!(softer > 1.5 * as_it_is, "{as_it_is} {softer} rad");
    // A comma may be in the name of a file.
    std::fs::copy(folder.join("p_pi.so"), folder.join("p,pi.so")).expect("it can be copied");
    let comma = ["benchmark", "--controller", "p,pi.so,position_gian=1"];
    let opened = text(&run(env!("CARGO_BIN_EXE_stickslip"), &comma, folder).stderr);
    assert!(opened.contains("position_gain"), "{opened}");
    for (set, told) in [("position_gain=soft", "position_gain=soft"), ("position_gian=15", "position_gain")] {
        let refused = format!("benchmark --controller ./p_pi.so,{set} --out out");
        let refused = run(env!("CARGO_BIN_EXE_stickslip"), &refused.split(' ').collect::<Vec<_>>(), folder);
        assert!(!refused.status.success() && text(&refused.stderr).contains(told), "{}", text(&refused.stderr));
    }

    // Another file of this name is another controller: one that fails is named, and the others are ranked.
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
    let said = ranked();
    assert!(said.contains("./p_pi.so failed, at first of this: ") && said.contains("(code 7)"), "{said}");
    assert_ne!(std::fs::read_to_string(&cell).expect("text"), before, "what was kept is of another file");
}

/// Another example, of a role, loaded for two speeds.
fn loaded_as(role: &str, source: &str, folder: &Path) -> String {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(role).join(format!("{source}.c"));
    std::fs::copy(example, folder.join(format!("{source}.c"))).expect("the folder takes files");
    assert!(run(env!("CARGO_BIN_EXE_stickslip"), &["load", "--header", "."], folder).status.success());
    let (library, source) = (format!("{source}.so"), format!("{source}.c"));
    let compiled = run("cc", &["-O2", "-shared", "-fPIC", "-I.", "-o", &library, &source, "-lm"], folder);
    assert!(compiled.status.success(), "{}", text(&compiled.stderr));
    let law = "bench.law.kind=residual";
    let words = ["load", &library, "--as", role, "--preset-set", law, "--duration", "1", "--out", role];
    let loaded = run(env!("CARGO_BIN_EXE_stickslip"), &words, folder);
    let (said, told) = (text(&loaded.stdout), text(&loaded.stderr));
    assert!(loaded.status.success(), "{said}{told}");
    let replayed = run(env!("CARGO_BIN_EXE_stickslip"), &["replay", role], folder);
    assert!(text(&replayed.stdout).contains("every bit is the same"), "{}", text(&replayed.stderr));
    said
}

#[test]
fn the_examples_of_a_friction_and_a_law_are_felt_and_replayed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let said = loaded_as("friction", "maxwell_slip", folder);
    for part in
        ["Maxwell slip, SHA-256 ", "Deviation from the friction of the file: ", "of the file", "stiffness = 100 N m/rad"]
    {
        assert!(said.contains(part), "{part}: {said}");
    }
    let summary = std::fs::read_to_string(folder.join("friction/summary.json")).expect("it wrote one");
    assert!(summary.contains("rendered.largest") && summary.contains("\"kind\": \"friction\""), "{summary}");
    let said = loaded_as("law", "difference", folder);
    for part in ["difference torque, SHA-256 ", "Deviation from the desired friction: ", "Under the preset's law: "] {
        assert!(said.contains(part), "{part}: {said}");
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
fn the_example_is_compiled_loaded_and_replayed_without_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let stickslip = |words: &[&str]| run(env!("CARGO_BIN_EXE_stickslip"), words, folder);
    compile(folder, &[]);
    let words = ["load", "p_pi.so", "--set", "position_gain=50", "--duration", "1", "--out", "there"];
    let loaded = stickslip(&words);
    let (said, told) = (text(&loaded.stdout), text(&loaded.stderr));
    assert!(loaded.status.success(), "{said}{told}");
    for part in ["P-PI cascade, SHA-256 ", "position_gain = 50 1/s", "sine_0.5hz", "A call took ", "of 5"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // The record says which file gave its torques.
    let hash = said.split("SHA-256 ").nth(1).and_then(|rest| rest.get(..64)).expect("64 digits");
    let record = std::fs::read(folder.join("there/run.mf4")).expect("it wrote one");
    assert!(
        String::from_utf8_lossy(&record).contains(&format!("stickslip load (controller P-PI cascade, SHA-256 {hash})"))
    );
    let summary = std::fs::read_to_string(folder.join("there/summary.json")).expect("it wrote one");
    assert!(summary.contains("controller.sine_0.5hz.rms") && summary.contains("call.over_budget"), "{summary}");
    // By the clock it may be late on a busy machine, which is said as well. It says which real-time priority it has.
    let source = std::fs::read_to_string(folder.join("p_pi.c")).expect("text");
    let end = "    return 0;\n}\n\nvoid stickslip_end";
    let says = "    struct sched_param own;\n    static int said;\n    \
                if (sample->time > 0.2 && !said++ && !sched_getparam(0, &own)) {\n        \
                fprintf(stderr, \"priority %d.\", own.sched_priority);\n    }\n";
    let tells = format!("#include <sched.h>\n#include <stdio.h>\n{}", source.replace(end, &(says.to_owned() + end)));
    assert!(tells.contains(says));
    std::fs::write(folder.join("tells.c"), tells).expect("the folder takes files");
    assert!(run("cc", &["-O2", "-shared", "-fPIC", "-I.", "-o", "p_pi.so", "tells.c"], folder).status.success());
    let in_real_time = stickslip(&["load", "p_pi.so", "--real-time", "--duration", "1", "--out", "clocked"]);
    let (said, told) = (text(&in_real_time.stdout), text(&in_real_time.stderr));
    assert!(in_real_time.status.success() || told.contains("ms after its sample began"), "{said}{told}");
    for part in ["In real time its torque was ready after ", "allowed: 750.00 µs", "from the deadline to the begin"] {
        assert!(said.contains(part), "{part}: {said}{told}");
    }
    // Below that of the loop, where it has one and leaves it room.
    let ordinary = said.contains("refuses real-time priority 80")
        || std::thread::available_parallelism().is_ok_and(|it| it.get() < 2);
    let priority = if ordinary { "priority 0." } else { "priority 79." };
    assert!(told.contains(priority) || !in_real_time.status.success(), "{told}{said}");
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
    let outside = stickslip(&["load", "p_pi.c", "--trust"]);
    assert!(text(&outside.stderr).contains("cc -shared -fPIC"), "{}", text(&outside.stderr));
}

#[test]
fn an_fmu_that_the_program_wrote_is_loaded_and_replayed_without_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let stickslip = |words: &[&str]| run(env!("CARGO_BIN_EXE_stickslip"), words, folder);
    assert!(stickslip(&["generate", "fmu", "position_controller", "--out", "fmu"]).status.success());
    let file = "fmu/position_controller-fmi3.fmu";
    let mapped = "measured_velocity=input.measured_velocity";
    let words = ["load", file, "--map", mapped, "--set", "input.integrates=0", "--duration", "1", "--out", "there"];
    let loaded = stickslip(&words);
    let (said, told) = (text(&loaded.stdout), text(&loaded.stderr));
    assert!(loaded.status.success(), "{said}{told}");
    for part in ["FMU 3.0 by stickslip ", "torque is output.torque [N.m]", "input.integrates = 0", "A call took "] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let summary = std::fs::read_to_string(folder.join("there/summary.json")).expect("it wrote one");
    assert!(summary.contains("input.measured_angle") && summary.contains("FMU 3.0"), "{summary}");
    std::fs::remove_dir_all(folder.join("fmu")).expect("it is there");
    let replayed = stickslip(&["replay", "there"]);
    assert!(text(&replayed.stdout).contains("every bit is the same"), "{}", text(&replayed.stderr));
    std::fs::write(folder.join("no.fmu"), "text").expect("the folder takes files");
    let refused = stickslip(&["load", "no.fmu"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("no.fmu: it is no FMU"), "{}", text(&refused.stderr));
}
