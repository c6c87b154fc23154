//! From continuous to sampled time.

use nalgebra::DMatrix;

use super::{finite, sampling_time, square};
use stickslip_base::Error;

/// Exact discretisation of ẋ = A·x + B·u with u held over each sampling time `dt` [s]: (Φ, Γ) of x⁺ = Φ·x + Γ·u.
///
/// Both from one matrix exponential, e^([A B; 0 0]·T) = [Φ Γ; 0 I] (van Loan 1978), by scaling, Taylor series and
/// squaring. No inverse of A is needed, so that A may have integrators.
pub fn zero_order_hold(a: &DMatrix<f64>, b: &DMatrix<f64>, dt: f64) -> Result<(DMatrix<f64>, DMatrix<f64>), Error> {
    let states = square("the system matrix", a)?;
    sampling_time(dt)?;
    finite("the input matrix", b)?;
    if b.nrows() != states {
        let remedy = "The input matrix must have one row for each state.";
        return Err(Error::Dimension { what: "the input matrix", found: b.nrows(), expected: states, remedy });
    }
    let inputs = b.ncols();
    let mut block = DMatrix::zeros(states + inputs, states + inputs);
    block.view_mut((0, 0), (states, states)).copy_from(&(a * dt));
    block.view_mut((0, states), (states, inputs)).copy_from(&(b * dt));
    let flow = exponential(&block);
    finite("the exponential of the system matrix over one sampling time", &flow)?;
    Ok((flow.view((0, 0), (states, states)).into(), flow.view((0, states), (states, inputs)).into()))
}

/// e^A: halved until ‖A‖₁ ≤ ½, the series up to A^16/16! (remainder 2e-20), squared as often.
///
/// nalgebra's own needs its `std` feature, which brings products in fused arithmetic on some processors only.
fn exponential(a: &DMatrix<f64>) -> DMatrix<f64> {
    let norm = a.column_iter().map(|column| column.lp_norm(1)).fold(0.0, f64::max);
    let halvings = if norm > 0.5 { (libm::log2(norm).ceil() + 1.0).clamp(0.0, 1000.0) as i32 } else { 0 };
    let scaled = a * libm::exp2(f64::from(-halvings));
    let identity = DMatrix::identity(a.nrows(), a.ncols());
    let mut sum = identity.clone();
    for power in (1..=16).rev() {
        sum = &identity + &scaled * sum / f64::from(power);
    }
    for _ in 0..halvings {
        sum = &sum * &sum;
    }
    sum
}
