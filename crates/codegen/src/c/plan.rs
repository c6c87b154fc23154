//! How a step passes structs to the blocks that it calls: existing structs directly, others as new local structs.

use super::text;
use super::types::Types;
use super::uses::{count, results, sources};
use crate::record::{Call, Id, Source, Step};
use crate::tree::Tree;

/// Source of a struct that is initialised or passed.
pub(super) enum Argument {
    /// An existing struct: how to access it.
    Whole(Access),
    /// Part by part.
    Parts(Vec<(Option<String>, Argument)>),
    /// One number.
    Number(Id),
}

/// A struct in memory: `p->friction`, `lag_1_out`.
#[derive(Clone)]
pub(super) struct Access {
    base: String,
    pointer: bool,
    path: String,
}

impl Access {
    /// The struct itself.
    pub(super) fn value(&self) -> String {
        match (self.path.is_empty(), self.pointer) {
            (true, true) => format!("*{}", self.base),
            (true, false) => self.base.clone(),
            (false, _) => self.member(""),
        }
    }

    /// Its address.
    pub(super) fn address(&self) -> String {
        if self.path.is_empty() && self.pointer { self.base.clone() } else { format!("&{}", self.value()) }
    }

    /// A number within.
    pub(super) fn member(&self, path: &str) -> String {
        let arrow = if self.pointer { "->" } else { "." };
        let dot = if self.path.is_empty() || path.is_empty() { "" } else { "." };
        format!("{}{arrow}{}{dot}{path}", self.base, self.path)
    }
}

/// A planned call.
pub(super) struct Planned {
    /// Prefix of its local structs.
    pub(super) name: String,
    pub(super) parameters: Option<Argument>,
    /// Place of its state, and its initial value if it is a local struct.
    pub(super) state: Option<(Access, Option<Argument>)>,
    pub(super) input: Option<Argument>,
    pub(super) output: Option<Access>,
}

/// All decisions about a step.
pub(super) struct Plan {
    /// `None` for a call without used results.
    pub(super) calls: Vec<Option<Planned>>,
    /// Number of uses of each operation as a single number.
    pub(super) uses: Vec<u32>,
    /// Stores at the end: the place and the number.
    pub(super) stores: Vec<(String, Id)>,
}

impl Plan {
    /// The names of all local structs.
    pub(super) fn names(&self) -> impl Iterator<Item = String> {
        let calls = self.calls.iter().flatten();
        calls.flat_map(|call| ["p", "s", "in", "out"].map(|kind| format!("{}_{kind}", call.name)))
    }
}

/// Numbers that are in memory as a struct.
struct Object<'a> {
    access: Access,
    tree: &'a Tree,
    ids: Vec<Id>,
    /// Whether a call may work on it in place.
    state: bool,
}

struct Planner<'a> {
    types: &'a Types,
    objects: Vec<Object<'a>>,
    uses: Vec<u32>,
}

/// Decides for a step.
pub(super) fn plan<'a>(step: &'a Step, steps: &'a [Step], labels: &[String], types: &'a Types) -> Plan {
    let graph = &step.graph;
    let (uses, live) = count(graph, step.new_state.iter().chain(&step.results));
    let mut planner = Planner { types, objects: Vec::new(), uses };
    for (base, tree, source) in [("p", &step.parameters, Source::Parameters), ("in", &step.input, Source::Input)] {
        planner.add(
            Access { base: base.into(), pointer: true, path: String::new() },
            tree,
            sources(graph, source, tree),
            false,
        );
    }
    let state = Access { base: "s".into(), pointer: true, path: String::new() };
    planner.add(state.clone(), &step.state, sources(graph, Source::State, &step.state), true);

    let mut calls = Vec::new();
    for (number, call) in graph.calls.iter().enumerate() {
        if !live[number] {
            calls.push(None);
            continue;
        }
        let callee = &steps[call.function];
        let same_function = |(other, other_call): (usize, &Call)| live[other] && other_call.function == call.function;
        let all = graph.calls.iter().enumerate().filter(|c| same_function(*c)).count();
        let before = graph.calls.iter().enumerate().take(number).filter(|c| same_function(*c)).count();
        let label = &labels[call.function];
        let name = if all == 1 { label.clone() } else { format!("{label}_{}", letters(before)) };
        let results = results(graph, number, callee.new_state.len() + callee.results.len());
        let (new_state, output) = results.split_at(callee.new_state.len());
        // Numbers that the callee does not change stay at their place.
        let after = |i: usize| if callee.keeps(i) { call.state[i] } else { new_state[i] };
        let new_state: Vec<Id> = (0..new_state.len()).map(after).collect();
        let parameters = planner.argument(&callee.parameters, &call.parameters);
        let input = planner.argument(&callee.input, &call.input);
        let state = planner.state(&callee.state, &call.state, &new_state, &name);
        let output = (!output.is_empty()).then(|| {
            let access = Access { base: format!("{name}_out"), pointer: false, path: String::new() };
            planner.add(access.clone(), &callee.output, output.to_vec(), false);
            access
        });
        calls.push(Some(Planned { name, parameters, state, input, output }));
    }

    let mut stores = Vec::new();
    let old_state = planner.objects[2].ids.clone();
    for ((path, id), old_id) in step.state.paths().iter().zip(&step.new_state).zip(old_state) {
        if *id == old_id {
            planner.uses[id.index()] -= 1;
        } else {
            stores.push((state.member(&text::path(path)), *id));
        }
    }
    let out = Access { base: "out".into(), pointer: true, path: String::new() };
    for (path, id) in step.output.paths().iter().zip(&step.results) {
        stores.push((out.member(&text::path(path)), *id));
    }
    Plan { calls, uses: planner.uses, stores }
}

