//! Fit in the closed loop: the parameters for which the simulated command equals the recorded one.
//!
//! The balance of forces requires the acceleration, which no sensor gives; here only the recorded command is compared,
//! and the loop keeps simulation and recording together over any length. Derivatives are those of the simulation
//! itself.

use std::ops::Range;

use nalgebra::{DMatrix, SMatrix, SVector};
use stickslip_core::friction::{Decay, Stribeck};
use stickslip_core::scalar::{Dual, Lanes, Scalar};

use super::axis::{AxisModel, Bristles, Loop};
use stickslip_base::{Error, Watch};
use stickslip_fit::{LongRun, Stop, TRIALS, minimise_side_by_side};

/// Names of the parameters, in order.
pub const CLOSED_LOOP: [&str; 12] = [
    "mass",
    "positive.breakaway",
    "positive.coulomb",
    "positive.stribeck_velocity",
    "positive.viscous",
    "negative.breakaway",
    "negative.coulomb",
    "negative.stribeck_velocity",
    "negative.viscous",
    "lag",
    "bristle_stiffness",
    "bristle_damping",
];

/// Number of parameters with a Stribeck curve for each direction and a lag of the drive.
pub(super) const STRIBECK: usize = 10;
/// The same with bristles.
pub(super) const LUGRE: usize = 12;

/// A fit in the closed loop.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined {
    /// The model.
    pub model: AxisModel<f64>,
    /// Its parameters, named by [`CLOSED_LOOP`].
    pub parameters: Vec<f64>,
    /// Standard errors, residual correlation counted; infinite where the motion does not determine them.
    pub standard_errors: Vec<f64>,
    /// 95 % intervals, in the logarithm.
    pub ci95: Vec<[f64; 2]>,
}

fn parameters<const N: usize>(model: &AxisModel<f64>) -> [f64; N] {
    let side = |s: &Stribeck<f64>| [s.breakaway_torque, s.kinetic_torque, s.stribeck_velocity, s.viscous_friction];
    let bristles = model.bristles.map_or([0.0; 2], |b| [b.stiffness, b.damping]);
    let [a, b] = [side(&model.positive), side(&model.negative)];
    let all = [&[model.inertia][..], &a, &b, &[model.lag], &bristles].concat();
    std::array::from_fn(|i| all[i])
}

fn model<const N: usize, T: Scalar>(p: [T; N], offset: f64) -> AxisModel<T> {
    let side = |first: usize| Stribeck {
        breakaway_torque: p[first],
        kinetic_torque: p[first + 1],
        stribeck_velocity: p[first + 2],
        viscous_friction: p[first + 3],
        decay: Decay::Exponential,
    };
    let (positive, negative) = (side(1), side(5));
    let bristles = (N == LUGRE).then(|| Bristles::passive(p[N - 2], p[N - 1], [&positive, &negative]));
    AxisModel { inertia: p[0], positive, negative, offset: T::of(offset), lag: p[9], bristles }
}

/// Minimises the error of the predicted command over a range of samples, without the first `skip` of them. N determines
/// the free parameters: [`STRIBECK`] or [`LUGRE`].
///
/// # Errors
/// [`Error::Cancelled`].
pub(super) fn refine<const N: usize>(
    around: &Loop<'_>,
    start: &AxisModel<f64>,
    range: Range<usize>,
    skip: usize,
    watch: &Watch,
) -> Result<Refined, Error> {
    // Derivatives come from coarse steps, in a fraction of the time, and most of the way the residuals as well; near the
    // end the residuals of the fine ones count. Stick makes the sum of squares rough: below 1e-3 of it (coarse) and 1e-4
    // (near the end) a search makes no progress, and the remaining error is far below the parameters' errors.
    let coarse = Loop { sub_steps: around.sub_steps.div_ceil(5), ..*around };
    let part = (range, skip);
    let slopes = |p: [Dual<N>; N]| residuals(&coarse, p, start.offset, &part, watch);
    let mut best = parameters(start);
    for (around, fall) in [(&coarse, 1e-3), (around, 1e-4)] {
        let stop = Stop { step: 1e-6, fall, evaluations: 20 };
        let trials = |p: [Lanes<f64, TRIALS>; N]| residuals(around, p, start.offset, &part, watch);
        best = minimise_side_by_side(best, [[0.0, f64::INFINITY]; N], stop, trials, slopes)?.parameters;
    }
    let slopes = slopes(std::array::from_fn(|i| Dual::variable(best[i], i)))?;
    let (shares, critical) = errors(&best, &slopes, around.motion.inertia.is_some());
    Ok(Refined {
        model: model(best, start.offset),
        parameters: best.to_vec(),
        standard_errors: best.iter().zip(&shares).map(|(p, s)| p * s).collect(),
        ci95: best
            .iter()
            .zip(&shares)
            .map(|(p, s)| [p / libm::exp(critical * s), p * libm::exp(critical * s)])
            .collect(),
    })
}

/// Predicted minus recorded command over a range of samples, without the first `skip` of them.
fn residuals<const N: usize, T: Scalar>(
    around: &Loop<'_>,
    mut p: [T; N],
    offset: f64,
    (range, skip): &(Range<usize>, usize),
    watch: &Watch,
) -> Result<Vec<T>, Error> {
    if let Some(inertia) = around.motion.inertia {
        p[0] = T::of(inertia);
    }
    let run = around.simulate(&model(p, offset), range.clone(), watch)?;
    let pairs = run.command.iter().zip(&around.signals.command[range.clone()]).skip(*skip);
    Ok(pairs.map(|(predicted, measured)| *predicted - T::of(*measured)).collect())
}

/// Standard errors of the logarithms, and the half-width of a 95 % interval in them.
fn errors<const N: usize>(parameters: &[f64; N], residuals: &[Dual<N>], known_inertia: bool) -> ([f64; N], f64) {
    // Ten samples are one row: their sum moves the parameters as they do, and the covariance takes a tenth of the time.
    const ROW: usize = 10;
    let mut normal = SMatrix::<f64, N, N>::zeros();
    let mut rows = vec![SVector::<f64, N>::zeros(); residuals.len().div_ceil(ROW)];
    for (t, residual) in residuals.iter().enumerate() {
        let slope = SVector::<f64, N>::from_fn(|i, _| residual.gradient[i] * parameters[i]);
        normal += slope * slope.transpose();
        rows[t / ROW] += slope * residual.value;
    }
    if known_inertia {
        // A parameter without influence has no error.
        normal[(0, 0)] = 1.0;
    }
    let Some(inverse) = normal.cholesky().map(|factor| factor.inverse()) else {
        return ([f64::INFINITY; N], 1.96);
    };
    let influence = DMatrix::from_fn(N, rows.len(), |i, t| inverse.row(i).transpose().dot(&rows[t]));
    let long_run = LongRun::of(&influence);
    (std::array::from_fn(|i| long_run.covariance[(i, i)].sqrt()), long_run.critical)
}
