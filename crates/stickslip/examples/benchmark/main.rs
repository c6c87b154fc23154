//! The best controller for each friction: the whole benchmark on both machines, at two rates of control.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use stickslip::benchmark::{Entrant, HOUSE, Manoeuvre, Outcome, Plan, run_plan};
use stickslip::parameters::presets;
use stickslip::{Error, Preset, Watch, output};

/// Machines, and ticks of 4 kHz in a sample of the controller.
const CASES: [(&str, f64); 4] = [("prototype", 4.0), ("prototype", 1.0), ("clm-bench", 4.0), ("clm-bench", 1.0)];
/// Controllers held at set-points, and their number; controllers on ways of all lengths, and their number.
const HELD: [&str; 2] = ["pid+hold", "state-feedback+hold"];
const PLACES: u64 = 200;
const SENT: [&str; 5] = ["pid", "cascade+feedforward", "state-feedback", "state-feedback+feedforward", "mpc"];
const WAYS: u64 = 24;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "docs/studies".into()));
    // Finished cells are stored, so that an interrupted study can be resumed.
    let cells = std::env::temp_dir().join("stickslip-benchmark");
    let mut page = String::from(
        "# Ranking of the built-in controllers\n\n\
         All controllers of `stickslip benchmark`, tuned by the same rules for machine and rate, on all frictions and \
         manoeuvres: six seeds, twelve held set-points, all deviations of the machine.\n\n\
         Made by `cargo xtask study benchmark`.\n",
    );
    for (machine, divider) in CASES {
        let cells = cells.join(format!("{machine}-{divider}"));
        let outcome = compare(machine, divider, &HOUSE, None, &cells)?;
        let rate = outcome.plan.preset.bench.tick_rate / divider / 1e3;
        write!(page, "\n## {machine}, control at {rate} kHz\n\n{}\n", outcome.remarks().join(" "))?;
        for (caption, table) in outcome.tables().into_iter().chain(outcome.robustness()) {
            write!(page, "\n{}", table.caption(caption).markdown())?;
        }
        for (intro, names, manoeuvre, places) in [
            (format!("{PLACES} held set-points, each with other noise:"), &HELD[..], Manoeuvre::Hold, PLACES),
            (
                format!("{WAYS} ways from 10 µm to 100 mm, as fast as half of the torque permits:"),
                &SENT[..],
                Manoeuvre::Strokes,
                WAYS,
            ),
        ] {
            let outcome = compare(machine, divider, names, Some((manoeuvre, places)), &cells.join(manoeuvre.name()))?;
            write!(page, "\n{intro}\n")?;
            for (caption, table) in outcome.tables() {
                write!(page, "\n{}", table.caption(caption).markdown())?;
            }
        }
        // Finished results are stored before the rest.
        output::write(&folder.join("benchmark.md"), &page)?;
    }
    Ok(())
}

/// Some controllers on a machine: in all manoeuvres, or in one manoeuvre with a number of runs.
fn compare(
    machine: &str,
    divider: f64,
    names: &[&str],
    only: Option<(Manoeuvre, u64)>,
    cells: &Path,
) -> Result<Outcome, Error> {
    let mut preset: Preset<f64> = presets::find(machine)?.read()?;
    preset.bench.control_divider = divider;
    let entrants = names.iter().map(|name| Entrant::find(name)).collect::<Result<_, _>>()?;
    let mut plan = Plan::new(machine, preset, entrants);
    if let Some((manoeuvre, places)) = only {
        plan = Plan { manoeuvres: vec![manoeuvre], places, variations: Vec::new(), ..plan };
    }
    let outcome = run_plan(&plan, cells, &Watch::silent())?;
    eprintln!("{machine}, every {divider} ticks: {} cells", outcome.cells.len());
    Ok(outcome)
}
