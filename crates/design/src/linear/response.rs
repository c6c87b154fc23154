//! Responses: to sines, to a step, to an impulse.

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix, DVector};

use super::StateSpace;
use super::spectrum::size;
use stickslip_base::Error;

/// Samples of a step response that are computed at once, as a power of two: C·Aᵏ·x for one x.
const LEAP: usize = 5;

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
        self.at(on_axis(frequency, self.dt))
    }

    /// From the first input to the first output at these frequencies [rad/s]; infinite on a pole.
    pub fn response(&self, frequencies: &[f64]) -> Vec<Complex<f64>> {
        self.responses(frequencies).map(|g| g.map_or(Complex::new(f64::INFINITY, 0.0), |g| g[(0, 0)])).collect()
    }

    /// As [`at_frequency`](Self::at_frequency) for many frequencies [rad/s], at n² instead of n³ each: by a Hessenberg
    /// matrix, whose equations are solved in one sweep (Laub 1981).
    pub(crate) fn responses(&self, frequencies: &[f64]) -> impl Iterator<Item = Option<DMatrix<Complex<f64>>>> {
        // Balanced first, so that states of different units lose no digits.
        let mut balanced = self.a.clone();
        let scale = if self.order() > 0 { balance_parlett_reinsch(&mut balanced) } else { DVector::zeros(0) };
        let mut b = self.b.clone();
        let mut c = self.c.clone();
        for (i, factor) in scale.iter().enumerate() {
            b.row_mut(i).unscale_mut(*factor);
            c.column_mut(i).scale_mut(*factor);
        }
        if self.order() > 1 {
            let (turn, hessenberg) = balanced.hessenberg().unpack();
            (balanced, b, c) = (hessenberg, turn.transpose() * b, c * turn);
        }
        let d = self.d.map(|value| Complex::new(value, 0.0));
        let dt = self.dt;
        frequencies.iter().map(move |&frequency| {
            let point = on_axis(frequency, dt);
            let mut shifted = balanced.map(|value| Complex::new(-value, 0.0));
            for i in 0..balanced.nrows() {
                shifted[(i, i)] += point;
            }
            let moved = sweep(shifted, b.map(|value| Complex::new(value, 0.0)))?;
            let mut answer = d.clone();
            for j in 0..moved.ncols() {
                for i in 0..c.nrows() {
                    answer[(i, j)] += (0..c.ncols()).map(|k| moved[(k, j)] * c[(i, k)]).sum::<Complex<f64>>();
                }
            }
            Some(answer)
        })
    }

    /// Gain for a constant input; `None` with a pole there.
    pub fn dc_gain(&self) -> Option<DMatrix<f64>> {
        let identity = DMatrix::identity(self.order(), self.order());
        let rest = if self.dt.is_some() { identity - &self.a } else { -&self.a };
        Some(&self.c * rest.lu().solve(&self.b)? + &self.d)
    }

    /// Responses of the first output to a unit step at the first input, `count` of them; a continuous system every
    /// `dt` [s].
    ///
    /// # Errors
    /// Errors of [`sampled`](Self::sampled).
    pub fn step_response(&self, count: usize, dt: f64) -> Result<Vec<f64>, Error> {
        let sampled = if self.dt.is_some() { self.clone() } else { self.sampled(dt)? };
        let order = self.order();
        // The constant input as a last state: [x; 1]⁺ = [A b; 0 1]·[x; 1].
        let mut flow = DMatrix::identity(order + 1, order + 1);
        flow.view_mut((0, 0), (order, order)).copy_from(&sampled.a);
        flow.view_mut((0, order), (order, 1)).copy_from(&sampled.b.column(0));
        let mut outputs = DMatrix::zeros(1 << LEAP, order + 1);
        outputs.view_mut((0, 0), (1, order)).copy_from(&sampled.c.row(0));
        outputs[(0, order)] = sampled.d[(0, 0)];
        for k in 1..outputs.nrows() {
            let next = outputs.row(k - 1) * &flow;
            outputs.row_mut(k).copy_from(&next);
        }
        for _ in 0..LEAP {
            flow = &flow * &flow;
        }
        let mut state = DVector::zeros(order + 1);
        state[order] = 1.0;
        let mut answers = Vec::with_capacity(count);
        while answers.len() < count {
            answers.extend((&outputs * &state).iter().take(count - answers.len()));
            state = &flow * state;
        }
        Ok(answers)
    }

    /// Responses to a unit impulse instead; that of a continuous system has unit area, and its direct share is left
    /// out.
    ///
    /// # Errors
    /// As [`step_response`](Self::step_response).
    pub fn impulse_response(&self, count: usize, dt: f64) -> Result<Vec<f64>, Error> {
        let (flow, mut state, direct) = match self.dt {
            Some(_) => (self.a.clone(), self.b.column(0).into_owned(), self.d[(0, 0)]),
            None => (self.sampled(dt)?.a, self.b.column(0).into_owned(), 0.0),
        };
        let output = self.c.row(0);
        let mut answers = Vec::with_capacity(count);
        if self.dt.is_some() && count > 0 {
            answers.push(direct);
        }
        while answers.len() < count {
            answers.push((output * &state)[0]);
            state = &flow * state;
        }
        Ok(answers)
    }
}

/// s or z of a frequency [rad/s].
fn on_axis(frequency: f64, dt: Option<f64>) -> Complex<f64> {
    match dt {
        Some(dt) => Complex::new(libm::cos(frequency * dt), libm::sin(frequency * dt)),
        None => Complex::new(0.0, frequency),
    }
}

/// The solution of H·x = b for a Hessenberg matrix, with row pivoting; `None` where it is singular.
fn sweep(mut h: DMatrix<Complex<f64>>, mut b: DMatrix<Complex<f64>>) -> Option<DMatrix<Complex<f64>>> {
    let (order, columns) = (h.nrows(), b.ncols());
    let rough = |value: Complex<f64>| value.re.abs() + value.im.abs();
    for k in 0..order {
        if k + 1 < order {
            if rough(h[(k + 1, k)]) > rough(h[(k, k)]) {
                h.swap_rows(k, k + 1);
                b.swap_rows(k, k + 1);
            }
            if rough(h[(k, k)]) == 0.0 {
                return None;
            }
            let factor = h[(k + 1, k)] / h[(k, k)];
            for j in k + 1..order {
                let above = h[(k, j)];
                h[(k + 1, j)] -= factor * above;
            }
            for j in 0..columns {
                let above = b[(k, j)];
                b[(k + 1, j)] -= factor * above;
            }
        } else if rough(h[(k, k)]) == 0.0 {
            return None;
        }
    }
    for j in 0..columns {
        for k in (0..order).rev() {
            let sum = (k + 1..order).map(|i| h[(k, i)] * b[(i, j)]).sum::<Complex<f64>>();
            b[(k, j)] = (b[(k, j)] - sum) / h[(k, k)];
        }
    }
    Some(b)
}

/// Magnitude [dB].
pub fn decibels(gain: Complex<f64>) -> f64 {
    20.0 * libm::log10(size(gain))
}

/// Phases without jumps [°], the first within half a turn of `near`.
pub fn unwrapped(gains: impl IntoIterator<Item = Complex<f64>>, near: f64) -> Vec<f64> {
    let mut last = near;
    let next = |gain: Complex<f64>| {
        let phase = libm::atan2(gain.im, gain.re).to_degrees();
        last = phase + 360.0 * ((last - phase) / 360.0).round();
        last
    };
    gains.into_iter().map(next).collect()
}
