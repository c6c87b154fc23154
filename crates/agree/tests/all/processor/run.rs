//! Inputs of a block, tick by tick, and its results in Rust.

use stickslip_codegen::record::Precision;
use stickslip_codegen::tree::Tree;
use stickslip_core::block::{Block, guarded};
use stickslip_core::fields::{Fields, each};
use stickslip_core::scalar::Scalar;

/// Inputs of the processor, in order; the numbers as the block's structs have them.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// Parameters of the next steps.
    Parameters(Vec<f64>),
    /// The state before the next step.
    State(Vec<f64>),
    /// A step: its input.
    Step(Vec<f64>),
}

/// Steps of one block.
pub struct Run {
    pub records: Vec<Record>,
    /// Step [s].
    pub dt: f64,
}

/// A number as the processor has it in memory.
pub trait Bytes: Precision {
    fn bytes(self) -> Vec<u8>;
}

impl Bytes for f64 {
    fn bytes(self) -> Vec<u8> {
        self.to_le_bytes().into()
    }
}

impl Bytes for f32 {
    fn bytes(self) -> Vec<u8> {
        self.to_le_bytes().into()
    }
}

/// The numbers of a value.
pub fn numbers<T: Scalar>(value: &impl Fields<T>) -> Vec<T> {
    let (mut copy, mut out) = (*value, Vec::new());
    each(&mut copy, &mut |number: &mut T| out.push(*number));
    out
}

/// The value with other numbers, rounded to its precision.
fn filled<T: Scalar, V: Fields<T>>(template: &V, numbers: &[f64]) -> V {
    let (mut value, mut numbers) = (*template, numbers.iter());
    each(&mut value, &mut |number| *number = T::of(*numbers.next().expect("one number for each field")));
    value
}

impl Run {
    /// The records up to a number of steps.
    pub fn first(&self, most: usize) -> Run {
        let mut steps = 0;
        let first = self.records.iter().take_while(|record| {
            steps += usize::from(matches!(record, Record::Step(_)));
            steps <= most
        });
        Run { records: first.cloned().collect(), dt: self.dt }
    }

    pub fn steps(&self) -> usize {
        self.records.iter().filter(|record| matches!(record, Record::Step(_))).count()
    }

    /// The file `inputs` of `firmware/pil.c`.
    pub fn inputs<F: Bytes>(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for record in &self.records {
            let (kind, numbers) = match record {
                Record::Parameters(numbers) => (1u32, numbers),
                Record::State(numbers) => (2, numbers),
                Record::Step(numbers) => (3, numbers),
            };
            out.extend(kind.to_le_bytes());
            if kind == 3 {
                out.extend(F::of(self.dt).bytes());
            }
            out.extend(numbers.iter().flat_map(|number| F::of(*number).bytes()));
        }
        out
    }

    /// The file `outputs` as Rust computes it in this precision.
    pub fn outputs<F: Bytes, B: Fields<f64>>(&self, block: &B) -> Vec<u8>
    where
        B::With<F>: Block<F, Input: Default>,
    {
        let template = block.map(&mut F::of);
        let (mut block, mut state) = (template, <B::With<F> as Block<F>>::State::default());
        let mut out = Vec::new();
        for record in &self.records {
            match record {
                Record::Parameters(numbers) => block = filled(&template, numbers),
                Record::State(numbers) => state = filled(&state, numbers),
                Record::Step(numbers) => {
                    let input = filled(&<B::With<F> as Block<F>>::Input::default(), numbers);
                    let (output, status) = guarded(&block, &mut state, input, F::of(self.dt));
                    out.extend((status as u32).to_le_bytes());
                    out.extend(numbers_of(&output).chain(numbers_of(&state)).flat_map(Bytes::bytes));
                }
            }
        }
        out
    }
}

fn numbers_of<T: Scalar>(value: &impl Fields<T>) -> impl Iterator<Item = T> {
    numbers(value).into_iter()
}

/// First difference of two files `outputs`: tick and name of the number. A status is a number too.
pub fn first_difference(expected: &[u8], actual: &[u8], output: &Tree, state: &Tree, single: bool) -> Option<String> {
    let size = if single { 4 } else { 8 };
    let names = [vec!["status".to_string()], output.paths(), state.paths()].concat();
    let row = 4 + (names.len() - 1) * size;
    let byte = expected.iter().zip(actual).position(|(a, b)| a != b);
    let length = (expected.len() != actual.len()).then_some(expected.len().min(actual.len()));
    let byte = byte.or(length)?;
    let within = byte % row;
    let name = if within < 4 { 0 } else { 1 + (within - 4) / size };
    let place = format!("tick {} of {}, {}", byte / row, expected.len() / row, names[name]);
    let start = byte / row * row + if name == 0 { 0 } else { 4 + (name - 1) * size };
    let shown = |file: &[u8]| file.get(start..start + if name == 0 { 4 } else { size }).map(<[u8]>::to_vec);
    Some(format!("{place}: {:02x?} expected, {:02x?} found", shown(expected), shown(actual)))
}
