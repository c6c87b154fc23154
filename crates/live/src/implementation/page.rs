//! A block from inside: its diagram, its C, its size.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_codegen::diagram::{Diagram, Kind};

use stickslip_base::Error;
use stickslip_generate::Generated;

/// A page of the generated signal-flow diagram.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DiagramPage {
    /// Its file, as links between pages name it.
    pub page: String,
    /// What it shows.
    pub name: String,
    /// The picture; its boxes link to pages.
    pub svg: String,
    /// The functions in C, those that are called first.
    pub code: String,
    /// How much that is.
    pub size: BlockSize,
}

/// How large a block is, with all that it calls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BlockSize {
    /// Numbers among its parameters.
    pub parameters: usize,
    /// Numbers that it remembers.
    pub states: usize,
    /// Operations of a step.
    pub operations: usize,
    /// Lines of C.
    pub lines: usize,
}

impl DiagramPage {
    /// The page of this file.
    pub(super) fn of(generated: &Generated, page: &str) -> Result<Self, Error> {
        let diagram = Diagram::of(&generated.program, &generated.prefix);
        let number = (0..diagram.pages.len()).find(|number| diagram.file(*number) == page).ok_or_else(|| {
            let known: Vec<String> = (0..diagram.pages.len()).map(|number| diagram.file(number)).collect();
            Error::Unknown { what: "page of the diagram", name: page.into(), remedy: known.join(", ") }
        })?;
        let code = code(generated, &diagram, number);
        let step = diagram.pages[number].step;
        let operations = within(&diagram, number).iter().map(|page| diagram.pages[*page].step.graph.nodes.len()).sum();
        Ok(DiagramPage {
            page: page.into(),
            name: words(step.name),
            svg: generated.text(&format!("diagram/{page}")).unwrap_or_default().into(),
            size: BlockSize {
                parameters: step.parameters.numbers(),
                states: step.state.numbers(),
                operations,
                lines: code.lines().count(),
            },
            code,
        })
    }
}

/// A page and all below it, those that are called first.
fn within(diagram: &Diagram, page: usize) -> Vec<usize> {
    let mut all = vec![page];
    let mut next = 0;
    while let Some(&page) = all.get(next) {
        for node in &diagram.pages[page].nodes {
            if let Kind::Call { page, .. } = node.kind
                && !all.contains(&page)
            {
                all.push(page);
            }
        }
        next += 1;
    }
    all.sort_unstable();
    all
}

/// The functions of a page and of those that it calls.
fn code(generated: &Generated, diagram: &Diagram, page: usize) -> String {
    let Some(source) = generated.text(&format!("{}.c", generated.prefix)) else { return String::new() };
    let lines: Vec<&str> = source.lines().collect();
    let mut code = String::new();
    for page in within(diagram, page) {
        let name = function(generated, diagram, page);
        let Some(begin) = lines.iter().position(|line| line.starts_with(&format!("static void {name}("))) else {
            continue;
        };
        let end = lines[begin..].iter().position(|line| *line == "}").map_or(lines.len(), |length| begin + length + 1);
        for line in &lines[begin..end] {
            code += line;
            code.push('\n');
        }
        code.push('\n');
    }
    code
}

/// What the function of a page is called.
pub(super) fn function(generated: &Generated, diagram: &Diagram, page: usize) -> String {
    let prefix = &generated.prefix;
    if page + 1 == diagram.pages.len() {
        format!("{prefix}_raw_step")
    } else {
        format!("{prefix}_{}_step", diagram.pages[page].label)
    }
}

/// `VelocityObserver` as people write it.
pub(super) fn words(name: &str) -> String {
    let mut out = String::new();
    for (place, letter) in name.chars().enumerate() {
        if place > 0 && letter.is_uppercase() {
            out.push(' ');
            out.extend(letter.to_lowercase());
        } else {
            out.push(letter);
        }
    }
    out
}
