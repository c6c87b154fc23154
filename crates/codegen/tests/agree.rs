//! Every block gives the same bits as `f64`, in lanes, as the value of a dual and as generated C.

mod support;

use support::agree;
use support::blocks::{Friction, Lag, Nested, Stribeck};

const DT: f64 = 1e-3;

#[test]
fn a_block_without_state_agrees() {
    agree(Stribeck::<f64>::default(), DT);
}

#[test]
fn a_block_with_state_agrees() {
    agree(Lag::<f64>::default(), DT);
}

#[test]
fn nested_blocks_agree() {
    agree(Nested { friction: Friction::Stribeck(Stribeck::default()), ..Nested::<f64>::default() }, DT);
    agree(Nested::<f64>::default(), DT);
}
