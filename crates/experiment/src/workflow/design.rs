//! The desired characteristic: from reference points or single values, checked against the limits of the load motor.

use std::convert::Infallible;
use std::path::Path;

use serde_json::Value;
use stickslip_core::friction::{Decay, Stribeck};
use stickslip_core::scalar::{Dual, Scalar};

use super::draw::{folded, friction, load, torque};

use stickslip_base::figure::{Axis, Role, Series};
use stickslip_base::parameters::{Entry, Value as Parameter, flatten};
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::{Error, Preset, Summary, output, parameters};
use stickslip_design::{Band, Region, Verdict};
use stickslip_fit::{PARAMETERS, Stop, minimise, values};

pub use stickslip_design::{FASTEST, fastest};

/// Own and desired friction, and the renderable region.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// Own friction.
    pub own: Stribeck<f64>,
    /// Desired friction.
    pub desired: Stribeck<f64>,
    /// Its reference points: speed [rad/s] and torque [N m].
    pub points: Vec<[f64; 2]>,
    /// Renderable region of the bench.
    pub region: Region,
}

/// The Stribeck curve through reference points (speed ≥ 0 [rad/s], torque > 0 [N m]) by least squares. Parameters that
/// the points do not determine stay near `start`: a change of a parameter by a factor of e weighs as much as a
/// thousandth of the largest torque.
///
/// # Errors
/// [`Error::CurvePoint`] for an invalid point; [`Error::TooFew`] without one.
pub fn through_points(points: &[[f64; 2]], start: &Stribeck<f64>) -> Result<Stribeck<f64>, Error> {
    let points: Vec<_> = points.iter().map(|&[speed, torque]| [speed, torque, 1.0]).collect();
    through_weighted(&points, start, None)
}

/// As [`through_points`], each point with a weight > 0 after speed and torque. One parameter, by its index in
/// [`PARAMETERS`], may be held at its value in `start`.
///
/// # Errors
/// As [`through_points`].
pub fn through_weighted(
    points: &[[f64; 3]],
    start: &Stribeck<f64>,
    held: Option<usize>,
) -> Result<Stribeck<f64>, Error> {
    for (index, &[speed, torque, weight]) in points.iter().enumerate() {
        if !(speed.is_finite() && speed >= 0.0) {
            let remedy = "The speed of a reference point is at least 0: friction is the same in both directions.";
            return Err(Error::CurvePoint { index, field: "velocity", value: speed, remedy });
        }
        if !(torque.is_finite() && torque > 0.0) {
            let remedy = "Friction brakes: the torque must be above 0.";
            return Err(Error::CurvePoint { index, field: "torque", value: torque, remedy });
        }
        if !(weight.is_finite() && weight > 0.0) {
            let remedy = "A weight must be above 0; remove the point instead.";
            return Err(Error::CurvePoint { index, field: "weight", value: weight, remedy });
        }
    }
    let largest = points.iter().map(|[_, torque, _]| *torque).fold(0.0, f64::max);
    if points.is_empty() {
        let remedy = "Give at least one.";
        return Err(Error::TooFew { what: "reference points", found: 0, needed: 1, remedy });
    }
    let old = [start.breakaway_torque, start.kinetic_torque, start.stribeck_velocity, start.viscous_friction.max(1e-9)];
    const BOUNDS: [[f64; 2]; 4] = [[1e-6, 200.0], [1e-6, 200.0], [1e-4, 1e3], [1e-12, 50.0]];
    let stop = Stop { step: 1e-10, fall: 1e-14, evaluations: 400 };
    let mut best: Option<(f64, [f64; 4])> = None;
    let factors = if held == Some(2) { &[1.0][..] } else { &[0.1, 0.3, 1.0, 3.0] };
    for factor in factors {
        let mut from = old;
        from[2] = (from[2] * factor).clamp(BOUNDS[2][0], BOUNDS[2][1]);
        let fit = minimise(from, BOUNDS, stop, |p: [Dual<4>; 4]| {
            let curve = exponential(p);
            let off = points.iter().map(|&[speed, torque, weight]| {
                (curve.magnitude(Dual::of(speed)) - Dual::of(torque)) * Dual::of(weight.sqrt())
            });
            let pull = |i: usize| if held == Some(i) { HELD } else { 1e-3 };
            let moved = (0..4).map(|i| (p[i] / Dual::of(old[i])).ln() * Dual::of(pull(i) * largest));
            Ok::<_, Infallible>(off.chain(moved).collect())
        });
        let Ok(fit) = fit;
        if best.is_none_or(|(cost, _)| fit.cost < cost) {
            best = Some((fit.cost, fit.parameters));
        }
    }
    let mut fit = best.expect("at least one start").1;
    if let Some(held) = held {
        fit[held] = old[held];
    }
    Ok(exponential(fit))
}

