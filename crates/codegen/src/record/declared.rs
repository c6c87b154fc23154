//! A step without a Rust type: its numbers are declared at run time, and it is computed by a callback, such as a
//! function in Python.

use std::sync::Mutex;

use stickslip_core::fields::{Field, Kind, Shape};

use super::program::isolated;
use super::{Id, LawBook, Node, Precision, Program, Real, Recorded, Source, Step};
use crate::tree::{Group, Member, Tree};

/// A declared number.
#[derive(Clone, Debug, PartialEq)]
pub struct Declared {
    /// Name in C: `position_gain`.
    pub name: String,
    /// SI unit: `N m/rad`; `1` for a pure number.
    pub unit: String,
    /// Description in one sentence.
    pub help: String,
    /// Smallest allowed value.
    pub minimum: f64,
    /// Largest allowed value.
    pub maximum: f64,
    /// Default value; of a state, that before the first step.
    pub value: f64,
}

/// Name, inputs and outputs of a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signature {
    /// The step's name.
    pub name: String,
    /// Description in Markdown.
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

/// Arguments of a step, each in the order of its declaration.
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

/// Results of a step, each in the order of its declaration.
#[derive(Clone, Debug)]
pub struct Computed {
    /// The state after the step.
    pub state: Vec<Recorded>,
    /// The output.
    pub output: Vec<Recorded>,
}

/// Records a step that computes with declared numbers, in the precision `F`. Recordings may be nested, each with its
/// own numbers.
///
/// # Errors
/// The error that the step returns.
///
/// # Panics
/// If the step computes another number of results than declared.
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
        assert_eq!(numbers.len(), declared.len(), "{}: one number per declaration", signature.name);
        numbers.into_iter().map(|number| number.id).collect()
    };
    let values = |declared: &[Declared]| declared.iter().map(|it| F::of(it.value).into()).collect();
    steps.push(Step {
        name: static_text(&signature.name),
        help: static_text(&signature.help),
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

/// The row of a number in the tables. Tables live as long as the program; equal declarations share one row.
fn row(declared: &Declared) -> &'static Field {
    static ROWS: Mutex<Vec<&'static Field>> = Mutex::new(Vec::new());
    let field = Field {
        name: static_text(&declared.name),
        symbol: "",
        unit: static_text(&declared.unit),
        minimum: declared.minimum,
        maximum: declared.maximum,
        default: declared.value,
        help: static_text(&declared.help),
        kind: Kind::Real,
        shape: Shape::Number,
    };
    let same = |other: &&&'static Field| {
        let text = |it: &Field| (it.name, it.unit, it.help);
        let numbers = |it: &Field| [it.minimum, it.maximum, it.default].map(f64::to_bits);
        text(other) == text(&field) && numbers(other) == numbers(&field)
    };
    let mut rows = ROWS.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(existing) = rows.iter().find(same) {
        return existing;
    }
    let row: &'static Field = Box::leak(Box::new(field));
    rows.push(row);
    row
}

/// A text with static lifetime; equal texts are stored once.
fn static_text(text: &str) -> &'static str {
    static TEXTS: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());
    let mut texts = TEXTS.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(existing) = texts.iter().find(|existing| **existing == text) {
        return existing;
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
    fn equal_declarations_share_one_row() {
        let rows = [row(&declared("again", 1.0)), row(&declared("again", 1.0)), row(&declared("again", -1.0))];
        assert!(std::ptr::eq(rows[0], rows[1]) && !std::ptr::eq(rows[0], rows[2]));
        assert_eq!(held(), held());
    }

    #[test]
    fn recordings_may_be_nested_and_a_failed_one_leaves_nothing() {
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
