//! The diagram as data.

use serde_json::{Value, json};

use super::{Bound, Diagram, Factor, Kind, Node, Page, Port, Relation, Role, crowd, formula};
use crate::record::{self, Id, Program};

/// The diagram of a recorded block; the module describes its format.
pub fn json(program: &Program, name: &str) -> String {
    let diagram = Diagram::of(program, name);
    let pages: Vec<String> = (0..diagram.pages.len()).map(|page| page_text(&diagram, page)).collect();
    let name = Value::from(name);
    format!("{{\"schema\": \"stickslip.diagram/1\", \"name\": {name}, \"pages\": [\n{}\n]}}\n", pages.join(",\n"))
}

/// A line for each node and wire, so that two diagrams can be compared as texts.
fn page_text(diagram: &Diagram, number: usize) -> String {
    let page = &diagram.pages[number];
    let groups = crowd::groups(page);
    let mut functions: Vec<usize> = groups.clone();
    functions.sort_unstable();
    functions.dedup();
    functions.retain(|group| groups.iter().filter(|other| *other == group).count() > 1);
    let function = |node: usize| functions.iter().position(|group| *group == groups[node]);
    let nodes = page.nodes.iter().enumerate().map(|(n, node)| node_value(diagram, page, node, function(n)));
    let wires = page
        .wires
        .iter()
        .map(|wire| json!({"from": [wire.from.node, wire.from.port], "to": [wire.to.node, wire.to.port]}));
    let live =
        super::condense::Reading::of(&page.step.graph, page.step.new_state.iter().chain(&page.step.results).copied());
    let operations = (0..live.uses.len()).filter(|id| live.uses[*id] > 0).map(|id| operation(page, Id(id as u32)));
    format!(
        "{{\"name\": {}, \"page\": {}, \"file\": {},\n \"operations\": [\n{}],\n \"nodes\": [\n{}],\n \"wires\": [\n{}]}}",
        json!(page.step.name),
        json!(page.label),
        json!(diagram.file(number)),
        lines(operations),
        lines(nodes),
        lines(wires)
    )
}

fn lines(values: impl Iterator<Item = Value>) -> String {
    values.map(|value| format!("  {value}")).collect::<Vec<_>>().join(",\n")
}

fn operation(page: &Page, id: Id) -> Value {
    let node = page.step.graph.node(id);
    let places = |places: &[u32]| places.to_vec();
    let (what, operands) = match node {
        record::Node::Source(source, place) => match source {
            record::Source::Parameters => ("parameter".into(), places(&[place])),
            record::Source::State => ("state".into(), places(&[place])),
            record::Source::Input => ("input".into(), places(&[place])),
            record::Source::Step => ("step".into(), Vec::new()),
        },
        record::Node::Result(call, place) => ("result".into(), places(&[call, place])),
        record::Node::Constant(bits) => return json!([id.0, "constant", [format!("{:?}", f64::from_bits(bits))]]),
        record::Node::Truth(truth) => return json!([id.0, "truth", [truth]]),
        _ => (format!("{:?}", Verb(node)), node.operands().map(|operand| operand.0).collect()),
    };
    json!([id.0, what, operands])
}

/// Name of an operation, in one word.
struct Verb(record::Node);

impl std::fmt::Debug for Verb {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let word = match self.0 {
            record::Node::Apply(function, _) => format!("{function:?}"),
            record::Node::Binary(operator, ..) => format!("{operator:?}"),
            other => format!("{other:?}").split('(').next().unwrap_or_default().into(),
        };
        f.write_str(&word.to_lowercase())
    }
}

