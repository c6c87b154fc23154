//! How much noise a stable system keeps.

use nalgebra::DMatrix;

use super::{finite, square};
use crate::Error;

/// Squarings until a radius is known to rounding: ‖Aⁿ‖^(1/n) with n = 2⁵⁰.
const SQUARINGS: i32 = 50;

/// Magnitude of the largest eigenvalue, lim ‖Aⁿ‖^(1/n) (Gelfand), by repeated squaring.
pub fn spectral_radius(a: &DMatrix<f64>) -> Result<f64, Error> {
    square("the system matrix", a)?;
    let mut power = a.clone();
    let mut logarithm = 0.0;
    for k in 0..SQUARINGS {
        let size = power.norm();
        if size == 0.0 {
            return Ok(0.0);
        }
        logarithm += libm::log(size) / 2f64.powi(k);
        power /= size;
        power = &power * &power;
    }
    Ok(libm::exp(logarithm))
}

/// Stationary covariance P = A·P·Aᵀ + Q of x⁺ = A·x + w with white w of covariance Q.
///
/// By doubling: P ← P + A·P·Aᵀ, A ← A² sums 2ᵏ terms in k steps (Smith 1968). `Err` where the spectral radius of A is
/// not below 1.
pub fn discrete_lyapunov(a: &DMatrix<f64>, q: &DMatrix<f64>) -> Result<DMatrix<f64>, Error> {
    let expected = square("the system matrix", a)?;
    let found = square("the noise covariance", q)?;
    if found != expected {
        let remedy = "The noise covariance is of the system's order.";
        return Err(Error::Dimension { what: "the noise covariance", found, expected, remedy });
    }
    let spectral_radius = spectral_radius(a)?;
    // Closer to 1 the sum has no digits left.
    let limit = 1.0 - 1e-12;
    if spectral_radius >= limit {
        let remedy = "Choose stable poles, or leave the integrating state out.";
        return Err(Error::Unstable { spectral_radius, limit, remedy });
    }
    let (mut power, mut sum) = (a.clone(), q.clone());
    for _ in 0..SQUARINGS {
        let more = &power * &sum * power.transpose();
        sum += &more;
        if more.norm() <= 0.1 * f64::EPSILON * sum.norm() {
            break;
        }
        power = &power * &power;
    }
    finite("the covariance", &sum)?;
    Ok(sum)
}
