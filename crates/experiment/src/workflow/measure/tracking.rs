//! Tracking, as `tracking.csv` and `tracking.parquet`: training data of a network.

use stickslip_core::fields::{Fields, Walk};

use super::{Outcome, Plan};
use crate::{Followed, Tracked, TrackedSample, TrackingPlan, record_tracking};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, Watch};
use stickslip_bench::Bench;

/// Largest number of points of a curve.
const POINTS: usize = 4000;

/// Features of a network, in the order of the block.
const FEATURE_COLUMNS: [(&str, &str); 6] = [
    ("feature_velocity", "rad/s"),
    ("feature_acceleration", "rad/s^2"),
    ("feature_slow_sign", "1"),
    ("feature_fast_sign", "1"),
    ("feature_short_memory", "1"),
    ("feature_long_memory", "1"),
];

impl Plan for TrackingPlan<f64> {
    const KIND: &'static str = "tracking";
    type Outcome = Tracked;

    /// More frequencies, and more speeds at each.
    fn thorough() -> Self {
        let quick = TrackingPlan::default();
        TrackingPlan { speeds: 2.0 * quick.speeds, frequencies: 2.0 * quick.frequencies - 1.0, ..quick }
    }

    fn duration(&self, _preset: &Preset<f64>) -> f64 {
        self.duration()
    }

    fn about(&self) -> String {
        let Self { slowest, speed, lowest_frequency, highest_frequency, .. } = *self;
        format!(
            "Tracking {} motions: sines of {lowest_frequency} to {highest_frequency} Hz with {slowest} to {speed} rad/s, \
             and moves",
            self.motions().len()
        )
    }

    fn run(&self, bench: &mut dyn Bench, watch: &Watch) -> Result<Tracked, Error> {
        record_tracking(self, bench, watch)
    }
}

impl Outcome for Tracked {
    const DATA: &'static str = "tracking";

    fn complete(&self) -> bool {
        self.complete
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    fn table(&self) -> Table {
        let reached = self.samples.last().map_or(0, |last| last.motion + 1);
        let row = |table: Table, (index, motion): (usize, &str)| {
            let Followed { deviation, peak } = self.followed(Some(index));
            table.row([
                Cell::Text(motion.into()),
                Cell::Estimate(Estimate::new(deviation, "rad")),
                Cell::Estimate(Estimate::new(peak, "rad")),
            ])
        };
        let motions = self.motions.iter().take(reached).map(|motion| motion.what.as_str()).enumerate();
        motions.fold(Table::new(["motion", "deviation, RMS", "largest"]), row)
    }

    fn figure(&self) -> (Figure, String) {
        let stride = self.samples.len().div_ceil(POINTS).max(1);
        let points = self.samples.iter().zip(self.friction()).step_by(stride);
        let points = points.map(|(sample, torque)| (sample.setpoint.velocity, torque));
        let figure = Figure::new("Torque without that of the inertia")
            .x(Axis::new("velocity of the set-point", "rad/s"))
            .y(Axis::new("torque", "N m"))
            .series(Series::points(Role::Measured, "samples", points));
        (figure, "Commanded torque of the controller under test, minus the torque of the modelled inertia.".into())
    }

    fn add_to(&self, summary: &mut Summary) {
        let Followed { deviation, peak } = self.followed(None);
        summary
            .result("measure.motions", self.samples.last().map_or(0.0, |last| last.motion as f64 + 1.0), "1")
            .result("measure.samples", self.samples.len() as f64, "1")
            .result("measure.period", self.period, "s")
            .result("measure.deviation", deviation, "rad")
            .result("measure.peak", peak, "rad");
        self.features.clone().contents(&mut Features(summary));
        let reached = self.samples.last().map_or(0, |last| last.motion + 1);
        for (index, motion) in self.motions.iter().enumerate().take(reached) {
            let Followed { deviation, peak } = self.followed(Some(index));
            summary.row([
                ("motion", motion.what.as_str().into()),
                ("deviation", deviation.into()),
                ("peak", peak.into()),
            ]);
        }
    }

    fn columns(&self) -> Vec<Column> {
        let column = |name: &str, unit: &str, values: Vec<f64>| Column { name: name.into(), unit: unit.into(), values };
        let of = |value: fn(&TrackedSample) -> f64| self.samples.iter().map(value).collect();
        let mut columns = vec![
            column("time", "s", of(|sample| sample.time)),
            column("motion", "1", of(|sample| sample.motion as f64 + 1.0)),
            column("setpoint", "rad", of(|sample| sample.setpoint.position)),
            column("setpoint_velocity", "rad/s", of(|sample| sample.setpoint.velocity)),
            column("setpoint_acceleration", "rad/s^2", of(|sample| sample.setpoint.acceleration)),
            column("angle", "rad", of(|sample| sample.angle)),
            column("commanded_torque", "N m", of(|sample| sample.torque)),
            column("friction_torque", "N m", self.friction()),
        ];
        let features = self.features();
        for (index, (name, unit)) in FEATURE_COLUMNS.iter().enumerate() {
            columns.push(column(name, unit, features.iter().map(|sample| sample[index]).collect()));
        }
        columns
    }
}

/// Adds the parameters of the features to the summary; a network trained on them requires the same.
struct Features<'a>(&'a mut Summary);

impl Walk<f64> for Features<'_> {
    fn number(&mut self, field: &'static stickslip_core::fields::Field, value: &mut f64) {
        self.0.result(&format!("measure.features.{}", field.name), *value, field.unit);
    }
}
