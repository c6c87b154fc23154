//! The statements of a step.

use std::collections::{HashMap, HashSet};

use super::plan::{Access, Argument, Plan, Planned};
use super::text::{self, literal, wrap};
use super::types::Types;
use crate::record::{Function, Graph, Id, Node, Operator, Precision, Source, Step};

/// Expressions that are needed once are written where they are needed up to this length.
const INLINE: usize = 44;
const INDENT: &str = "    ";

/// An expression; not atomic if it needs parentheses within another.
#[derive(Clone)]
struct Expression {
    text: String,
    atomic: bool,
}

/// Writes the statements of a graph one after the other.
pub(super) struct Body<'a> {
    graph: &'a Graph,
    uses: Vec<u32>,
    expressions: Vec<Option<Expression>>,
    wanted_names: Vec<Option<String>>,
    taken: HashSet<String>,
    temporaries: usize,
    /// Operations that are needed once, and that by a store or a return.
    final_only: HashSet<Id>,
    /// Constant structs by type and initialiser.
    structs: HashMap<(String, String), String>,
    /// What was written.
    pub(super) lines: String,
    /// The functions of one number that it calls.
    pub(super) functions: Vec<Function>,
}

/// What the calls of a step refer to.
pub(super) struct Callees<'a> {
    pub(super) steps: &'a [Step],
    pub(super) labels: &'a [String],
    pub(super) types: &'a Types,
    pub(super) prefix: &'a str,
}

/// The statements of a step, without its frame.
pub(super) fn step<'a, F: Precision>(step: &'a Step, plan: &Plan, callees: &Callees<'a>) -> Body<'a> {
    let mut body = Body::new(&step.graph, plan.uses.clone());
    body.name_results(step);
    body.final_only = plan.stores.iter().map(|store| store.1).filter(|id| plan.uses[id.index()] == 1).collect();
    body.load::<F>(step);
    let mut written = vec![false; step.graph.calls.len()];
    for position in 0..step.graph.nodes.len() {
        let id = Id(position as u32);
        if let Node::Result(call, _) = step.graph.node(id)
            && !std::mem::replace(&mut written[call as usize], true)
            && let Some(planned) = &plan.calls[call as usize]
        {
            body.call::<F>(call, planned, callees);
        }
        body.statement::<F>(id);
    }
    for (place, id) in &plan.stores {
        let value = body.plain(*id);
        body.lines += &wrap(INDENT, &format!("{place} = {value};"));
    }
    body
}

/// The statements of a function of one number, ending with its return.
pub(super) fn function<'a, F: Precision>(graph: &'a Graph, result: Id) -> Body<'a> {
    let mut uses = vec![0; graph.nodes.len()];
    uses[result.index()] = 1;
    for position in (0..graph.nodes.len()).rev() {
        if uses[position] > 0 {
            for operand in graph.nodes[position].operands() {
                uses[operand.index()] += 1;
            }
        }
    }
    let mut body = Body::new(graph, uses);
    body.final_only.insert(result);
    for (position, node) in graph.nodes.iter().enumerate() {
        if *node == Node::Source(Source::Input, 0) {
            body.expressions[position] = Some(Expression { text: "x".into(), atomic: true });
        }
        body.statement::<F>(Id(position as u32));
    }
    let value = body.plain(result);
    body.lines += &wrap(INDENT, &format!("return {value};"));
    body
}

impl<'a> Body<'a> {
    fn new(graph: &'a Graph, uses: Vec<u32>) -> Self {
        let taken = ["p", "s", "in", "out", "dt", "x", "i"].map(String::from).into();
        let expressions = vec![None; graph.nodes.len()];
        let wanted_names = vec![None; graph.nodes.len()];
        let (lines, functions) = (String::new(), Vec::new());
        let (final_only, structs) = (HashSet::new(), HashMap::new());
        Body { graph, uses, expressions, wanted_names, taken, temporaries: 0, final_only, structs, lines, functions }
    }

    /// What the numbers of state and output are called if they need a name.
    fn name_results(&mut self, step: &Step) {
        for (paths, ids, suffix) in
            [(step.state.paths(), &step.new_state, "_next"), (step.output.paths(), &step.results, "")]
        {
            for (path, id) in paths.iter().zip(ids) {
                self.wanted_names[id.index()] = Some(format!("{}{suffix}", last_name(path)));
            }
        }
    }

