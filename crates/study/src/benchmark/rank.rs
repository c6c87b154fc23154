//! Ranks of the entrants, and their confidence.

use super::{CellResult, Manoeuvre, Outcome, VARIATIONS};
use stickslip_base::statistics::{bootstrap, mean};

/// Result of an entrant on one friction.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranked {
    /// Name of the entrant.
    pub entrant: String,
    /// First and last place within its interval; equal where no interval overlaps. `None` where it failed in tracking.
    pub place: Option<[usize; 2]>,
    /// Deviations of the reference over its own, geometric mean over all tracking measures: 2 is half the deviation.
    pub factor: f64,
    /// 95 % interval of the factor over the seeds.
    pub ci95: [f64; 2],
    /// Failed runs, all manoeuvres together.
    pub failures: usize,
}

/// The entrants on a friction, the best first, failed ones last.
pub fn rank(outcome: &Outcome, friction: &str) -> Vec<Ranked> {
    let nominal = |cell: &&CellResult| cell.friction == friction && cell.variation == VARIATIONS[0].name;
    let cells: Vec<&CellResult> = outcome.cells.iter().filter(nominal).collect();
    let Some(reference) = cells.iter().find(|cell| cell.entrant == outcome.plan.entrants[0].name) else {
        return Vec::new();
    };
    let measures: Vec<(Manoeuvre, usize)> = outcome
        .plan
        .manoeuvres
        .iter()
        .flat_map(|manoeuvre| {
            let ranks = manoeuvre.measures().iter().enumerate().filter(|(_, measure)| measure.ranks);
            ranks.map(|(index, _)| (*manoeuvre, index))
        })
        .collect();
    let seeds = outcome.plan.seeds as usize;
    let mut ranked: Vec<Ranked> = cells
        .iter()
        .map(|cell| {
            let values: Vec<[Vec<f64>; 2]> =
                measures.iter().map(|&(m, index)| [reference.values(m, index), cell.values(m, index)]).collect();
            // The same seeds for both: common effects of the noise cancel.
            let factor = |drawn: &[usize]| {
                let logs = values.iter().map(|[of, own]| {
                    let of_all = |values: &[f64]| mean(drawn.iter().map(|&k| values[k]));
                    libm::log(of_all(of) / of_all(own))
                });
                libm::exp(mean(logs))
            };
            let all: Vec<usize> = (0..seeds).collect();
            let factor_of_all = if measures.is_empty() { f64::NAN } else { factor(&all) };
            let ci95 = if factor_of_all.is_nan() { [f64::NAN; 2] } else { bootstrap(seeds, factor) };
            let failures = cell.failures();
            Ranked { entrant: cell.entrant.clone(), place: None, factor: factor_of_all, ci95, failures }
        })
        .collect();
    // NaN sorts last.
    ranked.sort_by(|one, other| {
        let finite = |it: &Ranked| if it.factor.is_nan() { f64::NEG_INFINITY } else { it.factor };
        finite(other).total_cmp(&finite(one))
    });
    let intervals: Vec<[f64; 2]> = ranked.iter().map(|it| it.ci95).collect();
    for it in ranked.iter_mut().filter(|it| it.factor.is_finite()) {
        let [low, high] = it.ci95;
        let better = intervals.iter().filter(|other| other[0] > high).count();
        let not_worse = intervals.iter().filter(|other| other[1] >= low).count();
        it.place = Some([better + 1, not_worse.max(better + 1)]);
    }
    ranked
}
