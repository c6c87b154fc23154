//! Figures of an identification: friction over speed, and a lap of the recording beside its prediction.

use std::ops::Range;

use super::Identification;
use crate::figure::{Axis as FigureAxis, Figure, Role, Series};
use crate::fit::LinearFit;
use crate::machine::Axis;

/// Points of a drawn curve in each direction.
const POINTS: usize = 200;

impl Identification {
    /// All figures with file name and caption.
    pub fn figures(&self) -> [(&'static str, Figure, String); 3] {
        let (lap, laps) = self.lap();
        let which = match laps {
            0 => "The whole recording".to_owned(),
            laps => format!("One of {laps} laps, the one with the median error"),
        };
        let simulated = match self.closed_loop {
            Some(_) => "The simulated loop gets the reference alone; the recorded command is not used.",
            None => "The model gets the recorded motion alone.",
        };
        let friction = "What is left of the drive force without inertia. Means over bins of speed while the axis \
                        speeds up or slows down, and over stretches of constant speed.";
        [
            ("figure-friction.svg", self.friction_figure(), friction.into()),
            ("figure-prediction.svg", self.prediction_figure(lap.clone()), format!("{which}. {simulated}")),
            ("figure-error.svg", self.error_figure(lap), format!("{which}: measured minus predicted.")),
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
        let points = curve.points.iter().map(|p| (p.velocity, p.torque));
        let plateaus = curve.plateaus.iter().map(|p| (p.point.velocity, p.point.torque));
        let fit = &self.asymmetric.fit;
        let band = || grid(self.fastest()).map(|velocity| asymmetric(fit, velocity));
        let best = grid(self.fastest()).map(|v| (v, self.best().model.steady_force(v) - self.motion.offset));
        Figure::new("Friction over velocity")
            .x(velocity)
            .y(FigureAxis::new(format!("friction {quantity}"), unit))
            .interval(-curve.slowest, curve.slowest, "too slow to tell")
            .series(Series::points(Role::Measured, "changing speed", points).large())
            .series(Series::points(Role::Reference, "constant speed", plateaus).large())
            .series(Series::band(Role::Trace(1), "95 %", band().map(|[v, low, _, high]| (v, low, high))))
            .series(Series::line(Role::Trace(1), "Coulomb and viscous", band().map(|[v, _, f, _]| (v, f))).dashed())
            .series(Series::line(Role::Fitted, "best model", best))
    }

    fn prediction_figure(&self, lap: Range<usize>) -> Figure {
        let (title, quantity, unit) = self.predicted_quantity();
        let rows = || lap.clone().filter_map(|i| self.compared(i));
        Figure::new(title)
            .x(FigureAxis::new("time", "s"))
            .y(FigureAxis::new(quantity, unit))
            .series(Series::points(Role::Measured, "measured", rows().map(|[time, measured, _]| (time, measured))))
            .series(Series::line(Role::Fitted, "predicted", rows().map(|[time, _, predicted]| (time, predicted))))
    }

    fn error_figure(&self, lap: Range<usize>) -> Figure {
        let (_, quantity, unit) = self.predicted_quantity();
        let rows = lap.filter_map(|i| self.compared(i)).map(|[time, measured, predicted]| (time, measured - predicted));
        Figure::new("What the prediction misses")
            .x(FigureAxis::new("time", "s"))
            .y(FigureAxis::new(format!("error of the {quantity}"), unit))
            .series(Series::line(Role::Trace(0), "measured − predicted", rows))
    }

    /// Title, quantity and unit of what the best model predicts.
    fn predicted_quantity(&self) -> (&'static str, &'static str, &'static str) {
        let (quantity, unit) = self.force();
        match self.closed_loop {
            Some(_) => ("Command of the controller, recorded and simulated", "command", self.command_unit),
            None => ("Balance of forces, recorded and explained", quantity, unit),
        }
    }

    /// Time [s], measured and predicted at a sample: command [V] or, without a known controller, force.
    fn compared(&self, sample: usize) -> Option<[f64; 3]> {
        let time = sample as f64 * self.signals.period;
        let Some(run) = &self.closed_loop else {
            let model = &self.best().model;
            let predicted =
                model.inertia * self.motion.acceleration[sample] + model.steady_force(self.motion.velocity[sample]);
            return Some([time, self.motion.smooth_force[sample] + self.motion.offset, predicted]);
        };
        let predicted = run.command.get(sample.checked_sub(run.range.start)?)?;
        Some([time, self.signals.command[sample], *predicted])
    }

    /// The samples of a typical lap, and how many laps there are; all samples where there is none.
    ///
    /// A lap is from one rise through the middle of the stroke to the next, with a visit below its lower quarter.
    fn lap(&self) -> (Range<usize>, usize) {
        let position = &self.motion.position;
        let (low, high) = position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), q| (l.min(*q), h.max(*q)));
        let mut starts = Vec::new();
        let mut was_low = false;
        for (i, q) in position.iter().enumerate() {
            let share = (q - low) / (high - low);
            was_low |= share < 0.25;
            if was_low && share > 0.5 {
                starts.push(i);
                was_low = false;
            }
        }
        let error = |lap: &Range<usize>| {
            let errors = lap.clone().filter_map(|i| self.compared(i)).map(|[_, a, b]| (a - b).powi(2));
            errors.sum::<f64>() / lap.len() as f64
        };
        let mut laps: Vec<(f64, Range<usize>)> =
            starts.windows(2).map(|s| s[0]..s[1]).map(|lap| (error(&lap), lap)).collect();
        laps.sort_by(|a, b| a.0.total_cmp(&b.0));
        let typical = laps.get(laps.len() / 2).map(|lap| lap.1.clone());
        (typical.unwrap_or(0..position.len()), laps.len())
    }

    /// What friction is called, and its unit.
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
    // The interval of a coefficient tells how many standard errors make 95 %.
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
    fn the_laps_are_those_of_the_recording() {
        let (lap, laps) = found().lap();
        // Four and a half strokes out and back: three times from a rise through the middle to the next.
        assert_eq!(laps, 3);
        let middle = |i: usize| (found().motion.position[i] - 0.125).abs() < 2e-3;
        assert!(middle(lap.start) && middle(lap.end) && lap.len() > 6000, "{lap:?}");
    }

    #[test]
    fn a_recording_without_a_lap_is_shown_whole() {
        let mut once = found().clone();
        once.motion.position.truncate(2500);
        assert_eq!(once.lap(), (0..2500, 0));
    }

    #[test]
    fn the_error_of_the_lap_is_what_the_summary_says_of_the_whole() {
        let samples = emps().1.rows();
        let rows: Vec<_> = (50..samples).filter_map(|i| found().compared(i)).collect();
        let norm = |f: &dyn Fn(&[f64; 3]) -> f64| rows.iter().map(|r| f(r).powi(2)).sum::<f64>().sqrt();
        let error = norm(&|r| r[1] - r[2]) / norm(&|r| r[1]);
        let said = found().best().prediction.unwrap().voltage_error;
        assert!((error / said - 1.0).abs() < 1e-12, "{error} {said}");
    }
}
