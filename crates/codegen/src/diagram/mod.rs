//! The signal-flow diagram of a recorded block, as data and as pictures.
//!
//! [`Diagram::of`] condenses the operations of each step to what an engineer draws: summing points, gains, saturations,
//! switches, unit delays and boxes for other blocks. What does not depend on a signal is written at the block that uses
//! it ([`formula`]). [`json`] writes the diagram as data, [`pages`] one SVG for each step, with links from a box to the
//! page inside it.
//!
//! # JSON
//!
//! Schema `stickslip.diagram/1`. The last page is the block itself; a box (`"kind": "call"`) names its page in `page`.
//!
//! ```json
//! {"schema": "stickslip.diagram/1", "name": "lag", "pages": [
//!   {"name": "Lag", "page": "lag", "file": "lag.svg",
//!     "operations": [[1, "input", [0]], [3, "step", []], …],
//!     "nodes": [
//!       {"kind": "sum", "signs": "+-", "name": "", "inputs": [{"numbers": [1]}, …], "operations": [6], …},
//!       {"kind": "gain", "text": "T/(T_1 + T)", …},
//!       {"kind": "delay", "name": "value", "unit": "1", …}],
//!     "wires": [{"from": [0, 0], "to": [2, 0]}, …]}]}
//! ```
//!
//! - `operations`: what is computed, operands first, as `[number, what, operands]`. The operands of `input`, `state` and
//!   `parameter` are places in the struct, those of `result` a call and a place. Each belongs to exactly one node, but
//!   for those that depend on no signal: they are in a `text` or nowhere.
//! - `nodes`: `kind`, and `signs` of a sum, `text` of what is written at it, `page` of a box, `name`, `symbol`, `unit`
//!   and `help` where they are known. A port has `numbers`: the operations whose values pass; of a bus several.
//! - `wires`: from node and output port to node and input port. A state that a box keeps to itself has no wire.
//! - `function`: the number of the box `f` that a crowded picture draws instead of the node.

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
    /// What files are called.
    pub name: String,
    /// One for each step of the program; the last is the block itself.
    pub pages: Vec<Page<'a>>,
}

/// What one step computes.
#[derive(Clone, Debug)]
pub struct Page<'a> {
    /// Its name among the pages.
    pub label: String,
    /// What was recorded.
    pub step: &'a Step,
    /// What is drawn.
    pub nodes: Vec<Node>,
    /// How they are connected: at most one wire ends at an input port.
    pub wires: Vec<Wire>,
}

/// Something with ports.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// What it does.
    pub kind: Kind,
    /// What it is called: a path such as `reference.position`; empty for an operation.
    pub name: String,
    /// As in an equation; may be empty.
    pub symbol: String,
    /// Unit of what leaves it, if known.
    pub unit: &'static str,
    /// What it means, if known.
    pub help: &'static str,
    /// Where wires end, in the order of evaluation.
    pub inputs: Vec<Port>,
    /// Where wires begin.
    pub outputs: Vec<Port>,
    /// The operations that it stands for.
    pub operations: Vec<Id>,
}

/// Where a wire ends or begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Port {
    /// What it is called; empty at an operation.
    pub name: String,
    /// As in an equation; may be empty.
    pub symbol: String,
    /// Unit, if known.
    pub unit: &'static str,
    /// Which struct it is a part of.
    pub role: Role,
    /// Place of its first number there.
    pub first: usize,
    /// The operations whose values pass; several on a bus.
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

/// A port of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct End {
    /// Which node of the page.
    pub node: usize,
    /// Which of its ports.
    pub port: usize,
}

/// What a node does with the signals at its inputs, in their order.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// Comes from outside.
    Input,
    /// Goes outside.
    Output,
    /// Gives in this step what it got in the last: a part of the state.
    Delay,
    /// Depends on no signal; one operation for each number of its port.
    Constant(Vec<Id>),
    /// Added from the first to the last; `true` where it is subtracted.
    Sum(Vec<bool>),
    /// Multiplied by each factor in turn.
    Gain(Vec<Factor>),
    /// Multiplied from the first to the last; `true` where it divides.
    Product(Vec<bool>),
    /// A function of one signal.
    Apply(Function),
    /// The smaller; the second if either is NaN.
    Minimum,
    /// The larger; the second if either is NaN.
    Maximum,
    /// The first signal, limited. Bounds that are ports follow in this order.
    Saturation {
        /// Lower bound.
        low: Bound,
        /// Upper bound.
        high: Bound,
    },
    /// −1, 0 or 1.
    Sign,
    /// Where the mask, its first input, is true the second, else the third; number by number on a bus.
    Switch,
    /// Whether the signal, or its magnitude, keeps all bounds.
    Within {
        /// Of the magnitude.
        magnitude: bool,
        /// Relation to the bound, which depends on no signal.
        bounds: Vec<(Relation, Id)>,
    },
    /// How the first signal compares with the second.
    Compare(Relation),
    /// All of them.
    And,
    /// Any of them.
    Or,
    /// The opposite.
    Not,
    /// The step of another block.
    Call {
        /// Which call of the step's graph.
        call: usize,
        /// Which page is inside.
        page: usize,
        /// Where it keeps its state within the state of this page: neither read nor changed by others.
        keeps: Option<usize>,
    },
}

/// What a gain does with a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Factor {
    /// Multiplies by what depends on no signal.
    Times(Id),
    /// Divides by it.
    Over(Id),
    /// Changes the sign.
    Negated,
}

/// A bound of a saturation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// Depends on no signal.
    Fixed(Id),
    /// A signal: a port of its own.
    Signal,
    /// The upper bound with the opposite sign.
    Opposite,
}

/// How two numbers compare; false for NaN.
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
    /// As it is written.
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
    /// The diagram of a recorded block; `name` begins the names of its files.
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

/// Where the boxes and wires of a page's picture lie.
pub fn layout(page: &Page) -> Layout {
    picture::arrange(page).layout
}
