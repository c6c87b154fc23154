//! A linear system by its matrices.

use nalgebra::{DMatrix, DVector};

use crate::{finite, sampling_time, square, zero_order_hold};
use stickslip_base::Error;

/// A linear system in states; its inputs and outputs have names where they are known.
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace {
    /// How the states act on the states.
    pub a: DMatrix<f64>,
    /// How the inputs act on the states.
    pub b: DMatrix<f64>,
    /// How the outputs show the states.
    pub c: DMatrix<f64>,
    /// How the outputs show the inputs.
    pub d: DMatrix<f64>,
    /// Sampling time [s]; `None` where time is continuous.
    pub dt: Option<f64>,
    /// The inputs; empty where they have no names.
    pub inputs: Vec<Port>,
    /// The outputs; empty where they have no names.
    pub outputs: Vec<Port>,
}

/// An input or an output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Port {
    /// What it is: `commanded_torque`.
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
    /// Matrices whose sizes do not fit, what is no number, a sampling time that no drive has.
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

    /// With names.
    #[must_use]
    pub fn named(self, inputs: Vec<Port>, outputs: Vec<Port>) -> Self {
        StateSpace { inputs, outputs, ..self }
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// The way from one input to one output.
    ///
    /// # Errors
    /// [`Error::Dimension`] for an input or output that is not there.
    pub fn channel(&self, input: usize, output: usize) -> Result<Self, Error> {
        self.select(&[input], &[output])
    }

    /// The system between these inputs and outputs, in this order.
    ///
    /// # Errors
    /// [`Error::Dimension`] for an input or output that is not there.
    pub fn select(&self, inputs: &[usize], outputs: &[usize]) -> Result<Self, Error> {
        let there = |what: &'static str, index: &[usize], count: usize| match index.iter().find(|&&i| i >= count) {
            Some(&found) => Err(Error::Dimension { what, found, expected: count, remedy: "They are counted from 0." }),
            None => Ok(()),
        };
        there("the number of an input", inputs, self.b.ncols())?;
        there("the number of an output", outputs, self.c.nrows())?;
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
    /// A system that is sampled already; what [`zero_order_hold`] refuses.
    pub fn sampled(&self, dt: f64) -> Result<Self, Error> {
        same_time(None, self.dt)?;
        let (a, b) = zero_order_hold(&self.a, &self.b, dt)?;
        Ok(StateSpace { a, b, dt: Some(dt), ..self.clone() })
    }

    /// Without the states that no input reaches or no output shows, as far as the zeros of the matrices say so. What is
    /// left has its numbers unchanged.
    #[must_use]
    pub fn trimmed(&self) -> Self {
        let reached = closure(self.order(), |i| self.b.row(i).amax() != 0.0, |to, from| self.a[(to, from)] != 0.0);
        let shown = closure(self.order(), |i| self.c.column(i).amax() != 0.0, |to, from| self.a[(from, to)] != 0.0);
        let kept: Vec<usize> = (0..self.order()).filter(|&i| reached[i] && shown[i]).collect();
        StateSpace {
            a: self.a.select_rows(&kept).select_columns(&kept),
            b: self.b.select_rows(&kept),
            c: self.c.select_columns(&kept),
            ..self.clone()
        }
    }

    /// So many samples of the system as one sample of a slower one: its input is held meanwhile, its output read at the
    /// begin.
    ///
    /// # Errors
    /// A system that is continuous, or no sample at all.
    pub fn slower(&self, samples: usize) -> Result<Self, Error> {
        let dt = self.dt.ok_or(Error::Dimension {
            what: "samples of a continuous system",
            found: samples,
            expected: 0,
            remedy: "Sample it first.",
        })?;
        let (mut a, mut b) =
            (DMatrix::identity(self.order(), self.order()), DMatrix::zeros(self.order(), self.b.ncols()));
        for _ in 0..samples {
            b = &self.a * b + &self.b;
            a = &self.a * a;
        }
        fits("samples that are put together", samples, samples.max(1))?;
        Ok(StateSpace { a, b, dt: Some(dt * samples as f64), ..self.clone() })
    }

    /// Covariance of the outputs that white noise of unit variance at each input makes, without its direct share.
    ///
    /// # Errors
    /// A continuous system; one that is not stable.
    pub fn noise(&self) -> Result<DMatrix<f64>, Error> {
        if self.dt.is_none() {
            let remedy = "Sample it first.";
            return Err(Error::Dimension { what: "noise of a continuous system", found: 0, expected: 1, remedy });
        }
        let covariance = crate::discrete_lyapunov(&self.a, &(&self.b * self.b.transpose()))?;
        Ok(&self.c * covariance * self.c.transpose())
    }

    /// The outputs, sample after sample, from rest under these inputs; continuous systems hold each over `dt` [s].
    pub(super) fn simulate(&self, inputs: impl Iterator<Item = DVector<f64>>) -> Vec<DVector<f64>> {
        let mut state = DVector::zeros(self.order());
        inputs
            .map(|input| {
                let output = &self.c * &state + &self.d * &input;
                state = &self.a * &state + &self.b * &input;
                output
            })
            .collect()
    }
}

/// What is reached from a start by arrows.
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
    let remedy = "Take systems whose inputs and outputs fit each other.";
    if found == expected { Ok(()) } else { Err(Error::Dimension { what, found, expected, remedy }) }
}

/// `Err` unless both systems have the same time.
pub(super) fn same_time(one: Option<f64>, other: Option<f64>) -> Result<(), Error> {
    if one == other {
        return Ok(());
    }
    let (expected, value) = (one.unwrap_or(0.0), other.unwrap_or(0.0));
    Err(Error::OutOfRange {
        name: "the sampling time of a system that is joined (0: continuous)",
        value,
        unit: "s",
        minimum: expected,
        maximum: expected,
        remedy: "Sample both at the same rate first.",
    })
}
