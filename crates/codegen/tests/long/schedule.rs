//! Schedule of a million ticks, as a function of the tick's number alone, for C and Rust.

use stickslip_core::block::Block;

use crate::support::case::{self, GROUP};

/// Ticks between two lines of the hash.
pub const CHUNK: usize = 1_000;
/// Ticks with the same parameters.
pub const RUN: usize = 50_000;
/// The last ticks of a run get special values: NaN, ±∞, ±0, subnormals, the largest numbers.
pub const SPECIAL_TICKS: usize = 999;
/// Period in which the state before the special values is restored: a NaN would stay and hide the following ticks.
pub const SPECIAL_RESTART: usize = 3;

/// Inputs and parameters, each repeated when it ends. The numbers of rows are prime, so that combinations are not
/// repeated.
pub struct Schedule {
    pub parameters: Vec<Vec<f64>>,
    pub ordinary: Vec<Vec<f64>>,
    pub special: Vec<Vec<f64>>,
    pub dt: f64,
}

impl Schedule {
    pub fn new<B: Block<f64, Input: Default>>(block: &B, dt: f64) -> Self {
        let trajectories = case::trajectories(block, dt);
        let (long, short) = trajectories.split_at(GROUP);
        let rows = |of: &[case::Trajectory], number: usize| -> Vec<_> {
            of.iter().flat_map(|trajectory| trajectory.inputs.iter().cloned()).take(number).collect()
        };
        let parameters = long.iter().map(|trajectory| trajectory.parameters.clone()).take(31).collect();
        Schedule { parameters, ordinary: rows(long, 4093), special: rows(short, 1151), dt }
    }
}

/// Kind of a tick.
pub struct Tick {
    pub new_parameters: bool,
    pub special: bool,
    /// The state before it is saved.
    pub keep: bool,
    /// It starts with the saved state.
    pub restore: bool,
}

impl Tick {
    pub fn new(number: usize) -> Self {
        let within = number % RUN;
        let first_special = RUN - SPECIAL_TICKS;
        let special = within >= first_special;
        Tick {
            new_parameters: within == 0,
            special,
            keep: within == first_special,
            restore: special && (within - first_special).is_multiple_of(SPECIAL_RESTART) || within == 0 && number > 0,
        }
    }
}

/// Folds a number into a hash; all NaN are equal.
pub fn fold(hash: u64, number: f64) -> u64 {
    let bits = if number.is_nan() { 0x7ff8_0000_0000_0000 } else { number.to_bits() };
    (hash.rotate_left(5) ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}