    /// Names for what is handed in. The state is read before anything is written to it.
    fn load<F: Precision>(&mut self, step: &Step) {
        for (position, node) in self.graph.nodes.iter().enumerate() {
            let Node::Source(source, number) = *node else { continue };
            let uses = self.uses[position];
            if uses == 0 {
                continue;
            }
            let path = |tree: &crate::tree::Tree| tree.paths().swap_remove(number as usize);
            let (access, path, keep) = match source {
                Source::Parameters => ("p", path(&step.parameters), false),
                Source::Input => ("in", path(&step.input), uses > 1),
                Source::State => ("s", path(&step.state), true),
                Source::Step => {
                    self.expressions[position] = Some(Expression { text: "dt".into(), atomic: true });
                    continue;
                }
            };
            let text = format!("{access}->{}", text::path(&path));
            self.wanted_names[position] = Some(last_name(&path));
            if keep {
                self.assign(position, &text, F::C_NAME);
            } else {
                self.expressions[position] = Some(Expression { text, atomic: true });
            }
        }
    }

    fn assign(&mut self, position: usize, text: &str, kind: &str) {
        let name = self.name(position);
        self.lines += &wrap(INDENT, &format!("const {kind} {name} = {text};"));
        self.expressions[position] = Some(Expression { text: name, atomic: true });
    }

    /// A name that is not taken: after the field if the number is one, `t1`, `t2`, … if not.
    fn name(&mut self, position: usize) -> String {
        let wanted = self.wanted_names[position].clone();
        for attempt in 1.. {
            let name = match (&wanted, attempt) {
                (Some(name), 1) => name.clone(),
                (Some(name), _) => format!("{name}_{attempt}"),
                (None, _) => {
                    self.temporaries += 1;
                    format!("t{}", self.temporaries)
                }
            };
            if text::is_identifier(&name) && self.taken.insert(name.clone()) {
                return name;
            }
        }
        unreachable!("one of the numbered names is free")
    }

    /// The expression as it stands alone.
    fn plain(&self, id: Id) -> String {
        self.expressions[id.index()].as_ref().expect("operands are written before their results").text.clone()
    }

    /// The expression as it stands within another.
    fn operand(&self, id: Id) -> String {
        let expression = self.expressions[id.index()].as_ref().expect("operands are written before their results");
        if expression.atomic { expression.text.clone() } else { format!("({})", expression.text) }
    }

    /// Makes an expression of an operation, and a statement if it is needed twice or long.
    fn statement<F: Precision>(&mut self, id: Id) {
        let position = id.index();
        if self.uses[position] == 0 || self.expressions[position].is_some() {
            return;
        }
        let (text, atomic) = match self.graph.node(id) {
            Node::Constant(bits) => {
                let text = literal::<F>(f64::from_bits(bits));
                self.expressions[position] = Some(Expression { text, atomic: true });
                return;
            }
            Node::Source(..) | Node::Result(..) => return,
            Node::Negate(a) => (format!("-{}", self.operand(a)), false),
            Node::Apply(function, a) => {
                if !self.functions.contains(&function) {
                    self.functions.push(function);
                }
                (format!("{}({})", function_name::<F>(function), self.plain(a)), true)
            }
            Node::Binary(operator, a, b) => {
                let sign = match operator {
                    Operator::Add => '+',
                    Operator::Subtract => '-',
                    Operator::Multiply => '*',
                    Operator::Divide => '/',
                };
                (format!("{} {sign} {}", self.operand(a), self.operand(b)), false)
            }
            Node::Select(mask, yes, no) => {
                (format!("{} ? {} : {}", self.operand(mask), self.operand(yes), self.operand(no)), false)
            }
            Node::Truth(truth) => (truth.to_string(), true),
            Node::Less(a, b) => (format!("{} < {}", self.operand(a), self.operand(b)), false),
            Node::LessOrEqual(a, b) => (format!("{} <= {}", self.operand(a), self.operand(b)), false),
            Node::And(a, b) => (format!("{} && {}", self.operand(a), self.operand(b)), false),
            Node::Or(a, b) => (format!("{} || {}", self.operand(a), self.operand(b)), false),
            Node::Not(a) => (format!("!{}", self.operand(a)), false),
        };
        if self.uses[position] == 1 && (text.len() <= INLINE || self.final_only.contains(&id)) {
            self.expressions[position] = Some(Expression { text, atomic });
        } else {
            self.assign(position, &text, if is_mask(self.graph.node(id)) { "bool" } else { F::C_NAME });
        }
    }

