//! The stationary Kalman filter, and its mirror image, the linear quadratic regulator.

use crate::DesignError;
use nalgebra::DMatrix;

use super::{finite, square};
use stickslip_base::Error;

/// Doublings until the filter's covariance is exact to rounding: 2⁴⁰ samples.
const DOUBLINGS: usize = 40;

/// A stationary Kalman filter.
#[derive(Clone, Debug, PartialEq)]
pub struct KalmanFilter {
    /// Gain K of x̂ = x̄ + K·(y − C·x̄), one row for each state and one column for each output.
    pub gain: DMatrix<f64>,
    /// Covariance of the estimate x̂.
    pub covariance: DMatrix<f64>,
}

/// The stationary Kalman filter for x⁺ = A·x + w, y = C·x + v with white w and v of
/// covariance Q and R.
///
/// Structured doubling of P = A·P·Aᵀ − A·P·Cᵀ·(C·P·Cᵀ + R)⁻¹·C·P·Aᵀ + Q (Chu, Fan, Lin 2005): k steps are 2ᵏ samples.
///
/// # Errors
/// Non-finite numbers, R that is not positive definite, and no convergence: a state that is neither observable nor
/// decays.
pub fn kalman_filter(
    a: &DMatrix<f64>,
    c: &DMatrix<f64>,
    q: &DMatrix<f64>,
    r: &DMatrix<f64>,
) -> Result<KalmanFilter, Error> {
    let order = square("the system matrix", a)?;
    let inverse = inverse_of_weight(r)?;
    let covariance = stationary(a.transpose(), c.transpose() * inverse * c, q).ok_or_else(unobservable)?;
    finite("the covariance of the filter", &covariance)?;
    let innovation = c * &covariance * c.transpose() + r;
    let gain = innovation.lu().solve(&(c * &covariance)).ok_or_else(unobservable)?.transpose();
    finite("the gain of the filter", &gain)?;
    let covariance = (DMatrix::<f64>::identity(order, order) - &gain * c) * covariance;
    Ok(KalmanFilter { gain, covariance })
}

/// An unobservable state that does not decay.
fn unobservable() -> Error {
    let remedy = "Measure more, or remove the states that the outputs do not depend on.";
    DesignError::NotReachable { property: "observable", reciprocal_condition: 0.0, limit: 0.0, remedy }.into()
}

/// An uncontrollable state that does not decay.
fn uncontrollable() -> Error {
    let remedy = "Connect the inputs to each state, or remove the states that they do not reach.";
    DesignError::NotReachable { property: "controllable", reciprocal_condition: 0.0, limit: 0.0, remedy }.into()
}

/// R⁻¹ of a positive definite R.
fn inverse_of_weight(r: &DMatrix<f64>) -> Result<DMatrix<f64>, Error> {
    square("the weight R", r)?;
    let remedy = "The noise of each output, or the cost of each input, must be above 0.";
    let indefinite = || Error::NotSolvable { what: "the inverse of the weight R", remedy };
    Ok(r.clone().cholesky().ok_or_else(indefinite)?.inverse())
}

/// The solution X of X = S·X·Sᵀ − … for `step` Sᵀ, the information G and the source Q, by structured doubling; `None`
/// if it does not exist.
fn stationary(mut step: DMatrix<f64>, mut information: DMatrix<f64>, source: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let identity = DMatrix::<f64>::identity(step.nrows(), step.nrows());
    let mut covariance = source.clone();
    for _ in 0..DOUBLINGS {
        let lu = (&identity + &information * &covariance).lu();
        let forward = lu.solve(&step)?;
        let spread = (&identity + &covariance * &information).lu().solve(&step.transpose())?;
        let more = step.transpose() * &covariance * &forward;
        information = &information + &step * &information * &spread;
        step = &step * &forward;
        covariance += &more;
        covariance = 0.5 * (&covariance + covariance.transpose());
        information = 0.5 * (&information + information.transpose());
        if more.amax() <= 1e-14 * covariance.amax() {
            return Some(covariance);
        }
    }
    None
}

/// A state feedback u = −K·x with the least cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Regulator {
    /// Gain K, one row for each input and one column for each state.
    pub gain: DMatrix<f64>,
    /// Cost P of a state: xᵀ·P·x is the cost of bringing it to rest.
    pub cost: DMatrix<f64>,
}