/// Weight that holds a parameter: it moves less than the output resolution.
const HELD: f64 = 1e2;

/// The exponential form, equation (1).
fn exponential<T: Scalar>(parameters: [T; 4]) -> Stribeck<T> {
    let [breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction] = parameters;
    let decay = Decay::Exponential;
    Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, decay }
}

impl Design {
    /// Desired minus own torque at a speed Ω ≥ 0 [N m]: what the load motor adds.
    pub fn difference(&self, speed: f64) -> f64 {
        self.desired.magnitude(speed) - self.own.magnitude(speed)
    }

    /// RMS distance of the desired characteristic from its reference points [N m]; NaN without points.
    pub fn distance(&self) -> f64 {
        let squares: f64 =
            self.points.iter().map(|[speed, torque]| (self.desired.magnitude(*speed) - torque).powi(2)).sum();
        (squares / self.points.len() as f64).sqrt()
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
            let points = self.points.iter().map(|[v, m]| (*v, *m));
            figure = figure.series(Series::points(Role::Reference, "reference points", points).large());
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
    use stickslip_design::Passage;

    fn design(desired: Stribeck<f64>) -> Design {
        let Preset { model, bench, .. } = Preset::default();
        let region = Region::of(&model, &bench, Passage::default()).unwrap();
        Design { own: Stribeck::default(), desired, points: Vec::new(), region }
    }

    #[test]
    fn four_points_of_a_curve_return_the_curve() {
        let exact =
            Stribeck { kinetic_torque: 0.12, stribeck_velocity: 1.5, viscous_friction: 1.2e-3, ..Stribeck::default() };
        let points = [0.0, 1.5, 12.0, 80.0].map(|speed| [speed, exact.magnitude(speed)]);
        let fit = through_points(&points, &Stribeck::default()).unwrap();
        for (fit, exact) in values(&fit).into_iter().zip(values(&exact)) {
            // The pull of the start, a thousandth of the torque on each parameter, squared.
            assert!((fit / exact - 1.0).abs() < 1e-3, "{fit} for {exact}");
        }
    }

    #[test]
    fn one_point_moves_only_the_parameters_that_it_determines() {
        let start = Stribeck::default();
        let fit = through_points(&[[0.0, 0.4]], &start).unwrap();
        assert!((fit.breakaway_torque - 0.4).abs() < 1e-4, "{fit:?}");
        assert!((fit.kinetic_torque / start.kinetic_torque - 1.0).abs() < 1e-6);
    }

    #[test]
    fn an_invalid_reference_point_is_refused() {
        let refusal = |points: &[[f64; 2]]| through_points(points, &Stribeck::default()).unwrap_err().to_string();
        assert!(refusal(&[[1.0, 0.2], [-1.0, 0.2]]).starts_with("point 2 of the friction curve: velocity = -1."));
        assert!(refusal(&[[1.0, f64::NAN]]).contains("torque = NaN. Friction brakes"));
        assert!(refusal(&[]).contains("too few reference points: 0; at least 1 required"));
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
