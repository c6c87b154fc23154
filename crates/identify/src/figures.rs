//! Figures of an identification: friction over speed, and recording and prediction over time.

use std::ops::Range;

use super::Identification;
use super::limits::percent;
use super::recorded;
use crate::machine::Axis;
use stickslip_base::figure::{Axis as FigureAxis, Figure, Role, Series};
use stickslip_base::quantity::NORMAL95;
use stickslip_fit::{CurvePoint, LinearFit};

/// Points of a curve in each direction.
const POINTS: usize = 200;

impl Identification {
    /// All figures with file name and caption.
    pub fn figures(&self) -> [(&'static str, Figure, String); 5] {
        let best = self.best();
        let (which, error) = match &best.unseen {
            Some(_) => (
                "The second half of the recording, simulated in the closed loop by the fit to the first: the simulation \
                 uses only the reference, neither the recorded command nor the recorded motion.",
                format!("The error of the best model on unseen halves is {} of the command.", percent(best.held_out)),
            ),
            None => (
                "The second half of the recording; the model uses only the recorded motion.",
                format!(
                    "The error of the best model on unseen halves is {} of the {}.",
                    percent(best.held_out),
                    self.force().0
                ),
            ),
        };
        let friction = format!(
            "Drive {} minus inertia: means over bins of speed while the axis speeds up or slows \
             down, and over stretches of constant speed, with bars of 1.96 standard errors. The band is that of Coulomb \
             and viscous friction; the best model is {}.",
            self.force().0,
            best.kind.title(),
        );
        let [position, command] = recorded::figures(&self.signals, self.axis, self.command_unit);
        [
            position,
            command,
            ("figure-friction.svg", self.friction_figure(), friction),
            ("figure-prediction.svg", self.prediction_figure(), which.into()),
            ("figure-error.svg", self.error_figure(), format!("Residual of the same stretch. {error}")),
        ]
    }

    /// Measured friction, the two-parameter model of each direction with its 95 % band, and the best model.
    fn friction_figure(&self) -> Figure {
        let velocity = match self.axis {
            Axis::Linear => FigureAxis::new("velocity", "m/s"),
            Axis::Rotary => FigureAxis::new("velocity Ω", "rad/s").stretched(),
        };
        let (quantity, unit) = self.force();
        let curve = &self.curve;
        let bar = |p: &CurvePoint| (p.velocity, p.torque, NORMAL95 * p.standard_error);
        let points = curve.points.iter().map(bar);
        let plateaus = curve.plateaus.iter().map(|p| bar(&p.point));
        let fit = &self.asymmetric.fit;
        let band = || grid(self.fastest()).map(|velocity| asymmetric(fit, velocity));
        let best = grid(self.fastest()).map(|v| (v, self.best().model.steady_force(v) - self.motion.offset));
        Figure::new("Friction over velocity")
            .x(velocity)
            .y(FigureAxis::new(format!("friction {quantity}"), unit))
            .interval(-curve.slowest, curve.slowest, "too slow")
            .series(Series::bars(Role::Measured, "changing speed", points))
            .series(Series::bars(Role::Reference, "constant speed", plateaus))
            .series(Series::band(Role::Trace(1), "95 %", band().map(|[v, low, _, high]| (v, low, high))))
            .series(Series::line(Role::Trace(1), "Coulomb and viscous", band().map(|[v, _, f, _]| (v, f))).dashed())
            .series(Series::line(Role::Fitted, "best model", best))
    }

    fn prediction_figure(&self) -> Figure {
        let (title, quantity, unit) = self.predicted_quantity();
        let rows = || self.unseen().filter_map(|i| self.compared(i));
        Figure::new(title)
            .x(FigureAxis::new("time t", "s"))
            .y(FigureAxis::new(quantity, unit))
            .series(Series::points(Role::Measured, "recorded", rows().map(|[time, measured, _]| (time, measured))))
            .series(Series::line(Role::Fitted, "predicted", rows().map(|[time, _, predicted]| (time, predicted))))
    }

    fn error_figure(&self) -> Figure {
        let (_, quantity, unit) = self.predicted_quantity();
        let rows = self.unseen().filter_map(|i| self.compared(i));
        let residual = rows.map(|[time, measured, predicted]| (time, measured - predicted));
        Figure::new("Recorded minus predicted")
            .x(FigureAxis::new("time t", "s"))
            .y(FigureAxis::new(format!("error of the {quantity}"), unit))
            .series(Series::line(Role::Trace(0), "residual", residual))
    }

    /// The samples of the second half.
    fn unseen(&self) -> Range<usize> {
        let samples = self.motion.samples();
        self.best().unseen.as_ref().map_or(samples / 2..samples, |run| run.range.clone())
    }

    /// Title, quantity and unit of the prediction of the best model.
    fn predicted_quantity(&self) -> (&'static str, &'static str, &'static str) {
        let (quantity, unit) = self.force();
        match self.best().unseen {
            Some(_) => ("Command of the controller, recorded and predicted", "command", self.command_unit),
            None => ("Balance of forces, recorded and explained", quantity, unit),
        }
    }

    /// Time [s], measured and predicted at a sample: command [V] or, without a known controller, force.
    fn compared(&self, sample: usize) -> Option<[f64; 3]> {
        let time = sample as f64 * self.signals.period;
        let Some(run) = &self.best().unseen else {
            let model = &self.best().model;
            let predicted =
                model.inertia * self.motion.acceleration[sample] + model.steady_force(self.motion.velocity[sample]);
            return Some([time, self.motion.smooth_force[sample] + self.motion.offset, predicted]);
        };
        let predicted = run.command.get(sample.checked_sub(run.range.start)?)?;
        Some([time, self.signals.command[sample], *predicted])
    }

    /// Name of the friction force or torque, and its unit.
    pub(super) fn force(&self) -> (&'static str, &'static str) {
        match self.axis {
            Axis::Linear => ("force", "N"),
            Axis::Rotary => ("torque", "N m"),
        }
    }

    fn fastest(&self) -> f64 {
        self.curve.points.iter().fold(self.curve.slowest, |most, p| most.max(p.velocity.abs()))
    }
}

/// Velocities from −fastest to fastest, dense around standstill, with a gap at 0, where friction jumps.
fn grid(fastest: f64) -> impl Iterator<Item = f64> {
    let half = (1..=POINTS).map(move |k| fastest * (k as f64 / POINTS as f64).powi(2));
    half.clone().rev().map(|v| -v).chain([f64::NAN]).chain(half)
}

/// Velocity, then the friction of the asymmetric least squares with the ends of its 95 % band around it.
fn asymmetric(fit: &LinearFit, velocity: f64) -> [f64; 4] {
    let weights = if velocity > 0.0 { [0.0, velocity, 1.0, 0.0, 0.0] } else { [0.0, 0.0, 0.0, velocity, -1.0] };
    let force: f64 = fit.coefficients.iter().zip(&weights).map(|(c, w)| c * w).sum();
    // The interval of a coefficient determines how many standard errors make 95 %.
    let critical = 0.5 * (fit.ci95[1][1] - fit.ci95[1][0]) / fit.standard_errors[1];
    let half_width = critical * fit.variance(&weights).sqrt();
    [velocity, force - half_width, force, force + half_width]
}

#[cfg(test)]
mod tests {
    use super::super::tests::{emps, found};
    use super::*;

