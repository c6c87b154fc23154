//! The desired characteristic: from reference points or single values, checked against the limits of the load motor.

use std::path::Path;

use serde_json::Value;
use stickslip_core::friction::Stribeck;

use super::draw::{folded, friction, load, torque};

use stickslip_base::figure::{Axis, Role, Series};
use stickslip_base::parameters::{Entry, Value as Parameter, flatten};
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::{Error, Preset, Summary, output, parameters};
use stickslip_design::{Band, Region, Verdict};
use stickslip_fit::{PARAMETERS, values};

use super::through::{deviation, strays};

pub use super::through::{Weighted, through_points};
pub use stickslip_design::{FASTEST, fastest};

/// Own and desired friction, and the renderable region.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// Own friction.
    pub own: Stribeck<f64>,
    /// Desired friction.
    pub desired: Stribeck<f64>,
    /// Its reference points.
    pub points: Vec<Weighted>,
    /// Renderable region of the bench.
    pub region: Region,
}

impl Design {
    /// Desired minus own torque at a speed Ω ≥ 0 [N m]: what the load motor adds.
    pub fn difference(&self, speed: f64) -> f64 {
        self.desired.magnitude(speed) - self.own.magnitude(speed)
    }

    /// RMS distance of the desired characteristic from its reference points but the stray ones [N m]; NaN without points.
    pub fn distance(&self) -> f64 {
        let strays = self.strays();
        let used = self.points.iter().enumerate().filter(|(index, _)| !strays.contains(index));
        let squares: f64 = used.map(|(_, point)| deviation(point, &self.desired).powi(2)).sum();
        (squares / (self.points.len() - strays.len()) as f64).sqrt()
    }

    /// Indices of the reference points that contradict the others.
    pub fn strays(&self) -> Vec<usize> {
        strays(&self.points, &self.desired)
    }

    /// Highest speed of the comparison [rad/s].
    fn fastest(&self) -> f64 {
        fastest(&self.region)
    }

    /// The speeds of the comparison [rad/s], rising.
    fn speeds(&self) -> impl Iterator<Item = f64> + Clone + use<> {
        Region::speeds(self.fastest())
    }

    /// Whether the bench can render it; if not, the speeds, the limits, and the remedies.
    pub fn verdict(&self) -> Verdict {
        self.region.judge(&self.own, &self.desired, self.fastest())
    }

    /// Largest difference torque by magnitude, with its sign [N m], and the speed at which it is needed [rad/s].
    pub fn largest(&self) -> [f64; 2] {
        let differences = self.speeds().map(|speed| [self.difference(speed), speed]);
        differences.max_by(|a, b| a[0].abs().total_cmp(&b[0].abs())).expect("the plan has speeds")
    }

