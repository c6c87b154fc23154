//! Presliding loops, as `loops.csv`.

use super::{Outcome, Plan};
use crate::{FrictionPlan, Loop, Presliding, PreslidingPlan, measure_friction, measure_presliding};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, Watch};
use stickslip_bench::Bench;

impl Plan for PreslidingPlan<f64> {
    const KIND: &'static str = "presliding";
    type Outcome = Presliding;

    /// Twice the cycles.
    fn thorough() -> Self {
        let quick = PreslidingPlan::default();
        PreslidingPlan { slow_cycles: 2.0 * quick.slow_cycles, quick_cycles: 2.0 * quick.quick_cycles, ..quick }
    }

    fn duration(&self, preset: &Preset<f64>) -> f64 {
        self.duration() + Plan::duration(&FrictionPlan::quick(), preset)
    }

    fn about(&self) -> String {
        let Self { share, slow_frequency, quick_frequency, .. } = *self;
        format!(
            "Presliding loops of {} % of the breakaway torque at {slow_frequency} and {quick_frequency} Hz, after a \
             friction curve",
            100.0 * share
        )
    }

    /// The friction curve first: the loops require its breakaway torque, and their evaluation the whole curve.
    fn run(&self, bench: &mut dyn Bench, watch: &Watch) -> Result<Presliding, Error> {
        let own = measure_friction(&FrictionPlan::quick(), bench, false, watch)?;
        watch.check()?;
        bench.learn_own(own.fit()?.curve());
        let mut presliding = measure_presliding(self, bench, watch)?;
        presliding.duration += own.duration;
        Ok(presliding)
    }
}

impl Outcome for Presliding {
    const DATA: &'static str = "loops";

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
        let table = Table::new(["", "value"]).caption("Bristle parameters from the loops, with 95\u{a0}% intervals.");
        let table =
            self.lines().fold(table, |table, (name, estimate)| table.row([name.into(), Cell::Estimate(estimate)]));
        let least = Estimate::new(self.least_stiffness, "N m/rad");
        table.row(["bristle stiffness, at least".into(), Cell::Estimate(least)])
    }

    fn figure(&self) -> (Figure, String) {
        let figure = Figure::new("Presliding").x(Axis::new("angle", "rad")).y(Axis::new("torque", "N m"));
        let roles = [Role::Measured, Role::Reference];
        let figure = self.loops.iter().zip(roles).fold(figure, |figure, (one, role)| {
            let around = |points: &[[f64; 2]]| {
                points.iter().chain(points.first()).map(|[torque, angle]| (*angle, *torque)).collect::<Vec<_>>()
            };
            let figure = figure.series(Series::line(role, format!("{} Hz", one.frequency), around(&one.points)));
            if one.fitted.is_empty() {
                return figure;
            }
            let fitted = Series::line(Role::Fitted, format!("{} Hz, fitted", one.frequency), around(&one.fitted));
            figure.series(if role == Role::Measured { fitted } else { fitted.dashed() })
        });
        let levels: Vec<String> = self.loops.iter().map(|one| one.levels.to_string()).collect();
        let caption = format!(
            "Torque over the angle of the load, mean over the cycles; the encoder's counter changed at {} angles.",
            levels.join(" and ")
        );
        (figure, caption)
    }

    fn add_to(&self, summary: &mut Summary) {
        let estimates = [("stiffness", self.stiffness, "N m/rad"), ("damping", self.damping, "N m s/rad")];
        for (name, estimate, unit) in estimates {
            if let Some((value, ci95)) = estimate {
                summary.with_interval(&format!("measure.bristle_{name}"), value, ci95, unit);
            }
        }
        summary.result("measure.least_bristle_stiffness", self.least_stiffness, "N m/rad").result(
            "measure.counts_needed",
            self.counts_needed,
            "1",
        );
    }

    fn columns(&self) -> Vec<Column> {
        let rows = |value: fn(&Loop, [f64; 2]) -> f64| {
            let points = |one: &Loop| one.points.iter().map(|point| value(one, *point)).collect::<Vec<_>>();
            self.loops.iter().flat_map(points).collect()
        };
        let column = |name: &str, unit: &str, values: Vec<f64>| Column { name: name.into(), unit: unit.into(), values };
        vec![
            column("frequency", "Hz", rows(|one, _| one.frequency)),
            column("angle", "rad", rows(|_, [_, angle]| angle)),
            column("torque", "N m", rows(|_, [torque, _]| torque)),
        ]
    }
}
