//! A linear system by its matrices.

use nalgebra::DMatrix;

use crate::{finite, sampling_time, square, zero_order_hold};
use stickslip_base::Error;

/// A linear system in state space; its inputs and outputs may have names.
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace {
    /// System matrix A.
    pub a: DMatrix<f64>,
    /// Input matrix B.
    pub b: DMatrix<f64>,
    /// Output matrix C.
    pub c: DMatrix<f64>,
    /// Feedthrough D.
    pub d: DMatrix<f64>,
    /// Sampling time [s]; `None` for continuous time.
    pub dt: Option<f64>,
    /// The inputs; empty without names.
    pub inputs: Vec<Port>,
    /// The outputs; empty without names.
    pub outputs: Vec<Port>,
}

/// An input or an output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Port {
    /// Its name, for example `commanded_torque`.
    pub name: String,
    /// Its unit, as in a field.
    pub unit: String,
}

impl Port {
    /// A port of this name and unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Port { name: name.into(), unit: unit.into() }
    }
}

impl StateSpace {
    /// The system of these matrices, sampled every `dt` [s] or continuous.
    ///
    /// # Errors
    /// Matrices of inconsistent sizes, non-finite numbers, an invalid sampling time.
    pub fn new(
        a: DMatrix<f64>,
        b: DMatrix<f64>,
        c: DMatrix<f64>,
        d: DMatrix<f64>,
        dt: Option<f64>,
    ) -> Result<Self, Error> {
        let states = square("the system matrix", &a)?;
        fits("rows of the input matrix", b.nrows(), states)?;
        fits("columns of the output matrix", c.ncols(), states)?;
        fits("rows of the feedthrough", d.nrows(), c.nrows())?;
        fits("columns of the feedthrough", d.ncols(), b.ncols())?;
        for (what, matrix) in [("the input matrix", &b), ("the output matrix", &c), ("the feedthrough", &d)] {
            finite(what, matrix)?;
        }
        dt.map_or(Ok(()), sampling_time)?;
        Ok(StateSpace { a, b, c, d, dt, inputs: Vec::new(), outputs: Vec::new() })
    }