fn node_value(diagram: &Diagram, page: &Page, node: &Node, function: Option<usize>) -> Value {
    let (kind, key, value) = kind_value(diagram, page, &node.kind);
    let mut out = json!({
        "kind": kind,
        "inputs": node.inputs.iter().map(port_value).collect::<Vec<_>>(),
        "outputs": node.outputs.iter().map(port_value).collect::<Vec<_>>(),
        "operations": numbers(&node.operations),
    });
    put_texts(&mut out, [("name", &node.name), ("symbol", &node.symbol), ("unit", node.unit), ("help", node.help)]);
    if !key.is_empty() {
        out[key] = value;
    }
    if let Kind::Call { keeps: Some(first), .. } = node.kind {
        out["keeps_state_at"] = first.into();
    }
    if let Some(number) = function {
        out["function"] = (number + 1).into();
    }
    out
}

/// The name of a kind; key and value of its specific data, the key empty without data.
fn kind_value(diagram: &Diagram, page: &Page, kind: &Kind) -> (&'static str, &'static str, Value) {
    let text_of = |id: &Id| formula(page.step, *id, &|_| None);
    let factor = |factor: &Factor| match factor {
        Factor::Times(id) => json!(["*", text_of(id)]),
        Factor::Over(id) => json!(["/", text_of(id)]),
        Factor::Negated => json!(["-"]),
    };
    let bound = |bound: &Bound| match bound {
        Bound::Fixed(id) => json!(text_of(id)),
        Bound::Signal => json!({"input": true}),
        Bound::Opposite => json!({"opposite": true}),
    };
    let relation = |(relation, id): &(Relation, Id)| json!([relation.sign(), text_of(id)]);
    match kind {
        Kind::Input => ("input", "", Value::Null),
        Kind::Output => ("output", "", Value::Null),
        Kind::Delay => ("delay", "", Value::Null),
        Kind::Constant(ids) => ("constant", "text", ids.iter().map(text_of).collect::<Vec<_>>().into()),
        Kind::Sum(minus) => ("sum", "signs", signs(minus, '+', '-')),
        Kind::Product(over) => ("product", "signs", signs(over, '*', '/')),
        Kind::Gain(factors) => ("gain", "factors", factors.iter().map(factor).collect::<Vec<_>>().into()),
        Kind::Apply(function) => ("function", "text", format!("{function:?}").to_lowercase().into()),
        Kind::Minimum => ("minimum", "", Value::Null),
        Kind::Maximum => ("maximum", "", Value::Null),
        Kind::Saturation { low, high } => ("saturation", "bounds", json!([bound(low), bound(high)])),
        Kind::Sign => ("sign", "", Value::Null),
        Kind::Switch => ("switch", "", Value::Null),
        Kind::Within { magnitude, bounds } => {
            let kind = if *magnitude { "magnitude_within" } else { "within" };
            (kind, "bounds", bounds.iter().map(relation).collect::<Vec<_>>().into())
        }
        Kind::Compare(relation) => ("compare", "text", relation.sign().into()),
        Kind::And => ("and", "", Value::Null),
        Kind::Or => ("or", "", Value::Null),
        Kind::Not => ("not", "", Value::Null),
        Kind::Call { page, .. } => ("call", "page", diagram.pages[*page].label.clone().into()),
    }
}

fn port_value(port: &Port) -> Value {
    let role = match port.role {
        Role::Signal => "",
        Role::Parameters => "parameters",
        Role::State => "state",
        Role::Input => "input",
        Role::Output => "output",
    };
    let mut value = json!({"numbers": numbers(&port.numbers)});
    put_texts(&mut value, [("name", &port.name), ("symbol", &port.symbol), ("unit", port.unit), ("of", role)]);
    value
}

fn numbers(ids: &[Id]) -> Vec<u32> {
    ids.iter().map(|id| id.0).collect()
}

/// A sign for each input.
fn signs(reversed: &[bool], plain: char, other: char) -> Value {
    reversed.iter().map(|reversed| if *reversed { other } else { plain }).collect::<String>().into()
}

/// Adds the texts that are not empty.
fn put_texts(value: &mut Value, texts: [(&str, &str); 4]) {
    for (key, text) in texts {
        if !text.is_empty() {
            value[key] = text.into();
        }
    }
}
