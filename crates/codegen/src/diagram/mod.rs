//! The signal-flow diagram of a recorded block, as data and as pictures.
//!
//! [`Diagram::of`] condenses the operations of each step to the usual blocks: summing points, gains, saturations,
//! switches, unit delays and boxes for other blocks. Expressions that do not depend on a signal are written at the
//! block that uses them ([`formula`]). [`json`] writes the diagram as data, [`pages`] one SVG for each step, with links
//! from a box to the page inside it.
//!
//! # JSON
//!
//! Schema `stickslip.diagram/1`. The last page is the block itself; a box (`"kind": "call"`) names its page in `page`.
//!
//! ```json
//! {"schema": "stickslip.diagram/1", "name": "lag", "pages": [
//!   {"name": "Lag", "page": "lag", "file": "lag.svg",
//!     "operations": [[0, "parameter", [0]], [2, "state", [0]], [3, "input", [0]], [7, "subtract", [3, 2]], …],
//!     "nodes": [
//!       {"kind": "sum", "signs": "+-", "inputs": [{"numbers": [3]}, {"numbers": [2]}], "operations": [7], …},
//!       {"kind": "gain", "factors": [["*", "T/(T_1 + T)"]], …},
//!       {"kind": "delay", "name": "value", "unit": "1", …}],
//!     "wires": [{"from": [4, 0], "to": [0, 0]}, …]}]}
//! ```
//!
//! - `operations`: the computed operations, operands first, as `[number, what, operands]`. The operands of `input`,
//!   `state` and `parameter` are places in the struct, those of `result` a call and a place. Each belongs to exactly one
//!   node, except those that depend on no signal: they are in a `text` or omitted.
//! - `nodes`: `kind`, and its texts: `signs` of a sum or product in the order of evaluation, `factors` of a gain,
//!   `bounds` of a saturation or comparison, `text`; `page` of a box and `keeps_state_at`, the place of its state within
//!   the page's if nothing else reads or changes it. `name`, `symbol`, `unit` and `help` if known. A port has `numbers`,
//!   the operations whose values it carries, of a bus several; `of` is its struct.
//! - `wires`: from node and output port to node and input port; one wire ends at each input.
//! - `function`: the number of the box `f` that replaces the node in a crowded picture.

mod build;
mod condense;
mod crowd;
mod draw;
mod formula;
mod json;
mod layout;
mod picture;
mod text;

use crate::record::{Function, Id, Program, Step};

pub use build::Role;
pub use formula::formula;
pub use json::json;
pub use layout::{Layout, Link, Segment};

/// A block and the blocks within it.
#[derive(Clone, Debug)]
pub struct Diagram<'a> {
    /// Prefix of the files.
    pub name: String,
    /// One for each step of the program; the last is the block itself.
    pub pages: Vec<Page<'a>>,
}

/// The diagram of one step.
#[derive(Clone, Debug)]
pub struct Page<'a> {
    /// Its name among the pages.
    pub label: String,
    /// The recorded step.
    pub step: &'a Step,
    /// The nodes.
    pub nodes: Vec<Node>,
    /// The wires: at most one ends at an input port.
    pub wires: Vec<Wire>,
}

/// A node with ports.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Its kind.
    pub kind: Kind,
    /// Its name: a path such as `reference.position`, of a box that of its parameters; empty for an operation.
    pub name: String,
    /// As in an equation; may be empty.
    pub symbol: String,
    /// Unit of its output, if known.
    pub unit: &'static str,
    /// Its description, if known.
    pub help: &'static str,
    /// Input ports, in the order of evaluation.
    pub inputs: Vec<Port>,
    /// Output ports.
    pub outputs: Vec<Port>,
    /// Its operations.
    pub operations: Vec<Id>,
}

/// A port of a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Port {
    /// Its name; empty at an operation.
    pub name: String,
    /// As in an equation; may be empty.
    pub symbol: String,
    /// Unit, if known.
    pub unit: &'static str,
    /// Its struct.
    pub role: Role,
    /// Place of its first number in the struct.
    pub first: usize,
    /// The operations whose values it carries; several on a bus.
    pub numbers: Vec<Id>,
}

/// From an output port to an input port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Wire {
    /// An output port.
    pub from: End,
    /// An input port.
    pub to: End,
}

