//! Pole placement for sampled systems.

use crate::DesignError;
use nalgebra::{Complex, DMatrix, DVector};

use super::{as_long_as_states, square};
use stickslip_base::Error;

/// Below this reciprocal condition of the scaled controllability matrix the gains have fewer than four digits.
const WORST_CONDITION: f64 = 1e-12;

/// Sampling time of the output that corrects an observer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObserverForm {
    /// One sample ago: x̂⁺ = A·x̂ + B·u + L·(y − C·x̂), poles of A − L·C.
    Predictor,
    /// Now: x̂ = x̄ + L·(y − C·x̄), x̄⁺ = A·x̂ + B·u, poles of A − L·C·A.
    Current,
}

/// State feedback u = −kᵀ·x of x⁺ = A·x + b·u with given poles of A − b·kᵀ (Ackermann).
///
/// kᵀ = (0 … 0 1)·[b A·b … Aⁿ⁻¹·b]⁻¹·p(A). The controllability matrix is scaled in rows and columns first, so
/// that different units of the states and a short sampling time do not affect the condition.
pub fn place_poles(a: &DMatrix<f64>, b: &DVector<f64>, poles: &[Complex<f64>]) -> Result<DVector<f64>, Error> {
    let remedy = "Connect the input to each state, or remove the states that it does not reach.";
    ackermann(a, b, poles, "controllable", remedy)
}

/// Gain L of an observer of x⁺ = A·x + B·u, y = cᵀ·x with the given poles of its error: [`place_poles`] of the dual
/// system.
pub fn observer_gain(
    a: &DMatrix<f64>,
    c: &DVector<f64>,
    poles: &[Complex<f64>],
    form: ObserverForm,
) -> Result<DVector<f64>, Error> {
    as_long_as_states("the output vector", c, square("the system matrix", a)?)?;
    let output = match form {
        ObserverForm::Predictor => c.clone(),
        ObserverForm::Current => a.transpose() * c,
    };
    let remedy = "Measure more, or remove the states that the output does not depend on (for the current form also \
     states that vanish after one sample).";
    ackermann(&a.transpose(), &output, poles, "observable", remedy)
}

fn ackermann(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    poles: &[Complex<f64>],
    property: &'static str,
    remedy: &'static str,
) -> Result<DVector<f64>, Error> {
    let order = square("the system matrix", a)?;
    as_long_as_states("the input vector", b, order)?;
    if poles.len() != order {
        let remedy = "Give one pole for each state.";
        return Err(Error::Dimension { what: "the list of poles", found: poles.len(), expected: order, remedy });
    }
    let polynomial = characteristic(a, poles)?;

    let mut reached = DMatrix::zeros(order, order);
    let mut column = b.clone();
    for k in 0..order {
        reached.set_column(k, &column);
        column = a * column;
    }
    let (rows, columns) = equilibrate(&mut reached);
    let singular = reached.clone().singular_values();
    let reciprocal_condition = singular.min() / singular.max();
    let limit = WORST_CONDITION;
    let refused = DesignError::NotReachable { property, reciprocal_condition, limit, remedy };
    if reciprocal_condition.is_nan() || reciprocal_condition < limit {
        return Err(refused.into());
    }
    let mut last = DVector::zeros(order);
    last[order - 1] = columns[order - 1];
    let row = reached.transpose().lu().solve(&last).ok_or(refused)?.component_mul(&rows);
    Ok(polynomial.transpose() * row)
}

/// Rows, then columns, to unit length; a row or column of zeros stays. Returns the factors.
fn equilibrate(matrix: &mut DMatrix<f64>) -> (DVector<f64>, DVector<f64>) {
    let factor = |length: f64| if length > 0.0 { 1.0 / length } else { 1.0 };
    let rows = DVector::from_iterator(matrix.nrows(), matrix.row_iter().map(|row| factor(row.norm())));
    for (mut row, scale) in matrix.row_iter_mut().zip(&rows) {
        row *= *scale;
    }
    let columns = DVector::from_iterator(matrix.ncols(), matrix.column_iter().map(|column| factor(column.norm())));
    for (mut column, scale) in matrix.column_iter_mut().zip(&columns) {
        column *= *scale;
    }
    (rows, columns)
}

/// p(A) of the polynomial with these roots, as a product of real factors, exact near 0.
fn characteristic(a: &DMatrix<f64>, poles: &[Complex<f64>]) -> Result<DMatrix<f64>, Error> {
    let identity = DMatrix::identity(a.nrows(), a.nrows());
    let mut product = identity.clone();
    let mut open: Vec<Complex<f64>> = Vec::new();
    for &pole in poles {
        let magnitude = libm::hypot(pole.re, pole.im);
        if magnitude.is_nan() || magnitude >= 1.0 {
            return Err(DesignError::UnstablePole { real: pole.re, imaginary: pole.im, magnitude, limit: 1.0 }.into());
        }
        if pole.im == 0.0 {
            product *= a - &identity * pole.re;
        } else if let Some(partner) = open.iter().position(|&other| other == pole.conj()) {
            open.swap_remove(partner);
            let shifted = a - &identity * pole.re;
            product *= &shifted * &shifted + &identity * (pole.im * pole.im);
        } else {
            open.push(pole);
        }
    }
    match open.first() {
        Some(pole) => Err(DesignError::UnpairedPole { real: pole.re, imaginary: pole.im }.into()),
        None => Ok(product),
    }
}
