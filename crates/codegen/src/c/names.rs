//! Names of the numbers of a step: those of their fields, if they have one.

use super::body::{Body, Expression};
use super::text;
use crate::record::{Node, Real, Source, Step};
use crate::tree::Tree;

impl Body<'_> {
    /// Names of the numbers of state and output, if they need one.
    pub(super) fn name_results(&mut self, step: &Step) {
        for (path, id) in step.state.paths().iter().zip(&step.new_state) {
            self.preferred_names[id.index()] = vec![format!("{}_next", last_name(path))];
        }
        for (path, id) in step.output.paths().iter().zip(&step.results) {
            self.preferred_names[id.index()] = vec![last_name(path), format!("{}_out", last_name(path))];
        }
    }

    /// Names of the arguments. The state is read before it is written.
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
                // A parameter that is nested or used often gets a name of its own.
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
                self.preferred_names[position] = vec![name.clone(), format!("{name}{suffix}")];
                self.assign(position, &text, real.c_name);
            } else {
                self.expressions[position] = Some(Expression { text, atomic: true });
            }
        }
        self.blank_line();
    }

    /// An unused name: that of the field if the number is one, else `t1`, `t2`, …
    pub(super) fn name(&mut self, position: usize) -> String {
        let preferred = std::mem::take(&mut self.preferred_names[position]);
        let numbered = preferred.last().cloned();
        let mut preferred = preferred.into_iter();
        for attempt in 2.. {
            let name = match (preferred.next(), &numbered) {
                (Some(name), _) => name,
                (None, Some(name)) => format!("{name}_{attempt}"),
                (None, None) => {
                    self.temporaries += 1;
                    format!("t{}", self.temporaries)
                }
            };
            if text::is_identifier(&name) && self.used_names.insert(name.clone()) {
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
