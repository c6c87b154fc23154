//! Cases of a study side by side: parameters to measures.

use std::ops::Range;

use super::Work;
use super::table::Row;
use crate::benchmark::run_abreast;
use stickslip_base::isolated::isolated;
use stickslip_base::preset::Preset;
use stickslip_base::{Error, Watch};

/// What is known so far of the measures of a manoeuvre in one case.
#[derive(Clone, Debug, Default)]
struct Found {
    /// Of each run that came to its end, its measures.
    measures: Vec<Vec<f64>>,
    runs: usize,
    /// Seeds of those that were stopped.
    stopped: Vec<String>,
}

/// What is known of a machine.
#[derive(Clone, Debug, Default)]
pub(super) struct Measured {
    /// Measures in their order, means over the seeds.
    pub(super) measures: Vec<Option<f64>>,
    /// Why some are missing.
    pub(super) failures: Vec<String>,
    /// Step of the virtual machine [s], where it was chosen.
    pub(super) step: Option<f64>,
    /// Share by which measures moved when it was last halved.
    pub(super) error: Option<f64>,
}

/// Rows of cases side by side. Where their computation panics, they are run one after the other: the case that does so has
/// what it said as its failure, the others the numbers that they have beside anybody.
///
/// # Errors
/// What `run` refuses.
pub(super) fn none_ends_others(
    cases: Range<u64>,
    run: impl Fn(Range<u64>) -> Result<Vec<Row>, Error>,
    lost: impl Fn(u64, String) -> Row,
) -> Result<Vec<Row>, Error> {
    if let Ok(rows) = isolated(|| run(cases.clone())) {
        return rows;
    }
    let mut rows = Vec::new();
    for case in cases {
        match isolated(|| run(case..case + 1)) {
            Ok(row) => rows.extend(row?),
            Err(words) => rows.push(lost(case, words)),
        }
    }
    Ok(rows)
}

impl Work {
    /// Runs cases one beside the other, counted from 0; what a case cannot do is said in its row. A row is a function of
    /// its case's number, whoever is beside it.
    ///
    /// # Errors
    /// [`Error::Cancelled`] alone.
    pub(super) fn rows(&self, cases: Range<u64>, watch: &Watch) -> Result<Vec<Row>, Error> {
        none_ends_others(cases, |cases| self.beside(cases, watch), |case, words| self.lost(case, &words))
    }

    /// The row of a case whose computation panicked.
    pub(super) fn lost(&self, case: u64, words: &str) -> Row {
        let unknown = |_| vec![f64::NAN; self.plan.axes.len()];
        Row {
            case: case + 1,
            values: isolated(|| self.plan.values(case)).unwrap_or_else(unknown),
            measures: self.plan.measures().map(|_| None).collect(),
            step: None,
            error: None,
            failure: Some(format!("the program failed: {words}. That is a fault of stickslip: please report it.")),
        }
    }

    fn beside(&self, cases: Range<u64>, watch: &Watch) -> Result<Vec<Row>, Error> {
        let plan = &self.plan;
        let empty = |case: u64| Row { case: case + 1, values: plan.values(case), ..Row::default() };
        let mut rows: Vec<Row> = cases.map(empty).collect();
        let (mut presets, mut at) = (Vec::new(), Vec::new());
        for (index, row) in rows.iter_mut().enumerate() {
            match self.preset(row.case - 1, &row.values) {
                Ok(preset) => {
                    presets.push(preset);
                    at.push(index);
                }
                Err(error) => {
                    row.measures = plan.measures().map(|_| None).collect();
                    row.failure = Some(error.to_string());
                }
            }
        }
        let found = match plan.tolerance {
            Some(tolerance) => self.settled(&presets, tolerance, watch)?,
            None => self.measured(&presets, watch)?,
        };
        for (place, Measured { measures, failures, step, error }) in at.into_iter().zip(found) {
            let failure = (!failures.is_empty()).then(|| failures.join("; "));
            let row = &mut rows[place];
            *row = Row { measures, step, error, failure, ..std::mem::take(row) };
        }
        Ok(rows)
    }

    /// The measures of machines side by side, each with the steps that it states.
    ///
    /// # Errors
    /// [`Error::Cancelled`] alone.
    pub(super) fn measured(&self, presets: &[Preset<f64>], watch: &Watch) -> Result<Vec<Measured>, Error> {
        let plan = &self.plan;
        let machines: Vec<_> = presets.iter().collect();
        let mut all = vec![Measured::default(); machines.len()];
        for manoeuvre in &plan.manoeuvres {
            let mut found = vec![Found::default(); machines.len()];
            for (_, seed, chance) in plan.runs().filter(|(other, ..)| other == manoeuvre) {
                let courses = run_abreast(&machines, *manoeuvre, seed, chance, watch)?;
                for (place, course) in courses.into_iter().enumerate() {
                    let found = &mut found[place];
                    found.runs += 1;
                    match course {
                        Ok(Some(course)) => found.measures.push(manoeuvre.judge(&course, machines[place], chance)),
                        Ok(None) => found.stopped.push(seed.to_string()),
                        Err(error) => {
                            let text = format!("{}: {error}", manoeuvre.name());
                            let told = &mut all[place].failures;
                            told.extend((!told.contains(&text)).then_some(text));
                        }
                    }
                }
            }
            for (place, Found { measures, runs, stopped }) in found.into_iter().enumerate() {
                if !stopped.is_empty() {
                    let which = if runs > 1 { format!(" with seed {}", stopped.join(", ")) } else { String::new() };
                    let what = "it did not follow, the supervision stopped it";
                    all[place].failures.push(format!("{}{which}: {what}", manoeuvre.name()));
                }
                // A mean over those that came to their end would hide the others.
                let whole = measures.len() == runs;
                for index in 0..manoeuvre.measures().len() {
                    let known = measures.iter().map(|values| values[index]).filter(|value| value.is_finite());
                    let (sum, count) = known.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
                    all[place].measures.push((whole && count > 0.0).then(|| sum / count));
                }
            }
        }
        Ok(all)
    }
}
