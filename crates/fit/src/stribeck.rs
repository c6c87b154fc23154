//! The Stribeck curve, equation (1), from measured points: weighted, optionally robust, with covariance.
//!
//! A global search by variable projection, then Levenberg-Marquardt. The significance of a drop is judged separately:
//! [`StribeckDrop`].

use nalgebra::{Matrix4, SymmetricEigen, Vector4};
use stickslip_core::friction::Stribeck;
use stickslip_core::scalar::{Dual, Scalar};

use super::drop;
pub use super::drop::StribeckDrop;
use super::optimum::{bounds as bounds_of, from_near, optimum};
use super::points::check_points;
use super::projection::{Parameters, Sample, cost, curve};
use super::{runs_test, student_t95};
use stickslip_base::Error;
use stickslip_base::quantity::Estimate;

/// Key, name and unit of each parameter of a Stribeck curve, in the order of a fit.
pub const PARAMETERS: [(&str, &str, &str); 4] = [
    ("breakaway_torque", "breakaway torque M_S", "N m"),
    ("kinetic_torque", "kinetic torque M_K", "N m"),
    ("stribeck_velocity", "Stribeck velocity Ω_Strib", "rad/s"),
    ("viscous_friction", "viscous friction b", "N m s/rad"),
];

/// The numbers of a curve, in the order of [`PARAMETERS`].
pub fn values(curve: &Stribeck<f64>) -> [f64; 4] {
    [curve.breakaway_torque, curve.kinetic_torque, curve.stribeck_velocity, curve.viscous_friction]
}

/// A curve with these numbers, with the decay of another.
pub fn with_values(curve: &Stribeck<f64>, values: [f64; 4]) -> Stribeck<f64> {
    let [breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction] = values;
    Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, ..*curve }
}

/// One point of a friction curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Velocity, not 0 [rad/s, or m/s on a linear axis].
    pub velocity: f64,
    /// Friction, of the velocity's sign [N m or N].
    pub torque: f64,
    /// Standard error of `torque`, positive.
    pub standard_error: f64,
}

/// Selection of the points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// Velocity > 0.
    Positive,
    /// Velocity < 0; the parameters come out positive.
    Negative,
    /// Both, as one symmetric curve.
    #[default]
    Both,
}

/// Meaning of the points' standard errors for the covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Uncertainty {
    /// The standard errors are correct.
    Absolute,
    /// Only their ratios are correct: the scatter about the curve sets the scale (χ² per degree of freedom becomes 1).
    #[default]
    Scaled,
    /// The standard errors are those of noise, and the lack of fit of the curve is added: one variance for all points,
    /// chosen so that the scatter about the curve equals the errors; none where chance explains the scatter (Paule and
    /// Mandel, J. Res. NBS 87 (1982) 377). A scatter smaller than the errors never reduces them, and where no curve of
    /// this form fits, no point dominates by its small noise.
    Extra,
}

/// Huber's usual threshold in standard errors: 95 % of the efficiency of least squares on normal errors.
pub const HUBER: f64 = 1.345;

/// Plan of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StribeckPlan {
    /// Selection of the points.
    pub side: Side,
    /// Meaning of the standard errors.
    pub uncertainty: Uncertainty,
    /// Threshold in standard errors above which residuals count linearly instead of squared (Huber; [`HUBER`] is
    /// usual).
    pub huber: Option<f64>,
}

/// The curve that fits best. Lists of four are in the order M_S, M_K, Ω_Strib, b.
#[derive(Clone, Debug, PartialEq)]
pub struct StribeckFit {
    /// M_S [N m], M_K [N m], Ω_Strib [rad/s], b [N m s/rad], none negative.
    pub parameters: [f64; 4],
    /// Covariance of the parameters; infinite where the data do not determine all four.
    pub covariance: [[f64; 4]; 4],
    /// Square roots of its diagonal.
    pub standard_errors: [f64; 4],
    /// Half-width of a 95 % interval in standard errors: Student's t where the scatter set the scale, 1.96 where the
    /// points' own errors did.
    pub coverage_factor: f64,
    /// 95 % intervals in the logarithm of each parameter, so that no bound is negative.
    pub ci95: [[f64; 2]; 4],
    /// Parameters at the edge of their range: 0, or for Ω_Strib a tenth of the slowest to three times the fastest
    /// speed.
    pub at_bound: [bool; 4],
    /// Measured minus fitted [N m], in the order of the selected points, positive away from zero.
    pub residuals: Vec<f64>,
    /// Root mean square of the residuals [N m].
    pub rms: f64,
    /// Weighted sum of squares.
    pub chi_square: f64,
    /// Standard deviation [N m] that [`Uncertainty::Extra`] added to every point: distance of the curve's form from the
    /// measured friction.
    pub lack_of_fit: f64,
    /// Points minus parameters.
    pub degrees_of_freedom: usize,
    /// Slowest and fastest measured speed [rad/s].
    pub speeds: [f64; 2],
    /// Points further from the curve than [`OUTLIER`] of their standard errors, as indices of `residuals`.
    pub outliers: Vec<usize>,
    /// Probability of this number of changes of sign along rising speed with random residuals (Wald and
    /// Wolfowitz): small where the curve's form differs from that of the data.
    pub runs_probability: f64,
    /// Whether the data show M_S > M_K.
    pub drop: StribeckDrop,
}

