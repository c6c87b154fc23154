//! Nothing but tests: each block, and the whole bench, is compiled as ten kinds of number and as C, and every bit is
//! compared. So much is compiled for so few steps that it is not optimised, which is said by the package: it has one of
//! its own. What the optimiser makes of lanes, `crates/core/tests/vector.rs` compares. A controller and a friction of a
//! user's are compiled here for the same reason.
#![forbid(unsafe_code)]
