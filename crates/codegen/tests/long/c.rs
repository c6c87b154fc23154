//! The million ticks in C, by each compiler.

use std::fmt;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use stickslip_codegen::c;
use stickslip_codegen::record::{Precision, Program};
use tempfile::TempDir;

use super::schedule::{CHUNK, RUN, SPECIAL_RESTART, SPECIAL_TICKS, Schedule};

/// The step without the guard against non-finite numbers, which must have the bits of Rust for any input.
const RAW_STEP: &str = "block_raw_step";

/// A compiler with its switches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variant {
    pub compiler: &'static str,
    pub level: &'static str,
    pub native: bool,
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}{}", self.compiler, self.level, if self.native { " -march=native" } else { "" })
    }
}

/// A folder with a block's C code and its inputs.
pub struct Workshop {
    folder: TempDir,
    definitions: Vec<String>,
    single: bool,
    width: usize,
}

impl Workshop {
    pub fn new<F: Precision>(program: &Program, schedule: &Schedule) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let code = c::print::<F>(program, "block").expect("a good name");
        let write = |name: &str, content: &[u8]| {
            std::fs::write(folder.path().join(name), content).expect("a file in a new folder can be written");
        };
        write("block.h", code.header.as_bytes());
        write("block.c", code.source.as_bytes());
        write("driver.c", include_bytes!("driver.c"));

        let single = F::C_SUFFIX == "f";
        let rows = [&schedule.parameters, &schedule.ordinary, &schedule.special];
        let numbers = std::iter::once(&schedule.dt).chain(rows.into_iter().flatten().flatten());
        let bytes = |v: &f64| if single { (*v as f32).to_ne_bytes().to_vec() } else { v.to_ne_bytes().to_vec() };
        write("schedule", &numbers.flat_map(bytes).collect::<Vec<u8>>());

        let top = program.steps.last().expect("a program has at least the block itself");
        let has = |tree: &stickslip_codegen::tree::Tree| usize::from(tree.numbers() > 0);
        let definitions = [
            ("HAS_PARAMETERS", has(&top.parameters)),
            ("HAS_STATE", has(&top.state)),
            ("HAS_INPUT", has(&top.input)),
            ("SETS", schedule.parameters.len()),
            ("ORDINARY", schedule.ordinary.len()),
            ("SPECIAL", schedule.special.len()),
            ("CHUNK", CHUNK),
            ("RUN", RUN),
            ("SPECIAL_TICKS", SPECIAL_TICKS),
            ("SPECIAL_RESTART", SPECIAL_RESTART),
        ];
        let mut definitions: Vec<String> =
            definitions.iter().map(|(name, value)| format!("-D{name}={value}")).collect();
        definitions.push(format!("-DREAL={}", F::C_NAME));
        definitions.push(format!("-DRAW_STEP={RAW_STEP}"));
        Workshop { folder, definitions, single, width: top.output.numbers() + top.state.numbers() }
    }

    /// Compiles; `more` are switches besides those of the variant.
    pub fn compile(&self, variant: Variant, more: &[&str]) -> PathBuf {
        let program = self.folder.path().join(format!("{variant}").replace(' ', ""));
        let mut command = Command::new(variant.compiler);
        command.args(["-std=c99", variant.level]).args(variant.native.then_some("-march=native")).args(more);
        command.args(&self.definitions).arg("-o").arg(&program).arg("driver.c").current_dir(self.folder.path());
        let output = command.output().unwrap_or_else(|error| panic!("cannot start {}: {error}", variant.compiler));
        let messages = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{variant} refuses the generated code:\n{messages}");
        program
    }

    fn run(&self, program: &Path, arguments: &[usize]) -> Output {
        let schedule = File::open(self.folder.path().join("schedule")).expect("the file was just written");
        let mut command = Command::new(program);
        command.args(arguments.iter().map(usize::to_string)).stdin(Stdio::from(schedule));
        let output = command.output().expect("a compiled program runs");
        assert!(output.status.success(), "the generated program failed: {:?}", output.status);
        output
    }

    /// The hash after each thousand ticks.
    pub fn hashes(&self, program: &Path, ticks: usize) -> Vec<u64> {
        let text = String::from_utf8(self.run(program, &[ticks]).stdout).expect("hexadecimal digits");
        text.lines().map(|line| u64::from_str_radix(line, 16).expect("hexadecimal digits")).collect()
    }

    /// Output and state after the ticks of a chunk.
    pub fn rows(&self, program: &Path, chunk: usize) -> Vec<Vec<f64>> {
        let bytes = self.run(program, &[(chunk + 1) * CHUNK, chunk]).stdout;
        let numbers: Vec<f64> = if self.single {
            let single = |b: &[u8]| f64::from(f32::from_ne_bytes(b.try_into().expect("chunks of four")));
            bytes.chunks_exact(4).map(single).collect()
        } else {
            bytes.chunks_exact(8).map(|b| f64::from_ne_bytes(b.try_into().expect("chunks of eight"))).collect()
        };
        numbers.chunks_exact(self.width).map(<[f64]>::to_vec).collect()
    }
}
