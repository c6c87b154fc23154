//! Requirements of some blocks on the processors: memory and instructions, as a committed table.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use stickslip::Summary;
use stickslip_codegen::c;
use stickslip_codegen::record::{self, Recorded};
use stickslip_codegen::tree::Tree;
use stickslip_core::block::Block;
use stickslip_core::control::{Pid, PositionController};
use stickslip_core::estimate::MotionObserver;
use stickslip_core::fields::Fields;
use stickslip_core::render::Law;
use stickslip_core::tick::Tick;

use super::LIMIT;
use super::run::{Bytes, Record, Run};
use super::target::{M4F, M7, Main, Target, compiler};

/// Command that writes the table.
const COMMAND: &str = "UPDATE_EXPECT=1 cargo test -p stickslip-agree --test all table";

/// Number of measured steps; a count depends on the data only in the double arithmetic of the compiler.
const STEPS: usize = 2_000;

/// Requirements of one block on one processor; bytes, instructions.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    pub key: [String; 3],
    pub numbers: [f64; 7],
}

const KEYS: [&str; 3] = ["processor", "arithmetic", "block"];
const NUMBERS: [&str; 7] = ["code", "library", "parameters", "state", "stack", "instructions", "most_instructions"];

impl Row {
    /// The row as the committed file has it.
    pub fn cells(&self) -> impl Iterator<Item = (String, Value)> {
        let keys = KEYS.iter().zip(&self.key).map(|(key, value)| (key.to_string(), json!(value)));
        let numbers = NUMBERS.iter().zip(self.numbers).map(|(name, value)| (name.to_string(), json!(value)));
        keys.chain(numbers)
    }
}

/// Measures some blocks on each processor.
pub fn measure(tick: &Tick<f64>, run: &Run) -> Vec<Row> {
    let mut rows = Vec::new();
    let experiment = run.first(STEPS);
    let MotionObserver::Accelerometer(observer) = tick.observer else { panic!("the experiment has an accelerometer") };
    let Law::Paper(law) = tick.law else { panic!("the experiment uses the paper's law") };
    let PositionController::Cascade(cascade) = tick.control.controller else { panic!("the experiment uses a cascade") };
    for (target, single) in [(M4F, false), (M4F, true), (M7, false)] {
        macro_rules! count {
            ($name:literal, $block:expr, $run:expr) => {
                rows.push(if single {
                    row::<f32, _>(target, $name, $block, $run)
                } else {
                    row::<f64, _>(target, $name, $block, $run)
                })
            };
        }
        count!("pid", &Pid::<f64>::default(), None);
        count!("cascade", &cascade, None);
        count!("velocity_observer", &observer, None);
        count!("current_control", &tick.current, None);
        count!("difference_torque", &law, None);
        count!("tick", tick, Some(&experiment));
    }
    rows
}

/// Inputs from −5 to 5.
fn random_inputs(input: &Tree, dt: f64) -> Run {
    let mut random = 1u64;
    let mut value = || {
        // Knuth's linear congruential generator; its upper bits are random enough to vary an input.
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let step = |_| Record::Step((0..input.numbers()).map(|_| 5.0 * value()).collect());
    Run { records: (0..STEPS).map(step).collect(), dt }
}

fn row<F: Bytes, B: Fields<f64>>(target: Target, name: &str, block: &B, run: Option<&Run>) -> Row
where
    B::With<F>: Block<F, Input: Default>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    let program = record::record::<B, F>(block);
    let code = c::print::<F>(&program, "block").expect("a good name");
    let single = F::C_SUFFIX == "f";
    let image = target.compile(&Main::Block { program: &program, code: &code, single, measure: true });
    let top = program.steps.last().expect("a program has at least the block itself");
    let inputs = random_inputs(&top.input, 250e-6);
    let run = run.unwrap_or(&inputs);
    let outcome = image.run(&run.inputs::<F>(), LIMIT);
    assert!(outcome.succeeded, "{} {name}: {}", target.name, outcome.log);
    let reported = |word: &str| -> f64 {
        let line = outcome.log.lines().find_map(|line| line.strip_prefix(word)?.strip_prefix(' '));
        line.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("no {word} in: {}", outcome.log))
    };
    assert!(outcome.outputs == run.outputs::<F, B>(block), "{} {name}: different bits with counting", target.name);
    // The counter is exact: two thousand more turns of a loop of two instructions.
    assert_eq!(reported("loop_3000") - reported("loop_1000"), 4000.0);
    assert_eq!(reported("steps"), STEPS as f64);
    assert!(reported("stack") < reported("painted"), "the step uses more stack than was painted");
    let [code_bytes, library] = image.sizes().map(|bytes| bytes as f64);
    let mean = (reported("instructions") / STEPS as f64).round();
    Row {
        key: [target.name, F::C_NAME, name].map(String::from),
        numbers: [
            code_bytes,
            library,
            reported("parameters"),
            reported("state"),
            reported("stack"),
            mean,
            reported("largest"),
        ],
    }
}

