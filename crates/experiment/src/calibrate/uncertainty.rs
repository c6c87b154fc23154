//! Uncertainty of the fit, by the scatter of its segments.
//!
//! Counts, commutator and model errors leave residuals of any colour, which an assumption on noise cannot cover.
//! Segments are short and apart: the pull of each on the parameters at the minimum of the fit scatters as the estimate
//! would. That is the cluster-robust covariance, here in its bias-reduced form with its degrees of freedom (Bell &
//! McCaffrey 2002; Pustejovsky & Tipton 2018): few segments may have a small scatter by chance, which Student's t
//! compensates.

use nalgebra::SymmetricEigen;

use super::least_squares::{Block, Matrix, Vector, inverse, joined};
use super::parameters::PARAMETERS;
use stickslip_fit::student_t95;

/// Leverage threshold: a segment above it determines a direction alone and leaves no residual there.
const ALONE: f64 = 1e-6;

/// Uncertainty of the parameters, in the search's coordinates.
#[derive(Clone, Debug)]
pub(super) struct Uncertainty {
    /// R⁻¹ of all segments together.
    root: Matrix,
    segments: Vec<Influence>,
}

/// Influence of a segment, in coordinates in which the information of all segments is 1.
#[derive(Clone, Debug)]
struct Influence {
    /// Its rows Q; all ΣQᵀQ = 1.
    rows: Matrix,
    /// Qᵀ·(1 − QQᵀ)^(−1/2)·Q.
    reach: Matrix,
    /// Its pull: Qᵀ·(1 − QQᵀ)^(−1/2) times its residual.
    score: Vector,
}

/// Uncertainty of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Known {
    /// Standard uncertainty; infinite if no segment determines the number.
    pub(super) standard: f64,
    /// Half of the 95 % interval.
    pub(super) half: f64,
}

impl Known {
    /// No segment determines the number.
    pub(super) const NOTHING: Known = Known { standard: f64::INFINITY, half: f64::INFINITY };
}

impl Uncertainty {
    /// Uncertainty by the segments at the minimum.
    pub(super) fn of(blocks: &[Block]) -> Self {
        let root = inverse(&joined(blocks));
        let influence = |block: &Block| {
            let (mut rows, mut residual) = (Matrix::zeros(), Vector::zeros());
            for (i, row) in block.reduced().take(PARAMETERS).enumerate() {
                (0..PARAMETERS).for_each(|k| rows[(i, k)] = row[k]);
                residual[i] = row[PARAMETERS];
            }
            let rows = rows * root;
            let adjusted = rows.transpose() * inverse_root(Matrix::identity() - rows * rows.transpose());
            Influence { rows, reach: adjusted * rows, score: adjusted * residual }
        };
        Uncertainty { root, segments: blocks.iter().map(influence).collect() }
    }

    /// Uncertainty of a number with these slopes over the coordinates.
    pub(super) fn of_number(&self, slopes: &Vector) -> Known {
        let along = self.root.transpose() * slopes;
        let shares: Vec<f64> = self.segments.iter().map(|it| (it.rows * along).norm_squared()).collect();
        let information: f64 = shares.iter().sum();
        if information.partial_cmp(&(0.5 * along.norm_squared())) != Some(std::cmp::Ordering::Greater) {
            return Known::NOTHING;
        }
        let standard = self.segments.iter().map(|it| along.dot(&it.score).powi(2)).sum::<f64>().sqrt();
        let reaches: Vec<Vector> = self.segments.iter().map(|it| it.reach * along).collect();
        let mut squares: f64 = shares.iter().map(|share| share * share).sum();
        for (i, one) in reaches.iter().enumerate() {
            squares += 2.0 * reaches[..i].iter().map(|other| one.dot(other).powi(2)).sum::<f64>();
        }
        Known { standard, half: standard * student_t95((information * information / squares).max(1.0)) }
    }
}

/// M^(−1/2) of a symmetric matrix with eigenvalues 0 … 1; 0 for eigenvalues near zero.
fn inverse_root(m: Matrix) -> Matrix {
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(m);
    let scaled = eigenvalues.map(|value| if value > ALONE { 1.0 / value.sqrt() } else { 0.0 });
    eigenvectors * Matrix::from_diagonal(&scaled) * eigenvectors.transpose()
}
