//! The whole virtual bench, software and machine, as every kind of number and as C.

use super::support::bench::{STEPS, TICK, bench};
use super::support::bits_agree;
use stickslip_codegen::c;

/// Includes the virtual machine, which takes the longest to compile and is therefore not tested separately. The slopes of
/// the parts are compared in `agree.rs`.
#[test]
fn the_whole_bench_agrees() {
    // Without optimisation each of its values in 32 lanes has a separate place on the stack.
    let roomy = std::thread::Builder::new().stack_size(256 << 20);
    let agrees = roomy.spawn(|| bits_agree(bench(), TICK)).expect("memory for a stack");
    agrees.join().expect("the bits agree");
}

#[test]
fn the_whole_bench_is_at_most_3450_lines_of_c() {
    let code = c::generate::<_, f64>(&bench(), "bench").expect("a good name");
    let lines = |text: &str| text.lines().count();
    println!("bench.h {} lines, bench.c {} lines", lines(&code.header), lines(&code.source));
    // Of which 300 are the states of controllers and compensations that are not active, and unused states of contacts.
    assert!(lines(&code.header) + lines(&code.source) <= 3450);
    // A sub-step is a call, not a copy: ten of them in a tick.
    assert_eq!(code.source.matches("    bench_machine_step(").count(), STEPS);
    assert_eq!(code.source.matches("static void bench_machine_step(").count(), 1);
    let longest = code.source.lines().max_by_key(|line| line.chars().count()).unwrap_or_default();
    assert!(longest.chars().count() <= 120, "{longest}");
}

#[test]
fn the_same_bench_gives_the_same_text() {
    let code = || c::generate::<_, f64>(&bench(), "bench").expect("a good name");
    assert_eq!(code(), code());
}