fn study(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/studies").join(file)
}

/// Compares with the committed table, or writes it if `UPDATE_EXPECT` is set.
///
/// # Panics
/// If a number differs by more than 2 %, or by 30 % with another compiler than that of the table.
pub fn check(rows: &[Row]) {
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        write(rows);
    }
    let text = std::fs::read_to_string(study("processor.json")).expect("the table is committed");
    let committed: Value = serde_json::from_str(&text).expect("a study is written as JSON");
    let committed = committed["rows"].as_array().expect("a study has rows");
    assert_eq!(committed.len(), rows.len(), "the table has other rows: UPDATE_EXPECT=1");
    for (then, now) in committed.iter().zip(rows) {
        let tolerance = if then["compiler"] == compiler() { 0.02 } else { 0.3 };
        if let Some(difference) = differs(then, now, tolerance) {
            panic!("{difference}. If this is intended: {COMMAND}");
        }
    }
}

/// Difference of a committed row and a new one.
pub fn differs(then: &Value, now: &Row, tolerance: f64) -> Option<String> {
    let place = now.key.join(" ");
    if KEYS.iter().zip(&now.key).any(|(key, value)| then[*key] != **value) {
        return Some(format!("measured {place}, but the table has {then}"));
    }
    NUMBERS.iter().zip(now.numbers).find_map(|(name, now)| {
        let then = then[*name].as_f64().unwrap_or(f64::NAN);
        // A difference of one word is ignored.
        let same = (now - then).abs() <= (tolerance * then).max(4.0);
        (!same).then(|| format!("{place}: {name} was {then}, is {now}"))
    })
}

fn write(rows: &[Row]) {
    let mut summary = Summary::new(COMMAND);
    let mut text = String::from(HEAD);
    let _ = writeln!(text, "\nCompiler: {}, `-O2 -mthumb`.\n", compiler());
    text += "| processor | arithmetic | block | code | library | parameters | state | stack | instructions a \
             step | most |\n|-|-|-|-|-|-|-|-|-|-|\n";
    for row in rows {
        let cells: Vec<_> = row.cells().chain([("compiler".into(), json!(compiler()))]).collect();
        summary.row(cells.iter().map(|(name, value)| (name.as_str(), value.clone())));
        let cells = row.key.iter().cloned().chain(row.numbers.iter().map(f64::to_string));
        let _ = writeln!(text, "| {} |", cells.collect::<Vec<_>>().join(" | "));
    }
    for (file, text) in [("processor.json", summary.to_json()), ("processor.md", text)] {
        std::fs::write(study(file), text).expect("the folder of the studies is writable");
    }
}

const HEAD: &str = "\
# What a processor needs for the generated code

Memory in bytes and instructions of `NAME_step`, its guard included, on two processors in QEMU. Instructions are counted \
exactly, but they are not cycles: an emulator has no pipeline, no cache and no memory with wait states.

Code is the step with all its blocks and their constants; library is the part that the compiler adds, above \
all `double` arithmetic where the processor has none: it is there once, however many blocks share it. Parameters and \
state are the sizes of the structs. Stack is the deepest found below the caller over 2,000 steps. The tick is the whole \
software of the bench with a cascade and the paper's law, driven with the start of a recorded experiment; the other \
blocks are driven with numbers from −5 to 5.

The table is made and compared by a test; the numbers are in `processor.json`.
";