/// The end of a wire at a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct End {
    /// Index of the node.
    pub node: usize,
    /// Index of the port.
    pub port: usize,
}

/// Kind of a node: its function of the input signals, in their order.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// Input of the page.
    Input,
    /// Output of the page.
    Output,
    /// Unit delay: a part of the state.
    Delay,
    /// Constant: depends on no signal; one operation for each number of its port.
    Constant(Vec<Id>),
    /// Sum from the first to the last; `true` for subtraction.
    Sum(Vec<bool>),
    /// Product with each factor in turn.
    Gain(Vec<Factor>),
    /// Product from the first to the last; `true` for division.
    Product(Vec<bool>),
    /// A function of one signal.
    Apply(Function),
    /// The smaller; the second if either is NaN.
    Minimum,
    /// The larger; the second if either is NaN.
    Maximum,
    /// The limited first signal. Bounds that are ports follow in this order.
    Saturation {
        /// Lower bound.
        low: Bound,
        /// Upper bound.
        high: Bound,
    },
    /// −1, 0 or 1.
    Sign,
    /// The second input if the mask, its first input, is true, else the third; for each number of a bus.
    Switch,
    /// Whether the signal, or its magnitude, is within all bounds.
    Within {
        /// Whether the bounds are for the magnitude.
        magnitude: bool,
        /// Relation to the bound, which depends on no signal.
        bounds: Vec<(Relation, Id)>,
    },
    /// Comparison of the first signal with the second.
    Compare(Relation),
    /// Whether all inputs are true.
    And,
    /// Whether any input is true.
    Or,
    /// The negation.
    Not,
    /// The step of another block.
    Call {
        /// Number of the call in the step's graph.
        call: usize,
        /// Index of its page.
        page: usize,
        /// Place of its state within the state of this page, if not read or changed by others.
        keeps: Option<usize>,
    },
}

/// Factor of a gain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Factor {
    /// Multiplies by an expression that depends on no signal.
    Times(Id),
    /// Divides by such an expression.
    Over(Id),
    /// Changes the sign.
    Negated,
}

/// A bound of a saturation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// An expression that depends on no signal.
    Fixed(Id),
    /// A signal with its own port.
    Signal,
    /// The upper bound with the opposite sign.
    Opposite,
}

/// Relation of two numbers; false for NaN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// <
    Less,
    /// ≤
    LessOrEqual,
    /// >
    Greater,
    /// ≥
    GreaterOrEqual,
}

impl Relation {
    /// Its sign.
    pub fn sign(self) -> &'static str {
        match self {
            Relation::Less => "<",
            Relation::LessOrEqual => "≤",
            Relation::Greater => ">",
            Relation::GreaterOrEqual => "≥",
        }
    }

    /// The same with its sides exchanged.
    fn reversed(self) -> Self {
        match self {
            Relation::Less => Relation::Greater,
            Relation::LessOrEqual => Relation::GreaterOrEqual,
            Relation::Greater => Relation::Less,
            Relation::GreaterOrEqual => Relation::LessOrEqual,
        }
    }
}

impl<'a> Diagram<'a> {
    /// The diagram of a recorded block; `name` is the prefix of its files.
    pub fn of(program: &'a Program, name: &str) -> Diagram<'a> {
        let labels = crate::c::labels(&program.steps);
        let page = |(step, label): (&'a Step, String)| build::page(&program.steps, step, label);
        Diagram { name: name.into(), pages: program.steps.iter().zip(labels).map(page).collect() }
    }

    /// The file of a page's picture.
    pub fn file(&self, page: usize) -> String {
        if page + 1 == self.pages.len() {
            format!("{}.svg", self.name)
        } else {
            format!("{}.{}.svg", self.name, self.pages[page].label)
        }
    }
}

/// The pictures of a recorded block: file name and SVG of each page; the last is the block itself.
pub fn pages(program: &Program, name: &str) -> Vec<(String, String)> {
    let diagram = Diagram::of(program, name);
    (0..diagram.pages.len()).map(|page| (diagram.file(page), picture::svg(&diagram, page))).collect()
}

/// Positions of the boxes and wires of a page's picture.
pub fn layout(diagram: &Diagram, page: usize) -> Layout {
    picture::arrange(diagram, page).layout
}
