//! The ranking of a comparison of controllers on a bench.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::COMPARISON;
use super::row::scaled;
use crate::benchmark::{BENCH, Manoeuvre, Outcome};
use stickslip_base::{Error, output};

/// A comparison of controllers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Comparison {
    /// Number of its run; 0: none yet.
    pub run: u64,
    /// Whether it is running.
    pub running: bool,
    /// Whether all controllers have completed all manoeuvres.
    pub complete: bool,
    /// The friction.
    pub friction: String,
    /// Number of repetitions.
    pub repetitions: u64,
    /// The measures, in the order of the values of a row.
    pub columns: Vec<RankColumn>,
    /// The controllers, the best first.
    pub rows: Vec<RankRow>,
    /// Results and notes, in sentences.
    pub remarks: Vec<String>,
}

/// A measure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RankColumn {
    /// Its title.
    pub title: String,
    /// The unit of its numbers.
    pub unit: String,
}

/// A controller of a comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RankRow {
    /// Its name.
    pub controller: String,
    /// First and last place within its interval; `null` without a rank.
    pub place: Option<[usize; 2]>,
    /// Deviations of the first chosen controller over its own, geometric mean of the tracking measures.
    pub factor: Option<f64>,
    /// 95 % interval of the factor over the repetitions.
    pub ci95: Option<[f64; 2]>,
    /// Number of failed runs.
    pub failures: usize,
    /// Mean and half of the 95 % interval of each measure.
    pub values: Vec<Option<[f64; 2]>>,
    /// Numbers of its trials, one for each manoeuvre.
    pub trials: Vec<u64>,
}

/// What a ranking states besides the outcome.
#[derive(Clone, Copy, Debug)]
pub struct Ranking<'a> {
    /// Number of its run.
    pub run: u64,
    /// The friction in words.
    pub friction: &'a str,
    /// Name of the active controller in the plan, and in words.
    pub active: (&'a str, &'a str),
    /// Numbers of the trials of each entrant.
    pub trials: &'a [Vec<u64>],
}

impl Ranking<'_> {
    /// The ranking of an outcome of [`run_on_bench`](crate::benchmark::run_on_bench).
    pub fn of(&self, outcome: &Outcome) -> Comparison {
        let plan = &outcome.plan;
        let measures: Vec<(Manoeuvre, usize)> = (plan.manoeuvres.iter())
            .flat_map(|manoeuvre| (0..manoeuvre.measures().len()).map(|index| (*manoeuvre, index)))
            .collect();
        let columns = measures.iter().map(|(manoeuvre, index)| {
            let measure = &manoeuvre.measures()[*index];
            RankColumn { title: measure.title.into(), unit: scaled(measure.unit).0.into() }
        });
        let ranks = outcome.ranks().into_iter().next().map_or(Vec::new(), |(_, ranks)| ranks);
        let rows = ranks.into_iter().map(|ranked| {
            let values = measures.iter().map(|(manoeuvre, index)| {
                let (value, [low, high]) = outcome.measured(BENCH, &ranked.entrant, *manoeuvre, *index)?;
                let factor = scaled(manoeuvre.measures()[*index].unit).1;
                Some([factor * value, 0.5 * factor * (high - low)])
            });
            let index = plan.entrants.iter().position(|entrant| entrant.name == ranked.entrant).unwrap_or(0);
            let is_finite = ranked.factor.is_finite();
            RankRow {
                values: values.collect(),
                trials: self.trials.get(index).cloned().unwrap_or_default(),
                place: ranked.place,
                factor: is_finite.then_some(ranked.factor),
                ci95: is_finite.then_some(ranked.ci95),
                failures: ranked.failures,
                controller: self.display(&ranked.entrant),
            }
        });
        Comparison {
            run: self.run,
            running: false,
            complete: outcome.complete,
            friction: self.friction.into(),
            repetitions: plan.seeds,
            columns: columns.collect(),
            rows: rows.collect(),
            remarks: outcome.remarks().into_iter().map(|remark| self.named(&remark)).collect(),
        }
    }

    fn display(&self, name: &str) -> String {
        if name == self.active.0 { format!("{} (active)", self.active.1) } else { name.replace('+', " + ") }
    }

    /// A remark about this bench.
    fn named(&self, remark: &str) -> String {
        remark.replace("bench friction", self.friction).replace(self.active.0, &self.display(self.active.0))
    }
}

impl Comparison {
    /// Writes it into the folder of its run.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        output::write(&folder.join(COMPARISON), serde_json::to_string(self).unwrap_or_default())
    }
}
