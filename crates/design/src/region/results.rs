//! The region and its verdict as results, rows and words.

use serde_json::Value;
use stickslip_core::friction::Stribeck;

use super::verdict::{Verdict, walk};
use super::{Band, Limit, Region};
use stickslip_base::Summary;
use stickslip_base::quantity::{Estimate, tied};
use stickslip_fit::PARAMETERS;

/// Step between the examined speeds in a summary.
const EVERY: usize = 8;

impl Region {
    /// The numbers, under their stable names.
    pub fn add_to(&self, summary: &mut Summary) {
        summary
            .result("region.drive_limit", self.drive_limit, "N m")
            .result("region.torque_limit", self.torque_limit, "N m")
            .result("region.voltage_limit", self.voltage_limit, "V")
            .result("region.speed_limit", self.speed_limit, "rad/s")
            .result("region.delay", self.delay, "s")
            .result("region.velocity_noise", self.velocity_noise, "rad/s")
            .result("region.acceleration", self.passage.acceleration, "rad/s^2")
            .result("region.tolerance", self.passage.tolerance, "1");
    }

    /// One row for each speed: lowest and highest steady torque with their limits, the difference torque, its margin
    /// and the nearest limit.
    pub fn rows(&self, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64, summary: &mut Summary) {
        for (bound, speed) in walk(self, own, desired, fastest).step_by(EVERY) {
            let Band { torque: [low, high], limits } = self.at(speed);
            summary.row([
                ("kind", Value::from("region")),
                ("speed", speed.into()),
                ("lowest_torque", low.into()),
                ("lowest_by", limits[0].name().into()),
                ("highest_torque", high.into()),
                ("highest_by", limits[1].name().into()),
                ("difference_torque", (desired.magnitude(speed) - own.magnitude(speed)).into()),
                ("margin", bound.margin().into()),
                ("nearest_limit", bound.limit.name().into()),
            ]);
        }
    }

    /// Its limits, in a sentence for a figure.
    pub fn about(&self, fastest: f64) -> String {
        let speed = |value: f64| tied(&Estimate::new(value, "rad/s"));
        let bound = Region::speeds(fastest).find(|speed| self.at(*speed).limits[0] == Limit::Voltage);
        let voltage = match bound {
            Some(from) => format!("; from {} on the voltage limits a driving motor", speed(from)),
            None => String::new(),
        };
        format!(
            "The current limit permits {}{voltage}. Supervision limits the speed to {}.",
            tied(&Estimate::new(self.torque_limit, "N m")),
            speed(self.speed_limit)
        )
    }
}

impl Verdict {
    /// The numbers, and one row for each shortage and each feasible value, under their stable names.
    pub fn add_to(&self, summary: &mut Summary) {
        summary
            .result("region.renderable", f64::from(u8::from(self.renderable())), "1")
            .result("region.margin", self.margin, "1")
            .result("region.margin_at", self.nearest.1, "rad/s")
            .result("region.shortages", self.shortages.len() as f64, "1")
            .result("region.sign_change_time", self.sign_change_time, "s")
            .result("region.sign_change_speed", self.sign_change_speed, "rad/s");
        for shortage in &self.shortages {
            summary.row([
                ("kind", Value::from("shortage")),
                ("limit", shortage.bound.limit.name().into()),
                ("speed", shortage.speeds[0].into()),
                ("to", shortage.speeds[1].into()),
                ("worst", shortage.worst.into()),
                ("needed", shortage.bound.needed.into()),
                ("available", shortage.bound.available.into()),
                ("unit", shortage.bound.limit.unit().into()),
            ]);
        }
        for feasible in self.feasible.iter().flatten() {
            let (name, _, unit) = PARAMETERS[feasible.parameter];
            summary.row([
                ("kind", Value::from("feasible")),
                ("parameter", name.into()),
                ("value", feasible.value.into()),
                ("unit", unit.into()),
            ]);
        }
    }
}
