//! The interior of a block: its diagram, its C code, its size.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_codegen::diagram::{Diagram, Kind};

use stickslip_base::Error;
use stickslip_generate::Generated;

/// A page of the generated signal-flow diagram.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DiagramPage {
    /// Its file, as in links between pages.
    pub page: String,
    /// Name of the shown block.
    pub name: String,
    /// The picture; its boxes link to pages.
    pub svg: String,
    /// The functions in C; called functions come first.
    pub code: String,
    /// Size of the block.
    pub size: BlockSize,
}

/// Size of a block, with all called blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BlockSize {
    /// Number of parameters.
    pub parameters: usize,
    /// Number of state variables.
    pub states: usize,
    /// Number of operations in a step.
    pub operations: usize,
    /// Number of lines of C.
    pub lines: usize,
}

impl DiagramPage {
    /// The page of this file.
    pub(super) fn of(generated: &Generated, page: &str) -> Result<Self, Error> {
        let diagram = Diagram::of(&generated.program, &generated.prefix);
        let number = (0..diagram.pages.len()).find(|number| diagram.file(*number) == page).ok_or_else(|| {
            let files: Vec<String> = (0..diagram.pages.len()).map(|number| diagram.file(number)).collect();
            let remedy = format!("Available: {}.", files.join(", "));
            Error::Unknown { what: "page of the diagram", name: page.into(), remedy }
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

/// A page and all pages below it; called pages come first.
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

/// The functions of a page and of all called pages.
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

/// Name of the function of a page.
pub(super) fn function(generated: &Generated, diagram: &Diagram, page: usize) -> String {
    let prefix = &generated.prefix;
    if page + 1 == diagram.pages.len() {
        format!("{prefix}_raw_step")
    } else {
        format!("{prefix}_{}_step", diagram.pages[page].label)
    }
}

/// `VelocityObserver` as `Velocity observer`.
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
