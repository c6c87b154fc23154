//! The friction that is felt while a loaded friction or law renders: measured at constant speeds, beside what it should be.

use serde_json::Value;
use stickslip_core::supervise::ExternalFault;

use crate::workflow::draw::{friction, plateaus, points};
use crate::workflow::render::faded_below;
use crate::{FrictionCurve, FrictionPlan, Plateau, measure_friction};
use stickslip_base::figure::{Figure, Role, Series};
use stickslip_base::quantity::{Estimate, NORMAL95};
use stickslip_base::report::{Cell, Table};
use stickslip_base::{Error, Preset, Summary, Watch};
use stickslip_bench::Bench;
use stickslip_bench::external::{External, ModuleSample, Role as Part, role};

/// A friction is stepped alone for so long at each velocity [s]; the mean of the last half counts.
const ALONE: f64 = 1.0;

/// What was measured, and what it should be.
pub(super) struct Rendered {
    role: Part,
    plan: FrictionPlan<f64>,
    brought: Option<FrictionCurve>,
    /// Under the preset's law, beside which a law stands.
    own: Option<FrictionCurve>,
    /// Velocity and torque of a friction alone [rad/s], [N m]; why not.
    alone: Result<Vec<(f64, f64)>, String>,
}

/// How far a curve is from what it should be.
struct Deviation {
    rms: f64,
    /// Of largest magnitude, and at which velocity.
    largest: f64,
    velocity: f64,
}

impl Rendered {
    /// At as many speeds of the quick plan as fit into a duration [s], two at least.
    pub(super) fn planned(role: Part, preset: &Preset<f64>, duration: f64) -> Self {
        let mut plan = FrictionPlan::quick();
        while plan.speeds > 2.0 && plan.duration(0.0, preset.bench.tick_time()) > duration {
            plan.speeds -= 1.0;
        }
        Rendered { role, plan, brought: None, own: None, alone: Ok(Vec::new()) }
    }

    /// Under what was brought along.
    pub(super) fn with(&mut self, bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
        self.brought = Some(measure_friction(&self.plan, bench, true, watch)?);
        Ok(())
    }

    /// A law stands beside that of the preset.
    pub(super) fn without(&mut self, bench: &mut dyn Bench, watch: &Watch) -> Result<(), Error> {
        if self.role == Part::Law {
            self.own = Some(measure_friction(&self.plan, bench, true, watch)?);
        }
        Ok(())
    }

    /// A friction alone, at the velocities that were measured.
    pub(super) fn ask(&mut self, external: &mut External, preset: &Preset<f64>) {
        if self.role != Part::Friction {
            return;
        }
        let velocities = self.brought.iter().flat_map(|curve| &curve.plateaus).map(|plateau| plateau.velocity);
        let limit = role::torque_limit(self.role, &preset.model, &preset.bench);
        let asked = velocities.map(|velocity| {
            let torque = steady(external, velocity, role::period(self.role, &preset.bench), limit);
            torque.map(|torque| (velocity, torque)).map_err(|fault| external.told(fault).to_string())
        });
        self.alone = asked.collect();
    }

    /// What should be felt at the velocity of a plateau [N m]; NaN where that is not known.
    fn expected(&self, plateau: &Plateau, preset: &Preset<f64>) -> f64 {
        if self.role == Part::Law {
            return preset.bench.desired.torque(plateau.velocity);
        }
        let known = self.alone.iter().flatten().find(|(velocity, _)| *velocity == plateau.velocity);
        known.map_or(f64::NAN, |(_, torque)| *torque)
    }

    fn deviation(&self, curve: &FrictionCurve, preset: &Preset<f64>) -> Deviation {
        let of = |plateau: &Plateau| (plateau.velocity, plateau.torque - self.expected(plateau, preset));
        let all: Vec<(f64, f64)> = curve.kept().map(of).collect();
        let square: f64 = all.iter().map(|(_, deviation)| deviation * deviation).sum();
        let none = (f64::NAN, f64::NAN);
        let largest = all.iter().copied().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or(none);
        Deviation { rms: libm::sqrt(square / all.len() as f64), largest: largest.1, velocity: largest.0 }
    }

