//! The compared laws, and the width around standstill of some of them.

use super::cell::Machine;
use super::scenario::CLOSED_LOOP;
use super::{Cell, Role, Runs, Score, scores};
use stickslip_base::Error;
use stickslip_base::preset::{LawChoice, Residual, Tracking};

/// All laws with their stable names.
pub const LAWS: &[(&str, LawChoice<f64>)] = &[
    (PAPER, LawChoice::Paper),
    ("smooth", LawChoice::Smooth),
    ("karnopp", LawChoice::Karnopp),
    ("bristle", LawChoice::Bristle),
    ("residual", LawChoice::Residual(Residual { missing_torque: 0.03 })),
    ("residual_slow", LawChoice::Residual(Residual { missing_torque: 0.01 })),
    ("admittance", LawChoice::Admittance(Tracking { bandwidth: 350.0, missing_torque: 0.1 })),
    ("admittance_slow", LawChoice::Admittance(Tracking { bandwidth: 350.0, missing_torque: 0.02 })),
];

/// The reference law.
pub const PAPER: &str = "paper";
/// Name of the law that the bench selects before the run.
pub const AUTO: &str = "auto";

/// Tested half widths of the fade-out [rad/s].
pub const WIDTHS: [f64; 6] = [0.02, 0.05, 0.1, 0.2, 0.3, 0.5];
/// Seed of that search, not used by any comparison.
pub const SEARCH_SEED: u64 = 1000;

/// The names for a selection.
pub fn law_names() -> impl Iterator<Item = &'static str> {
    LAWS.iter().map(|(name, _)| *name).chain([AUTO])
}

/// Whether a law has a width around standstill: the fade-out, or its counterpart.
pub fn has_width(name: &str) -> bool {
    [PAPER, "smooth", "karnopp"].contains(&name)
}

/// Runs of the search for the width of one law.
pub fn search_runs() -> usize {
    WIDTHS.len() * CLOSED_LOOP.len()
}

/// The cell with a law of this name; a law with a width gets the best one for this machine, mismatch included, found by
/// `search` against A and A0.
pub fn with_law(cell: &Cell, name: &str, search: impl FnOnce(&Cell) -> Result<f64, Error>) -> Result<Cell, Error> {
    let mut cell = cell.clone();
    if let Some((_, choice)) = LAWS.iter().find(|(other, _)| *other == name) {
        cell.preset.bench.law = *choice;
    }
    if has_width(name) {
        cell.preset.bench.fade_velocity = search(&cell)?;
    }
    prepare(&mut cell)?;
    Ok(cell)
}

/// Designs the law named by the bench of a cell.
///
/// # Errors
/// As [`rendering_law`](crate::rendering_law).
pub fn prepare(cell: &mut Cell) -> Result<(), Error> {
    cell.law = crate::rendering_law(&cell.preset.model, &cell.preset.bench)?;
    Ok(())
}

/// A and A0 in closed loop with the seed of the search.
pub fn search_references(cell: &Cell, threads: usize, done: &Done) -> Result<[Runs; 2], Error> {
    let of = |role| Machine { cell, role, seeds: &[SEARCH_SEED] };
    let mut runs = Runs::of_all(&[of(Role::Desired), of(Role::Own)], CLOSED_LOOP, threads, done)?;
    let own = runs.remove(1);
    Ok([runs.remove(0), own])
}

/// Called after each run; its error ends the work.
pub type Done<'a> = dyn Fn() -> Result<(), Error> + Sync + 'a;

/// The half width of the fade-out [rad/s] with the least mean difference over all measures in closed loop; the smaller
/// of equal ones.
pub fn best_width(cell: &Cell, references: &[Runs; 2], threads: usize, done: &Done) -> Result<f64, Error> {
    let [a, a0] = references;
    let with = |width| {
        let mut cell = cell.clone();
        cell.preset.bench.fade_velocity = width;
        prepare(&mut cell)?;
        Ok(cell)
    };
    let cells = WIDTHS.into_iter().map(with).collect::<Result<Vec<Cell>, Error>>()?;
    let of = |cell| Machine { cell, role: Role::Rendered, seeds: &[SEARCH_SEED] };
    let machines: Vec<Machine<'_>> = cells.iter().map(of).collect();
    let mut best = (f64::INFINITY, WIDTHS[0]);
    for (b, width) in Runs::of_all(&machines, CLOSED_LOOP, threads, done)?.iter().zip(WIDTHS) {
        let badness: f64 = scores(b, a, a0).iter().map(badness).sum();
        if badness < best.0 {
            best = (badness, width);
        }
    }
    Ok(best.1)
}

/// A difference between 0 and 1; counts by their share, 1 without a value.
pub(super) fn badness(score: &Score) -> f64 {
    let share = if score.measure.ends_with("count") { score.reference.max(1.0) } else { 1.0 };
    let difference = score.difference / share;
    // Not `min` alone: an unstable run is the worst.
    if difference.is_nan() { 1.0 } else { difference.min(1.0) }
}
