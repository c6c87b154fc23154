//! From continuous to sampled time.

use nalgebra::DMatrix;

use super::{finite, sampling_time, square};
use crate::Error;

/// Exact discretisation of ẋ = A·x + B·u with u held over each sampling time `dt` [s]: (Φ, Γ) of x⁺ = Φ·x + Γ·u.
///
/// Both from one matrix exponential, e^([A B; 0 0]·T) = [Φ Γ; 0 I] (van Loan 1978), by Padé approximation with scaling
/// and squaring (Al-Mohy and Higham 2009, in nalgebra). No inverse of A is needed: integrators are welcome.
pub fn zero_order_hold(a: &DMatrix<f64>, b: &DMatrix<f64>, dt: f64) -> Result<(DMatrix<f64>, DMatrix<f64>), Error> {
    let states = square("the system matrix", a)?;
    sampling_time(dt)?;
    finite("the input matrix", b)?;
    if b.nrows() != states {
        let remedy = "The input matrix has one row a state.";
        return Err(Error::Dimension { what: "the input matrix", found: b.nrows(), expected: states, remedy });
    }
    let inputs = b.ncols();
    let mut block = DMatrix::zeros(states + inputs, states + inputs);
    block.view_mut((0, 0), (states, states)).copy_from(&(a * dt));
    block.view_mut((0, states), (states, inputs)).copy_from(&(b * dt));
    let flow = block.exp();
    finite("the exponential of the system matrix over one sampling time", &flow)?;
    Ok((flow.view((0, 0), (states, states)).into(), flow.view((0, states), (states, inputs)).into()))
}
