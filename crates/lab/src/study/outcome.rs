//! What a study came to: the numbers over all of its cases.

use super::table::{Columns, Row, each};
use super::{Outcome, Plan};
use crate::benchmark::Measure;
use crate::quantity::{Estimate, tied};
use crate::{Error, Summary};

/// A measure over all cases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub(super) measure: &'static Measure,
    /// Cases that have a number.
    pub(super) known: u64,
    sum: f64,
    /// Smallest number and its case.
    pub(super) smallest: (f64, u64),
    /// Largest number and its case.
    pub(super) largest: (f64, u64),
}

impl Range {
    /// Mean over the cases that have a number.
    pub(super) fn mean(&self) -> f64 {
        self.sum / self.known as f64
    }
}

/// What is known of all cases together.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Overview {
    pub(super) ranges: Vec<Range>,
    /// Cases with a failure.
    pub(super) failed: u64,
    /// Reasons as they were first met, with their cases and how many more there are of the same.
    pub(super) reasons: Vec<(String, u64, u64)>,
}

/// How many reasons are told.
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
        Overview { ranges: plan.measures().map(range).collect(), failed: 0, reasons: Vec::new() }
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
        let Some(reason) = &row.failure else { return };
        self.failed += 1;
        // Numbers differ from case to case; the words before them say what it is.
        let kind = |text: &str| text.chars().filter(|letter| !letter.is_ascii_digit()).take(40).collect::<String>();
        match self.reasons.iter().position(|(other, ..)| kind(other) == kind(reason)) {
            Some(index) => self.reasons[index].2 += 1,
            None if self.reasons.len() < REASONS => self.reasons.push((reason.clone(), row.case, 0)),
            None => {}
        }
    }
}

impl Outcome {
    /// Calls with all rows, a group at a time.
    pub(super) fn each(&self, mut take: impl FnMut(&Row)) -> Result<(), Error> {
        each(&self.file, &Columns::of(&self.plan), |rows| rows.iter().for_each(&mut take))
    }

    /// The numbers over all cases.
    pub(super) fn overview(&self) -> Result<Overview, Error> {
        let mut overview = Overview::new(&self.plan);
        self.each(|row| overview.add(row))?;
        Ok(overview)
    }

    /// The numbers under their stable names, and a row for each measure.
    pub(super) fn summary(&self, overview: &Overview) -> Summary {
        let mut summary = Summary::new("study");
        summary.result("study.cases", self.cases as f64, "1").result("study.failed_cases", overview.failed as f64, "1");
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
        summary
    }

    /// What came out, in words.
    pub(super) fn told(&self, overview: &Overview) -> String {
        let count = |count: u64, one: &str, many: &str| format!("{count} {}", if count == 1 { one } else { many });
        let mut told = vec![format!("{} on {}.", count(self.cases, "case", "cases"), self.plan.machine)];
        for range in overview.ranges.iter().filter(|range| range.known > 0) {
            let said = |value: f64| tied(&Estimate::new(value, range.measure.unit));
            told.push(format!(
                "{}: {} (case {}) to {} (case {}).",
                range.measure.title,
                said(range.smallest.0),
                range.smallest.1,
                said(range.largest.0),
                range.largest.1
            ));
        }
        if overview.failed > 0 {
            told.push(format!("{} failed; the column failure says why.", count(overview.failed, "case", "cases")));
        }
        told.join(" ")
    }
}