/// Standard errors, each with the lack of fit, above which a point is an outlier.
pub const OUTLIER: f64 = 4.0;

impl StribeckFit {
    /// The fitted curve.
    pub fn curve(&self) -> Stribeck<f64> {
        curve(self.parameters)
    }

    /// Whether the points determine a parameter: a torque, or the viscous part, to within the friction itself, the
    /// Stribeck velocity to within a factor of ten.
    pub fn knows(&self, parameter: usize) -> bool {
        let [slowest, fastest] = self.speeds;
        let friction = self.curve().magnitude(slowest).max(self.curve().magnitude(fastest));
        let scale = [friction, friction, 10.0 * self.parameters[2], friction / fastest];
        let [low, high] = self.ci95[parameter];
        0.5 * (high - low) <= scale[parameter]
    }

    /// The parameters with their names; undetermined ones are unknown.
    pub fn lines(&self) -> impl Iterator<Item = (&'static str, Estimate)> + '_ {
        PARAMETERS.iter().enumerate().map(|(i, (_, name, unit))| {
            let half_width = 0.5 * (self.ci95[i][1] - self.ci95[i][0]);
            let estimate = Estimate::new(self.parameters[i], *unit).with_half_width(half_width);
            (*name, if self.knows(i) { estimate } else { Estimate::new(f64::NAN, *unit) })
        })
    }

    /// Derivatives of the curve at a speed [rad/s] with respect to each parameter.
    pub fn gradient(&self, speed: f64) -> [f64; 4] {
        gradient(self.parameters, speed).1
    }

    /// Half-width of the 95 % band of the curve at a speed, first order [N m].
    pub fn band95(&self, speed: f64) -> f64 {
        let gradient = Vector4::from(gradient(self.parameters, speed).1);
        let covariance = Matrix4::from_fn(|i, j| self.covariance[i][j]);
        self.coverage_factor * gradient.dot(&(covariance * gradient)).sqrt()
    }
}

/// Fits equation (1) to the points of one side or of both.
///
/// # Errors
/// A non-finite torque, a velocity that is 0 or not finite, a standard error that is not positive; fewer than five
/// points.
pub fn fit_stribeck(points: &[CurvePoint], plan: &StribeckPlan) -> Result<StribeckFit, Error> {
    let mut samples = select(points, plan.side)?;
    let bounds = bounds_of(speed_range(&samples));
    let mut parameters = robust(&samples, plan.huber, bounds);
    let mut lack_of_fit = 0.0;
    if plan.uncertainty == Uncertainty::Extra {
        lack_of_fit = extra(&samples, plan.huber, parameters, bounds);
        samples.iter_mut().for_each(|s| s.weight = 1.0 / (1.0 / s.weight + lack_of_fit * lack_of_fit));
        parameters = robust(&samples, plan.huber, bounds);
    }
    Ok(assess(parameters, &samples, plan, bounds, lack_of_fit))
}

/// The best parameters, large residuals counted linearly. Iteratively reweighted least squares: its fixed point is the
/// minimum of Huber's loss.
fn robust(samples: &[Sample], huber: Option<f64>, bounds: [f64; 2]) -> Parameters<f64> {
    let mut weighted = samples.to_vec();
    let mut parameters = optimum(&weighted, bounds);
    let Some(threshold) = huber else { return parameters };
    for _ in 0..100 {
        for (w, s) in weighted.iter_mut().zip(samples) {
            w.weight = s.weight * huber_weight(standardised(parameters, s), threshold);
        }
        let next = optimum(&weighted, bounds);
        let moved = (0..4).any(|i| (next[i] - parameters[i]).abs() > 1e-10 * parameters[i].abs());
        parameters = next;
        if !moved {
            break;
        }
    }
    parameters
}

/// Standard deviation [N m] that makes the scatter equal to the errors.
fn extra(samples: &[Sample], huber: Option<f64>, start: Parameters<f64>, bounds: [f64; 2]) -> f64 {
    let threshold = huber.unwrap_or(f64::INFINITY);
    let Normal { square, .. } = Normal::of(threshold);
    let with = |extra: f64| {
        let widened = |s: &Sample| Sample { weight: 1.0 / (1.0 / s.weight + extra * extra), ..*s };
        samples.iter().map(widened).collect::<Vec<_>>()
    };
    let excess = |extra: f64| {
        let widened = with(extra);
        let mut weighted = widened.clone();
        let mut parameters = start;
        for _ in 0..if huber.is_some() { 5 } else { 1 } {
            for (w, s) in weighted.iter_mut().zip(&widened) {
                w.weight = s.weight * huber_weight(standardised(parameters, s), threshold);
            }
            parameters = from_near(&weighted, parameters, bounds);
        }
        scatter(parameters, &widened, threshold) - square
    };
    let largest = samples.iter().map(|s| s.torque.abs()).fold(0.0, f64::max);
    // Below this share of the torque nothing is added.
    let (mut low, mut high) = (1e-8 * largest, largest);
    // A scatter within the 95 % of chance is not a lack of fit: adding it half of the time would widen the intervals of
    // good fits, and most by the best points.
    let chance = 1.645 * (2.0 / (samples.len() - 4) as f64).sqrt();
    if excess(low) <= chance * square {
        return 0.0;
    }
    for _ in 0..40 {
        let middle = (low * high).sqrt();
        if excess(middle) > 0.0 { low = middle } else { high = middle }
    }
    high
}

/// Mean square of the standardised residuals, large ones cut at the threshold, per degree of freedom.
fn scatter(parameters: Parameters<f64>, samples: &[Sample], threshold: f64) -> f64 {
    let cut = |s: &Sample| standardised(parameters, s).abs().min(threshold).powi(2);
    samples.iter().map(cut).sum::<f64>() / (samples.len() - 4) as f64
}

/// Moments of normal errors of variance 1 under Huber's ψ.
pub(super) struct Normal {
    /// E[ψ²].
    pub(super) square: f64,
    /// E[ψ'].
    pub(super) inside: f64,
}

impl Normal {
    pub(super) fn of(threshold: f64) -> Self {
        if threshold.is_infinite() {
            return Normal { square: 1.0, inside: 1.0 };
        }
        let inside = libm::erf(threshold * std::f64::consts::FRAC_1_SQRT_2);
        let density = libm::exp(-0.5 * threshold * threshold) / std::f64::consts::TAU.sqrt();
        let square = inside - 2.0 * threshold * density + threshold * threshold * (1.0 - inside);
        Normal { square, inside }
    }
}

fn standardised(parameters: Parameters<f64>, s: &Sample) -> f64 {
    (s.torque - curve(parameters).magnitude(s.speed)) * s.weight.sqrt()
}

pub(super) fn huber_weight(residual: f64, threshold: f64) -> f64 {
    (threshold / residual.abs()).min(1.0)
}

/// The points of a side.
pub(super) fn select(points: &[CurvePoint], side: Side) -> Result<Vec<Sample>, Error> {
    check_points(points)?;
    let mut samples = Vec::new();
    for CurvePoint { velocity, torque, standard_error } in points.iter().copied() {
        if match side {
            Side::Positive => velocity > 0.0,
            Side::Negative => velocity < 0.0,
            Side::Both => true,
        } {
            let weight = standard_error.powi(-2);
            samples.push(Sample { speed: velocity.abs(), torque: torque * velocity.signum(), weight });
        }
    }
    if samples.len() < 5 {
        let remedy = "Four parameters and their errors require five speeds. Measure more.";
        return Err(Error::TooFew { what: "points of the friction curve", found: samples.len(), needed: 5, remedy });
    }
    Ok(samples)
}

fn speed_range(samples: &[Sample]) -> [f64; 2] {
    samples.iter().fold([f64::INFINITY, 0.0], |[low, high], s| [low.min(s.speed), high.max(s.speed)])
}

/// Value and gradient with respect to M_S, M_K, Ω_Strib, b.
fn gradient(parameters: Parameters<f64>, speed: f64) -> (f64, [f64; 4]) {
    let variables = std::array::from_fn(|i| Dual::<4>::variable(parameters[i], i));
    let value = curve(variables).magnitude(Dual::of(speed));
    (value.value, value.gradient)
}

/// JᵀWJ.
fn normal(parameters: Parameters<f64>, samples: &[Sample]) -> [[f64; 4]; 4] {
    let mut normal = [[0.0; 4]; 4];
    for s in samples {
        let (_, row) = gradient(parameters, s.speed);
        for i in 0..4 {
            for j in 0..4 {
                normal[i][j] += s.weight * row[i] * row[j];
            }
        }
    }
    normal
}

fn at_bound(parameters: Parameters<f64>, bounds: [f64; 2]) -> [bool; 4] {
    let [breakaway, kinetic, velocity, viscous] = parameters;
    let edge = velocity <= bounds[0] * (1.0 + 1e-9) || velocity >= bounds[1] * (1.0 - 1e-9);
    [breakaway == 0.0, kinetic == 0.0, edge, viscous == 0.0]
}

fn assess(
    parameters: Parameters<f64>,
    samples: &[Sample],
    plan: &StribeckPlan,
    bounds: [f64; 2],
    lack_of_fit: f64,
) -> StribeckFit {
    let degrees_of_freedom = samples.len() - 4;
    let chi_square = cost(parameters, samples);
    let threshold = plan.huber.unwrap_or(f64::INFINITY);
    let scale = match plan.uncertainty {
        Uncertainty::Absolute | Uncertainty::Extra => {
            let Normal { square, inside } = Normal::of(threshold);
            square / (inside * inside)
        }
        // Huber (1981), eq. (7.6.5) without its small-sample factor: E[ψ²] / E[ψ']² in place of the variance.
        Uncertainty::Scaled => {
            let count = |s: &&Sample| standardised(parameters, s).abs() <= threshold;
            let inside = samples.iter().filter(count).count() as f64 / samples.len() as f64;
            scatter(parameters, samples, threshold) / (inside * inside)
        }
    };
    let inverse = inverse(&normal(parameters, samples));
    let covariance = inverse.map_or([[f64::INFINITY; 4]; 4], |c| c.map(|r| r.map(|v| v * scale)));
    let standard_errors: [f64; 4] = std::array::from_fn(|i| covariance[i][i].sqrt());
    let is_absolute = match plan.uncertainty {
        Uncertainty::Absolute => true,
        Uncertainty::Scaled => false,
        Uncertainty::Extra => lack_of_fit == 0.0,
    };
    let coverage_factor = if is_absolute { 1.96 } else { student_t95(degrees_of_freedom as f64) };
    let ci95 = std::array::from_fn(|i| interval(parameters[i], coverage_factor * standard_errors[i]));
    let residuals: Vec<f64> = samples.iter().map(|s| s.torque - curve(parameters).magnitude(s.speed)).collect();
    let rms = (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt();
    let speeds = speed_range(samples);
    let is_outlier = |i: &usize| standardised(parameters, &samples[*i]).abs() > OUTLIER;
    let outliers = (0..samples.len()).filter(is_outlier).collect();
    let mut order: Vec<usize> = (0..samples.len()).collect();
    order.sort_by(|a, b| samples[*a].speed.total_cmp(&samples[*b].speed));
    let runs_probability = runs_test(order.iter().map(|i| residuals[*i] > 0.0));
    let drop = drop::judge(parameters, &covariance, samples);
    let at_bound = at_bound(parameters, bounds);
    StribeckFit {
        parameters,
        covariance,
        standard_errors,
        ci95,
        at_bound,
        residuals,
        rms,
        chi_square,
        coverage_factor,
        lack_of_fit,
        degrees_of_freedom,
        speeds,
        outliers,
        runs_probability,
        drop,
    }
}

/// Interval of a magnitude: symmetric in its logarithm while its error is below its value; beyond, from 0 to the upper
/// end of the standard error.
pub(super) fn interval(value: f64, half_width: f64) -> [f64; 2] {
    if half_width <= value && value > 0.0 {
        let factor = libm::exp(half_width / value);
        return [value / factor, value * factor];
    }
    [0.0, value + half_width]
}

/// (JᵀWJ)⁻¹ by the eigenvalues of the scaled matrix; `None` if the data leave a direction undetermined.
fn inverse(normal: &[[f64; 4]; 4]) -> Option<[[f64; 4]; 4]> {
    let scales: [f64; 4] = std::array::from_fn(|j| normal[j][j].sqrt());
    // NaN counts as undetermined.
    if !scales.iter().all(|scale| *scale > 0.0) {
        return None;
    }
    let eigen = SymmetricEigen::new(Matrix4::from_fn(|i, j| normal[i][j] / (scales[i] * scales[j])));
    // Eigenvalues below 1e-13 of the largest (4 at most) are rounding errors.
    if eigen.eigenvalues.min() < 4e-13 {
        return None;
    }
    let inverse = eigen.eigenvectors
        * Matrix4::from_diagonal(&eigen.eigenvalues.map(|v| 1.0 / v))
        * eigen.eigenvectors.transpose();
    Some(std::array::from_fn(|i| std::array::from_fn(|j| inverse[(i, j)] / (scales[i] * scales[j]))))
}
