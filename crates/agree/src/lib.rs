//! Tests only: one source text gives the same bits as every kind of number and as generated C.
//!
//! All results except NaN are compared, over inputs that include ±0, subnormal numbers, ±∞ and NaN:
//!
//! | instance | same bits as | test |
//! |-|-|-|
//! | `Dual`, its value; `Lanes` of `f64` | `f64` | `tests/all/agree.rs`, `tests/all/bench.rs` |
//! | C99 in `double`, gcc | `f64` | the same |
//! | `Lanes` of `f32`; C99 in `float`, gcc | `f32` | the same |
//! | lanes as AVX2 and AVX-512 instructions, with few calls | `f64` | `crates/wide/tests/vector.rs` |
//! | C99, gcc and clang, several optimisations, up to a million ticks | `f64`, `f32` | `crates/codegen/tests/long/main.rs` |
//! | C99 on Cortex-M4F and Cortex-M7 in QEMU, a whole experiment | `f64`, `f32` | `tests/all/processor` |
//! `tests/all/agree.rs` runs each block of `crates/codegen/tests/support/list.rs` and also compares the slopes of the duals
//! with difference quotients. It fails if a block of `stickslip-core` is not in the list. `tests/all/bench.rs` runs the
//! whole virtual bench; its converters and counters have the slope 0. `tests/all/own` uses the examples
//! `own_controller` and `own_friction` as C, library, FMU and A2L, in the loop and in sweeps. `tests/all/processor`
//! also writes `docs/studies/processor.md`.
//!
//! The package is compiled without optimisation (see the workspace's `Cargo.toml`): compiling takes longer than
//! running.
#![forbid(unsafe_code)]

/// The Rust example of the README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
