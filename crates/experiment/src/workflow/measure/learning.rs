//! Iterative learning, as `learning.csv`.

use super::{Outcome, Plan};
use crate::{Learned, LearningPlan, learn_torque};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::{Estimate, number};
use stickslip_base::report::{Cell, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, Watch};
use stickslip_bench::Bench;

/// Largest number of points of a curve.
const POINTS: usize = 2000;

impl Plan for LearningPlan<f64> {
    const KIND: &'static str = "learning";
    type Outcome = Learned;

    /// Twice the repetitions.
    fn thorough() -> Self {
        let quick = LearningPlan::default();
        LearningPlan { repetitions: 2.0 * quick.repetitions, ..quick }
    }

    fn duration(&self, preset: &Preset<f64>) -> f64 {
        self.duration(preset.bench.tick_time())
    }

    fn about(&self) -> String {
        let Self { amplitude, frequency, repetitions, .. } = *self;
        format!(
            "Learning the torque along a sine of {amplitude} rad at {frequency} Hz, {repetitions} repetitions at most"
        )
    }

    fn run(&self, bench: &mut dyn Bench, watch: &Watch) -> Result<Learned, Error> {
        learn_torque(self, bench, watch)
    }
}

impl Learned {
    /// The deviations of the first repetition over those of the best.
    pub fn factor(&self) -> f64 {
        let of = |index: usize| self.repetitions.get(index).map_or(f64::NAN, |it| it.deviation);
        of(0) / of(self.best)
    }

    /// Values of a period over time, reduced for a figure.
    fn drawn(&self, values: &[f64], scale: f64) -> Vec<(f64, f64)> {
        let stride = values.len().div_ceil(POINTS).max(1);
        values.iter().enumerate().step_by(stride).map(|(k, value)| (k as f64 * self.dt, scale * value)).collect()
    }
}

impl Outcome for Learned {
    const DATA: &'static str = "learning";

    fn complete(&self) -> bool {
        self.complete
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.best == 0 {
            warnings.push(
                "Nothing was learnt: no repetition is better than the first. A deviation that does not repeat, such as \
                 random sticking, cannot be learnt; a lower plan.share or plan.cutoff may help."
                    .into(),
            );
        } else if self.stopped {
            warnings.push(format!(
                "Ended after {} repetitions without further improvement; the best one is the result.",
                self.repetitions.len()
            ));
        }
        warnings
    }

    fn table(&self) -> Table {
        let head = Table::new(["repetition", "deviation, RMS", "largest", "torque, RMS"]);
        self.repetitions.iter().enumerate().fold(head, |table, (index, it)| {
            let best = if index == self.best { " (best)" } else { "" };
            table.row([
                Cell::Text(format!("{}{best}", index + 1)),
                Cell::Estimate(Estimate::new(it.deviation, "rad")),
                Cell::Estimate(Estimate::new(it.peak, "rad")),
                Cell::Estimate(Estimate::new(it.torque, "N m")),
            ])
        })
    }

    fn figure(&self) -> (Figure, String) {
        let points = self.repetitions.iter().enumerate().map(|(index, it)| (index as f64 + 1.0, 1e3 * it.deviation));
        let figure = Figure::new("Deviation from repetition to repetition")
            .x(Axis::new("repetition", "1"))
            .y(Axis::new("deviation, RMS", "mrad"))
            .series(Series::line(Role::Measured, "measured", points));
        let caption = format!(
            "Deviation of the best repetition {} times smaller than that of the first, with the controller alone.",
            number(self.factor(), 1)
        );
        (figure, caption)
    }

    fn further(&self) -> Vec<(Figure, String)> {
        let [best, first] = &self.deviations;
        let deviation = Figure::new("Deviation over a period")
            .x(Axis::new("time", "s"))
            .y(Axis::new("deviation", "mrad"))
            .series(Series::line(Role::Reference, "first", self.drawn(first, 1e3)))
            .series(Series::line(Role::Measured, "best", self.drawn(best, 1e3)));
        let torque = Figure::new("Learnt torque")
            .x(Axis::new("time", "s"))
            .y(Axis::new("torque", "N m"))
            .series(Series::line(Role::Measured, "learnt", self.drawn(&self.torque, 1.0)));
        vec![
            (deviation, "Deviation by the encoder in the first and the best repetition.".into()),
            (torque, "Torque added to that of the controller in the best repetition.".into()),
        ]
    }

    fn add_to(&self, summary: &mut Summary) {
        let of = |index: usize| self.repetitions.get(index).map_or(f64::NAN, |it| it.deviation);
        summary
            .result("measure.repetitions", self.repetitions.len() as f64, "1")
            .result("measure.best", self.best as f64 + 1.0, "1")
            .result("measure.first_deviation", of(0), "rad")
            .result("measure.best_deviation", of(self.best), "rad")
            .result("measure.factor", self.factor(), "1");
        for (index, it) in self.repetitions.iter().enumerate() {
            summary.row([
                ("repetition", (index + 1).into()),
                ("deviation", it.deviation.into()),
                ("peak", it.peak.into()),
                ("torque", it.torque.into()),
            ]);
        }
    }

    fn columns(&self) -> Vec<Column> {
        let column = |name: &str, unit: &str, values: Vec<f64>| Column { name: name.into(), unit: unit.into(), values };
        let [best, first] = &self.deviations;
        let times = (0..self.torque.len()).map(|k| k as f64 * self.dt).collect();
        vec![
            column("time", "s", times),
            column("torque", "N m", self.torque.clone()),
            column("deviation", "rad", best.clone()),
            column("first_deviation", "rad", first.clone()),
        ]
    }
}
