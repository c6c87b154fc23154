//! What the numbers of a step are called: after their fields, where they have one.

use super::body::{Body, Expression};
use super::text;
use crate::record::{Node, Real, Source, Step};
use crate::tree::Tree;

impl Body<'_> {
    /// What the numbers of state and output are called if they need a name.
    pub(super) fn name_results(&mut self, step: &Step) {
        for (path, id) in step.state.paths().iter().zip(&step.new_state) {
            self.wanted_names[id.index()] = vec![format!("{}_next", last_name(path))];
        }
        for (path, id) in step.output.paths().iter().zip(&step.results) {
            self.wanted_names[id.index()] = vec![last_name(path), format!("{}_out", last_name(path))];
        }
    }

    /// Names for what is handed in. The state is read before anything is written to it.
    pub(super) fn load(&mut self, real: Real, trees: &[&Tree]) {
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
                self.assign(position, &text, real.c_name);
            } else {
                self.expressions[position] = Some(Expression { text, atomic: true });
            }
        }
        self.blank_line();
    }

    /// A name that is not taken: after the field if the number is one, `t1`, `t2`, … if not.
    pub(super) fn name(&mut self, position: usize) -> String {
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
}

/// `friction.table[1][2]` → `table_1_2`.
pub(super) fn last_name(path: &str) -> String {
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