/// The feedback u = −K·x of x⁺ = A·x + B·u with the least ∑ xᵀ·Q·x + 2·xᵀ·N·u + uᵀ·R·u: the Kalman filter of the dual
/// system. Without `cross` N is 0.
///
/// # Errors
/// Non-finite numbers, R that is not positive definite, and no convergence: a state that the inputs do not reach and
/// that does not decay.
pub fn linear_quadratic_regulator(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    q: &DMatrix<f64>,
    r: &DMatrix<f64>,
    cross: Option<&DMatrix<f64>>,
) -> Result<Regulator, Error> {
    square("the system matrix", a)?;
    let inverse = inverse_of_weight(r)?;
    // With a cross term: u = v − R⁻¹·Nᵀ·x removes it.
    let shift = cross.map(|n| &inverse * n.transpose());
    let (moved, weight) = match (&shift, cross) {
        (Some(shift), Some(n)) => (a - b * shift, q - n * shift),
        _ => (a.clone(), q.clone()),
    };
    let cost = stationary(moved.clone(), b * inverse * b.transpose(), &weight).ok_or_else(uncontrollable)?;
    finite("the cost of the regulator", &cost)?;
    let weighted = b.transpose() * &cost;
    let gain = (&weighted * b + r).lu().solve(&(weighted * moved)).ok_or_else(uncontrollable)?;
    finite("the gain of the regulator", &gain)?;
    Ok(Regulator { gain: shift.map_or_else(|| gain.clone(), |shift| &gain + shift), cost })
}

/// The feedback u = −K·x of ẋ = A·x + B·u with the least ∫ xᵀ·Q·x + uᵀ·R·u dt.
///
/// Aᵀ·P + P·A − P·B·R⁻¹·Bᵀ·P + Q = 0 becomes that of a sampled system by the bilinear map (A + γ)/(A − γ), whose
/// doubling is that of [`linear_quadratic_regulator`] (Chu, Fan, Lin 2005).
///
/// # Errors
/// As [`linear_quadratic_regulator`].
pub fn continuous_regulator(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    q: &DMatrix<f64>,
    r: &DMatrix<f64>,
) -> Result<Regulator, Error> {
    let order = square("the system matrix", a)?;
    let inverse = inverse_of_weight(r)?;
    let reached = b * &inverse * b.transpose();
    finite("the system matrix", a)?;
    // Beyond every pole, so that none is mapped far out; powers of two are exact.
    let rate = libm::exp2(libm::ceil(libm::log2(2.0 * a.norm().max(reached.norm()).max(1e-300))));
    let identity = DMatrix::<f64>::identity(order, order);
    let back = (a - rate * &identity).try_inverse().ok_or_else(uncontrollable)?;
    let joint = (a.transpose() - rate * &identity + q * &back * &reached).lu();
    let weight = 2.0 * rate * joint.solve(&(q * &back)).ok_or_else(uncontrollable)?;
    let both = (a - rate * &identity + &reached * back.transpose() * q).lu();
    let step = &identity + 2.0 * rate * both.solve(&identity).ok_or_else(uncontrollable)?;
    let information = 2.0 * rate * both.solve(&(&reached * back.transpose())).ok_or_else(uncontrollable)?;
    let half = |matrix: DMatrix<f64>| 0.5 * (&matrix + matrix.transpose());
    let cost = stationary(step, half(information), &half(weight)).ok_or_else(uncontrollable)?;
    finite("the cost of the regulator", &cost)?;
    Ok(Regulator { gain: inverse * b.transpose() * &cost, cost })
}

