//! Motion and force from the recorded position and command, for the balance of forces.

use std::ops::Range;

use super::axis::AxisModel;
use crate::machine::{Machine, Signals};
use stickslip_base::Error;
use stickslip_base::filter::{LowPass, central_difference, decimate};
use stickslip_fit::{LinearFit, fit_linear};

/// Motion and force at every sample, all of one length. Units as the axis has them: m and N, or rad and N m.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Sampling period [s].
    pub period: f64,
    /// Position, low-passed.
    pub position: Vec<f64>,
    /// Velocity: central difference of the position.
    pub velocity: Vec<f64>,
    /// Acceleration: central difference of the velocity.
    pub acceleration: Vec<f64>,
    /// Drive gain times the input of the drive, as recorded.
    pub force: Vec<f64>,
    /// The force through the low-pass of the position.
    pub smooth_force: Vec<f64>,
    /// Constant force that was subtracted from both: the weight on a vertical axis, else 0.
    pub offset: f64,
    /// Inertia, if stated in the machine file [kg or kg m²].
    pub inertia: Option<f64>,
}

impl Motion {
    /// Motion by the machine's recipe; the low-pass is applied in both directions and adds no delay.
    ///
    /// # Errors
    /// A recording too short for the low-pass, or a cut-off above half the sampling rate.
    pub fn of(signals: &Signals, machine: &Machine) -> Result<Self, Error> {
        let period = signals.period;
        let low_pass = LowPass::butterworth(machine.recipe.order, machine.recipe.low_pass, 1.0 / period)?;
        let position = low_pass.both_ways(&signals.position)?;
        let velocity = match &signals.velocity {
            Some(measured) => low_pass.both_ways(measured)?,
            None => central_difference(&position, period),
        };
        let acceleration = central_difference(&velocity, period);
        let force: Vec<f64> = signals.drive_input().iter().map(|u| machine.gain * u).collect();
        let smooth_force = low_pass.both_ways(&force)?;
        Ok(Motion {
            period,
            position,
            velocity,
            acceleration,
            force,
            smooth_force,
            offset: 0.0,
            inertia: machine.inertia,
        })
    }

    /// Subtracts a constant force, so that only friction and inertia remain.
    pub(super) fn unload(&mut self, offset: f64) {
        for force in self.force.iter_mut().chain(&mut self.smooth_force) {
            *force -= offset;
        }
        self.offset += offset;
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.position.len()
    }
}

/// Columns of a regression and its measured values, decimated.
#[derive(Clone, Debug, PartialEq)]
pub struct Regression {
    /// One for each parameter.
    pub columns: Vec<Vec<f64>>,
    /// Force.
    pub measured: Vec<f64>,
}

impl Regression {
    /// Evaluates `regressors` (velocity, acceleration) at each sample of the range and decimates all columns alike, so
    /// that the low-pass has the same effect on both sides of the balance.
    ///
    /// # Errors
    /// A range too short to decimate.
    pub fn of<const K: usize>(
        motion: &Motion,
        range: Range<usize>,
        decimation: usize,
        regressors: impl Fn(f64, f64) -> [f64; K],
    ) -> Result<Self, Error> {
        let rows: Vec<[f64; K]> =
            range.clone().map(|i| regressors(motion.velocity[i], motion.acceleration[i])).collect();
        let column = |k: usize| decimate(&rows.iter().map(|r| r[k]).collect::<Vec<_>>(), decimation);
        let columns = (0..K).map(column).collect::<Result<_, _>>()?;
        Ok(Regression { columns, measured: decimate(&motion.force[range], decimation)? })
    }

    /// Least squares. The first column is the acceleration; where its coefficient, the inertia, is known, the others
    /// explain the rest.
    ///
    /// # Errors
    /// Too few rows, or a motion that does not determine the parameters.
    pub fn fit(&self, inertia: Option<f64>) -> Result<LinearFit, Error> {
        let Some(inertia) = inertia else { return fit_linear(&self.columns, &self.measured) };
        let rest: Vec<f64> = self.measured.iter().zip(&self.columns[0]).map(|(f, a)| f - inertia * a).collect();
        let mut fit = fit_linear(&self.columns[1..], &rest)?;
        fit.with_known_first(inertia);
        fit.relative_error *= norm(&rest) / norm(&self.measured);
        Ok(fit)
    }
}

/// ‖measured − predicted‖ / ‖measured‖ of the force over a range, decimated: error of a model for the measured motion.
///
/// # Errors
/// A range too short to decimate.
pub fn force_error(
    model: &AxisModel<f64>,
    motion: &Motion,
    range: Range<usize>,
    decimation: usize,
) -> Result<f64, Error> {
    let predicted = |velocity: f64, acceleration: f64| {
        [model.inertia * acceleration + model.steady_force(velocity) - motion.offset]
    };
    let rows = Regression::of(motion, range, decimation, predicted)?;
    let missed: Vec<f64> = rows.measured.iter().zip(&rows.columns[0]).map(|(f, p)| f - p).collect();
    Ok(norm(&missed) / norm(&rows.measured))
}

pub(super) fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}
