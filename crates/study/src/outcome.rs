//! Results of a study: its rows, and statistics over all of them.

use super::pictures::{Picture, Sensitivity};
use super::table::{CASE, Columns, Row, each};
use super::{Outcome, Plan};
use crate::benchmark::Measure;
use stickslip_base::quantity::{Estimate, rough, tied};
use stickslip_base::table::Column;
use stickslip_base::{Error, Summary};

/// A measure over all cases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub(super) measure: &'static Measure,
    /// Cases with a finite number.
    pub(super) known: u64,
    sum: f64,
    /// Smallest number and its case.
    pub(super) smallest: (f64, u64),
    /// Largest number and its case.
    pub(super) largest: (f64, u64),
}

impl Range {
    /// Mean over the cases with a finite number.
    pub(super) fn mean(&self) -> f64 {
        self.sum / self.known as f64
    }
}

/// Errors of all cases, where the tolerance selected their steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Accuracy {
    pub(super) tolerance: f64,
    /// Cases whose measures still moved by more than the tolerance.
    pub(super) beyond: u64,
    /// Largest error, and its case.
    pub(super) worst: (f64, u64),
    /// Shortest and longest step [s].
    pub(super) steps: [f64; 2],
}

/// Statistics over all cases.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Overview {
    pub(super) ranges: Vec<Range>,
    pub(super) accuracy: Option<Accuracy>,
    /// Cases with a failure.
    pub(super) failed: u64,
    /// Reasons in order of occurrence, with their first case and the number of further cases.
    pub(super) reasons: Vec<(String, u64, u64)>,
}

/// Largest number of listed reasons.
const REASONS: usize = 8;

impl Overview {
    fn new(plan: &Plan) -> Self {
        let range = |measure| Range {
            measure,
            known: 0,
            sum: 0.0,
            smallest: (f64::INFINITY, 0),
            largest: (f64::NEG_INFINITY, 0),
        };
        let accuracy =
            |tolerance| Accuracy { tolerance, beyond: 0, worst: (f64::NEG_INFINITY, 0), steps: [f64::INFINITY, 0.0] };
        Overview {
            ranges: plan.measures().map(range).collect(),
            accuracy: plan.tolerance.map(accuracy),
            failed: 0,
            reasons: Vec::new(),
        }
    }

    fn add(&mut self, row: &Row) {
        for (range, value) in self.ranges.iter_mut().zip(&row.measures) {
            let Some(value) = *value else { continue };
            range.known += 1;
            range.sum += value;
            if value < range.smallest.0 {
                range.smallest = (value, row.case);
            }
            if value > range.largest.0 {
                range.largest = (value, row.case);
            }
        }
        if let (Some(accuracy), Some(step), Some(error)) = (&mut self.accuracy, row.step, row.error) {
            accuracy.beyond += u64::from(error > accuracy.tolerance);
            accuracy.steps = [accuracy.steps[0].min(step), accuracy.steps[1].max(step)];
            if error > accuracy.worst.0 {
                accuracy.worst = (error, row.case);
            }
        }
        let Some(reason) = &row.failure else { return };
        self.failed += 1;
        // Numbers differ from case to case; the words before them identify the reason.
        let kind = |text: &str| text.chars().filter(|letter| !letter.is_ascii_digit()).take(40).collect::<String>();
        match self.reasons.iter().position(|(other, ..)| kind(other) == kind(reason)) {
            Some(index) => self.reasons[index].2 += 1,
            None if self.reasons.len() < REASONS => self.reasons.push((reason.clone(), row.case, 0)),
            None => {}
        }
    }
}

/// Results of a study: numbers, sentences, pictures, computed once from its rows.
#[derive(Clone, Debug)]
pub struct Findings {
    pub(super) outcome: Outcome,
    pub(super) overview: Overview,
    pub(super) sensitivities: Vec<Sensitivity>,
    pub(super) pictures: Vec<Picture>,
}

impl Outcome {
    /// Calls with all rows, one group at a time.
    pub(super) fn each(&self, mut take: impl FnMut(&Row)) -> Result<(), Error> {
        each(&self.file, &Columns::of(&self.plan), |rows| rows.iter().for_each(&mut take))
    }

    /// The rows as columns: the number of the case from 1, the axes, the measures, and, with a tolerance, the step and
    /// its error; NaN for missing numbers.
    ///
    /// # Errors
    /// [`Error::File`], and [`Error::Recording`] where the file of the study has changed.
    pub fn columns(&self) -> Result<Vec<Column>, Error> {
        let named = Columns::of(&self.plan);
        let empty = |(name, unit): (&str, &str)| Column { name: name.into(), unit: unit.into(), values: Vec::new() };
        let mut columns: Vec<Column> = std::iter::once((CASE, "1")).chain(named.named()).map(empty).collect();
        self.each(|row| {
            let optional = (0..).map(|index| row.optional(index).unwrap_or(f64::NAN));
            let values = std::iter::once(row.case as f64).chain(row.values.iter().copied()).chain(optional);
            columns.iter_mut().zip(values).for_each(|(column, value)| column.values.push(value));
        })?;
        Ok(columns)
    }

