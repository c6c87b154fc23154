//! The full benchmark of the rendering laws.
//!
//!     cargo xtask study fidelity
//!
//! runs the benchmark of `stickslip fidelity` with default options and writes its tables into
//! `docs/studies/fidelity.md`, all numbers into `fidelity.csv`, and the figures into the folder of the guide. `--
//! FOLDER SEEDS` uses fewer noise seeds.

use std::fmt::Write as _;
use std::path::PathBuf;

use stickslip::fidelity::{Outcome, Row, Selection, run_plan};
use stickslip::{Error, Watch, output};

/// Folder of the guide's figures, relative to the folder of the studies.
const FIGURES: &str = "../src/figures/fidelity";

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/studies".into()));
    let seeds = arguments.next().and_then(|text| text.parse().ok());
    output::create_folder(&folder)?;
    let plan = Selection { seeds, ..Selection::default() }.plan()?;
    let outcome = run_plan(&plan, &Watch::silent())?;
    output::write(&folder.join("fidelity.csv"), csv(&outcome.rows))?;
    let figures = folder.join(FIGURES);
    output::create_folder(&figures)?;
    for (name, figure, _) in outcome.figures() {
        output::write(&figures.join(name), figure.svg())?;
    }
    output::write(&folder.join("fidelity.md"), page(&outcome))
}

fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "preset,wheel,rate_hz,mismatch,law,auto,scenario,difference,low95,high95,excess,floor,predicted,stable,observer\n",
    );
    for row in rows {
        let score = &row.score;
        let number = |value: f64| if value.is_nan() { String::new() } else { format!("{value:.5}") };
        let numbers = [score.difference, score.ci95[0], score.ci95[1], score.excess, score.floor, row.predicted];
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{}",
            row.preset,
            u8::from(row.wheel),
            row.rate,
            row.mismatch,
            row.law,
            u8::from(row.auto),
            score.measure,
            numbers.map(number).join(","),
            u8::from(score.stable),
            row.observer
        );
    }
    text
}

fn page(outcome: &Outcome) -> String {
    let mut text = format!(
        "# Difference between rendered and physical friction\n\n\
         The full benchmark of `stickslip fidelity`, {} noise seeds. The method is described in \
         [the chapter on fidelity](fidelity.md). Made by `cargo xtask study fidelity`; all numbers with their intervals are in \
         `fidelity.csv`.\n",
        outcome.plan.seeds.len()
    );
    for (caption, table) in outcome.tables() {
        let _ = write!(text, "\n## {caption}\n\n```text\n{}\n```\n", table.lines().join("\n"));
    }
    text
}
