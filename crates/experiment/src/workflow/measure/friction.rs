//! Friction at constant speeds, as `curve.csv`, the input of `stickslip fit`.

use super::{Outcome, Plan};
use crate::workflow::draw::{friction, plateaus, points};
use crate::workflow::results::rows;
use crate::{FrictionCurve, FrictionPlan, Plateau, measure_friction};
use stickslip_base::figure::{Figure, Role, Series};
use stickslip_base::quantity::{Estimate, NORMAL95, number};
use stickslip_base::report::{Cell, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, Watch};
use stickslip_bench::Bench;

impl Plan for FrictionPlan<f64> {
    const KIND: &'static str = "friction";
    type Outcome = FrictionCurve;

    fn thorough() -> Self {
        FrictionPlan::thorough()
    }

    fn duration(&self, preset: &Preset<f64>) -> f64 {
        self.duration(0.0, preset.bench.tick_time())
    }

    fn about(&self) -> String {
        let Self { speeds, slowest, fastest, .. } = *self;
        format!("Friction at {speeds} speeds from {slowest} to {fastest} rad/s in both directions")
    }

    fn run(&self, bench: &mut dyn Bench, watch: &Watch) -> Result<FrictionCurve, Error> {
        measure_friction(self, bench, false, watch)
    }
}

impl Outcome for FrictionCurve {
    const DATA: &'static str = "curve";

    fn complete(&self) -> bool {
        self.complete
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn warnings(&self) -> Vec<String> {
        self.dropped()
            .filter_map(|plateau| {
                let reason = plateau.dropped?;
                Some(format!("The plateau at {} rad/s is not used: {reason}", number(plateau.set_velocity, 3)))
            })
            .collect()
    }

    /// One row for each speed, with both directions.
    fn table(&self) -> Table {
        let mut table = Table::new(["speed", "torque, positive", "torque, negative"])
            .caption("Friction torque of the load side on each plateau, with its 95\u{a0}% interval.");
        let mut speeds: Vec<f64> = self.plateaus.iter().map(|plateau| plateau.set_velocity.abs()).collect();
        speeds.dedup();
        let errors = self.points();
        let cell = |velocity: f64| {
            let at = |plateau: &&Plateau| plateau.set_velocity == velocity;
            let Some(plateau) = self.plateaus.iter().find(at) else { return Cell::Text("not measured".into()) };
            let point = errors.iter().find(|point| point.velocity == plateau.velocity);
            match point.filter(|_| plateau.dropped.is_none()) {
                Some(point) => {
                    let half_width = NORMAL95 * point.standard_error;
                    Cell::Estimate(Estimate::new(point.torque, "N m").with_half_width(half_width))
                }
                None => Cell::Text("sticks or hunts".into()),
            }
        };
        for speed in speeds {
            table = table.row([Cell::Estimate(Estimate::new(speed, "rad/s")), cell(speed), cell(-speed)]);
        }
        table
    }

    fn figure(&self) -> (Figure, String) {
        let figure = friction("Measured friction")
            .series(Series::points(Role::Measured, "course", points(self)))
            .series(plateaus(Role::Reference, self));
        let caption = format!(
            "Torque at {} constant speeds: the noisy signal, and its mean on each plateau with the 95\u{a0}% interval.",
            self.valid().count()
        );
        (figure, caption)
    }

    fn add_to(&self, summary: &mut Summary) {
        summary
            .result("measure.plateaus", self.valid().count() as f64, "1")
            .result("measure.dropped_plateaus", self.dropped().count() as f64, "1")
            .result("measure.ripple", self.ripple, "1");
        rows(summary, "own", self);
    }

    fn columns(&self) -> Vec<Column> {
        let points = self.points();
        let column = |name: &str, unit: &str, values: Vec<f64>| Column { name: name.into(), unit: unit.into(), values };
        vec![
            column("velocity", "rad/s", points.iter().map(|point| point.velocity).collect()),
            column("torque", "N m", points.iter().map(|point| point.torque).collect()),
            column("standard_error", "N m", points.iter().map(|point| point.standard_error).collect()),
        ]
    }
}
