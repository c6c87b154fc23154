//! Series, parallel and feedback connection of systems, and delays.

use nalgebra::DMatrix;

use super::StateSpace;
use super::state_space::{fits, same_time};
use stickslip_base::Error;

/// A matrix of four blocks.
fn blocks(rows: [[&DMatrix<f64>; 2]; 2]) -> DMatrix<f64> {
    let [[a, b], [c, d]] = rows;
    let mut whole = DMatrix::zeros(a.nrows() + c.nrows(), a.ncols() + b.ncols());
    whole.view_mut((0, 0), a.shape()).copy_from(a);
    whole.view_mut((0, a.ncols()), b.shape()).copy_from(b);
    whole.view_mut((a.nrows(), 0), c.shape()).copy_from(c);
    whole.view_mut((a.nrows(), a.ncols()), d.shape()).copy_from(d);
    whole
}

/// Two matrices above each other.
fn above(one: &DMatrix<f64>, other: &DMatrix<f64>) -> DMatrix<f64> {
    blocks([[one, &DMatrix::zeros(one.nrows(), 0)], [other, &DMatrix::zeros(other.nrows(), 0)]])
}

/// Two matrices side by side.
fn beside(one: &DMatrix<f64>, other: &DMatrix<f64>) -> DMatrix<f64> {
    blocks([[one, other], [&DMatrix::zeros(0, one.ncols()), &DMatrix::zeros(0, other.ncols())]])
}

fn nothing(rows: &DMatrix<f64>, columns: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::zeros(rows.nrows(), columns.ncols())
}

impl StateSpace {
    /// This system followed by `next`.
    ///
    /// # Errors
    /// Outputs and inputs that do not fit, or different sampling times.
    pub fn then(&self, next: &StateSpace) -> Result<Self, Error> {
        same_time(self.dt, next.dt)?;
        fits("inputs of the second system", next.b.ncols(), self.c.nrows())?;
        Ok(StateSpace {
            a: blocks([[&self.a, &nothing(&self.a, &next.a)], [&(&next.b * &self.c), &next.a]]),
            b: above(&self.b, &(&next.b * &self.d)),
            c: beside(&(&next.d * &self.c), &next.c),
            d: &next.d * &self.d,
            dt: self.dt,
            inputs: self.inputs.clone(),
            outputs: next.outputs.clone(),
        })
    }

    /// Both systems on the same inputs, their outputs added.
    ///
    /// # Errors
    /// As [`then`](Self::then).
    pub fn plus(&self, other: &StateSpace) -> Result<Self, Error> {
        same_time(self.dt, other.dt)?;
        fits("inputs of the second system", other.b.ncols(), self.b.ncols())?;
        fits("outputs of the second system", other.c.nrows(), self.c.nrows())?;
        Ok(StateSpace {
            a: blocks([[&self.a, &nothing(&self.a, &other.a)], [&nothing(&other.a, &self.a), &other.a]]),
            b: above(&self.b, &other.b),
            c: beside(&self.c, &other.c),
            d: &self.d + &other.d,
            ..self.clone()
        })
    }

    /// The loop that `back` closes around this system: u = r − back·y.
    ///
    /// # Errors
    /// As [`then`](Self::then); a loop that is not well-posed because its direct gain is −1.
    pub fn feedback(&self, back: &StateSpace) -> Result<Self, Error> {
        same_time(self.dt, back.dt)?;
        fits("inputs of the feedback", back.b.ncols(), self.c.nrows())?;
        fits("outputs of the feedback", back.c.nrows(), self.b.ncols())?;
        let count = self.b.ncols();
        let direct = DMatrix::identity(count, count) + &back.d * &self.d;
        let direct = direct.try_inverse().ok_or(Error::NotSolvable {
            what: "the closed loop",
            remedy: "Give the loop a delay: its direct gain is −1.",
        })?;
        // u = E·(r − C_b·x_b − D_b·C·x)
        let (own, of_back) = (-&direct * &back.d * &self.c, -&direct * &back.c);
        let c = beside(&(&self.c + &self.d * &own), &(&self.d * &of_back));
        let d = &self.d * &direct;
        let above_rows = beside(&(&self.a + &self.b * &own), &(&self.b * &of_back));
        let below = &back.b * &c + beside(&nothing(&back.a, &self.a), &back.a);
        Ok(StateSpace {
            a: above(&above_rows, &below),
            b: above(&(&self.b * &direct), &(&back.b * &d)),
            c,
            d,
            ..self.clone()
        })
    }

    /// The system with its inputs delayed by a number of samples.
    ///
    /// # Errors
    /// A continuous system.
    pub fn delayed(&self, samples: usize) -> Result<Self, Error> {
        (0..samples * self.b.ncols()).try_fold(self.clone(), |late, k| late.late_input(k % self.b.ncols()))
    }

    /// The system with one of its inputs delayed by a sample.
    ///
    /// # Errors
    /// A continuous system; [`Error::Dimension`] for an input that does not exist.
    pub fn late_input(&self, input: usize) -> Result<Self, Error> {
        self.channel(input, 0)?;
        if self.dt.is_none() {
            let remedy = "Sample the system first.";
            return Err(Error::Dimension { what: "a sample of a continuous system", found: 1, expected: 0, remedy });
        }
        let one = DMatrix::from_element(1, 1, 1.0);
        let waits = DMatrix::from_fn(1, self.b.ncols(), |_, j| if j == input { 1.0 } else { 0.0 });
        let (mut b, mut d) = (above(&self.b, &waits), self.d.clone());
        b.view_mut((0, input), (self.order(), 1)).fill(0.0);
        d.column_mut(input).fill(0.0);
        let (into, direct) = (self.b.column(input).into_owned(), self.d.column(input).into_owned());
        let (into, direct) = (DMatrix::from_columns(&[into]), DMatrix::from_columns(&[direct]));
        Ok(StateSpace {
            a: blocks([[&self.a, &into], [&DMatrix::zeros(1, self.order()), &(one * 0.0)]]),
            b,
            c: beside(&self.c, &direct),
            d,
            ..self.clone()
        })
    }
}
