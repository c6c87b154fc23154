//! Responses: to sines, to a step, to an impulse.

use nalgebra::{Complex, DMatrix, DVector};

use super::StateSpace;
use super::spectrum::size;
use crate::Error;

impl StateSpace {
    /// From each input to each output at a complex frequency, s or z; `None` on a pole.
    pub fn at(&self, point: Complex<f64>) -> Option<DMatrix<Complex<f64>>> {
        let complex = |matrix: &DMatrix<f64>| matrix.map(|value| Complex::new(value, 0.0));
        let mut shifted = -complex(&self.a);
        for i in 0..self.order() {
            shifted[(i, i)] += point;
        }
        let moved = shifted.lu().solve(&complex(&self.b))?;
        Some(complex(&self.c) * moved + complex(&self.d))
    }

    /// The same at a frequency [rad/s].
    pub fn at_frequency(&self, frequency: f64) -> Option<DMatrix<Complex<f64>>> {
        self.at(match self.dt {
            Some(dt) => Complex::new(libm::cos(frequency * dt), libm::sin(frequency * dt)),
            None => Complex::new(0.0, frequency),
        })
    }

    /// From the first input to the first output at these frequencies [rad/s]; infinite on a pole.
    pub fn response(&self, frequencies: &[f64]) -> Vec<Complex<f64>> {
        let infinite = Complex::new(f64::INFINITY, 0.0);
        frequencies.iter().map(|&frequency| self.at_frequency(frequency).map_or(infinite, |g| g[(0, 0)])).collect()
    }

    /// What a constant input comes to; `None` with a pole there.
    pub fn dc_gain(&self) -> Option<DMatrix<f64>> {
        let identity = DMatrix::identity(self.order(), self.order());
        let rest = if self.dt.is_some() { identity - &self.a } else { -&self.a };
        Some(&self.c * rest.lu().solve(&self.b)? + &self.d)
    }

    /// Answers of the first output to a unit step at the first input, `count` of them; a continuous system every
    /// `dt` [s].
    ///
    /// # Errors
    /// What [`sampled`](Self::sampled) refuses.
    pub fn step_response(&self, count: usize, dt: f64) -> Result<Vec<f64>, Error> {
        let mut unit = DVector::zeros(self.b.ncols());
        unit[0] = 1.0;
        let sampled = if self.dt.is_some() { self.clone() } else { self.sampled(dt)? };
        Ok(sampled.simulate(std::iter::repeat_n(unit, count)).iter().map(|y| y[0]).collect())
    }

    /// Answers to a unit impulse instead; that of a continuous system has unit area, and its direct share is left out.
    ///
    /// # Errors
    /// As [`step_response`](Self::step_response).
    pub fn impulse_response(&self, count: usize, dt: f64) -> Result<Vec<f64>, Error> {
        let (flow, mut state, direct) = match self.dt {
            Some(_) => (self.a.clone(), self.b.column(0).into_owned(), self.d[(0, 0)]),
            None => (self.sampled(dt)?.a, self.b.column(0).into_owned(), 0.0),
        };
        let shown = self.c.row(0);
        let mut answers = Vec::with_capacity(count);
        if self.dt.is_some() && count > 0 {
            answers.push(direct);
        }
        while answers.len() < count {
            answers.push((shown * &state)[0]);
            state = &flow * state;
        }
        Ok(answers)
    }
}

/// Magnitude [dB].
pub(crate) fn decibels(gain: Complex<f64>) -> f64 {
    20.0 * libm::log10(size(gain))
}

/// Phases without jumps [°], the first within half a turn of `near`.
pub(crate) fn unwrapped(gains: impl IntoIterator<Item = Complex<f64>>, near: f64) -> Vec<f64> {
    let mut last = near;
    let next = |gain: Complex<f64>| {
        let phase = libm::atan2(gain.im, gain.re).to_degrees();
        last = phase + 360.0 * ((last - phase) / 360.0).round();
        last
    };
    gains.into_iter().map(next).collect()
}