/// a, b, … z, aa, ab, …: functions with the same name have numbers already.
fn letters(number: usize) -> String {
    let last = char::from(b'a' + (number % 26) as u8);
    if number < 26 { last.into() } else { format!("{}{last}", letters(number / 26 - 1)) }
}

impl<'a> Planner<'a> {
    fn add(&mut self, access: Access, tree: &'a Tree, ids: Vec<Id>, state: bool) {
        self.objects.push(Object { access, tree, ids, state });
    }

    /// The place of these numbers as one struct: object, first number, and path.
    fn find(&self, tree: &Tree, ids: &[Id], state: bool) -> Option<(usize, usize, Access)> {
        self.objects.iter().enumerate().filter(|(_, object)| object.state == state).find_map(|(number, object)| {
            object.tree.parts().into_iter().find_map(|(path, first, part)| {
                (part == tree && object.ids[first..first + ids.len()] == *ids)
                    .then(|| (number, first, Access { path: text::path(&path), ..object.access.clone() }))
            })
        })
    }

    fn argument(&mut self, tree: &Tree, ids: &[Id]) -> Option<Argument> {
        (!ids.is_empty()).then(|| self.parts(tree, ids))
    }

    fn parts(&mut self, tree: &Tree, ids: &[Id]) -> Argument {
        if self.types.name(tree).is_some()
            && let Some((_, _, access)) = self.find(tree, ids, false)
        {
            for id in ids {
                self.uses[id.index()] -= 1;
            }
            return Argument::Whole(access);
        }
        match tree {
            Tree::Number => Argument::Number(ids[0]),
            Tree::List(length, element) => {
                let size = ids.len() / length;
                Argument::Parts(ids.chunks(size.max(1)).map(|chunk| (None, self.parts(element, chunk))).collect())
            }
            Tree::Group(group) => {
                let mut rest = ids;
                let mut parts = Vec::new();
                for member in &group.members {
                    let (mine, others) = rest.split_at(member.tree.numbers());
                    rest = others;
                    if !mine.is_empty() {
                        parts.push((Some(text::identifier(&member.name)), self.parts(&member.tree, mine)));
                    }
                }
                Argument::Parts(parts)
            }
        }
    }

    /// In place if the old state is a struct, which then holds the new one; else in a local struct.
    fn state(&mut self, tree: &'a Tree, old: &[Id], new: &[Id], name: &str) -> Option<(Access, Option<Argument>)> {
        if old.is_empty() {
            return None;
        }
        if let Some((object, first, access)) = self.find(tree, old, true) {
            for id in old {
                self.uses[id.index()] -= 1;
            }
            self.objects[object].ids[first..first + new.len()].copy_from_slice(new);
            return Some((access, None));
        }
        let argument = self.parts(tree, old);
        let access = Access { base: format!("{name}_s"), pointer: false, path: String::new() };
        self.add(access.clone(), tree, new.to_vec(), true);
        Some((access, Some(argument)))
    }
}

#[cfg(test)]
mod tests {
    use super::letters;

    #[test]
    fn calls_are_counted_in_letters() {
        assert_eq!([0, 25, 26, 27, 52, 701, 702].map(letters), ["a", "z", "aa", "ab", "ba", "zz", "aaa"]);
    }
}
