//! Every block gives the same bits in Rust and in C over a million ticks, for every compiler.
//!
//! Output and state of each tick go into a hash, which both sides print each thousand ticks. If the hashes differ, the
//! thousand ticks are run again and compared number by number.
#![expect(unreachable_pub, reason = "a test has no users")]

mod c;
mod rust;
mod schedule;
#[path = "../support/mod.rs"]
mod support;

use std::process::Command;

use stickslip_codegen::record::{self, Precision, Program, Recorded};
use stickslip_core::block::Block;
use stickslip_core::fields::Fields;
use stickslip_core::scalar::Scalar;

use c::{Variant, Workshop};
use schedule::{CHUNK, Schedule};
use support::number::Number;

const MILLION: usize = 1_000_000;
const SHORT: usize = 100_000;

/// Numbers of ticks, in addition to the million in double precision by gcc and clang at their extremes, baseline -O2
/// and native -O3.
#[derive(Clone, Copy)]
struct Ticks {
    /// In single precision at the extremes.
    single: usize,
    /// In double precision in the other ways.
    double_other: usize,
    /// In single precision in the other ways.
    single_other: usize,
    /// Largest number of operations for which calls may be inlined.
    inlined: usize,
}

/// Compiling takes half a second in each way: the extremes only. A block of more operations would take several seconds;
/// inlined calls are tested by the blocks that it consists of.
const USUAL: Ticks = Ticks { single: SHORT, double_other: 0, single_other: 0, inlined: 300 };
/// With the variable `STICKSLIP_LONG` set: everything, except blocks that compile for half a minute.
const FULL: Ticks = Ticks { single: MILLION, double_other: MILLION, single_other: MILLION, inlined: 10_000 };

fn ticks() -> Ticks {
    if std::env::var_os("STICKSLIP_LONG").is_some() { FULL } else { USUAL }
}

/// Number of operations from which a shorter run is sufficient.
const MANY: usize = 30_000;
const CALLS_STAY: [&str; 1] = ["-fno-inline"];

/// Operations of a step, calls included.
fn operations(program: &Program) -> usize {
    let mut of_each: Vec<usize> = Vec::new();
    for step in &program.steps {
        let calls = step.graph.calls.iter().map(|call| of_each[call.function]);
        of_each.push(step.graph.nodes.len() + calls.sum::<usize>());
    }
    of_each.last().copied().unwrap_or_default()
}

/// The available compilers.
fn compilers() -> Vec<&'static str> {
    let (available, absent): (Vec<_>, Vec<_>) =
        ["gcc", "clang"].into_iter().partition(|name| Command::new(name).arg("--version").output().is_ok());
    assert!(!available.is_empty(), "neither gcc nor clang starts: apt-get install gcc libc6-dev");
    absent.iter().for_each(|name| println!("NOT RUN: {name} is missing (apt-get install {name})"));
    available
}

fn variants() -> Vec<Variant> {
    let mut out = Vec::new();
    for compiler in compilers() {
        for level in ["-O2", "-O3"] {
            out.extend([false, true].map(|native| Variant { compiler, level, native }));
        }
    }
    out
}

/// Whether it is most or least optimised.
fn is_extreme(variant: Variant) -> bool {
    (variant.level == "-O3") == variant.native
}

/// The first difference of two runs: tick, number, expected and actual value.
type Difference = (usize, usize, f64, f64);

fn first_difference<F: Number, B: Block<F, Input: Default>>(
    block: &B,
    schedule: &Schedule,
    workshop: &Workshop,
    program: &std::path::Path,
    expected: &[u64],
) -> Option<Difference> {
    let actual = workshop.hashes(program, expected.len() * CHUNK);
    assert_eq!(actual.len(), expected.len());
    let chunk = expected.iter().zip(&actual).position(|(a, b)| a != b)?;
    let (expected, actual) = (rust::rows(block, schedule, chunk), workshop.rows(program, chunk));
    assert_eq!(expected.len(), actual.len());
    for (tick, (expected, actual)) in expected.iter().zip(&actual).enumerate() {
        for (number, (a, b)) in expected.iter().zip(actual).enumerate() {
            if a.to_bits() != b.to_bits() && !(a.is_nan() && b.is_nan()) {
                return Some((chunk * CHUNK + tick, number, *a, *b));
            }
        }
    }
    panic!("the hashes of chunk {chunk} differ, its numbers do not");
}

