//! Friction rendered by a loaded friction or law: measured at constant speeds and compared with its expected value.

use serde_json::Value;
use stickslip_software::supervise::ExternalFault;

use crate::workflow::draw::{friction, plateaus, points};
use crate::workflow::render::faded_below;
use crate::{FrictionCurve, FrictionPlan, Plateau, measure_friction};
use stickslip_base::figure::{Figure, Role, Series};
use stickslip_base::quantity::{Estimate, NORMAL95};
use stickslip_base::report::{Cell, Table};
use stickslip_base::{Error, Preset, Summary, Watch};
use stickslip_bench::Bench;
use stickslip_bench::external::{External, ModuleSample, Role as Part, role};

/// Time for which a friction is stepped alone at each velocity [s]; its value is the mean of the last half.
const ALONE: f64 = 1.0;

/// Measured and expected friction.
pub(super) struct Rendered {
    role: Part,
    plan: FrictionPlan<f64>,
    loaded: Option<FrictionCurve>,
    /// Under the preset's law, for comparison with a loaded law.
    own: Option<FrictionCurve>,
    /// Velocity and torque of a friction alone [rad/s], [N m]; or the fault.
    alone: Result<Vec<(f64, f64)>, String>,
}

/// Deviation of a curve from the expected one.
struct Deviation {
    rms: f64,
    /// Deviation of largest magnitude, and its velocity.
    largest: f64,
    velocity: f64,
}

impl Rendered {
    /// A measurement at as many speeds of the quick plan as fit into a duration [s], at least two.
    pub(super) fn planned(role: Part, preset: &Preset<f64>, duration: f64) -> Self {
        let mut plan = FrictionPlan::quick();
        while plan.speeds > 2.0 && plan.duration(0.0, preset.bench.tick_time()) > duration {
            plan.speeds -= 1.0;
        }
        Rendered { role, plan, loaded: None, own: None, alone: Ok(Vec::new()) }
    }

    /// Measures under the loaded friction or law.
    pub(super) fn with(&mut self, bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
        self.loaded = Some(measure_friction(&self.plan, bench, true, watch)?);
        Ok(())
    }

    /// Measures a law's comparison, the law of the preset.
    pub(super) fn without(&mut self, bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
        if self.role == Part::Law {
            self.own = Some(measure_friction(&self.plan, bench, true, watch)?);
        }
        Ok(())
    }

    /// Computes a friction alone, at the measured velocities.
    pub(super) fn compute_alone(&mut self, external: &mut External, preset: &Preset<f64>) {
        if self.role != Part::Friction {
            return;
        }
        let velocities = self.loaded.iter().flat_map(|curve| &curve.plateaus).map(|plateau| plateau.velocity);
        let limit = role::torque_limit(self.role, &preset.model, &preset.bench);
        let torques = velocities.map(|velocity| {
            let torque = steady(external, velocity, role::period(self.role, &preset.bench), limit);
            torque.map(|torque| (velocity, torque)).map_err(|fault| external.fault(fault).to_string())
        });
        self.alone = torques.collect();
    }

    /// Expected friction at the velocity of a plateau [N m]; NaN if unknown.
    fn expected(&self, plateau: &Plateau, preset: &Preset<f64>) -> f64 {
        if self.role == Part::Law {
            return preset.bench.desired.torque(plateau.velocity);
        }
        let point = self.alone.iter().flatten().find(|(velocity, _)| *velocity == plateau.velocity);
        point.map_or(f64::NAN, |(_, torque)| *torque)
    }

    fn deviation(&self, curve: &FrictionCurve, preset: &Preset<f64>) -> Deviation {
        let of = |plateau: &Plateau| (plateau.velocity, plateau.torque - self.expected(plateau, preset));
        let all: Vec<(f64, f64)> = curve.valid().map(of).collect();
        let square: f64 = all.iter().map(|(_, deviation)| deviation * deviation).sum();
        let none = (f64::NAN, f64::NAN);
        let largest = all.iter().copied().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or(none);
        Deviation { rms: libm::sqrt(square / all.len() as f64), largest: largest.1, velocity: largest.0 }
    }

