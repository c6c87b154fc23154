//! Stationary noise of a stable system.

use crate::DesignError;
use nalgebra::{Complex, DMatrix, DVector, Schur};

use super::{finite, square};
use crate::linear::size;
use stickslip_base::Error;

/// Squarings until a radius is known to rounding: ‖Aⁿ‖^(1/n) with n = 2⁵⁰.
const SQUARINGS: i32 = 50;

/// Sweeps of the QR iteration per state before it fails.
const SWEEPS: usize = 100;

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
/// With the Schur form A = U·T·Uᴴ, column after column from the last one (Kitagawa, Int. J. Control 25 (1977) 745):
/// accurate to rounding also with slow modes and states of very different size. `Err` unless the spectral radius of A
/// is below 1.
pub fn discrete_lyapunov(a: &DMatrix<f64>, q: &DMatrix<f64>) -> Result<DMatrix<f64>, Error> {
    let expected = square("the system matrix", a)?;
    let order = square("the noise covariance", q)?;
    if order != expected {
        let remedy = "The noise covariance must have the system's order.";
        return Err(Error::Dimension { what: "the noise covariance", found: order, expected, remedy });
    }
    let failed = || Error::NotSolvable {
        what: "the stationary covariance",
        remedy: "Scale the states so that their numbers are of similar size.",
    };
    let complex = |matrix: &DMatrix<f64>| matrix.map(|value| Complex::new(value, 0.0));
    let (u, t) = Schur::try_new(complex(a), f64::EPSILON, SWEEPS * expected).ok_or_else(failed)?.unpack();
    let spectral_radius = t.diagonal().iter().map(|&pole| size(pole)).fold(0.0, f64::max);
    // Closer to 1 the sum has no valid digits.
    let limit = 1.0 - 1e-12;
    if spectral_radius >= limit {
        let remedy = "Choose stable poles, or remove the integrating state.";
        return Err(DesignError::Unstable { spectral_radius, limit, remedy }.into());
    }
    let source = u.adjoint() * complex(q) * &u;
    let mut solution = DMatrix::zeros(expected, expected);
    for j in (0..expected).rev() {
        // Contribution of the columns after this one.
        let mut behind = DVector::zeros(expected);
        for k in j + 1..expected {
            behind += solution.column(k) * t[(j, k)].conj();
        }
        let right = source.column(j) + &t * behind;
        let matrix = DMatrix::identity(expected, expected) - &t * t[(j, j)].conj();
        solution.set_column(j, &matrix.solve_upper_triangular(&right).ok_or_else(failed)?);
    }
    let covariance = (&u * solution * u.adjoint()).map(|value| value.re);
    finite("the covariance", &covariance)?;
    Ok((&covariance + covariance.transpose()) * 0.5)
}
