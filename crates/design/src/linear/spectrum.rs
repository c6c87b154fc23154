//! Poles and zeros.

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix, Schur};

use super::StateSpace;
use crate::square;
use stickslip_base::Error;

/// Iterations per state before an eigenvalue counts as not found; two or three are usual.
const ITERATIONS: usize = 200;
/// Share of the largest number of a system below which a singular value is 0.
const RANK: f64 = 1e-11;

/// Eigenvalues of a real matrix, balanced first: so that states of different units lose no digits.
///
/// # Errors
/// A matrix that is not square or not finite; one for which the iteration does not converge.
pub(crate) fn eigenvalues(a: &DMatrix<f64>) -> Result<Vec<Complex<f64>>, Error> {
    let order = square("the system matrix", a)?;
    if order == 0 {
        return Ok(Vec::new());
    }
    let mut balanced = a.clone();
    balance_parlett_reinsch(&mut balanced);
    let schur = Schur::try_new(balanced, f64::EPSILON, ITERATIONS * order)
        .or_else(|| Schur::try_new(a.transpose(), f64::EPSILON, ITERATIONS * order))
        .ok_or(Error::NotSolvable {
            what: "an eigenvalue of the system matrix",
            remedy: "Scale its states so that their numbers are of the same size.",
        })?;
    let mut values: Vec<Complex<f64>> = schur.complex_eigenvalues().iter().copied().collect();
    values.sort_by(|x, y| size(*x).total_cmp(&size(*y)).then(x.im.total_cmp(&y.im)));
    Ok(values)
}

/// |z|.
pub fn size(z: Complex<f64>) -> f64 {
    libm::hypot(z.re, z.im)
}

impl StateSpace {
    /// The poles, from the smallest magnitude on: of a sampled system in z.
    ///
    /// # Errors
    /// An eigenvalue that is not found.
    pub fn poles(&self) -> Result<Vec<Complex<f64>>, Error> {
        eigenvalues(&self.a)
    }

    /// Whether every deviation decays.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn is_stable(&self) -> Result<bool, Error> {
        let sampled = self.dt.is_some();
        Ok(self.poles()?.iter().all(|&pole| if sampled { size(pole) < 1.0 } else { pole.re < 0.0 }))
    }

    /// The invariant zeros: numbers at which an input can oscillate without any output.
    ///
    /// The pencil of the system is reduced by orthogonal transformations until its feedthrough is square and regular
    /// (Emami-Naeini and Van Dooren 1982), so that the zeros at infinity do not affect the others.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn zeros(&self) -> Result<Vec<Complex<f64>>, Error> {
        let mut a = self.a.clone();
        let scale = balance_parlett_reinsch(&mut a);
        let mut b = self.b.clone();
        let mut c = self.c.clone();
        for (i, factor) in scale.iter().enumerate() {
            b.row_mut(i).unscale_mut(*factor);
            c.column_mut(i).scale_mut(*factor);
        }
        let pencil = Pencil { a, b, c, d: self.d.clone() }.scaled();
        let tolerance = RANK * pencil.a.amax().max(1.0);
        let rows = pencil.reduced(tolerance);
        rows.transposed().reduced(tolerance).transposed().finite_zeros()
    }
}

/// [A − λ·I, B; C, D].
struct Pencil {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
}

/// The right singular vectors of a matrix, all of them, those of its row space first, and the rank.
fn right_vectors(matrix: &DMatrix<f64>, tolerance: f64) -> (DMatrix<f64>, usize) {
    let columns = matrix.ncols();
    // Rows of zeros complete the basis.
    let mut padded = DMatrix::zeros(matrix.nrows().max(columns), columns);
    padded.view_mut((0, 0), matrix.shape()).copy_from(matrix);
    if columns == 0 {
        return (DMatrix::zeros(0, 0), 0);
    }
    let svd = padded.svd(false, true);
    let rank = svd.singular_values.iter().filter(|&&value| value > tolerance).count();
    (svd.v_t.map_or_else(|| DMatrix::identity(columns, columns), |v_t| v_t.transpose()), rank)
}

