//! The statements of a step.

use std::collections::{HashMap, HashSet};

use stickslip_core::fields::Order;

use super::idiom::{self, Idiom};
use super::kernel::Needs;
use super::plan::{Access, Argument, Plan, Planned, count};
use super::text::{self, literal, wrap};
use super::types::Types;
use crate::record::{Function, Graph, Id, Law, LawBook, Node, Operator, Precision, Source, Step};
use crate::tree::Tree;

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
    idioms: Vec<Option<Idiom>>,
    /// What each number would like to be called, best first.
    wanted_names: Vec<Vec<String>>,
    taken: HashSet<String>,
    temporaries: usize,
    /// Operations that stand alone: a choice, and what a choice gives if it is true, read badly within others.
    alone: HashSet<Id>,
    /// Operations that are needed once, and that by a store or a return.
    final_only: HashSet<Id>,
    /// Constant structs by type and initialiser.
    structs: HashMap<(String, String), String>,
    /// What was written.
    pub(super) lines: String,
    /// The small functions that it calls.
    pub(super) needs: Needs,
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
    body.taken.extend(plan.names());
    body.final_only = plan.stores.iter().map(|store| store.1).filter(|id| body.uses[id.index()] == 1).collect();
    body.load::<F>(&[&step.parameters, &step.state, &step.input]);
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
    body.blank_line();
    for (place, id) in &plan.stores {
        let value = body.plain(*id);
        body.lines += &wrap(INDENT, &format!("{place} = {value};"));
    }
    body
}

/// The statements of a function of one number, ending with its return.
pub(super) fn function<'a, F: Precision>(graph: &'a Graph, result: Id) -> Body<'a> {
    let mut body = Body::new(graph, count(graph, [&result]).0);
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

/// The statements that compute values and bounds from the parameters, and each law as a condition.
pub(super) fn laws<'a, F: Precision>(book: &'a LawBook, parameters: &Tree) -> (Body<'a>, Vec<String>) {
    let graph = &book.graph;
    let mut body = Body::new(graph, count(graph, book.laws.iter().flat_map(|law| [&law.value, &law.bound])).0);
    body.load::<F>(&[parameters]);
    (0..graph.nodes.len()).for_each(|position| body.statement::<F>(Id(position as u32)));
    let condition = |law: &Law| {
        let order = if law.order == Order::AtMost { "<=" } else { ">=" };
        format!("{} {order} {}", body.operand(law.value), body.operand(law.bound))
    };
    let conditions = book.laws.iter().map(condition).collect();
    (body, conditions)
}

impl<'a> Body<'a> {
    fn new(graph: &'a Graph, mut uses: Vec<u32>) -> Self {
        let idioms = idiom::find(graph, &mut uses);
        let mut alone = HashSet::new();
        for (position, node) in graph.nodes.iter().enumerate() {
            if let (Node::Select(_, yes, _), None) = (node, idioms[position]) {
                alone.extend([Id(position as u32), *yes]);
            }
        }
        Body {
            graph,
            uses,
            expressions: vec![None; graph.nodes.len()],
            idioms,
            wanted_names: vec![Vec::new(); graph.nodes.len()],
            taken: ["p", "s", "in", "out", "dt", "x", "i"].map(String::from).into(),
            temporaries: 0,
            alone,
            final_only: HashSet::new(),
            structs: HashMap::new(),
            lines: String::new(),
            needs: Needs::default(),
        }
    }

    /// Sets apart what follows.
    fn blank_line(&mut self) {
        if !self.lines.is_empty() {
            self.lines.push('\n');
        }
    }

    /// What the numbers of state and output are called if they need a name.
    fn name_results(&mut self, step: &Step) {
        for (path, id) in step.state.paths().iter().zip(&step.new_state) {
            self.wanted_names[id.index()] = vec![format!("{}_next", last_name(path))];
        }
        for (path, id) in step.output.paths().iter().zip(&step.results) {
            self.wanted_names[id.index()] = vec![last_name(path), format!("{}_out", last_name(path))];
        }
    }