/// The stationary Kalman–Bucy filter for ẋ = A·x + w, y = C·x + v with white w and v of densities Q and R: the gain L of
/// x̂˙ = A·x̂ + L·(y − C·x̂), and the covariance of x̂. It is the dual of [`continuous_regulator`].
///
/// # Errors
/// As [`kalman_filter`].
pub fn kalman_bucy_filter(
    a: &DMatrix<f64>,
    c: &DMatrix<f64>,
    q: &DMatrix<f64>,
    r: &DMatrix<f64>,
) -> Result<KalmanFilter, Error> {
    let dual = continuous_regulator(&a.transpose(), &c.transpose(), q, r).map_err(|error| match error.of() {
        Some(DesignError::NotReachable { .. }) => unobservable(),
        _ => error,
    })?;
    Ok(KalmanFilter { gain: dual.gain.transpose(), covariance: dual.cost })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_double_integrator_has_the_regulator_of_the_textbook() {
        // Q = diag(1, 0), R = 1: K = [1, √2].
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, 0.0]);
        let b = DMatrix::from_row_slice(2, 1, &[0.0, 1.0]);
        let q = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.0]);
        let one = DMatrix::from_element(1, 1, 1.0);
        let regulator = continuous_regulator(&a, &b, &q, &one).unwrap();
        let root = 2f64.sqrt();
        assert!((regulator.gain - DMatrix::from_row_slice(1, 2, &[1.0, root])).amax() < 1e-12);
        assert!((regulator.cost - DMatrix::from_row_slice(2, 2, &[root, 1.0, 1.0, root])).amax() < 1e-12);
        let filter = kalman_bucy_filter(&a.transpose(), &b.transpose(), &q, &one).unwrap();
        assert!((filter.gain - DMatrix::from_row_slice(2, 1, &[1.0, root])).amax() < 1e-12);
        let refused = continuous_regulator(&a, &DMatrix::zeros(2, 1), &q, &one).unwrap_err();
        assert!(matches!(refused.of(), Some(DesignError::NotReachable { property: "controllable", .. })), "{refused}");
        let refused = kalman_bucy_filter(&a, &DMatrix::zeros(1, 2), &q, &one).unwrap_err();
        assert!(matches!(refused.of(), Some(DesignError::NotReachable { property: "observable", .. })), "{refused}");
    }

    #[test]
    fn a_random_walk_is_filtered_as_the_closed_form() {
        // x⁺ = x + w, y = x + v with unit variances: P̄ = P̄ − P̄²/(P̄ + 1) + 1, the golden ratio; K = P̄/(P̄ + 1).
        let one = DMatrix::from_element(1, 1, 1.0);
        let filter = kalman_filter(&one, &one, &one, &one).expect("an observable number");
        let golden = 0.5 * (1.0 + 5f64.sqrt());
        assert!((filter.gain[(0, 0)] - golden / (golden + 1.0)).abs() < 1e-12);
        assert!((filter.covariance[(0, 0)] - golden / (golden + 1.0)).abs() < 1e-12);
    }

    #[test]
    fn the_covariance_is_that_of_the_filter_run_for_long() {
        let dt = 1e-3;
        let a = DMatrix::from_row_slice(2, 2, &[1.0, dt, 0.0, 1.0]);
        let c = DMatrix::from_row_slice(1, 2, &[1.0, 0.0]);
        let (q, r) = (DMatrix::from_row_slice(2, 2, &[1e-9, 0.0, 0.0, 1e-4]), DMatrix::from_element(1, 1, 1e-6));
        let filter = kalman_filter(&a, &c, &q, &r).expect("an observable motion");
        let mut p = DMatrix::<f64>::identity(2, 2);
        for _ in 0..20_000 {
            let ahead = &a * &p * a.transpose() + &q;
            let gain = &ahead * c.transpose() / (&c * &ahead * c.transpose() + &r)[(0, 0)];
            p = (DMatrix::identity(2, 2) - &gain * &c) * ahead;
        }
        assert!((&p - &filter.covariance).norm() < 1e-9 * p.norm(), "{p} {}", filter.covariance);
    }

    #[test]
    fn an_uncontrollable_state_is_refused_unless_it_decays() {
        let one = DMatrix::identity(2, 2);
        let b = DMatrix::from_row_slice(2, 1, &[1.0, 0.0]);
        let r = DMatrix::from_element(1, 1, 1.0);
        let regulator = |slow: f64| {
            let a = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, slow]);
            linear_quadratic_regulator(&a, &b, &one, &r, None)
        };
        assert!(regulator(1.1).is_err());
        // The golden section, as for the filter.
        let gain = regulator(0.5).expect("the rest decays").gain;
        assert!((gain[0] - (5f64.sqrt() - 1.0) / 2.0).abs() < 1e-12, "{gain}");
    }

    #[test]
    fn an_unobservable_state_that_does_not_decay_is_refused() {
        let a = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 1.1]);
        let c = DMatrix::from_row_slice(1, 2, &[1.0, 0.0]);
        let noise = DMatrix::identity(2, 2);
        assert!(kalman_filter(&a, &c, &noise, &DMatrix::from_element(1, 1, 1.0)).is_err());
        assert!(
            kalman_filter(&a, &c, &noise, &DMatrix::from_element(1, 1, 0.0)).is_err(),
            "without noise there is no weight"
        );
    }

    #[test]
    fn a_marginal_state_out_of_reach_has_no_stationary_solution() {
        let a = DMatrix::<f64>::identity(2, 2);
        let output = DMatrix::from_row_slice(1, 2, &[1.0, 0.0]);
        let (q, r) = (DMatrix::identity(2, 2), DMatrix::from_element(1, 1, 1.0));
        let refused = kalman_filter(&a, &output, &q, &r).unwrap_err();
        assert!(matches!(refused.of(), Some(DesignError::NotReachable { property: "observable", .. })), "{refused}");
        let refused = linear_quadratic_regulator(&a, &output.transpose(), &q, &r, None).unwrap_err();
        assert!(matches!(refused.of(), Some(DesignError::NotReachable { property: "controllable", .. })), "{refused}");
    }

    #[test]
    fn a_weight_that_is_not_positive_is_refused() {
        let one = DMatrix::<f64>::identity(1, 1);
        for weight in [-1.0, 0.0] {
            let r = DMatrix::from_element(1, 1, weight);
            let refused = kalman_filter(&one, &one, &one, &r).unwrap_err().to_string();
            assert!(refused.contains("above 0"), "{refused}");
            let refused = linear_quadratic_regulator(&one, &one, &one, &r, None).unwrap_err().to_string();
            assert!(refused.contains("above 0"), "{refused}");
        }
    }
}
