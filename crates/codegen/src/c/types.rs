//! Structs of C from the tables of the fields.

use super::prose::{comment, plain};
use super::text::{identifier, number};
use crate::record::Real;
use crate::tree::{Member, Tree};

/// The structs that have a name.
#[derive(Default)]
pub(super) struct Types {
    names: Vec<(String, Tree)>,
}

impl Types {
    /// Gives a struct a name, unless an equal one has a name.
    pub(super) fn register(&mut self, name: String, tree: &Tree) {
        if tree.numbers() > 0 && self.name(tree).is_none() {
            self.names.push((name, tree.clone()));
        }
    }

    /// The name of a struct.
    pub(super) fn name(&self, tree: &Tree) -> Option<&str> {
        self.names.iter().find(|(_, other)| other == tree).map(|(name, _)| name.as_str())
    }

    /// The definition of a struct and of the named ones within, without those in `defined`.
    pub(super) fn define(&self, real: Real, tree: &Tree, defined: &mut Vec<String>) -> String {
        let mut out = String::new();
        for (path, _, part) in tree.parts() {
            if !path.is_empty() && self.name(part).is_some() {
                out += &self.define(real, part, defined);
            }
        }
        if let Some(name) = self.name(tree).map(String::from)
            && !defined.contains(&name)
        {
            out += &format!("typedef struct {{\n{}}} {name};\n\n", self.members(real, tree, "    "));
            defined.push(name);
        }
        out
    }

    fn members(&self, real: Real, tree: &Tree, indent: &str) -> String {
        tree.members().iter().map(|member| self.member(real, member, indent)).collect()
    }

    fn member(&self, real: Real, member: &Member, indent: &str) -> String {
        // C has no struct without members.
        if member.tree.numbers() == 0 {
            return String::new();
        }
        let mut element = &member.tree;
        let mut lengths = String::new();
        while let Tree::List(length, inner) = element {
            lengths += &format!("[{length}]");
            element = inner;
        }
        let declared = match (element, self.name(element)) {
            (_, Some(name)) => name.to_string(),
            (Tree::Group(_), None) => {
                format!("struct {{\n{}{indent}}}", self.members(real, element, &format!("{indent}    ")))
            }
            _ => real.c_name.to_string(),
        };
        let about = comment(indent, &describe(member, element));
        format!("{about}{indent}{declared} {}{lengths};\n", identifier(&member.name))
    }
}

/// Help, then symbol, unit, range and default.
fn describe(member: &Member, element: &Tree) -> Vec<String> {
    let field = member.field;
    let mut out: Vec<String> = plain(field.help);
    match element {
        Tree::Number => {
            let mut facts = Vec::new();
            if !field.unit.is_empty() {
                facts.push(format!("{} [{}]", field.symbol, field.unit).trim().to_string());
            }
            if field.minimum.is_finite() || field.maximum.is_finite() {
                facts.push(super::check::values(field));
                if field.default != 0.0 {
                    facts.push(format!("default {}", number(field.default)));
                }
            }
            out.push(facts.join(", "));
        }
        Tree::Group(group) => out.extend(group.chosen.iter().map(|(tag, name)| format!("{tag}: {name}"))),
        Tree::List(..) => {}
    }
    out
}
