//! Compiles generated C and runs it over trajectories.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use stickslip_codegen::c::CSource;
use stickslip_codegen::record::Program;

use super::case::Trajectory;

/// Flags with which the generated code must compile without a warning.
pub const STRICT: [&str; 8] =
    ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-pedantic", "-Werror"];

/// Results of the trajectories, and the parameters that the code sets.
pub struct Ran {
    /// Output and state after each step.
    pub raw: Vec<Vec<f64>>,
    /// Output, status and state after each guarded step.
    pub guarded: Vec<Vec<f64>>,
    pub parameters: Vec<f64>,
    /// Result of `check`; empty without a fault.
    pub fault: String,
}

fn write(path: &Path, text: &str) {
    std::fs::write(path, text).unwrap_or_else(|error| panic!("cannot write {}: {error}", path.display()));
}

/// A program that reads trajectories and writes the results of the block, raw and guarded.
fn main_program(program: &Program, real: &str) -> String {
    let top = program.steps.last().expect("a program has at least the block itself");
    let sizes = [&top.parameters, &top.state, &top.input, &top.output].map(stickslip_codegen::tree::Tree::numbers);
    let [p, s, input, out] = sizes.map(|n| n > 0);
    let when = |yes: bool, text: &str| if yes { text.to_string() } else { String::new() };
    let call = |step: &str, state: &str| {
        let arguments = [(p, "&p"), (s, state), (input, "&in"), (true, "dt"), (out, "&out")];
        format!("{step}({})", arguments.iter().filter(|a| a.0).map(|a| a.1).collect::<Vec<_>>().join(", "))
    };
    let write = |yes: bool, name: &str| when(yes, &format!("            fwrite(&{name}, sizeof {name}, 1, stdout);\n"));
    let (raw, guarded) = (call("block_raw_step", "&raw"), call("block_step", "&guarded"));
    [
        "#include \"block.c\"\n#include <stdio.h>\nint main(void) {\n",
        &when(p, "    block_parameters p;\n    const char *fault;\n"),
        &when(s, "    block_state raw, guarded;\n"),
        &when(input, "    block_input in;\n"),
        &when(out, "    block_output out;\n"),
        &format!("    {real} head[2];\n"),
        &when(p, "    block_parameters_init(&p);\n    fault = block_check(&p);\n"),
        &when(p, "    fputs(fault ? fault : \"\", stderr);\n    fwrite(&p, sizeof p, 1, stdout);\n"),
        "    while (fread(head, sizeof head, 1, stdin) == 1) {\n",
        &format!("        const {real} dt = head[1];\n"),
        &when(p, "        if (fread(&p, sizeof p, 1, stdin) != 1) return 1;\n"),
        &when(s, "        block_init(&raw);\n        block_init(&guarded);\n"),
        "        for (long k = 0; k < (long)head[0]; ++k) {\n",
        &format!("            {real} status;\n"),
        &when(input, "            if (fread(&in, sizeof in, 1, stdin) != 1) return 1;\n"),
        &format!("            {raw};\n"),
        &(write(out, "out") + &write(s, "raw")),
        &format!("            status = ({real}){guarded};\n"),
        &(write(out, "out") + &write(true, "status") + &write(s, "guarded")),
        "        }\n    }\n    return 0;\n}\n",
    ]
    .concat()
}

/// Runs a tool in a folder; returns its output. Panics with the command to install it, or if it fails.
pub fn tool(folder: &Path, name: &str, package: &str, arguments: &[&str]) -> (bool, String) {
    let ran = Command::new(name).args(arguments).current_dir(folder).output();
    let ran =
        ran.unwrap_or_else(|error| panic!("cannot start {name} ({error}). Install it: apt-get install {package}"));
    let text = String::from_utf8_lossy(&ran.stdout).into_owned() + &String::from_utf8_lossy(&ran.stderr);
    (ran.status.success(), text)
}

/// Compiles files to a program; panics with the compiler's messages if it refuses.
pub fn compile(folder: &Path, compiler: &str, flags: &[&str], files: &[&str], program: &str) {
    let package = if compiler == "gcc" { "gcc libc6-dev" } else { compiler };
    let arguments = [flags, &["-o", program], files, &["-lm"]].concat();
    let (success, messages) = tool(folder, compiler, package, &arguments);
    assert!(success, "{compiler} {flags:?} refuses the generated code {files:?}:\n{messages}");
}

/// Compiles the block with the name `block` and runs it.
pub fn compile_and_run(
    program: &Program,
    code: &CSource,
    compiler: &str,
    flags: &[&str],
    trajectories: &[Trajectory],
) -> Ran {
    let single = code.header.contains("float dt");
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = |name: &str| folder.path().join(name);
    write(&path("block.h"), &code.header);
    write(&path("block.c"), &code.source);
    write(&path("main.c"), &main_program(program, if single { "float" } else { "double" }));
    compile(folder.path(), compiler, flags, &["main.c"], "block");

    let mut bytes = Vec::new();
    let mut put = |value: f64| {
        if single { bytes.extend((value as f32).to_ne_bytes()) } else { bytes.extend(value.to_ne_bytes()) }
    };
    for trajectory in trajectories {
        let head = [trajectory.inputs.len() as f64, trajectory.dt];
        head.iter().chain(&trajectory.parameters).chain(trajectory.inputs.iter().flatten()).for_each(|v| put(*v));
    }
    let mut file = BufWriter::new(File::create(path("trajectories")).expect("a file in a new folder can be made"));
    file.write_all(&bytes).and_then(|()| file.flush()).expect("a small file can be written");
    let input = File::open(path("trajectories")).expect("the file was just written");
    let ran = Command::new(path("block")).stdin(Stdio::from(input)).output().expect("a compiled program runs");
    assert!(ran.status.success(), "the generated program failed: {:?}", ran.status);

    let numbers: Vec<f64> = if single {
        ran.stdout
            .chunks_exact(4)
            .map(|b| f64::from(f32::from_ne_bytes(b.try_into().expect("chunks of this size"))))
            .collect()
    } else {
        ran.stdout.chunks_exact(8).map(|b| f64::from_ne_bytes(b.try_into().expect("chunks of this size"))).collect()
    };
    let top = program.steps.last().expect("a program has at least the block itself");
    let (parameters, mut remainder) = numbers.split_at(top.parameters.numbers());
    let width = top.output.numbers() + top.state.numbers();
    let (mut raw, mut guarded) = (Vec::new(), Vec::new());
    for trajectory in trajectories {
        let (both, others) = remainder.split_at((2 * width + 1) * trajectory.inputs.len());
        let part = |range: std::ops::Range<usize>| {
            both.chunks(2 * width + 1).flat_map(|step| step[range.clone()].to_vec()).collect::<Vec<f64>>()
        };
        raw.push(part(0..width));
        guarded.push(part(width..2 * width + 1));
        remainder = others;
    }
    assert!(remainder.is_empty());
    let fault = String::from_utf8_lossy(&ran.stderr).into_owned();
    Ran { raw, guarded, parameters: parameters.to_vec(), fault }
}
