//! The exact flow of a linear system over a step.

use crate::scalar::Scalar;

/// Number of halvings of the step before the series, and of squarings after it.
const HALVINGS: usize = 10;
/// Last power of the series.
const ORDER: usize = 12;

/// e^(A·h) by scaling, Taylor series and squaring, with fixed counts, so that lanes and duals carry their own
/// parameters. Exact to about 1e-12 of the largest entry for ‖A·h‖ ≤ 300. Inputs held over the step are appended to
/// the state, with zero rows (Van Loan 1978). Runs when parameters change, not in the step.
pub fn flow<T: Scalar, const N: usize>(a: &[[T; N]; N], h: T) -> [[T; N]; N] {
    let scale = h * T::of(1.0 / (1 << HALVINGS) as f64);
    let a = a.map(|row| row.map(|v| v * scale));
    // Horner: 1 + A(1 + A/2(1 + A/3(…))), stored without the leading 1, next to which small entries would lose digits.
    let mut small = zero();
    for power in (1..=ORDER).rev() {
        small = product(&a, &small);
        for i in 0..N {
            for j in 0..N {
                small[i][j] = (small[i][j] + a[i][j]) * T::of(1.0 / power as f64);
            }
        }
    }
    // (1 + E)² = 1 + (2E + E²)
    for _ in 0..HALVINGS {
        let square = product(&small, &small);
        for i in 0..N {
            for j in 0..N {
                small[i][j] = T::of(2.0) * small[i][j] + square[i][j];
            }
        }
    }
    for (i, row) in small.iter_mut().enumerate() {
        row[i] += T::of(1.0);
    }
    small
}

fn zero<T: Scalar, const N: usize>() -> [[T; N]; N] {
    [[T::of(0.0); N]; N]
}

fn product<T: Scalar, const N: usize>(a: &[[T; N]; N], b: &[[T; N]; N]) -> [[T; N]; N] {
    let mut out = zero();
    for i in 0..N {
        for k in 0..N {
            for j in 0..N {
                out[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::flow;

    #[test]
    fn the_flow_of_an_oscillator_is_a_rotation() {
        // ẍ = −ω²x with ω = 4000 1/s: the stiffness entry is 1.6e7, as in a light drive.
        let (omega, h) = (4000.0, 25e-6);
        let phi = flow(&[[0.0, 1.0], [-omega * omega, 0.0]], h);
        let (sin, cos) = f64::sin_cos(omega * h);
        for (got, exact) in [(phi[0][0], cos), (phi[0][1], sin / omega), (phi[1][0], -omega * sin), (phi[1][1], cos)] {
            assert!((got - exact).abs() <= 1e-12 * (1.0 + exact.abs()), "{got} {exact}");
        }
    }

    #[test]
    fn a_held_input_integrates() {
        // ẋ = −x/τ + u, u held: x = τ·u·(1 − e^(−h/τ)).
        let (tau, h) = (3e-4, 2.5e-4);
        let phi = flow(&[[-1.0 / tau, 1.0], [0.0, 0.0]], h);
        assert!((phi[0][1] - tau * (1.0 - f64::exp(-h / tau))).abs() <= 1e-16);
        assert_eq!((phi[1][0], phi[1][1]), (0.0, 1.0));
    }
}
