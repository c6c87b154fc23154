//! Inputs of a block: many trajectories of pseudo-random inputs, each with its own parameters.

use stickslip_codegen::tree::Tree;
use stickslip_core::block::Block;
use stickslip_core::fields::{Field, Kind};

use super::number::numbers;

/// One run of a block from its state at the start.
#[derive(Clone)]
pub struct Trajectory {
    pub parameters: Vec<f64>,
    pub inputs: Vec<Vec<f64>>,
    pub dt: f64,
    /// Whether the last input is valid except for one number that is NaN or infinite.
    pub fault: bool,
}

/// Number of the widest lanes.
pub const GROUP: usize = 32;
const STEPS: usize = 128;
/// Steps with special values: a NaN stays in most states.
const SPECIAL_STEPS: usize = 3;
const SPECIAL_GROUPS: usize = 12;
const SPECIAL: [f64; 12] =
    [0.0, -0.0, 5e-324, -5e-324, 1e-310, 1e-40, -1e-40, 1e300, -1e300, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];

/// Weyl sequence with an output permutation: small, and the same everywhere.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn below(&mut self, bound: usize) -> usize {
        (self.bits() % bound as u64) as usize
    }
}

/// A value near the given one, according to the kind of number and its range. A number without a range is computed
/// from others: varied alone it would describe an unstable machine.
fn vary(field: &Field, value: f64, random: &mut Random) -> f64 {
    match field.kind {
        Kind::Real if field.minimum.is_finite() && field.maximum.is_finite() => {
            (value * (0.9 + 0.2 * random.unit())).clamp(field.minimum, field.maximum)
        }
        _ => value,
    }
}

/// An input between its limits, or of a typical size: sweeps, noise, tiny and large values.
fn excite(field: &Field, mode: usize, phase: f64, random: &mut Random) -> f64 {
    let (low, high) = (field.minimum.max(-50.0), field.maximum.min(50.0));
    let at = |share: f64| low + (high - low) * share;
    let value = match mode {
        0 => at(0.5 + 0.5 * phase.sin()),
        1 => at(random.unit()),
        2 => at(0.5 + 0.05 * phase.sin() + 0.001 * random.unit()),
        _ => (10f64.powf(-9.0 + 11.0 * random.unit()) * if random.unit() < 0.5 { -1.0 } else { 1.0 }).clamp(low, high),
    };
    if field.kind == Kind::Real { value } else { value.round().clamp(low, high) }
}

/// Trajectories for a block: a group of long ones with typical inputs, then short ones with special values among them,
/// then those with a fault.
pub fn trajectories<B: Block<f64, Input: Default>>(block: &B, dt: f64) -> Vec<Trajectory> {
    let mut random = Random::new(1);
    let (tree, values) = (Tree::of(block), numbers(block));
    let inputs = Tree::of(&B::Input::default());
    let (parameters, inputs) = (tree.leaves(), inputs.leaves());
    let mut out = Vec::new();
    for number in 0..GROUP * (1 + SPECIAL_GROUPS) {
        let special = number >= GROUP;
        let frequency: Vec<f64> = inputs.iter().map(|_| 0.01 + 0.3 * random.unit()).collect();
        let steps = (0..if special { SPECIAL_STEPS } else { STEPS }).map(|step| {
            let input = |(i, (_, field)): (usize, &(String, &'static Field))| {
                if special && random.unit() < 0.5 {
                    return SPECIAL[random.below(SPECIAL.len())];
                }
                excite(field, number % 4, frequency[i] * step as f64 + i as f64, &mut random)
            };
            inputs.iter().enumerate().map(input).collect()
        });
        let steps = steps.collect();
        let parameters = parameters
            .iter()
            .zip(&values)
            .map(|((_, field), value)| if number == 0 { *value } else { vary(field, *value, &mut random) });
        out.push(Trajectory { parameters: parameters.collect(), inputs: steps, dt, fault: false });
    }
    out.extend(faults(&out));
    out
}

/// The start of a valid trajectory with each number of the last input in turn made NaN or infinite; in whole groups.
fn faults(trajectories: &[Trajectory]) -> Vec<Trajectory> {
    let sensible = Trajectory { inputs: trajectories[0].inputs[..9].to_vec(), ..trajectories[0].clone() };
    let mut out = Vec::new();
    for number in 0..sensible.inputs[0].len() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut faulty = Trajectory { fault: true, ..sensible.clone() };
            faulty.inputs[8][number] = value;
            out.push(faulty);
        }
    }
    out.resize(out.len().next_multiple_of(GROUP), sensible);
    out
}