    #[test]
    fn the_band_at_its_edges_is_that_of_the_coefficients() {
        let fit = &found().asymmetric.fit;
        // At 1e-12 m/s friction is the Coulomb level: its interval is the band.
        for (velocity, index, sign) in [(1e-12, 2, 1.0), (-1e-12, 4, -1.0)] {
            let [_, low, force, high] = asymmetric(fit, velocity);
            assert!((sign * force - fit.coefficients[index]).abs() < 1e-6);
            assert!(((high - low) / (fit.ci95[index][1] - fit.ci95[index][0]) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn the_half_in_the_figure_is_predicted_by_a_fit_to_the_other_half() {
        let (samples, unseen) = (emps().1.rows(), found().unseen());
        assert_eq!(unseen, samples / 2..samples);
        let rows: Vec<_> = unseen.clone().filter_map(|i| found().compared(i)).collect();
        assert_eq!(rows.len(), unseen.len());
        let norm = |f: &dyn Fn(&[f64; 3]) -> f64| rows.iter().map(|r| f(r).powi(2)).sum::<f64>().sqrt();
        let error = norm(&|r| r[1] - r[2]) / norm(&|r| r[1]);
        // The other half of the mean is that of the first half by the second: 20 % is far more than their difference.
        assert!((error / found().best().held_out - 1.0).abs() < 0.2, "{error} {}", found().best().held_out);
        let whole = found().closed_loop.as_ref().expect("the controller is known");
        assert!(rows.iter().zip(&whole.command[unseen.start - whole.range.start..]).any(|(row, all)| row[2] != *all));
    }
}