    /// A system without states.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn gain(d: DMatrix<f64>, dt: Option<f64>) -> Result<Self, Error> {
        let (outputs, inputs) = d.shape();
        Self::new(DMatrix::zeros(0, 0), DMatrix::zeros(0, inputs), DMatrix::zeros(outputs, 0), d, dt)
    }

    /// The system with names.
    #[must_use]
    pub fn named(self, inputs: Vec<Port>, outputs: Vec<Port>) -> Self {
        StateSpace { inputs, outputs, ..self }
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// The system from one input to one output.
    ///
    /// # Errors
    /// [`Error::Dimension`] for an input or output that does not exist.
    pub fn channel(&self, input: usize, output: usize) -> Result<Self, Error> {
        self.select(&[input], &[output])
    }

    /// The system between these inputs and outputs, in this order.
    ///
    /// # Errors
    /// [`Error::Dimension`] for an input or output that does not exist.
    pub fn select(&self, inputs: &[usize], outputs: &[usize]) -> Result<Self, Error> {
        let exists = |what: &'static str, index: &[usize], count: usize| match index.iter().find(|&&i| i >= count) {
            Some(&index) => {
                Err(Error::Dimension { what, found: index, expected: count, remedy: "Numbers start at 0." })
            }
            None => Ok(()),
        };
        exists("the number of an input", inputs, self.b.ncols())?;
        exists("the number of an output", outputs, self.c.nrows())?;
        let names = |ports: &[Port], index: &[usize]| index.iter().filter_map(|&i| ports.get(i).cloned()).collect();
        Ok(StateSpace {
            a: self.a.clone(),
            b: self.b.select_columns(inputs),
            c: self.c.select_rows(outputs),
            d: self.d.select_columns(inputs).select_rows(outputs),
            dt: self.dt,
            inputs: names(&self.inputs, inputs),
            outputs: names(&self.outputs, outputs),
        })
    }

    /// The continuous system with its inputs held over each sample of `dt` [s], exactly.
    ///
    /// # Errors
    /// A sampled system; errors of [`zero_order_hold`].
    pub fn sampled(&self, dt: f64) -> Result<Self, Error> {
        same_time(None, self.dt)?;
        let (a, b) = zero_order_hold(&self.a, &self.b, dt)?;
        Ok(StateSpace { a, b, dt: Some(dt), ..self.clone() })
    }

    /// The system without the states that no input reaches or no output depends on, by the zeros of the matrices. The
    /// other numbers are unchanged.
    #[must_use]
    pub fn trimmed(&self) -> Self {
        let reached = closure(self.order(), |i| self.b.row(i).amax() != 0.0, |to, from| self.a[(to, from)] != 0.0);
        let observed = closure(self.order(), |i| self.c.column(i).amax() != 0.0, |to, from| self.a[(from, to)] != 0.0);
        let remaining: Vec<usize> = (0..self.order()).filter(|&i| reached[i] && observed[i]).collect();
        StateSpace {
            a: self.a.select_rows(&remaining).select_columns(&remaining),
            b: self.b.select_rows(&remaining),
            c: self.c.select_columns(&remaining),
            ..self.clone()
        }
    }

    /// A number of samples of the system as one sample of a slower one: its input is held meanwhile, its output read at
    /// the start.
    ///
    /// # Errors
    /// A continuous system; 0 samples.
    pub fn slower(&self, samples: usize) -> Result<Self, Error> {
        let dt = self.dt.ok_or(Error::Dimension {
            what: "samples of a continuous system",
            found: samples,
            expected: 0,
            remedy: "Sample the system first.",
        })?;
        let (mut a, mut b) =
            (DMatrix::identity(self.order(), self.order()), DMatrix::zeros(self.order(), self.b.ncols()));
        for _ in 0..samples {
            b = &self.a * b + &self.b;
            a = &self.a * a;
        }
        fits("samples of the slower system", samples, samples.max(1))?;
        Ok(StateSpace { a, b, dt: Some(dt * samples as f64), ..self.clone() })
    }

    /// Covariance of the outputs for white noise of unit variance at each input, without its direct share.
    ///
    /// # Errors
    /// A continuous system; an unstable system.
    pub fn noise(&self) -> Result<DMatrix<f64>, Error> {
        if self.dt.is_none() {
            let remedy = "Sample the system first.";
            return Err(Error::Dimension { what: "noise of a continuous system", found: 0, expected: 1, remedy });
        }
        let covariance = crate::discrete_lyapunov(&self.a, &(&self.b * self.b.transpose()))?;
        Ok(&self.c * covariance * self.c.transpose())
    }
}

/// Nodes reachable from a start along arrows.
fn closure(count: usize, start: impl Fn(usize) -> bool, arrow: impl Fn(usize, usize) -> bool) -> Vec<bool> {
    let mut reached: Vec<bool> = (0..count).map(start).collect();
    let mut open: Vec<usize> = (0..count).filter(|&i| reached[i]).collect();
    while let Some(from) = open.pop() {
        for to in 0..count {
            if !reached[to] && arrow(to, from) {
                reached[to] = true;
                open.push(to);
            }
        }
    }
    reached
}

pub(super) fn fits(what: &'static str, found: usize, expected: usize) -> Result<(), Error> {
    let remedy = "The numbers of inputs and outputs must be equal.";
    if found == expected { Ok(()) } else { Err(Error::Dimension { what, found, expected, remedy }) }
}

/// `Err` unless both systems have the same sampling time.
pub(super) fn same_time(one: Option<f64>, other: Option<f64>) -> Result<(), Error> {
    if one == other {
        return Ok(());
    }
    let (expected, value) = (one.unwrap_or(0.0), other.unwrap_or(0.0));
    Err(Error::OutOfRange {
        name: "the sampling time of a connected system (0: continuous)",
        value,
        unit: "s",
        minimum: expected,
        maximum: expected,
        remedy: "Sample both at the same rate first.",
    })
}