    /// Name of the expected curve.
    fn expected_name(&self) -> &'static str {
        if self.role == Part::Law { "desired" } else { "of the file" }
    }

    pub(super) fn table(&self, preset: &Preset<f64>) -> Table {
        let law = self.own.is_some();
        let mut heads = vec!["velocity", "measured", self.expected_name(), "deviation"];
        heads.extend(law.then_some("deviation, preset's law"));
        let caption = if law {
            "Friction measured under the loaded law, the desired friction, and the deviation; for comparison the \
             deviation under the preset's law."
        } else {
            "Friction measured under the loaded friction, and that of the file alone at constant velocity."
        };
        let mut table = Table::new(heads).caption(caption);
        let missing = || Cell::from("sticks or hunts");
        for plateau in self.loaded.iter().flat_map(|curve| &curve.plateaus) {
            let expected = self.expected(plateau, preset);
            let cells = |plateau: &Plateau| {
                let half_width = NORMAL95 * plateau.standard_error;
                let estimate = |value| Cell::Estimate(Estimate::new(value, "N m").with_half_width(half_width));
                let deviation = plateau.torque - self.expected(plateau, preset);
                if plateau.dropped.is_some() {
                    [missing(), missing()]
                } else {
                    [estimate(plateau.torque), estimate(deviation)]
                }
            };
            let [measured, deviation] = cells(plateau);
            let velocity = Cell::Estimate(Estimate::new(plateau.set_velocity, "rad/s"));
            let mut row = vec![velocity, measured, Cell::Estimate(Estimate::new(expected, "N m")), deviation];
            if let Some(own) = &self.own {
                let at = own.plateaus.iter().find(|other| other.set_velocity == plateau.set_velocity);
                row.push(at.map_or_else(missing, |plateau| {
                    let [_, deviation] = cells(plateau);
                    deviation
                }));
            }
            table = table.row(row);
        }
        table
    }

    pub(super) fn add_to(&self, preset: &Preset<f64>, summary: &mut Summary) {
        for (source, curve) in [("rendered", &self.loaded), ("own", &self.own)] {
            let Some(curve) = curve else { continue };
            let Deviation { rms, largest, .. } = self.deviation(curve, preset);
            summary.result(&format!("{source}.rms"), rms, "N m").result(
                &format!("{source}.largest"),
                largest.abs(),
                "N m",
            );
            summary.result(&format!("{source}.plateaus"), curve.valid().count() as f64, "1");
            summary.result(&format!("{source}.dropped_plateaus"), curve.dropped().count() as f64, "1");
            for plateau in &curve.plateaus {
                summary.row([
                    ("kind", Value::from("plateau")),
                    ("under", source.into()),
                    ("velocity", plateau.velocity.into()),
                    ("torque", plateau.torque.into()),
                    ("standard_error", plateau.standard_error.into()),
                    ("wanted", self.expected(plateau, preset).into()),
                    ("counts", plateau.dropped.is_none().into()),
                ]);
            }
        }
    }

    /// The results, in sentences.
    pub(super) fn lead(&self, preset: &Preset<f64>) -> Vec<String> {
        let words = |curve: &FrictionCurve| {
            let Deviation { rms, largest, velocity } = self.deviation(curve, preset);
            let [rms, largest] = [rms, largest.abs()].map(|torque| Estimate::new(torque, "N m"));
            let at = Estimate::new(velocity, "rad/s");
            let dropped = curve.dropped().count();
            let dropped =
                if dropped > 0 { format!("; at {dropped} speeds the load sticks or hunts") } else { String::new() };
            format!("{rms} RMS, at most {largest} (at {at}){dropped}")
        };
        let loaded = self.loaded.as_ref().map(|curve| match self.role {
            Part::Law => format!("Deviation from the desired friction: {}.", words(curve)),
            _ => format!("Deviation from the friction of the file: {}.", words(curve)),
        });
        let own = self.own.as_ref().map(|curve| format!("Under the preset's law: {}.", words(curve)));
        let unknown = self.alone.as_ref().err().map(|reason| format!("The curve of the file is unknown: {reason}"));
        let fade = faded_below(&preset.bench);
        let faded = (self.role == Part::Friction && fade > 0.0).then(|| {
            format!(
                "The preset's law renders no torque below {fade} rad/s: there the machine's own friction remains. \
                 A law with bristles does not fade out (bench.law.kind = \"residual\")."
            )
        });
        loaded.into_iter().chain(own).chain(unknown).chain(faded).collect()
    }

    /// Names of files, figures and captions.
    pub(super) fn figures(&self, preset: &Preset<f64>) -> Vec<(String, Figure, String)> {
        let Some(curve) = &self.loaded else { return Vec::new() };
        let mut expected: Vec<_> =
            curve.plateaus.iter().map(|plateau| (plateau.velocity, self.expected(plateau, preset))).collect();
        // Friction jumps at standstill.
        expected.push((0.0, f64::NAN));
        expected.sort_by(|a, b| a.0.total_cmp(&b.0));
        let figure = friction("Rendered friction")
            .series(Series::points(Role::Rendered, "measured", points(curve)))
            .series(Series::line(Role::Desired, self.expected_name(), expected))
            .series(plateaus(Role::Rendered, curve));
        let figure = self.own.iter().fold(figure, |figure, own| figure.series(plateaus(Role::Reference, own)));
        let caption = match self.own {
            Some(_) => "Friction measured under the loaded law, the desired friction, and in grey the preset's law.",
            None => "Friction measured under the loaded friction, and that of the file alone at constant velocity.",
        };
        vec![("rendered.svg".into(), figure, caption.into())]
    }
}

/// Torque of a friction alone at a constant velocity [rad/s], on a bench of these samples [s] and this limit [N m]: no
/// load torque, no drive torque.
fn steady(external: &mut External, velocity: f64, period: f64, torque_limit: f64) -> Result<f64, ExternalFault> {
    let samples = (ALONE / period).ceil() as usize;
    external.begin(period, torque_limit)?;
    let mut sum = 0.0;
    for k in 0..samples {
        let time = k as f64 * period;
        let moving = ModuleSample {
            time,
            measured_angle: velocity * time,
            measured_velocity: velocity,
            estimated_velocity: velocity,
            ..ModuleSample::default()
        };
        let torque = external.step(&moving)?;
        sum += if k >= samples / 2 { torque } else { 0.0 };
    }
    Ok(sum / (samples - samples / 2) as f64)
}
