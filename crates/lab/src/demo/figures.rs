//! Figures 5 and 12 to 14 of the paper, from this run.

use super::Demo;
use crate::bench::Frame;
use crate::experiment::FrictionCurve;
use crate::figure::{Axis, Figure, Role, Series};
use stickslip_core::friction::Stribeck;

/// Points of a drawn curve.
const POINTS: usize = 400;

impl Demo {
    /// Speed up to which curves are drawn [rad/s]: beyond the plan, where the difference torque changes its sign.
    fn drawn_to(&self) -> f64 {
        1.6 * self.plan.fastest
    }

    /// Figure 5: released, pressed and desired.
    pub fn figure_5(&self) -> Figure {
        let fastest = self.drawn_to();
        friction("Own friction with linings released (1) and pressed on (2), and the desired (3)")
            .series(Series::points(Role::Reference, "1 measured", folded_points(&self.released.curve)))
            .series(Series::line(Role::Reference, "1 fitted", folded(&self.released.fit.curve(), fastest)))
            .series(Series::points(Role::Measured, "2 measured", folded_points(&self.pressed.curve)))
            .series(Series::line(Role::Fitted, "2 fitted", folded(&self.pressed.fit.curve(), fastest)))
            .series(Series::line(Role::Desired, "3 desired", folded(&self.law.desired, fastest)))
    }

    /// Figure 12: own friction as measured, and the desired characteristic.
    pub fn figure_12(&self) -> Figure {
        let fastest = self.drawn_to();
        friction("Measured friction with friction wheel, and desired characteristic")
            .series(Series::points(Role::Measured, "measured", points(&self.own.curve)))
            .series(Series::line(Role::Own, "fitted", curve(&self.law.own, fastest)))
            .series(Series::line(Role::Desired, "desired", curve(&self.law.desired, fastest)))
    }

    /// Figure 13: desired characteristic, and the friction measured under the rendering law.
    pub fn figure_13(&self) -> Figure {
        let (fastest, fade) = (self.drawn_to(), self.law.fade_velocity);
        friction("Desired characteristic, and friction measured while the load motor renders it")
            .interval(-fade, fade, "fade-out")
            .series(Series::points(Role::Rendered, "measured", points(&self.rendered)))
            .series(Series::line(Role::Own, "own", curve(&self.law.own, fastest)))
            .series(Series::line(Role::Desired, "desired", curve(&self.law.desired, fastest)))
    }

    /// Figure 14: difference torque as the law asks for it, and the load motor's by its current.
    pub fn figure_14(&self) -> Figure {
        let (fastest, fade) = (self.drawn_to(), self.law.fade_velocity);
        let measured = self
            .rendered
            .kept()
            .flat_map(|plateau| plateau.blocks.iter().map(|block| (block.velocity, block.load_torque)));
        let asked = grid(fastest).map(|velocity| (velocity, self.law.torque(velocity)));
        Figure::new("Difference torque, and torque of the load motor by its current")
            .x(Axis::new("speed Ω", "rad/s").stretched())
            .y(Axis::new("load torque", "N m"))
            .interval(-fade, fade, "fade-out")
            .series(Series::points(Role::Rendered, "measured", measured))
            .series(Series::line(Role::Desired, "difference torque", asked))
    }

    /// The step at the fade limits: a sweep through standstill.
    pub fn figure_sweep(&self) -> Figure {
        let fade = self.law.fade_velocity;
        let of = |value: fn(&Frame) -> f64| {
            self.sweep.iter().map(|frame| (frame.signals.estimated_velocity, value(frame))).collect::<Vec<_>>()
        };
        let limit = self.sweep.iter().fold(0.0, |most: f64, frame| most.max(frame.signals.estimated_velocity.abs()));
        let asked = (0..=POINTS)
            .map(|k| limit * (2.0 * k as f64 / POINTS as f64 - 1.0))
            .map(|velocity| (velocity, self.law.torque(velocity)));
        Figure::new("Sweep through standstill: the step at the fade limits")
            .x(Axis::new("estimated speed Ω", "rad/s"))
            .y(Axis::new("load torque", "N m"))
            .interval(-fade, fade, "fade-out")
            .series(Series::points(Role::Rendered, "measured", of(|frame| frame.signals.measured_load_torque)))
            .series(Series::line(Role::Desired, "difference torque", asked))
    }
}

fn friction(title: &str) -> Figure {
    Figure::new(title).x(Axis::new("speed Ω", "rad/s").stretched()).y(Axis::new("friction torque", "N m"))
}

/// The parts of all plateaus that slid: the noisy course.
fn points(curve: &FrictionCurve) -> impl Iterator<Item = (f64, f64)> + '_ {
    curve.kept().flat_map(|plateau| plateau.blocks.iter().map(|block| (block.velocity, block.torque)))
}

/// The same with both directions on the positive side.
fn folded_points(curve: &FrictionCurve) -> impl Iterator<Item = (f64, f64)> + '_ {
    curve.kept().flat_map(|plateau| {
        let sign = plateau.set_velocity.signum();
        plateau.blocks.iter().map(move |block| (sign * block.velocity, sign * block.torque))
    })
}

/// Velocities from −fastest to fastest, dense around standstill, without 0 itself.
fn grid(fastest: f64) -> impl Iterator<Item = f64> {
    let half = move |sign: f64| {
        (0..POINTS).map(move |k| {
            let share = if sign < 0.0 { POINTS - 1 - k } else { k } as f64 / (POINTS - 1) as f64;
            sign * 1e-3 * libm::exp(libm::log(fastest / 1e-3) * share)
        })
    };
    half(-1.0).chain(half(1.0))
}

fn curve(law: &Stribeck<f64>, fastest: f64) -> impl Iterator<Item = (f64, f64)> + use<> {
    let law = *law;
    grid(fastest).map(move |velocity| (velocity, law.torque(velocity)))
}

/// The positive half alone.
fn folded(law: &Stribeck<f64>, fastest: f64) -> impl Iterator<Item = (f64, f64)> + use<> {
    curve(law, fastest).filter(|(velocity, _)| *velocity > 0.0)
}
