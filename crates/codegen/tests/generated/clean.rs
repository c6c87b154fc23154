//! Review of generated code: compilers, sanitizers and cppcheck with MISRA find nothing, faults are reported, the
//! example runs, and the page is correct.

use std::path::Path;

use super::support::blocks::{Lag, Nested};
use super::support::compiler::{STRICT, compile, compile_and_run, tool};
use super::support::projects::{self, Written};
use super::support::{assert_same, bench, case, number};
use stickslip_codegen::c::{DEVIATIONS, Project, Ready, project};
use stickslip_codegen::record;
use stickslip_core::control::{Pid, VelocityObserver};
use stickslip_core::friction::{Fading, LuGre, Model};
use stickslip_core::plant::Plant;
use stickslip_core::render::DifferenceTorque;
use stickslip_core::tick::Tick;

const SANITIZERS: [&str; 3] = ["-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];

/// Compiles code, self-test and example, and runs them; returns their output.
fn run_example(project_folder: &Written, compiler: &str, flags: &[&str]) -> (bool, String) {
    let (folder, name) = (project_folder.folder.path(), project_folder.name);
    let files = [format!("{name}.c"), format!("{name}_selftest.c"), "main.c".into()];
    compile(folder, compiler, flags, &files.each_ref().map(String::as_str), "example");
    tool(folder, "./example", "", &[])
}

fn every_project_compiles_without_a_warning_and_its_example_runs(compiler: &str, level: &str) {
    for project_folder in projects::all() {
        let flags = [&STRICT[..], &[level]].concat();
        let (success, table) = run_example(&project_folder, compiler, &flags);
        assert!(success, "{}: {table}", project_folder.name);
        let columns = table.lines().next().unwrap_or_default().split(',').count();
        assert_eq!(table.lines().count(), 401, "{table}");
        assert!(table.lines().all(|line| line.split(',').count() == columns && !line.contains("nan")), "{table}");
        assert!(table.lines().skip(1).all(|line| line.ends_with(",ok")), "{}: {table}", project_folder.name);
        let outputs = table.lines().next().unwrap_or_default().split(',').filter(|c| c.starts_with("output"));
        let results = |line: &str| line.splitn(columns - outputs.clone().count(), ',').last().map(String::from);
        let different: std::collections::HashSet<_> = table.lines().skip(1).map(results).collect();
        assert!(different.len() > 5, "{}: {table}", project_folder.name);
    }
}

macro_rules! every_project_is_clean {
    ($($test:ident: $compiler:literal, $level:literal;)+) => {$(
        #[test]
        fn $test() {
            every_project_compiles_without_a_warning_and_its_example_runs($compiler, $level);
        }
    )+};
}

every_project_is_clean! {
    every_project_is_clean_by_gcc_o2: "gcc", "-O2";
    every_project_is_clean_by_gcc_o3: "gcc", "-O3";
    every_project_is_clean_by_clang_o2: "clang", "-O2";
    every_project_is_clean_by_clang_o3: "clang", "-O3";
}

#[test]
fn sanitizers_find_no_fault() {
    for project_folder in projects::all() {
        let flags = [&STRICT[..], &SANITIZERS].concat();
        let (success, messages) = run_example(&project_folder, "gcc", &flags);
        assert!(success, "{}: {messages}", project_folder.name);
    }
    let (block, dt) = (bench::bench(), bench::TICK);
    let trajectories = case::trajectories(&block, dt);
    let program = record::record::<_, f64>(&block);
    let code = stickslip_codegen::c::print::<f64>(&program, "block").expect("a good name");
    let ran = compile_and_run(&program, &code, "gcc", &SANITIZERS, &trajectories);
    assert_same("with sanitizers", &number::run_guarded(&block, &trajectories), &ran.guarded);
}

/// Rules that cppcheck reports as violated: `misra-c2012-19.2`, `duplicateExpression`. The example is not part of the
/// product.
fn findings(folder: &Path) -> Vec<String> {
    let arguments = [
        "--std=c99",
        "--enable=all",
        "--addon=misra",
        "--suppress=missingIncludeSystem",
        "--template={file}:{line}:{id}",
        "--quiet",
        ".",
    ];
    let (_, text) = tool(folder, "cppcheck", "cppcheck", &arguments);
    // A block's input is the same for every model: one without ripple does not read the angle.
    let counts = |line: &&str| line.contains(':') && !line.starts_with("main.c:") && rule(line) != "unusedStructMember";
    text.lines().filter(counts).map(String::from).collect()
}

fn rule(finding: &str) -> &str {
    finding.rsplit(':').next().unwrap_or_default()
}

#[test]
fn cppcheck_and_misra_find_the_stated_deviations_and_no_more() {
    let deviations = DEVIATIONS.map(|(rule, _)| format!("misra-c2012-{rule}"));
    let mut needed = Vec::new();
    // The parts of machine and software, and one in single precision: bench and tick, composed of them, take cppcheck
    // five times as long as all parts.
    let parts = [
        "sliding",
        "nested",
        "cascade",
        "current",
        "pid",
        "position",
        "decoder",
        "observer",
        "encoder",
        "pickups",
        "machine",
        "difference_single",
    ];
    let all: Vec<_> =
        projects::all().into_iter().filter(|project_folder| parts.contains(&project_folder.name)).collect();
    // In parallel: this takes longest.
    let reports = std::thread::scope(|scope| {
        let running: Vec<_> = all.iter().map(|it| it.folder.path()).map(|at| scope.spawn(|| findings(at))).collect();
        running.into_iter().map(|it| it.join().expect("cppcheck has run")).collect::<Vec<_>>()
    });
    for (project_folder, reports) in all.iter().zip(reports) {
        let other: Vec<_> = reports.iter().filter(|finding| !deviations.iter().any(|d| d == rule(finding))).collect();
        assert!(other.is_empty(), "{}: {other:#?}", project_folder.name);
        needed.extend(reports.iter().map(|finding| rule(finding).to_string()));
        let page = project_folder.project.file("README.md").expect("a project has a page");
        assert!(DEVIATIONS.iter().all(|(rule, why)| page.contains(&format!("| {rule} | {why} |"))), "{page}");
    }
    for deviation in &deviations {
        assert!(needed.contains(deviation), "{deviation} is stated, but not required");
    }
}

#[test]
fn cppcheck_finds_inserted_faults() {
    let project_folder = projects::project::<f64, _>("lag", &Lag::<f64>::default(), 1e-3);
    let bad = "int lag_bad(int x);\nint lag_bad(int x) { if (x) x = 1; return x; }\n";
    let source = format!("{}{bad}", project_folder.project.file("lag.c").expect("a project has code"));
    std::fs::write(project_folder.folder.path().join("lag.c"), source).expect("a small file can be written");
    let reports = findings(project_folder.folder.path());
    for id in ["misra-c2012-14.4", "unusedFunction"] {
        assert!(reports.iter().any(|finding| rule(finding) == id), "{id} is not among {reports:?}");
    }
}

/// Changes the C code and returns the result of the self-test.
fn selftest(project_folder: &Written, compiler: &str, flags: &[&str], change: impl Fn(&str) -> String) -> String {
    let (folder, file) = (project_folder.folder.path(), format!("{}.c", project_folder.name));
    let source = project_folder.project.file(&file).expect("a project has code");
    let changed = change(source);
    std::fs::write(folder.join(&file), &changed).expect("a small file can be written");
    let (success, text) = run_example(project_folder, compiler, flags);
    if success { String::new() } else { text }
}

#[test]
fn the_self_test_detects_a_compiler_that_changes_results() {
    let project_folder = projects::project::<f64, _>("observer", &VelocityObserver::<f64>::default(), 250e-6);
    let as_it_is = |source: &str| source.to_string();
    let bare = |source: &str| source.replace("#error", "#define ignored").replace("#pragma", "#define");
    let plain = ["-O3", "-march=native"];
    assert_eq!(selftest(&project_folder, "gcc", &plain, as_it_is), "");
    assert_eq!(selftest(&project_folder, "clang", &plain, as_it_is), "");
    let fast = ["-O3", "-march=native", "-ffast-math"];
    assert!(selftest(&project_folder, "gcc", &fast, bare).starts_with("step "), "fast-math is not detected");
    let one_bit = |source: &str| source.replace("0.17097088181959966", "0.17097088181959969");
    let message = selftest(&project_folder, "gcc", &["-O2"], one_bit);
    assert!(
        message.starts_with("step ") && message.ends_with(": output angle\n"),
        "one bit is not detected: \
        {message}"
    );
    if cfg!(target_arch = "x86_64") {
        let extended = ["-std=gnu99", "-O2", "-mfpmath=387"];
        let message = selftest(&project_folder, "gcc", &extended, bare);
        assert!(message.starts_with("step "), "80 bits are not detected: {message}");
    }
    if std::arch::is_x86_feature_detected!("fma") {
        let greedy = ["-O3", "-march=native", "-ffp-contract=fast"];
        let message = selftest(&project_folder, "gcc", &greedy, bare);
        assert!(message.starts_with("step ") && message.contains(": "), "contraction is not detected: {message}");
    } else {
        println!("NOT RUN: this processor lacks fma, contraction is not tested");
    }
}

/// Result of `check` after a change of the parameters.
fn fault(project_folder: &Written, change: &str) -> String {
    let (folder, name) = (project_folder.folder.path(), project_folder.name);
    let text = format!(
        "#include \"{name}.h\"\n#include <math.h>\n#include <stdio.h>\nint main(void) {{\n    {name}_parameters p;\n    \
         const char *fault;\n    {name}_parameters_init(&p);\n    {change}\n    fault = {name}_check(&p);\n    \
         printf(\"%s\", (fault != 0) ? fault : \"none\");\n    return 0;\n}}\n"
    );
    std::fs::write(folder.join("check.c"), text).expect("a small file can be written");
    compile(folder, "gcc", &STRICT, &[&format!("{name}.c"), "check.c"], "check");
    tool(folder, "./check", "", &[]).1
}

#[test]
fn parameters_out_of_their_range_are_refused_with_path_and_range() {
    let nested = projects::project::<f64, _>("nested", &Nested::<f64>::default(), 1e-3);
    assert_eq!(fault(&nested, ""), "none");
    let inertia = "inertia must be 1e-6 to 1 kg m^2";
    for wrong in ["0.0", "2.0", "NAN", "INFINITY", "-1e-3"] {
        assert_eq!(fault(&nested, &format!("p.inertia = {wrong};")), inertia);
    }
    assert_eq!(fault(&nested, "p.inertia = 1e-6;"), "none", "the limits are allowed");
    assert_eq!(fault(&nested, "p.lags[2].limit = NAN;"), "lags[2].limit must be 0 to 1e9");
    assert_eq!(fault(&nested, "p.lags[0].limit = -1.0; p.inertia = 2.0;"), "lags[0].limit must be 0 to 1e9");

    let pid = projects::project::<f32, _>("pid", &Pid::<f64>::default(), 1e-3);
    for wrong in ["0.5f", "2.0f", "NAN"] {
        assert_eq!(fault(&pid, &format!("p.use_tacho = {wrong};")), "use_tacho must be 0 or 1");
    }
    let mut plant = Plant::<f64>::default();
    plant.screw_friction.model =
        Model::Lugre(LuGre { fading: Fading::Rational(Default::default()), ..LuGre::default() });
    let machine = projects::project::<f64, _>("machine", &plant.prepare(10, 25e-6), 25e-6);
    assert_eq!(fault(&machine, "p.half_flow[0][1] = INFINITY;"), "half_flow[0][1] must be finite");
    let bits = fault(&machine, "p.plant.inputs.bits = 15.5;");
    assert!(bits.starts_with("plant.inputs.bits must be a whole number, "), "{bits}");
    let law = fault(&machine, "p.plant.screw_friction.model.fading.velocity = 500.0;");
    assert!(
        law.starts_with(
            "plant.screw_friction.model.fading must be at most the limit that the other parameters \
        set. "
        ),
        "{law}"
    );
}

#[test]
fn the_page_shows_calls_that_compile_and_every_number() {
    for project_folder in projects::all() {
        let page = project_folder.project.file("README.md").expect("a project has a page");
        let calls = page.split("```c\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a block of C");
        std::fs::write(project_folder.folder.path().join("calls.c"), calls).expect("a small file can be written");
        compile(project_folder.folder.path(), "gcc", &[&STRICT[..], &["-c"]].concat(), &["calls.c"], "calls.o");
        assert!(calls.contains(&format!("{}_step(", project_folder.name)));
        let heads = ["# ", "## Outputs", "## How to compile it", "## MISRA C:2012"];
        assert!(heads.iter().all(|head| page.contains(head)), "{page}");
    }
    let observer = projects::project::<f64, _>("observer", &VelocityObserver::<f64>::default(), 250e-6);
    let page = observer.project.file("README.md").expect("a project has a page");
    for line in [
        "| `angle_gain` | l_φ | 1 | 0 to 1 | 0.17097088181959966 |",
        "The state has 4 numbers, 32 bytes.",
        "    φ⁺ = φ + T·Ω + T²/2·α,",
        "| `OBSERVER_NOT_COMPUTED` |",
    ] {
        assert!(page.contains(line), "{line} is not in:\n{page}");
    }
    let single = projects::project::<f32, _>("law", &DifferenceTorque::<f64>::default(), 250e-6);
    let page = single.project.file("README.md").expect("a project has a page");
    assert!(page.contains("| M_K | N m | 1e-6 to 200 | 0.18 |"), "{page}");
}

#[test]
fn the_self_test_of_a_recorded_program_is_that_of_its_block() {
    let (bench, tick, pid) = (bench::bench(), Tick::<f64>::default(), Pid::<f64>::default());
    let double: [(&dyn Ready, Project); 3] = [
        (&bench, project::<_, f64>(&bench, "block", bench::TICK).expect("a good name")),
        (&tick, project::<_, f64>(&tick, "block", bench::TICK).expect("a good name")),
        (&pid, project::<_, f64>(&pid, "block", bench::TICK).expect("a good name")),
    ];
    let single: [(&dyn Ready, Project); 2] = [
        (&tick, project::<_, f32>(&tick, "block", bench::TICK).expect("a good name")),
        (&pid, project::<_, f32>(&pid, "block", bench::TICK).expect("a good name")),
    ];
    for (block, expected) in double {
        assert!(block.double("block", bench::TICK) == Ok(expected));
    }
    for (block, expected) in single {
        assert!(block.single("block", bench::TICK) == Ok(expected));
    }
}
