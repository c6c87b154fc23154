//! Figures 5 and 10 to 14 of the paper, from this run, each with its file and caption.

use super::{Demo, Measured};
use crate::workflow::draw::{Captioned, curve, folded, folded_points, friction, measured, plateaus, points, torque};
use crate::workflow::results::estimate;
use stickslip_base::figure::{Figure, Role, Series};
use stickslip_base::quantity::{Estimate, number, tied};
use stickslip_core::friction::Stribeck;

impl Demo {
    /// All figures in the order of the experiment.
    pub fn figures(&self) -> [(&'static str, Figure, String); 7] {
        let [own_and_desired, rendered, load_torque, sweep] = self.rendering.figures(Some(measured(&self.own.curve)));
        [self.shaping(), self.measurement(), self.design(), own_and_desired, rendered, load_torque, sweep]
    }

    /// Figure 5: released, pressed and desired.
    fn shaping(&self) -> Captioned {
        let fastest = self.rendering.drawn_to();
        let figure = friction("Shares of friction wheel and load motor")
            .series(Series::points(Role::Reference, "1 released", folded_points(&self.released.curve)))
            .series(Series::line(Role::Reference, "1 fitted", folded(&self.released.fit.curve(), fastest)))
            .series(Series::points(Role::Measured, "2 pressed on", folded_points(&self.pressed.curve)))
            .series(Series::line(Role::Fitted, "2 fitted", folded(&self.pressed.fit.curve(), fastest)))
            .series(Series::line(Role::Desired, "3 desired", folded(&self.rendering.law.desired, fastest)));
        let breakaway = |measured: &Measured| tied(&estimate(&measured.fit, 0, "N m"));
        let caption = format!(
            "Friction without the wheel (1), with its linings pressed on fully (2), and the desired characteristic (3); \
             figure 5 of the paper. The wheel raises the breakaway torque from {} to {}; a preload of {} sets it to \
             {}. The load motor renders the remaining difference between own and desired friction.",
            breakaway(&self.released),
            breakaway(&self.pressed),
            number(self.preload.preload, 3),
            torque(self.preload.breakaway_torque),
        );
        ("figure-05.svg", figure, caption)
    }

    /// Figure 10: the noisy signal, the plateaus with their errors, the fit with its band.
    fn measurement(&self) -> Captioned {
        let (fastest, fit) = (self.plan.fastest, &self.own.fit);
        let band = curve(&self.rendering.law.own, fastest).map(|(velocity, torque)| {
            let half_width = fit.band95(velocity.abs());
            (velocity, torque - half_width, torque + half_width)
        });
        let figure = friction("Measured own friction and its fit")
            .series(Series::points(Role::Measured, "course", points(&self.own.curve)))
            .series(Series::band(Role::Fitted, "95 %", band))
            .series(Series::line(Role::Fitted, "fit", curve(&self.rendering.law.own, fastest)))
            .series(plateaus(Role::Reference, &self.own.curve));
        let caption = format!(
            "Torque at {} constant speeds at the active preload: the noisy signal, its mean on each plateau with the \
             95\u{a0}% interval, and the fitted Stribeck curve, residual {} rms; figure 10 of the paper.",
            self.own.curve.valid().count(),
            torque(fit.rms),
        );
        ("figure-10.svg", figure, caption)
    }

    /// Figure 11: the desired characteristic and its reference points, over the own friction.
    fn design(&self) -> Captioned {
        let (fastest, desired) = (self.rendering.drawn_to(), &self.rendering.law.desired);
        let Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, .. } = *desired;
        // Where each parameter has most effect: at rest, on the slope, at the foot of the drop, at the fast end.
        let fixed = [0.0, stribeck_velocity, 8.0 * stribeck_velocity, fastest];
        let figure = friction("Design of the desired characteristic")
            .series(Series::line(Role::Own, "own", folded(&self.rendering.law.own, fastest)))
            .series(Series::line(Role::Desired, "desired", folded(desired, fastest)))
            .series(
                Series::points(Role::Reference, "reference points", fixed.map(|v| (v, desired.magnitude(v)))).large(),
            );
        let caption = format!(
            "Four reference points determine the four parameters: at rest M_S = {}, on the slope Ω_Strib = {}, behind the \
             drop M_K = {}, at the fast end b = {}; figure 11 of the paper.",
            torque(breakaway_torque),
            tied(&Estimate::new(stribeck_velocity, "rad/s")),
            torque(kinetic_torque),
            tied(&Estimate::new(viscous_friction, "N m s/rad")),
        );
        ("figure-11.svg", figure, caption)
    }
}