impl Pencil {
    /// Inputs and outputs scaled to the size of the states: zeros do not depend on the scale, but the ranks below do.
    fn scaled(mut self) -> Self {
        for j in 0..self.b.ncols() {
            let size = self.b.column(j).amax().max(self.d.column(j).amax());
            if size > 0.0 {
                self.b.column_mut(j).unscale_mut(size);
                self.d.column_mut(j).unscale_mut(size);
            }
        }
        for i in 0..self.c.nrows() {
            let size = self.c.row(i).amax().max(self.d.row(i).amax());
            if size > 0.0 {
                self.c.row_mut(i).unscale_mut(size);
                self.d.row_mut(i).unscale_mut(size);
            }
        }
        self
    }

    fn transposed(&self) -> Self {
        Pencil { a: self.a.transpose(), b: self.c.transpose(), c: self.b.transpose(), d: self.d.transpose() }
    }

    /// The same finite zeros with a feedthrough whose rows are independent.
    fn reduced(self, tolerance: f64) -> Self {
        let Pencil { mut a, mut b, mut c, mut d } = self;
        loop {
            let (left, rank) = right_vectors(&d.transpose(), tolerance);
            if rank == d.nrows() {
                return Pencil { a, b, c, d };
            }
            let (turned_c, turned_d) = (left.transpose() * &c, left.transpose() * &d);
            let silent = turned_c.rows(rank, c.nrows() - rank).into_owned();
            let (upper_c, upper_d) = (turned_c.rows(0, rank).into_owned(), turned_d.rows(0, rank).into_owned());
            let (basis, count) = right_vectors(&silent, tolerance);
            if count == 0 {
                return Pencil { a, b, c: upper_c, d: upper_d };
            }
            // States in such an output must be 0: their equations become outputs.
            let (turned_a, turned_b) = (basis.transpose() * &a * &basis, basis.transpose() * &b);
            let left_over = a.nrows() - count;
            a = turned_a.view((count, count), (left_over, left_over)).into_owned();
            b = turned_b.rows(count, left_over).into_owned();
            let upper = (upper_c * &basis).columns(count, left_over).into_owned();
            let constraints = turned_a.view((0, count), (count, left_over)).into_owned();
            c = DMatrix::from_fn(rank + count, left_over, |i, j| {
                if i < rank { upper[(i, j)] } else { constraints[(i - rank, j)] }
            });
            d = DMatrix::from_fn(rank + count, upper_d.ncols(), |i, j| {
                if i < rank { upper_d[(i, j)] } else { turned_b[(i - rank, j)] }
            });
        }
    }

    /// Zeros of a pencil whose feedthrough is square and regular: (A·N₁ + B·N₂)·v = λ·N₁·v on the kernel N of [C D].
    fn finite_zeros(&self) -> Result<Vec<Complex<f64>>, Error> {
        let (states, outputs) = (self.a.nrows(), self.d.nrows());
        if states == 0 {
            return Ok(Vec::new());
        }
        let both = DMatrix::from_fn(outputs, states + self.d.ncols(), |i, j| {
            if j < states { self.c[(i, j)] } else { self.d[(i, j - states)] }
        });
        let (basis, _) = right_vectors(&both, 0.0);
        let kernel = basis.columns(outputs, basis.ncols() - outputs);
        let (of_states, of_inputs) = (kernel.rows(0, states).into_owned(), kernel.rows(states, self.d.ncols()));
        let moved = &self.a * &of_states + &self.b * of_inputs;
        let degenerate = Error::NotSolvable {
            what: "the set of zeros of the system",
            remedy: "Give each output an input of its own: now every number is a zero.",
        };
        eigenvalues(&of_states.lu().solve(&moved).ok_or(degenerate)?)
    }
}