    /// Speeds at which the difference torque changes its sign [rad/s]: there the load motor changes from braking to
    /// driving, or back.
    pub fn sign_changes(&self) -> Vec<f64> {
        let speeds: Vec<f64> = self.speeds().collect();
        let crosses = |pair: &&[f64]| self.difference(pair[0]) * self.difference(pair[1]) < 0.0;
        let narrow = |pair: &[f64]| {
            let [mut low, mut high] = [pair[0], pair[1]];
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if self.difference(low) * self.difference(middle) > 0.0 { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        };
        speeds.windows(2).filter(crosses).map(narrow).collect()
    }

    /// Remarks for the report.
    pub fn remarks(&self) -> Vec<String> {
        self.remarks_on(&self.verdict())
    }

    /// As [`remarks`](Self::remarks), with a computed verdict.
    pub(crate) fn remarks_on(&self, verdict: &Verdict) -> Vec<String> {
        let speed = |value: f64| Estimate::new(value, "rad/s").to_string();
        let mut remarks = Vec::new();
        let [largest, at] = self.largest();
        let limit = Estimate::new(self.region.torque_limit, "N m");
        remarks.push(format!(
            "The load motor must {} with up to {} at {}; its limit is {limit}.",
            if largest < 0.0 { "drive" } else { "brake" },
            Estimate::new(largest.abs(), "N m"),
            speed(at)
        ));
        for index in self.strays() {
            let point = &self.points[index];
            remarks.push(format!(
                "Reference point {} at {} contradicts the others: {} from the curve. It is not used; a weight above 1 \
                 forces its use.",
                index + 1,
                speed(point[0]),
                torque(deviation(point, &self.desired).abs())
            ));
        }
        for change in self.sign_changes() {
            remarks.push(format!("The difference torque changes its sign at {}.", speed(change)));
        }
        if let Some(remedy) = verdict.remedy() {
            remarks.push("The desired friction cannot be rendered.".into());
            remarks.extend(verdict.reasons());
            remarks.push(remedy);
        }
        let rest = self.desired.breakaway_torque - self.own.breakaway_torque;
        if rest.abs() > 0.05 * self.desired.breakaway_torque {
            remarks.push(format!(
                "At rest no torque is rendered: the breakaway torque is {} off. Adjust the friction wheel, or set M_S = {}.",
                Estimate::new(rest.abs(), "N m"),
                Estimate::new(self.own.breakaway_torque, "N m")
            ));
        }
        remarks
    }

    /// Own and desired parameters.
    pub fn table(&self) -> Table {
        let table = Table::new(["parameter", "own", "desired", "difference"]).caption("Own and desired friction.");
        PARAMETERS.iter().zip(values(&self.own)).zip(values(&self.desired)).fold(
            table,
            |table, (((_, name, unit), own), desired)| {
                let cell = |value: f64| Cell::Estimate(Estimate::new(value, *unit));
                table.row([(*name).into(), cell(own), cell(desired), cell(desired - own)])
            },
        )
    }

    /// `desired.toml`: the desired friction as a part of a parameter file.
    pub fn fragment(&self) -> String {
        let head = "# Desired friction.\n# A part of a parameter file: omitted parameters have their defaults.\n\n[bench.desired]\n";
        let line = |Entry { path, value, .. }: &Entry| match value {
            Parameter::Number(value) => format!("{path} = {value:?}\n"),
            Parameter::Variant(name) => format!("{path} = \"{name}\"\n"),
        };
        head.to_owned() + &flatten(&self.desired).iter().map(line).collect::<String>()
    }

    /// The numbers, under their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("design");
        for ((key, _, unit), (own, desired)) in
            PARAMETERS.iter().zip(values(&self.own).into_iter().zip(values(&self.desired)))
        {
            summary.result(&format!("own.{key}"), own, unit).result(&format!("desired.{key}"), desired, unit);
        }
        let [largest, at] = self.largest();
        summary.result("design.largest_difference", largest, "N m").result("design.largest_difference_at", at, "rad/s");
        self.region.add_to(&mut summary);
        self.verdict().add_to(&mut summary);
        if !self.points.is_empty() {
            summary.result("design.distance_from_points", self.distance(), "N m");
            summary.result("design.stray_points", self.strays().len() as f64, "1");
        }
        for change in self.sign_changes() {
            summary.row([("kind", Value::from("sign change")), ("speed", change.into())]);
        }
        self.region.rows(&self.own, &self.desired, self.fastest(), &mut summary);
        summary
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let mut figure = friction("Own and desired friction")
            .series(Series::line(Role::Own, "own", folded(&self.own, FASTEST)))
            .series(Series::line(Role::Desired, "desired", folded(&self.desired, FASTEST)));
        if !self.points.is_empty() {
            let strays = self.strays();
            let of = |stray: bool| {
                let chosen = self.points.iter().enumerate().filter(|(index, _)| strays.contains(index) == stray);
                chosen.map(|(_, [speed, torque, _])| (*speed, *torque)).collect::<Vec<_>>()
            };
            figure = figure.series(Series::points(Role::Reference, "reference points", of(false)).large());
            if !strays.is_empty() {
                figure = figure.series(Series::points(Role::Measured, "not used", of(true)).large());
            }
        }
        let difference = self.speeds().map(|speed| (speed, self.difference(speed)));
        let able = self.speeds().map(|speed| {
            let Band { torque: [low, high], .. } = self.region.at(speed);
            (speed, low, high)
        });
        let difference_figure = load("Difference torque in the renderable region")
            .x(Axis::new("speed Ω", "rad/s").stretched())
            .series(Series::band(Role::Reference, "steadily by current and voltage", able))
            .series(Series::line(Role::Rendered, "difference torque", difference));
        let difference_figure = self.verdict().shortages.iter().fold(difference_figure, |figure, shortage| {
            figure.interval(shortage.speeds[0], shortage.speeds[1], format!("{} limit", shortage.bound.limit))
        });
        let [largest, _] = self.largest();
        let caption = format!(
            "Own and desired friction; the load motor renders a difference of up to {}.",
            torque(largest.abs())
        );
        let about =
            format!("Desired minus own friction, against positive motion. {}", self.region.about(self.fastest()));
        Report::new("Desired friction", Provenance::new(command, None, self.fragment()))
            .summary(self.remarks().join(" "))
            .table(self.table())
            .figure(figure, caption)
            .figure(difference_figure, about)
    }

    /// Writes `desired.toml`, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::Parameters`] if a parameter file does not accept the desired characteristic; [`Error::File`].
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        let text = self.fragment();
        parameters::read::<Preset<f64>>(&text, "desired.toml")?;
        output::create_folder(directory)?;
        output::write(&directory.join("desired.toml"), text)?;
        let mut summary = self.summary();
        summary.file("desired.toml");
        self.report(command).write_all(summary, [], directory)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_core::friction::Decay;
    use stickslip_design::Passage;

    fn design(desired: Stribeck<f64>) -> Design {
        let Preset { model, bench, .. } = Preset::default();
        let region = Region::of(&model, &bench, Passage::default()).unwrap();
        Design { own: Stribeck::default(), desired, points: Vec::new(), region }
    }

    #[test]
    fn sign_changes_are_found() {
        let gentle = design(Stribeck { kinetic_torque: 0.12, viscous_friction: 1.2e-3, ..Stribeck::default() });
        let [change] = gentle.sign_changes()[..] else { panic!("{:?}", gentle.sign_changes()) };
        // −0.06 N m·(1 − e^(−Ω/3)) + 1e-3·Ω = 0: from 20 rad/s on the exponential is below 1e-8 of it.
        assert!((change - 60.0).abs() < 1e-5, "{change}");
    }

    #[test]
    fn a_desired_characteristic_reads_back_to_its_bits() {
        let desired = Stribeck { decay: Decay::Gaussian, kinetic_torque: 0.1 + 0.2, ..Stribeck::default() };
        let back: Preset<f64> = parameters::read(&design(desired).fragment(), "desired.toml").unwrap();
        assert_eq!(back.bench.desired, desired);
    }
}
