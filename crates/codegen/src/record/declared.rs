//! A step that no Rust type describes: its numbers are declared while the program runs, and it is computed by whoever
//! has the words for it, such as a function in Python.

use std::sync::Mutex;

use stickslip_core::fields::{Field, Kind, Shape};

use super::program::isolated;
use super::{Id, LawBook, Node, Precision, Program, Real, Recorded, Source, Step};
use crate::tree::{Group, Member, Tree};

/// A number as it is declared.
#[derive(Clone, Debug, PartialEq)]
pub struct Declared {
    /// As in C: `position_gain`.
    pub name: String,
    /// SI unit: `N m/rad`; `1` for a pure number.
    pub unit: String,
    /// What it is, in a sentence.
    pub help: String,
    /// Smallest allowed value.
    pub minimum: f64,
    /// Largest allowed value.
    pub maximum: f64,
    /// Value unless given; of a state, that before the first step.
    pub value: f64,
}

/// What a step is called, and what goes in and out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signature {
    /// The step's name.
    pub name: String,
    /// What it is: Markdown.
    pub help: String,
    /// The parameters.
    pub parameters: Vec<Declared>,
    /// The state.
    pub state: Vec<Declared>,
    /// The input.
    pub input: Vec<Declared>,
    /// The output.
    pub output: Vec<Declared>,
}

/// What a step computes with, each in the order of its declaration.
#[derive(Clone, Debug)]
pub struct Given {
    /// The parameters.
    pub parameters: Vec<Recorded>,
    /// The state before the step.
    pub state: Vec<Recorded>,
    /// The input.
    pub input: Vec<Recorded>,
    /// The time step.
    pub dt: Recorded,
}

/// What a step has computed, each in the order of its declaration.
#[derive(Clone, Debug)]
pub struct Computed {
    /// The state after the step.
    pub state: Vec<Recorded>,
    /// The output.
    pub output: Vec<Recorded>,
}

/// Records a step that computes with declared numbers, in the precision `F`. Recordings may lie within each other, each
/// with numbers of its own.
///
/// # Errors
/// What the step returns in place of its numbers.
///
/// # Panics
/// If the step computes another count of numbers than is declared.
pub fn record_declared<F: Precision, E>(
    signature: &Signature,
    step: impl FnOnce(Given) -> Result<Computed, E>,
) -> Result<Program, E> {
    let (computed, graph, mut steps) = isolated(Real::of::<F>(), || {
        let all = |source, declared: &[Declared]| {
            (0..declared.len()).map(|k| Recorded::new(Node::Source(source, k as u32))).collect()
        };
        step(Given {
            parameters: all(Source::Parameters, &signature.parameters),
            state: all(Source::State, &signature.state),
            input: all(Source::Input, &signature.input),
            dt: Recorded::new(Node::Source(Source::Step, 0)),
        })
    });
    let Computed { state, output } = computed?;
    let ids = |numbers: Vec<Recorded>, declared: &[Declared]| -> Vec<Id> {
        assert_eq!(numbers.len(), declared.len(), "{}: a number for each that is declared", signature.name);
        numbers.into_iter().map(|number| number.id).collect()
    };
    let values = |declared: &[Declared]| declared.iter().map(|it| F::of(it.value).into()).collect();
    steps.push(Step {
        name: kept(&signature.name),
        help: kept(&signature.help),
        type_name: "",
        parameters: tree(&signature.parameters),
        state: tree(&signature.state),
        input: tree(&signature.input),
        output: tree(&signature.output),
        graph,
        new_state: ids(state, &signature.state),
        results: ids(output, &signature.output),
    });
    let (parameters, start) = (values(&signature.parameters), values(&signature.state));
    Ok(Program { steps, parameters, start, laws: LawBook::default() })
}

/// The struct of declared numbers.
fn tree(declared: &[Declared]) -> Tree {
    let member = |it| {
        let field = row(it);
        Member { name: field.name.into(), field, tree: Tree::Number }
    };
    Tree::Group(Group { chosen: Vec::new(), members: declared.iter().map(member).collect() })
}

