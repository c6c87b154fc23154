//! Cases of a study side by side: from parameters to measures.

use std::ops::Range;

use super::Work;
use super::table::Row;
use crate::benchmark::{Lane, run_in_lanes};
use stickslip_base::isolated::isolated;
use stickslip_base::preset::Preset;
use stickslip_base::{Error, Watch};

/// Intermediate results of the measures of a manoeuvre in one case.
#[derive(Clone, Debug, Default)]
struct Partial {
    /// Measures of each completed run.
    measures: Vec<Vec<f64>>,
    runs: usize,
    /// Seeds of the stopped runs.
    stopped: Vec<String>,
}

/// Measures of a machine.
#[derive(Clone, Debug, Default)]
pub(super) struct Measured {
    /// Measures in their order, means over the seeds.
    pub(super) measures: Vec<Option<f64>>,
    /// Reasons for missing measures.
    pub(super) failures: Vec<String>,
    /// Step of the virtual machine [s], where the tolerance selected it.
    pub(super) step: Option<f64>,
    /// Share by which measures moved when it was last halved.
    pub(super) error: Option<f64>,
}

/// Rows of cases side by side. If their computation panics, they run one after the other: the panicking case has the
/// message as its failure, the others have the same numbers as before.
///
/// # Errors
/// Errors of `run`.
pub(super) fn isolate_panics(
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
    /// Runs cases side by side, counted from 0; the failure of a case is in its row. A row is a function of the number
    /// of its case alone.
    ///
    /// # Errors
    /// [`Error::Cancelled`] alone.
    pub(super) fn rows(&self, cases: Range<u64>, watch: &Watch) -> Result<Vec<Row>, Error> {
        isolate_panics(cases, |cases| self.beside(cases, watch), |case, words| self.lost(case, &words))
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
            failure: Some(format!("internal error: {words}. Please report it.")),
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
        let measured = match plan.tolerance {
            Some(tolerance) => self.settled(&presets, tolerance, watch)?,
            None => self.measured(&presets, watch)?,
        };
        for (place, Measured { measures, failures, step, error }) in at.into_iter().zip(measured) {
            let failure = (!failures.is_empty()).then(|| failures.join("; "));
            let row = &mut rows[place];
            *row = Row { measures, step, error, failure, ..std::mem::take(row) };
        }
        Ok(rows)
    }

    /// Measures of machines side by side, each with its own steps.
    ///
    /// # Errors
    /// [`Error::Cancelled`] alone.
    pub(super) fn measured(&self, presets: &[Preset<f64>], watch: &Watch) -> Result<Vec<Measured>, Error> {
        let plan = &self.plan;
        let mut all = vec![Measured::default(); presets.len()];
        for manoeuvre in &plan.manoeuvres {
            let mut partial = vec![Partial::default(); presets.len()];
            for (_, seed, chance) in plan.runs().filter(|(other, ..)| other == manoeuvre) {
                let lane = |preset| Lane { preset, manoeuvre: *manoeuvre, seed, chance, long_steps: true };
                let lanes: Vec<Lane<'_>> = presets.iter().map(lane).collect();
                let courses = run_in_lanes(&lanes, watch)?;
                for (place, course) in courses.into_iter().enumerate() {
                    let partial = &mut partial[place];
                    partial.runs += 1;
                    match course {
                        Ok(Some(course)) => partial.measures.push(manoeuvre.judge(&course, &presets[place], chance)),
                        Ok(None) => partial.stopped.push(seed.to_string()),
                        Err(error) => {
                            let text = format!("{}: {error}", manoeuvre.name());
                            let failures = &mut all[place].failures;
                            failures.extend((!failures.contains(&text)).then_some(text));
                        }
                    }
                }
            }
            for (place, Partial { measures, runs, stopped }) in partial.into_iter().enumerate() {
                if !stopped.is_empty() {
                    let seeds = if runs > 1 { format!(" with seed {}", stopped.join(", ")) } else { String::new() };
                    let what = "the supervision stopped it, since it did not follow the set-point";
                    all[place].failures.push(format!("{}{seeds}: {what}", manoeuvre.name()));
                }
                // A mean over the completed runs alone would hide the stopped ones.
                let whole = measures.len() == runs;
                for index in 0..manoeuvre.measures().len() {
                    let finite = measures.iter().map(|values| values[index]).filter(|value| value.is_finite());
                    let (sum, count) = finite.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
                    all[place].measures.push((whole && count > 0.0).then(|| sum / count));
                }
            }
        }
        Ok(all)
    }
}
