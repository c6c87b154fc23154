//! How sure the fit is, by how much its segments differ.
//!
//! Counts, commutator and all that the model lacks leave errors of any colour, which no assumption on noise covers.
//! Segments are short and apart: what each of them asks of the parameters once the fit has its minimum scatters as the
//! estimate would. That is the cluster-robust covariance, here in its bias-reduced form with its degrees of freedom
//! (Bell & McCaffrey 2002; Pustejovsky & Tipton 2018): few segments have a small scatter by chance, and Student's t
//! pays for it.

use nalgebra::SymmetricEigen;

use super::least_squares::{Block, Matrix, Vector, inverse, joined};
use super::parameters::PARAMETERS;
use stickslip_fit::student_t95;

/// Share of a segment's say that no other segment has, beyond which it leaves no residual to judge by.
const ALONE: f64 = 1e-6;

/// Uncertainty of the parameters, in the search's coordinates.
#[derive(Clone, Debug)]
pub(super) struct Uncertainty {
    /// R⁻¹ of all segments together.
    root: Matrix,
    segments: Vec<Say>,
}

/// What a segment says, in coordinates in which all segments' information is 1.
#[derive(Clone, Debug)]
struct Say {
    /// Its rows Q; all ΣQᵀQ = 1.
    rows: Matrix,
    /// Qᵀ·(1 − QQᵀ)^(−1/2)·Q.
    reach: Matrix,
    /// What it asks for: Qᵀ·(1 − QQᵀ)^(−1/2) times its residual.
    score: Vector,
}

/// How well a number is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Known {
    /// Standard uncertainty; infinite for what no segment tells.
    pub(super) standard: f64,
    /// Half of the 95 % interval.
    pub(super) half: f64,
}

impl Uncertainty {
    /// By segments at the minimum.
    pub(super) fn of(blocks: &[Block]) -> Self {
        let root = inverse(&joined(blocks));
        let say = |block: &Block| {
            let (mut rows, mut residual) = (Matrix::zeros(), Vector::zeros());
            for (i, row) in block.reduced().take(PARAMETERS).enumerate() {
                (0..PARAMETERS).for_each(|k| rows[(i, k)] = row[k]);
                residual[i] = row[PARAMETERS];
            }
            let rows = rows * root;
            let adjusted = rows.transpose() * inverse_root(Matrix::identity() - rows * rows.transpose());
            Say { rows, reach: adjusted * rows, score: adjusted * residual }
        };
        Uncertainty { root, segments: blocks.iter().map(say).collect() }
    }

    /// Of a number with these slopes over the coordinates.
    pub(super) fn of_number(&self, slopes: &Vector) -> Known {
        let along = self.root.transpose() * slopes;
        let shares: Vec<f64> = self.segments.iter().map(|say| (say.rows * along).norm_squared()).collect();
        let told: f64 = shares.iter().sum();
        if told.partial_cmp(&(0.5 * along.norm_squared())) != Some(std::cmp::Ordering::Greater) {
            return Known { standard: f64::INFINITY, half: f64::INFINITY };
        }
        let standard = self.segments.iter().map(|say| along.dot(&say.score).powi(2)).sum::<f64>().sqrt();
        let reaches: Vec<Vector> = self.segments.iter().map(|say| say.reach * along).collect();
        let mut squares: f64 = shares.iter().map(|share| share * share).sum();
        for (i, one) in reaches.iter().enumerate() {
            squares += 2.0 * reaches[..i].iter().map(|other| one.dot(other).powi(2)).sum::<f64>();
        }
        Known { standard, half: standard * student_t95((told * told / squares).max(1.0)) }
    }
}

/// M^(−1/2) of a symmetric matrix with eigenvalues 0 … 1; 0 where it has none to speak of.
fn inverse_root(m: Matrix) -> Matrix {
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(m);
    let scaled = eigenvalues.map(|value| if value > ALONE { 1.0 / value.sqrt() } else { 0.0 });
    eigenvectors * Matrix::from_diagonal(&scaled) * eigenvectors.transpose()
}
