//! Breakaway from rest, as `ramps.csv`.

use serde_json::Value;

use super::{Outcome, Plan};
use crate::{Breakaway, BreakawayPlan, Mean, Ramp, measure_breakaway};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, Watch};
use stickslip_bench::Bench;

/// Columns of the table of ramps.
pub const TORQUE: &str = "breakaway_torque";
/// Column of the ramp rate.
pub const RATE: &str = "rate";
/// Column of the rest time.
pub const REST: &str = "rest_time";

impl Plan for BreakawayPlan<f64> {
    const KIND: &'static str = "breakaway";
    type Outcome = Breakaway;

    /// Twice the angles, ramps half as fast.
    fn thorough() -> Self {
        let quick = BreakawayPlan::default();
        BreakawayPlan { rate: 0.5 * quick.rate, angles: 2.0 * quick.angles, ..quick }
    }

    /// Duration of the ramps to the model's breakaway torque.
    fn duration(&self, preset: &Preset<f64>) -> f64 {
        self.duration(preset.model.own.breakaway_torque)
    }

    fn about(&self) -> String {
        let Self { repetitions, angles, rate, .. } = *self;
        format!("Breakaway from rest, {repetitions} ramps of {rate} N·m/s at {angles} angles in both directions")
    }

    fn run(&self, bench: &mut dyn Bench, watch: &Watch) -> Result<Breakaway, Error> {
        measure_breakaway(self, bench, watch)
    }
}

impl Outcome for Breakaway {
    const DATA: &'static str = "ramps";

    fn complete(&self) -> bool {
        self.complete
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn warnings(&self) -> Vec<String> {
        self.warnings()
    }

    fn table(&self) -> Table {
        let table = Table::new(["", "torque"]).caption("Breakaway torque of the load side, with 95\u{a0}% intervals.");
        self.lines().fold(table, |table, (name, estimate)| table.row([name.into(), Cell::Estimate(estimate)]))
    }

    fn figure(&self) -> (Figure, String) {
        let of = |direction: f64| {
            let ramps = self.ramps.iter().filter(move |ramp| ramp.direction == direction);
            ramps.filter_map(|ramp| Some((ramp.angle, ramp.torque?)))
        };
        let figure = Figure::new("Breakaway torque over the turn")
            .x(Axis::new("angle", "rad"))
            .y(Axis::new("breakaway torque", "N m"))
            .series(Series::points(Role::Measured, "positive", of(1.0)).large())
            .series(Series::points(Role::Reference, "negative", of(-1.0)).large());
        let spread = self.mean_torque().map_or(f64::NAN, |mean| mean.spread);
        let caption = format!("Each ramp from rest; they scatter by {}.", Estimate::new(spread, "N m"));
        (figure, caption)
    }

    fn add_to(&self, summary: &mut Summary) {
        let mut add = |name: &str, mean: Option<Mean>| {
            if let Some(Mean { torque, ci95, .. }) = mean {
                summary.with_interval(name, torque, ci95, "N m");
            }
        };
        add("measure.breakaway_torque", self.mean_torque());
        add("measure.positive.breakaway_torque", self.direction(1.0));
        add("measure.negative.breakaway_torque", self.direction(-1.0));
        summary.result("measure.ramps", self.ramps.len() as f64, "1").result("measure.detection_lag", self.lag, "N m");
        for ramp in &self.ramps {
            let torque = ramp.torque.map_or(Value::Null, Value::from);
            summary.row([("angle", ramp.angle.into()), ("direction", ramp.direction.into()), ("torque", torque)]);
        }
    }

    /// The ramps with breakaway.
    fn columns(&self) -> Vec<Column> {
        let row = |ramp: &Ramp| Some([ramp.angle, ramp.direction, ramp.torque?, self.rate, self.rest_time]);
        let ended: Vec<[f64; 5]> = self.ramps.iter().filter_map(row).collect();
        let column = |index: usize, name: &str, unit: &str| Column {
            name: name.into(),
            unit: unit.into(),
            values: ended.iter().map(|row| row[index]).collect(),
        };
        vec![
            column(0, "angle", "rad"),
            column(1, "direction", "1"),
            column(2, TORQUE, "N m"),
            column(3, RATE, "N m/s"),
            column(4, REST, "s"),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_without_breakaway_gives_a_warning_and_is_not_in_the_data() {
        let ramp = |torque| Ramp { angle: 0.0, direction: 1.0, torque };
        let ramps = vec![ramp(Some(0.3)), ramp(None)];
        let breakaway = Breakaway { ramps, rate: 0.1, rest_time: 0.3, lag: 1e-3, duration: 8.0, complete: true };
        assert_eq!(breakaway.columns()[2].values, [0.3]);
        let mut summary = Summary::new("measure breakaway");
        breakaway.add_to(&mut summary);
        assert!(summary.to_json().contains("\"torque\": null"));
        assert!(Outcome::warnings(&breakaway)[0].starts_with("No breakaway in 1 of 2 ramps"));
    }
}