    /// A call, with the structs that it needs before and the new state that is needed after it.
    fn call<F: Precision>(&mut self, number: u32, planned: &Planned, callees: &Callees<'_>) {
        let call = &self.graph.calls[number as usize];
        let callee = &callees.steps[call.function];
        let label = &callees.labels[call.function];
        let type_of = |tree| callees.types.name(tree).expect("the structs of every step have names").to_string();
        let mut arguments = Vec::new();
        if let Some(argument) = &planned.parameters {
            let name = format!("{}_p", planned.name);
            arguments.push(self.constant_struct(argument, &type_of(&callee.parameters), &name));
        }
        if let Some((access, argument)) = &planned.state {
            if let Some(argument) = argument {
                let value = self.initialiser(argument);
                self.lines += &wrap(INDENT, &format!("{} {} = {value};", type_of(&callee.state), access.value()));
            }
            arguments.push(access.address());
        }
        if let Some(argument) = &planned.input {
            let name = format!("{}_in", planned.name);
            arguments.push(self.constant_struct(argument, &type_of(&callee.input), &name));
        }
        arguments.push(self.plain(call.step));
        if let Some(access) = &planned.output {
            self.lines += &format!("{INDENT}{} {};\n", type_of(&callee.output), access.value());
            arguments.push(access.address());
        }
        self.lines += &wrap(INDENT, &format!("{}_{label}_step({});", callees.prefix, arguments.join(", ")));
        self.results::<F>(number, planned, callee);
    }

    /// The new state is copied, since the next call may work on it in place; an output stays where it lies.
    fn results<F: Precision>(&mut self, call: u32, planned: &Planned, callee: &Step) {
        let (state, output) = (callee.state.paths(), callee.output.paths());
        for position in 0..self.graph.nodes.len() {
            let Node::Result(of, number) = self.graph.nodes[position] else { continue };
            let number = number as usize;
            if of != call || self.uses[position] == 0 {
                continue;
            }
            let member = |access: &Access, path: &str| access.member(&text::path(path));
            if let (Some((access, _)), Some(path)) = (&planned.state, state.get(number)) {
                self.wanted_names[position].get_or_insert(last_name(path));
                self.assign(position, &member(access, path), F::C_NAME);
            } else if let Some(access) = &planned.output {
                let text = member(access, &output[number - state.len()]);
                self.expressions[position] = Some(Expression { text, atomic: true });
            }
        }
    }

    fn constant_struct(&mut self, argument: &Argument, type_name: &str, name: &str) -> String {
        if let Argument::Whole(access) = argument {
            return access.address();
        }
        let value = self.initialiser(argument);
        if let Some(name) = self.structs.get(&(type_name.into(), value.clone())) {
            return format!("&{name}");
        }
        self.lines += &wrap(INDENT, &format!("const {type_name} {name} = {value};"));
        self.structs.insert((type_name.into(), value), name.into());
        format!("&{name}")
    }

    fn initialiser(&self, argument: &Argument) -> String {
        match argument {
            Argument::Whole(access) => access.value(),
            Argument::Number(id) => self.plain(*id),
            Argument::Parts(parts) => {
                let part = |(name, part): &(Option<String>, Argument)| match name {
                    Some(name) => format!(".{name} = {}", self.initialiser(part)),
                    None => self.initialiser(part),
                };
                format!("{{ {} }}", parts.iter().map(part).collect::<Vec<_>>().join(", "))
            }
        }
    }
}

fn is_mask(node: Node) -> bool {
    matches!(
        node,
        Node::Truth(_) | Node::Less(..) | Node::LessOrEqual(..) | Node::And(..) | Node::Or(..) | Node::Not(_)
    )
}

/// `friction.table[1][2]` → `table_1_2`.
fn last_name(path: &str) -> String {
    let last = path.rsplit('.').next().unwrap_or(path);
    text::identifier(&last.replace("][", "_").replace('[', "_").replace(']', ""))
}

/// What C calls a function of one number.
pub(super) fn function_name<F: Precision>(function: Function) -> String {
    let name = match function {
        Function::Abs => return format!("fabs{}", F::C_SUFFIX),
        Function::Exp => "exp",
        Function::Ln => "ln",
        Function::Sin => "sin",
        Function::Cos => "cos",
        Function::Round => "round",
        Function::Floor => "floor",
        Function::PowerOfTwo => "power_of_two",
        Function::Exponent => "exponent",
    };
    format!("stickslip_{name}{}", F::C_SUFFIX)
}

/// Whether a word stands in a text.
pub(super) fn mentions(text: &str, word: &str) -> bool {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').any(|w| w == word)
}
