//! The page of a report: title block, numbered figures and tables, provenance; for screen, phone, paper and no script.

use super::{Key, Provenance, Report, Section, figure, map};
use crate::figure::symbol::{self, escape};
use crate::figure::theme;
use crate::quantity::Written;

/// Inter if installed, otherwise the system's font: a font in the page would add 70 kB.
const STYLE: &str = include_str!("style.css");
/// Read-out of values and export. The page is complete without it.
const SCRIPT: &str = include_str!("script.js");

/// Writes the whole page.
pub(super) fn page(report: &Report) -> String {
    let (title, title_text) = (symbol::html(&report.title), escape(&report.title));
    let summary = match report.summary.as_str() {
        "" => String::new(),
        text => format!("<p class=\"summary\">{}</p>\n", symbol::html(text)),
    };
    let parts = report.sections.iter().any(|section| matches!(section, Section::Part(_)));
    let (mut tables, mut figures) = (0, 0);
    let count = |number: &mut usize| {
        *number += 1;
        *number
    };
    let body: String = report
        .sections
        .iter()
        .map(|section| match section {
            Section::Part(text) => format!("<h2 class=\"part\">{}</h2>\n", symbol::html(text)),
            Section::Heading(text) if parts => format!("<h3>{}</h3>\n", symbol::html(text)),
            Section::Heading(text) => format!("<h2>{}</h2>\n", symbol::html(text)),
            Section::Paragraph(text) => format!("<p>{}</p>\n", symbol::html(text)),
            Section::List(items) => {
                let items: String = items.iter().map(|item| format!("<li>{}</li>\n", symbol::html(item))).collect();
                format!("<ul>\n{items}</ul>\n")
            }
            Section::Table(table) => table.html(count(&mut tables)),
            Section::Figure { figure, caption } => figure::html(figure, caption, count(&mut figures)),
            Section::Map { map, caption } => map::html(map, caption, count(&mut figures)),
        })
        .collect();
    let provenance: String = report.provenance.iter().map(origin).collect();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title_text}</title>\n\
         <style>\n{STYLE}{}{}</style>\n</head>\n<body>\n<main>\n<header>\n<h1>{title}</h1>\n{summary}{}</header>\n{body}\
         <footer>\n<h2>Where this comes from</h2>\n{provenance}</footer>\n</main>\n<script>\n{SCRIPT}</script>\n</body>\n\
         </html>\n",
        colours(),
        running_head(&report.title),
        key(&report.key),
    )
}

fn key(numbers: &[Key]) -> String {
    let entry = |Key { name, number }: &Key| {
        let Written { value, half_width, unit } = number.written();
        let half_width = if half_width.is_empty() { half_width } else { format!(" <span>± {half_width}</span>") };
        let unit = if unit.is_empty() { unit } else { format!(" <span>{}</span>", escape(&unit)) };
        format!("<div><dt>{}</dt><dd>{value}{half_width}{unit}</dd></div>\n", symbol::html(name))
    };
    match numbers {
        [] => String::new(),
        numbers => format!("<dl class=\"key\">\n{}</dl>\n", numbers.iter().map(entry).collect::<String>()),
    }
}

fn origin(Provenance { command, version, commit, seed, parameters }: &Provenance) -> String {
    let line = |name: &str, value: String| format!("<dt>{name}</dt><dd>{value}</dd>\n");
    let commit = commit.as_ref().map(|commit| format!(", commit {}", escape(commit))).unwrap_or_default();
    let seed = seed.map(|seed| line("Seed", seed.to_string())).unwrap_or_default();
    format!(
        "<dl>\n{}{}{seed}</dl>\n<details>\n<summary>Parameters</summary>\n<pre tabindex=\"0\">{}</pre>\n</details>\n",
        line("Command", format!("<code>{}</code>", escape(command))),
        line("Program", format!("stickslip {}{commit}", escape(version))),
        escape(parameters)
    )
}

/// The title at the head of each printed page, the page number at its foot.
fn running_head(title: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || " .,:;·()+−-".contains(letter);
    let title: String = title.chars().map(|letter| if plain(letter) { letter } else { ' ' }).collect();
    format!("@page{{@top-left{{content:\"{title}\"}}}}\n")
}

/// The page's colours; figures take theirs from the classes of their elements. Paper is always light.
fn colours() -> String {
    let list = |dark: bool| -> String {
        let value = |colour: &theme::Colour| if dark { colour.dark } else { colour.light };
        theme::COLOURS.iter().map(|colour| format!("--{}:{};", colour.class, value(colour))).collect()
    };
    let classes: String = theme::COLOURS.iter().map(|colour| rule(colour.class)).collect();
    let rim = "svg .rim{stroke:var(--surface)}\n";
    format!(
        ":root{{{}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{}}}}}\n{classes}{rim}",
        list(false),
        list(true)
    )
}

fn rule(class: &str) -> String {
    let property = match class {
        "grid" | "axis" => "stroke",
        "surface" | "ink" | "text-2" | "text-3" | "interval" => "fill",
        _ => "color",
    };
    format!("svg .{class}{{{property}:var(--{class})}}\n")
}