    /// Names for what is handed in. The state is read before anything is written to it.
    fn load<F: Precision>(&mut self, trees: &[&Tree]) {
        let paths: Vec<Vec<String>> = trees.iter().map(|tree| tree.paths()).collect();
        for (position, node) in self.graph.nodes.iter().enumerate() {
            let Node::Source(source, number) = *node else { continue };
            let uses = self.uses[position];
            if uses == 0 {
                continue;
            }
            let of = |kind: usize| paths[kind][number as usize].as_str();
            let (access, path, keep, suffix) = match source {
                // Far down in its struct or needed often, a parameter is read more easily by its own name.
                Source::Parameters => ("p", of(0), uses > if of(0).contains('.') { 1 } else { 2 }, ""),
                Source::Input => ("in", of(2), uses > 1, "_in"),
                Source::State => ("s", of(1), true, ""),
                Source::Step => {
                    self.expressions[position] = Some(Expression { text: "dt".into(), atomic: true });
                    continue;
                }
            };
            let text = format!("{access}->{}", text::path(path));
            if keep {
                let among = &paths[source as usize];
                let short = last_name(path);
                let unique = among.iter().filter(|other| last_name(other) == short).count() == 1;
                let name = if unique { short } else { last_names(path) };
                self.wanted_names[position] = vec![name.clone(), format!("{name}{suffix}")];
                self.assign(position, &text, F::C_NAME);
            } else {
                self.expressions[position] = Some(Expression { text, atomic: true });
            }
        }
        self.blank_line();
    }

    fn assign(&mut self, position: usize, text: &str, kind: &str) {
        let name = self.name(position);
        self.lines += &wrap(INDENT, &format!("const {kind} {name} = {text};"));
        self.expressions[position] = Some(Expression { text: name, atomic: true });
    }

    /// A name that is not taken: after the field if the number is one, `t1`, `t2`, … if not.
    fn name(&mut self, position: usize) -> String {
        let wanted = std::mem::take(&mut self.wanted_names[position]);
        let numbered = wanted.last().cloned();
        let mut wanted = wanted.into_iter();
        for attempt in 2.. {
            let name = match (wanted.next(), &numbered) {
                (Some(name), _) => name,
                (None, Some(name)) => format!("{name}_{attempt}"),
                (None, None) => {
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
        if let Some(idiom) = self.idioms[position] {
            return self.idiom::<F>(id, idiom);
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
                self.needs.functions.insert(function);
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
            // False for NaN alone.
            Node::LessOrEqual(a, b) if a == b => (format!("!isnan({})", self.plain(a)), false),
            Node::LessOrEqual(a, b) => (format!("{} <= {}", self.operand(a), self.operand(b)), false),
            Node::And(a, b) => (format!("{} && {}", self.operand(a), self.operand(b)), false),
            Node::Or(a, b) => (format!("{} || {}", self.operand(a), self.operand(b)), false),
            Node::Not(a) => (format!("!{}", self.operand(a)), false),
        };
        self.put::<F>(id, Expression { text, atomic });
    }

    /// The call of a small function.
    fn idiom<F: Precision>(&mut self, id: Id, idiom: Idiom) {
        self.needs.helpers.insert(idiom.helper());
        let arguments: Vec<String> = idiom.arguments().into_iter().map(|id| self.plain(id)).collect();
        let text = format!("{}({})", idiom.helper().name::<F>(), arguments.join(", "));
        self.put::<F>(id, Expression { text, atomic: true });
    }

    /// Keeps an expression for the one place that needs it, or gives it a name.
    fn put<F: Precision>(&mut self, id: Id, expression: Expression) {
        let short = expression.text.len() <= INLINE && !self.alone.contains(&id);
        if self.uses[id.index()] == 1 && (short || self.final_only.contains(&id)) {
            self.expressions[id.index()] = Some(expression);
        } else {
            let kind = if is_mask(self.graph.node(id)) { "bool" } else { F::C_NAME };
            self.assign(id.index(), &expression.text, kind);
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
                self.wanted_names[position].push(last_name(path));
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

/// `desired.friction.viscous` → `friction_viscous`.
fn last_names(path: &str) -> String {
    match path.rsplit_once('.') {
        Some((before, last)) => format!("{}_{}", last_name(before), last_name(last)),
        None => last_name(path),
    }
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
