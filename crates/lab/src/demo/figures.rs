//! Figures 5 and 10 to 14 of the paper, from this run, each with its file and what one sees in it.

use super::{Demo, Measured};
use crate::bench::Frame;
use crate::figure::{Axis, Figure, Role, Series};
use crate::quantity::{Estimate, number, tied};
use crate::workflow::draw::{POINTS, curve, folded, folded_points, friction, grid, load, plateaus, points, torque};
use crate::workflow::tell::estimate;
use stickslip_core::friction::Stribeck;

/// A figure with the name of its file and its caption.
type Captioned = (&'static str, Figure, String);

impl Demo {
    /// Speed up to which curves are drawn [rad/s]: beyond the plan, where the difference torque changes its sign.
    fn drawn_to(&self) -> f64 {
        1.6 * self.plan.fastest
    }

    /// All figures in the order of the experiment.
    pub fn figures(&self) -> [(&'static str, Figure, String); 7] {
        [
            self.shaping(),
            self.measurement(),
            self.design(),
            self.own_and_desired(),
            self.desired_and_rendered(),
            self.load_torque(),
            self.sweep_through_standstill(),
        ]
    }

    /// Figure 5: released, pressed and desired.
    fn shaping(&self) -> Captioned {
        let fastest = self.drawn_to();
        let figure = friction("What friction wheel and load motor each do")
            .series(Series::points(Role::Reference, "1 released", folded_points(&self.released.curve)))
            .series(Series::line(Role::Reference, "1 fitted", folded(&self.released.fit.curve(), fastest)))
            .series(Series::points(Role::Measured, "2 pressed on", folded_points(&self.pressed.curve)))
            .series(Series::line(Role::Fitted, "2 fitted", folded(&self.pressed.fit.curve(), fastest)))
            .series(Series::line(Role::Desired, "3 desired", folded(&self.law.desired, fastest)));
        let breakaway = |measured: &Measured| tied(&estimate(&measured.fit, 0, "N m"));
        let caption = format!(
            "Friction without the wheel (1), with its linings pressed on fully (2), and the desired characteristic (3); \
             figure 5 of the paper. The wheel lifts the breakaway torque from {} to {}, a preload of {} brings it to \
             {}; what then remains between own and desired friction is the load motor's work.",
            breakaway(&self.released),
            breakaway(&self.pressed),
            number(self.preload.preload, 3),
            torque(self.preload.breakaway_torque),
        );
        ("figure-05.svg", figure, caption)
    }

    /// Figure 10: the noisy course, the plateaus with their errors, the fit with its band.
    fn measurement(&self) -> Captioned {
        let (fastest, fit) = (self.plan.fastest, &self.own.fit);
        let band = curve(&self.law.own, fastest).map(|(velocity, torque)| {
            let half_width = fit.band95(velocity.abs());
            (velocity, torque - half_width, torque + half_width)
        });
        let figure = friction("Measured own friction and its fit")
            .series(Series::points(Role::Measured, "course", points(&self.own.curve)))
            .series(Series::band(Role::Fitted, "95 %", band))
            .series(Series::line(Role::Fitted, "fit", curve(&self.law.own, fastest)))
            .series(plateaus(Role::Reference, &self.own.curve));
        let caption = format!(
            "Torque at {} constant speeds with the preload in force: the noisy course, its mean on each plateau with the \
             95\u{a0}% interval, and the Stribeck curve through them, which leaves {} rms; figure 10 of the paper.",
            self.own.curve.kept().count(),
            torque(fit.rms),
        );
        ("figure-10.svg", figure, caption)
    }

    /// Figure 11: the desired characteristic and the points that fix it, over the own friction.
    fn design(&self) -> Captioned {
        let (fastest, desired) = (self.drawn_to(), &self.law.desired);
        let Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, .. } = *desired;
        // Where each parameter shows most: at rest, on the slope, at the foot of the drop, at the fast end.
        let fixed = [0.0, stribeck_velocity, 8.0 * stribeck_velocity, fastest];
        let figure = friction("Design of the desired characteristic")
            .series(Series::line(Role::Own, "own", folded(&self.law.own, fastest)))
            .series(Series::line(Role::Desired, "desired", folded(desired, fastest)))
            .series(
                Series::points(Role::Reference, "reference points", fixed.map(|v| (v, desired.magnitude(v)))).large(),
            );
        let caption = format!(
            "Four reference points fix the four parameters: at rest M_S = {}, on the slope Ω_Strib = {}, behind the drop \
             M_K = {}, at the fast end b = {}; figure 11 of the paper.",
            torque(breakaway_torque),
            tied(&Estimate::new(stribeck_velocity, "rad/s")),
            torque(kinetic_torque),
            tied(&Estimate::new(viscous_friction, "N m s/rad")),
        );
        ("figure-11.svg", figure, caption)
    }

    /// Figure 12: own friction as measured, and the desired characteristic.
    fn own_and_desired(&self) -> Captioned {
        let fastest = self.drawn_to();
        let figure = friction("Own friction and desired characteristic")
            .series(Series::points(Role::Measured, "measured", points(&self.own.curve)))
            .series(Series::line(Role::Own, "own, fitted", curve(&self.law.own, fastest)))
            .series(Series::line(Role::Desired, "desired", curve(&self.law.desired, fastest)));
        let widest = grid(fastest).map(|velocity| self.law.torque(velocity).abs()).fold(0.0, f64::max);
        let caption = format!(
            "Own friction at the preload that was set, measured, and what the axis shall feel like; figure 12 of the \
             paper. The load motor has to bridge up to {}.",
            torque(widest),
        );
        ("figure-12.svg", figure, caption)
    }

    /// Figure 13: desired characteristic, and the friction measured under the rendering law.
    fn desired_and_rendered(&self) -> Captioned {
        let (fastest, fade) = (self.drawn_to(), self.law.fade_velocity);
        let figure = friction("Desired characteristic, and friction measured under it")
            .interval(-fade, fade, "fade-out")
            .series(Series::points(Role::Rendered, "measured", points(&self.rendered)))
            .series(Series::line(Role::Own, "own", curve(&self.law.own, fastest)))
            .series(Series::line(Role::Desired, "desired", curve(&self.law.desired, fastest)))
            .series(plateaus(Role::Rendered, &self.rendered));
        let caption = format!(
            "Measured again while the load motor renders the difference; figure 13 of the paper. Outside the fade-out \
             the plateaus lie {} rms from the desired characteristic, inside, where only the mechanics acts, {}.",
            self.over_breakaway(self.error_outside_fade()),
            self.over_breakaway(self.error_inside_fade()),
        );
        ("figure-13.svg", figure, caption)
    }

    /// Figure 14: difference torque as the law asks for it, and the load motor's by its current.
    fn load_torque(&self) -> Captioned {
        let (fastest, fade) = (self.drawn_to(), self.law.fade_velocity);
        let measured = self
            .rendered
            .kept()
            .flat_map(|plateau| plateau.blocks.iter().map(|block| (block.velocity, block.load_torque)));
        let asked = grid(fastest).map(|velocity| (velocity, self.law.torque(velocity)));
        let figure = load("Difference torque, and torque of the load motor")
            .x(Axis::new("speed Ω", "rad/s").stretched())
            .interval(-fade, fade, "fade-out")
            .series(Series::points(Role::Rendered, "measured", measured))
            .series(Series::line(Role::Reference, "difference torque", asked));
        let caption = "The reference of the load motor's current control, and its torque by the current sensor; \
                       figure 14 of the paper.";
        ("figure-14.svg", figure, caption.into())
    }

    /// The step at the fade limits.
    fn sweep_through_standstill(&self) -> Captioned {
        let fade = self.law.fade_velocity;
        let of = |value: fn(&Frame) -> f64| {
            self.sweep.iter().map(|frame| (frame.signals.estimated_velocity, value(frame))).collect::<Vec<_>>()
        };
        let limit = self.sweep.iter().fold(0.0, |most: f64, frame| most.max(frame.signals.estimated_velocity.abs()));
        let asked = (0..=POINTS)
            .map(|k| limit * (2.0 * k as f64 / POINTS as f64 - 1.0))
            .map(|velocity| (velocity, self.law.torque(velocity)));
        let figure = load("Sweep through standstill")
            .x(Axis::new("estimated speed Ω", "rad/s"))
            .interval(-fade, fade, "fade-out")
            .series(Series::points(Role::Rendered, "measured", of(|frame| frame.signals.measured_load_torque)))
            .series(Series::line(Role::Reference, "difference torque", asked));
        let caption = format!(
            "A slow sweep both ways: at the limits of the fade-out, ± {}, the difference torque steps by {}. The step \
             that figure 14 of the paper shows, from close by.",
            tied(&Estimate::new(fade, "rad/s")),
            torque(self.step_at_fade()),
        );
        ("figure-14-sweep.svg", figure, caption)
    }

    /// Height of the torque step at the limits of the fade-out [N m].
    pub(super) fn step_at_fade(&self) -> f64 {
        let fade = self.law.fade_velocity;
        (self.law.desired.magnitude(fade) - self.law.own.magnitude(fade)).abs()
    }

    /// A torque as people compare it: "1.23 % of M_S", the desired breakaway torque.
    pub(super) fn over_breakaway(&self, torque: f64) -> String {
        format!("{}\u{a0}% of M_S", number(100.0 * torque / self.law.desired.breakaway_torque, 2))
    }
}