/// Rust in precision `F` = C, over these numbers of ticks for the extreme and the other ways of compilation.
fn agree_in<F: Precision + Number, B: Fields<f64>>(
    block: &B,
    schedule: &Schedule,
    (extreme, other): (usize, usize),
    inlined: usize,
) where
    B::With<F>: Block<F, Input: Default>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    let program = record::record::<B, F>(block);
    let top = program.steps.last().expect("a program has at least the block itself");
    let names = [top.output.paths(), top.state.paths()].concat();
    let operations = operations(&program);
    let most = if operations > MANY { SHORT } else { MILLION };
    let switches = if operations > inlined { &CALLS_STAY[..] } else { &[] };
    let (extreme, other) = (extreme.min(most), other.min(most));
    let workshop = Workshop::new::<F>(&program, schedule);
    let block = block.map(&mut |v: f64| <F as Scalar>::of(v));
    let expected = rust::hashes(&block, schedule, extreme.max(other));
    for variant in variants() {
        let ticks = if is_extreme(variant) { extreme } else { other };
        if ticks == 0 {
            continue;
        }
        let (compiled, expected) = (workshop.compile(variant, switches), &expected[..ticks / CHUNK]);
        if let Some((tick, number, a, b)) = first_difference(&block, schedule, &workshop, &compiled, expected) {
            panic!("{variant}, {}: tick {tick}, {}: {a:?} expected, {b:?} actual", F::C_NAME, names[number]);
        }
    }
}

fn million_agree<B>(block: B, dt: f64, ticks: Ticks)
where
    B: Block<f64, Input: Default>,
    B::With<f32>: Block<f32, Input: Default>,
    B::With<f64>: Block<f64, Input: Default>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    let schedule = Schedule::new(&block, dt);
    agree_in::<f64, B>(&block, &schedule, (MILLION, ticks.double_other), ticks.inlined);
    agree_in::<f32, B>(&block, &schedule, (ticks.single, ticks.single_other), ticks.inlined);
}

/// A test: a block, then parameters for each run.
macro_rules! agree {
    ($test:ident, $Block:ident, $first:expr $(, $further:expr)* $(,)?) => {
        #[test]
        fn $test() {
            million_agree::<$Block<f64>>($first, DT, ticks());
            $(million_agree::<$Block<f64>>($further, DT, USUAL);)*
        }
    };
}

include!("../support/list.rs");

/// It takes longest: its name makes it the first to start.
#[test]
fn a_whole_bench() {
    million_agree(support::bench::bench(), support::bench::TICK, USUAL);
}

#[test]
fn one_flipped_bit_is_found_at_its_tick() {
    let block = Lag::<f64>::default();
    let schedule = Schedule::new(&block, DT);
    let workshop = Workshop::new::<f64>(&record::record::<_, f64>(&block), &schedule);
    let expected = rust::hashes(&block, &schedule, MILLION);
    let variant = Variant { compiler: compilers()[0], level: "-O2", native: false };
    let wrong = workshop.compile(variant, &["-DFLIPPED_TICK=654321"]);
    let (tick, number, a, b) = first_difference(&block, &schedule, &workshop, &wrong, &expected).expect("it is wrong");
    assert_eq!((tick, number, a.to_bits() ^ b.to_bits()), (654_321, 0, 1));
    let right = workshop.compile(variant, &[]);
    assert_eq!(first_difference(&block, &schedule, &workshop, &right, &expected), None);
}

/// The panic of a comparison of constant numbers.
fn panic_message(block: &SlidingFriction<f64>, input: f64) -> String {
    let mut schedule = Schedule::new(block, DT);
    schedule.ordinary.iter_mut().for_each(|row| row.fill(input));
    let panic = std::panic::catch_unwind(|| rust::hashes(block, &schedule, CHUNK)).expect_err("constant numbers");
    panic.downcast_ref::<String>().cloned().unwrap_or_default()
}

#[test]
fn a_block_without_changes_or_with_non_finite_numbers_is_refused() {
    let block = SlidingFriction::<f64>::default();
    assert!(panic_message(&block, 1.0).starts_with("only 1 of the 1000 ticks"), "{}", panic_message(&block, 1.0));
    assert!(panic_message(&block, f64::INFINITY).starts_with("tick 0 gives inf though"));
}
