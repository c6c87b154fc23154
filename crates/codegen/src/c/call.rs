//! The step of a block within another, as a call.

use super::body::{Body, Callees, Expression, INDENT};
use super::names::last_name;
use super::plan::{Access, Argument, Planned};
use super::text::{self, wrap};
use crate::record::{Node, Real, Step};

impl Body<'_> {
    /// A call, with the structs before it and the new state after it.
    pub(super) fn call(&mut self, real: Real, number: u32, planned: &Planned, callees: &Callees<'_>) {
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
        self.results(real, number, planned, callee);
    }

    /// The new state is copied, since the next call may work on it in place; an output stays at its place.
    fn results(&mut self, real: Real, call: u32, planned: &Planned, callee: &Step) {
        let (state, output) = (callee.state.paths(), callee.output.paths());
        for position in 0..self.graph.nodes.len() {
            let Node::Result(of, number) = self.graph.nodes[position] else { continue };
            let number = number as usize;
            if of != call || self.uses[position] == 0 {
                continue;
            }
            let member = |access: &Access, path: &str| access.member(&text::path(path));
            if let (Some((access, _)), Some(path)) = (&planned.state, state.get(number)) {
                self.preferred_names[position].push(last_name(path));
                self.assign(position, &member(access, path), real.c_name);
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