    /// Failed cases with their reasons.
    ///
    /// # Errors
    /// As [`columns`](Self::columns).
    pub fn failures(&self) -> Result<Vec<(u64, String)>, Error> {
        let mut failures = Vec::new();
        self.each(|row| failures.extend(row.failure.clone().map(|reason| (row.case, reason))))?;
        Ok(failures)
    }

    /// Statistics, sentences and pictures of all rows.
    ///
    /// # Errors
    /// As [`columns`](Self::columns).
    pub fn findings(&self) -> Result<Findings, Error> {
        let mut overview = Overview::new(&self.plan);
        self.each(|row| overview.add(row))?;
        let (sensitivities, pictures) = (self.sensitivities()?, self.pictures()?);
        Ok(Findings { outcome: self.clone(), overview, sensitivities, pictures })
    }
}

impl Findings {
    /// The numbers under their stable names, and a row for each measure.
    pub fn summary(&self) -> Summary {
        let Findings { outcome, overview, sensitivities, .. } = self;
        let mut summary = Summary::new("study");
        summary.result("study.cases", outcome.cases as f64, "1").result(
            "study.failed_cases",
            overview.failed as f64,
            "1",
        );
        if let Some(Accuracy { tolerance, beyond, worst, steps }) = overview.accuracy {
            summary.result("study.tolerance", tolerance, "1").result(
                "study.cases_beyond_tolerance",
                beyond as f64,
                "1",
            );
            if worst.1 > 0 {
                summary.result("study.largest_step_error", worst.0, "1");
                summary.result("study.shortest_step", steps[0], "s").result("study.longest_step", steps[1], "s");
            }
        }
        for range in &overview.ranges {
            summary.row([
                ("kind", "measure".into()),
                ("measure", range.measure.name.into()),
                ("unit", range.measure.unit.into()),
                ("known", range.known.into()),
                ("mean", range.mean().into()),
                ("smallest", range.smallest.0.into()),
                ("smallest_case", range.smallest.1.into()),
                ("largest", range.largest.0.into()),
                ("largest_case", range.largest.1.into()),
            ]);
        }
        for sensitivity in sensitivities {
            sensitivity.rows(&mut summary);
        }
        summary
    }

    /// Main results, in sentences.
    pub fn sentences(&self) -> String {
        let Findings { outcome, overview, .. } = self;
        let count = |count: u64, one: &str, many: &str| format!("{count} {}", if count == 1 { one } else { many });
        let mut sentences = vec![format!("{} on {}.", count(outcome.cases, "case", "cases"), outcome.plan.machine)];
        for range in overview.ranges.iter().filter(|range| range.known > 0) {
            let quantity = |value: f64| tied(&Estimate::new(value, range.measure.unit));
            sentences.push(format!(
                "{}: {} (case {}) to {} (case {}).",
                range.measure.title,
                quantity(range.smallest.0),
                range.smallest.1,
                quantity(range.largest.0),
                range.largest.1
            ));
        }
        sentences.extend(self.accuracy());
        if overview.failed > 0 {
            sentences.push(format!("{} failed; see the column failure.", count(overview.failed, "case", "cases")));
        }
        sentences.join(" ")
    }

    /// Accuracy of the selected steps, in a sentence.
    fn accuracy(&self) -> Option<String> {
        let Accuracy { tolerance, beyond, worst, steps } = self.overview.accuracy.filter(|it| it.worst.1 > 0)?;
        let percent = |share: f64| format!("{} %", rough(100.0 * share));
        let microseconds = |step: f64| rough(1e6 * step);
        let [shortest, longest] = steps.map(microseconds);
        let of = if shortest == longest { shortest } else { format!("{shortest} to {longest}") };
        let all = format!("Steps of {of} µs; doubling them changes");
        Some(match beyond {
            0 => format!("{all} no measure by more than {} (tolerance: {}).", percent(worst.0), percent(tolerance)),
            beyond => format!(
                "{all} the measures by up to {} (case {}). In {beyond} of the cases that exceeds the tolerance of {}, \
                 and finer steps did not reduce it: where noise or single counts dominate, use means over more seeds.",
                percent(worst.0),
                worst.1,
                percent(tolerance)
            ),
        })
    }
}