/// The row of a number in the tables. Tables live as long as the program; what is declared again is kept once.
fn row(declared: &Declared) -> &'static Field {
    static ROWS: Mutex<Vec<&'static Field>> = Mutex::new(Vec::new());
    let field = Field {
        name: kept(&declared.name),
        symbol: "",
        unit: kept(&declared.unit),
        minimum: declared.minimum,
        maximum: declared.maximum,
        default: declared.value,
        help: kept(&declared.help),
        kind: Kind::Real,
        shape: Shape::Number,
    };
    let same = |other: &&&'static Field| {
        let text = |it: &Field| (it.name, it.unit, it.help);
        let numbers = |it: &Field| [it.minimum, it.maximum, it.default].map(f64::to_bits);
        text(other) == text(&field) && numbers(other) == numbers(&field)
    };
    let mut rows = ROWS.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(known) = rows.iter().find(same) {
        return known;
    }
    let row: &'static Field = Box::leak(Box::new(field));
    rows.push(row);
    row
}

/// A text for as long as the program lives; the same text is kept once.
fn kept(text: &str) -> &'static str {
    static TEXTS: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());
    let mut texts = TEXTS.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(known) = texts.iter().find(|known| **known == text) {
        return known;
    }
    let text: &'static str = Box::leak(text.into());
    texts.push(text);
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_core::scalar::{Mask, Scalar};

    fn declared(name: &str, value: f64) -> Declared {
        Declared { name: name.into(), unit: "1".into(), help: String::new(), minimum: -9.0, maximum: 9.0, value }
    }

    fn signature() -> Signature {
        Signature {
            name: "held".into(),
            parameters: vec![declared("gain", 2.0)],
            state: vec![declared("sum", 0.5)],
            input: vec![declared("deviation", 0.0)],
            output: vec![declared("torque", 0.0)],
            ..Signature::default()
        }
    }

    fn held() -> Program {
        let program = record_declared::<f64, ()>(&signature(), |given| {
            let torque = given.parameters[0] * given.input[0] + given.state[0];
            let sum =
                torque.abs().lt(Scalar::of(3.0)).select(given.state[0] + given.dt * given.input[0], given.state[0]);
            Ok(Computed { state: vec![sum], output: vec![torque] })
        });
        program.expect("it computes")
    }

    #[test]
    fn a_declared_step_is_a_program_like_that_of_a_block() {
        let program = held();
        let top = program.steps.last().expect("the step itself");
        assert_eq!(
            (top.name, top.parameters.paths(), top.state.paths()),
            ("held", vec!["gain".into()], vec!["sum".into()])
        );
        assert_eq!((program.parameters.as_slice(), program.start.as_slice()), (&[2.0][..], &[0.5][..]));
        assert_eq!(program.evaluate::<f64>(&[2.0], &[0.5], &[1.0], 0.125), (vec![0.625], vec![2.5]));
        assert_eq!(program.evaluate::<f64>(&[2.0], &[0.5], &[7.0], 0.125), (vec![0.5], vec![14.5]));
    }

    #[test]
    fn what_is_declared_again_is_the_same_row() {
        let rows = [row(&declared("again", 1.0)), row(&declared("again", 1.0)), row(&declared("again", -1.0))];
        assert!(std::ptr::eq(rows[0], rows[1]) && !std::ptr::eq(rows[0], rows[2]));
        assert_eq!(held(), held());
    }

    #[test]
    fn recordings_lie_within_each_other_and_a_refused_one_leaves_nothing() {
        let outer = record_declared::<f64, ()>(&signature(), |given| {
            let torque = given.parameters[0] * given.input[0];
            assert_eq!(held(), held());
            let refused = record_declared::<f64, &str>(&signature(), |_| Err("no"));
            assert_eq!(refused, Err("no"));
            Ok(Computed { state: given.state, output: vec![torque + given.dt] })
        });
        let outer = outer.expect("it computes");
        assert_eq!(outer.evaluate::<f64>(&[2.0], &[0.5], &[1.0], 0.125), (vec![0.5], vec![2.125]));
    }
}
