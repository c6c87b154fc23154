//! From the recorded position and command to what a force balance needs.

use std::ops::Range;

use crate::Error;
use crate::filter::{LowPass, central_difference, decimate};
use crate::machine::{Machine, Signals};

/// Motion and force at every sample, all of one length. Units as the axis has them: m and N, or rad and N m.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Sampling period [s].
    pub period: f64,
    /// Position, low-passed.
    pub position: Vec<f64>,
    /// Its central difference.
    pub velocity: Vec<f64>,
    /// And the next.
    pub acceleration: Vec<f64>,
    /// Drive gain times what reached the drive, as recorded.
    pub force: Vec<f64>,
    /// The same through the low-pass of the position.
    pub smooth_force: Vec<f64>,
}

impl Motion {
    /// By the machine's recipe; the low-pass looks both ways and adds no delay.
    ///
    /// # Errors
    /// A recording too short for the low-pass, or a cut-off above half the sampling rate.
    pub fn of(signals: &Signals, machine: &Machine) -> Result<Self, Error> {
        let period = signals.period;
        let low_pass = LowPass::butterworth(machine.recipe.order, machine.recipe.low_pass, 1.0 / period)?;
        let position = low_pass.both_ways(&signals.position)?;
        let velocity = central_difference(&position, period);
        let acceleration = central_difference(&velocity, period);
        let force: Vec<f64> = signals.drive_input().iter().map(|u| machine.gain * u).collect();
        let smooth_force = low_pass.both_ways(&force)?;
        Ok(Motion { period, position, velocity, acceleration, force, smooth_force })
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.position.len()
    }
}

/// Columns of a regression and what they should explain, decimated.
#[derive(Clone, Debug, PartialEq)]
pub struct Regression {
    /// One a parameter.
    pub columns: Vec<Vec<f64>>,
    /// Force.
    pub measured: Vec<f64>,
}

impl Regression {
    /// Evaluates `regressors` (velocity, acceleration) at each sample of the range and decimates all columns alike, so
    /// that what the low-pass takes from one side of the balance it takes from the other.
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

    /// ‖measured − columns·coefficients‖ / ‖measured‖.
    pub fn relative_error(&self, coefficients: &[f64]) -> f64 {
        let fitted = |i: usize| self.columns.iter().zip(coefficients).map(|(c, p)| c[i] * p).sum::<f64>();
        let residual: f64 = self.measured.iter().enumerate().map(|(i, y)| (y - fitted(i)).powi(2)).sum();
        (residual / self.measured.iter().map(|y| y * y).sum::<f64>()).sqrt()
    }
}