    /// What it should be is called so.
    fn wanted(&self) -> &'static str {
        if self.role == Part::Law { "desired" } else { "of the file" }
    }

    pub(super) fn table(&self, preset: &Preset<f64>) -> Table {
        let law = self.own.is_some();
        let mut heads = vec!["velocity", "measured", self.wanted(), "deviation"];
        heads.extend(law.then_some("deviation, preset's law"));
        let caption = if law {
            "Friction that the drive feels under the loaded law, beside the desired one; and how far it is from that under \
             the preset's law."
        } else {
            "Friction that the drive feels under the loaded friction, beside that of the file alone at constant velocity."
        };
        let mut table = Table::new(heads).caption(caption);
        let missing = || Cell::from("sticks or hunts");
        for plateau in self.brought.iter().flat_map(|curve| &curve.plateaus) {
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

    pub(super) fn tell(&self, preset: &Preset<f64>, summary: &mut Summary) {
        for (who, curve) in [("rendered", &self.brought), ("own", &self.own)] {
            let Some(curve) = curve else { continue };
            let Deviation { rms, largest, .. } = self.deviation(curve, preset);
            summary.result(&format!("{who}.rms"), rms, "N m").result(&format!("{who}.largest"), largest.abs(), "N m");
            summary.result(&format!("{who}.plateaus"), curve.kept().count() as f64, "1");
            summary.result(&format!("{who}.dropped_plateaus"), curve.dropped().count() as f64, "1");
            for plateau in &curve.plateaus {
                summary.row([
                    ("kind", Value::from("plateau")),
                    ("under", who.into()),
                    ("velocity", plateau.velocity.into()),
                    ("torque", plateau.torque.into()),
                    ("standard_error", plateau.standard_error.into()),
                    ("wanted", self.expected(plateau, preset).into()),
                    ("counts", plateau.dropped.is_none().into()),
                ]);
            }
        }
    }

    /// What came of it, in sentences.
    pub(super) fn lead(&self, preset: &Preset<f64>) -> Vec<String> {
        let words = |curve: &FrictionCurve| {
            let Deviation { rms, largest, velocity } = self.deviation(curve, preset);
            let [rms, largest] = [rms, largest.abs()].map(|torque| Estimate::new(torque, "N m"));
            let at = Estimate::new(velocity, "rad/s");
            let dropped = curve.dropped().count();
            let dropped =
                if dropped > 0 { format!("; at {dropped} speeds the load sticks or hunts") } else { String::new() };
            format!("{rms} RMS, {largest} at most (at {at}){dropped}")
        };
        let brought = self.brought.as_ref().map(|curve| match self.role {
            Part::Law => format!("The desired friction is met within {}.", words(curve)),
            _ => format!("The friction of the file is felt within {}.", words(curve)),
        });
        let own = self.own.as_ref().map(|curve| format!("Under the preset's law: {}.", words(curve)));
        let unknown = self.alone.as_ref().err().map(|why| format!("Its own curve is not known: {why}"));
        let fade = faded_below(&preset.bench);
        let faded = (self.role == Part::Friction && fade > 0.0).then(|| {
            format!(
                "The preset's law gives nothing below {fade} rad/s, or less: the machine's own friction is felt there as \
                 well. One with bristles does not fade out (bench.law.kind = \"residual\")."
            )
        });
        brought.into_iter().chain(own).chain(unknown).chain(faded).collect()
    }

    /// Names of files, figures and captions.
    pub(super) fn figures(&self, preset: &Preset<f64>) -> Vec<(String, Figure, String)> {
        let Some(curve) = &self.brought else { return Vec::new() };
        let mut expected: Vec<_> =
            curve.plateaus.iter().map(|plateau| (plateau.velocity, self.expected(plateau, preset))).collect();
        // Friction jumps at standstill.
        expected.push((0.0, f64::NAN));
        expected.sort_by(|a, b| a.0.total_cmp(&b.0));
        let figure = friction("Friction while it renders")
            .series(Series::points(Role::Rendered, "measured", points(curve)))
            .series(Series::line(Role::Desired, self.wanted(), expected))
            .series(plateaus(Role::Rendered, curve));
        let figure = self.own.iter().fold(figure, |figure, own| figure.series(plateaus(Role::Reference, own)));
        let caption = match self.own {
            Some(_) => "Friction measured under the loaded law, the desired one, and grey what the preset's law gives.",
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
