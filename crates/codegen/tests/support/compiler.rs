//! Compiles generated C and runs it over trajectories.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use stickslip_codegen::c::CSource;
use stickslip_codegen::record::Program;

use super::case::Trajectory;

/// What the generated code must stand without a warning.
pub const STRICT: [&str; 8] =
    ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-pedantic", "-Werror"];

/// Output and state after each step of each trajectory, and the parameters that the code sets by itself.
pub struct Ran {
    pub rows: Vec<Vec<f64>>,
    pub parameters: Vec<f64>,
}

fn write(path: &Path, text: &str) {
    std::fs::write(path, text).unwrap_or_else(|error| panic!("cannot write {}: {error}", path.display()));
}

/// A program that reads trajectories and writes what the block makes of them.
fn main_program(program: &Program, real: &str) -> String {
    let top = program.steps.last().expect("a program has at least the block itself");
    let sizes = [&top.parameters, &top.state, &top.input, &top.output].map(stickslip_codegen::tree::Tree::numbers);
    let [p, s, input, out] = sizes.map(|n| n > 0);
    let when = |yes: bool, text: &str| if yes { text.to_string() } else { String::new() };
    let arguments: Vec<&str> = [(p, "&p"), (s, "&s"), (input, "&in"), (true, "dt"), (out, "&out")]
        .iter()
        .filter(|a| a.0)
        .map(|a| a.1)
        .collect();
    format!(
        "#include \"block.h\"\n#include <stdio.h>\nint main(void) {{\n{}{}{}{}    {real} head[2];\n{}    \
         while (fread(head, sizeof head, 1, stdin) == 1) {{\n        const {real} dt = head[1];\n{}{}        \
         for (long k = 0; k < (long)head[0]; ++k) {{\n{}            block_step({});\n{}{}        }}\n    }}\n    \
         return 0;\n}}\n",
        when(p, "    block_parameters p;\n"),
        when(s, "    block_state s;\n"),
        when(input, "    block_input in;\n"),
        when(out, "    block_output out;\n"),
        when(p, "    block_parameters_init(&p);\n    fwrite(&p, sizeof p, 1, stdout);\n"),
        when(p, "        if (fread(&p, sizeof p, 1, stdin) != 1) return 1;\n"),
        when(s, "        block_init(&s);\n"),
        when(input, "            if (fread(&in, sizeof in, 1, stdin) != 1) return 1;\n"),
        arguments.join(", "),
        when(out, "            fwrite(&out, sizeof out, 1, stdout);\n"),
        when(s, "            fwrite(&s, sizeof s, 1, stdout);\n"),
    )
}

/// Compiles the block called `block` with these flags and runs it.
pub fn compile_and_run(program: &Program, code: &CSource, flags: &[&str], trajectories: &[Trajectory]) -> Ran {
    let single = code.header.contains("float dt");
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = |name: &str| folder.path().join(name);
    write(&path("block.h"), &code.header);
    write(&path("block.c"), &code.source);
    write(&path("main.c"), &main_program(program, if single { "float" } else { "double" }));
    let compiled = Command::new("gcc")
        .args(flags)
        .args(["-o", "block", "block.c", "main.c"])
        .current_dir(folder.path())
        .output()
        .unwrap_or_else(|error| panic!("cannot start gcc ({error}). Install it: apt-get install gcc libc6-dev"));
    let messages = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success(), "gcc {flags:?} refuses the generated code:\n{messages}\n{}", code.source);

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
    let (parameters, mut rest) = numbers.split_at(top.parameters.numbers());
    let width = top.output.numbers() + top.state.numbers();
    let mut rows = Vec::new();
    for trajectory in trajectories {
        let (row, others) = rest.split_at(width * trajectory.inputs.len());
        rows.push(row.to_vec());
        rest = others;
    }
    assert!(rest.is_empty());
    Ran { rows, parameters: parameters.to_vec() }
}
