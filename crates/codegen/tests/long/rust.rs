//! The million ticks in Rust.

use stickslip_core::block::Block;
use stickslip_core::fields::Fields;

use super::schedule::{CHUNK, Schedule, Tick, fold};
use crate::support::number::{Number, filled, numbers, step};

/// The block's ticks one after the other: number, output and state after it.
fn ticks<T: Number, B: Block<T, Input: Default>>(
    block: &B,
    schedule: &Schedule,
    until: usize,
    mut visit: impl FnMut(usize, &B::Output, &B::State),
) {
    let of = |row: &Vec<f64>| row.iter().map(|v| T::of(*v)).collect::<Vec<T>>();
    let inputs = |rows: &[Vec<f64>]| rows.iter().map(|row| filled(&B::Input::default(), of(row))).collect::<Vec<_>>();
    let (ordinary, special) = (inputs(&schedule.ordinary), inputs(&schedule.special));
    let parameters: Vec<B> = schedule.parameters.iter().map(|row| filled(block, of(row))).collect();
    let (mut state, mut saved) = (B::State::default(), B::State::default());
    let mut sets = parameters.iter().cycle();
    let mut block = block;
    for number in 0..until {
        let tick = Tick::new(number);
        if tick.new_parameters {
            block = sets.next().expect("there are parameters, and they are repeated");
        }
        if tick.keep {
            saved = state;
        }
        if tick.restore {
            state = saved;
        }
        let table = if tick.special { &special } else { &ordinary };
        let output = step(block, &mut state, &table[number % table.len()], T::of(schedule.dt));
        visit(number, &output, &state);
    }
}

/// The hash after each thousand ticks.
///
/// # Panics
/// If the comparison is meaningless: a number that is not finite although all inputs are, or a thousand ticks without a
/// change.
pub fn hashes<T: Number, B: Block<T, Input: Default>>(block: &B, schedule: &Schedule, until: usize) -> Vec<u64> {
    let (mut hash, mut out) = (0, Vec::new());
    let (mut last, mut changes) = (0, 0);
    ticks(block, schedule, until, |number, output, state| {
        let ordinary = !Tick::new(number).special;
        let mut alone = 0;
        let mut take = |value: T| {
            let value = value.lane(0);
            assert!(value.is_finite() || !ordinary, "tick {number} gives {value} though all inputs are finite");
            alone = fold(alone, value);
            hash = fold(hash, value);
            T::of(0.0)
        };
        output.map(&mut take);
        state.map(&mut take);
        changes += usize::from(alone != last);
        last = alone;
        if (number + 1).is_multiple_of(CHUNK) {
            // With many inputs one is not finite in nearly all special ticks, and all NaN are equal.
            let least = if ordinary { CHUNK / 10 } else { 0 };
            assert!(changes > least, "only {changes} of the {CHUNK} ticks up to {number} change anything");
            changes = 0;
            out.push(hash);
        }
    });
    out
}

/// Output and state after the ticks of a chunk.
pub fn rows<T: Number, B: Block<T, Input: Default>>(block: &B, schedule: &Schedule, chunk: usize) -> Vec<Vec<f64>> {
    let mut out = Vec::new();
    ticks(block, schedule, (chunk + 1) * CHUNK, |number, output, state| {
        if number >= chunk * CHUNK {
            out.push(numbers(output).iter().chain(&numbers(state)).map(|v| v.lane(0)).collect());
        }
    });
    out
}
