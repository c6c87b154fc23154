//! Linear least squares with errors that hold for correlated residuals.
//!
//! Filtered and decimated signals leave correlated residuals: where the friction deviates from the model, they keep
//! their sign for tenths of a second. Ordinary standard errors treat every row as independent and are several times too
//! small. Here the covariance is that of Newey and West (1987): products of residuals up to a lag are counted, with
//! linearly falling weights. The lag is 1.3·√n and the intervals use the critical values of Kiefer and Vogelsang (2005)
//! for that share of the record, as Lazarus, Lewis, Stock and Watson (2018) recommend.

use crate::FitError;
use nalgebra::{DMatrix, DVector};

use super::statistics::student_t95;
use stickslip_base::Error;

/// Coefficients with their errors.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearFit {
    /// One for each column.
    pub coefficients: Vec<f64>,
    /// Covariance, residual correlation counted.
    pub covariance: Vec<Vec<f64>>,
    /// Square roots of its diagonal.
    pub standard_errors: Vec<f64>,
    /// Standard errors that would hold if the residuals were white, as literature usually prints them.
    pub white_standard_errors: Vec<f64>,
    /// 95 % intervals.
    pub ci95: Vec<[f64; 2]>,
    /// Lag up to which the residuals were treated as correlated, in rows.
    pub lag: usize,
    /// Largest over smallest singular value of the regressors.
    pub condition: f64,
    /// Measured minus fitted.
    pub residuals: Vec<f64>,
    /// ‖residuals‖ / ‖measured‖.
    pub relative_error: f64,
}

impl LinearFit {
    /// Variance of a weighted sum of the coefficients.
    pub fn variance(&self, weights: &[f64]) -> f64 {
        let row = |i: usize| self.covariance[i].iter().zip(weights).map(|(c, w)| c * w).sum::<f64>();
        weights.iter().enumerate().map(|(i, w)| w * row(i)).sum()
    }

    /// Inserts a coefficient that is known exactly, as the first.
    pub fn with_known_first(&mut self, value: f64) {
        self.coefficients.insert(0, value);
        self.ci95.insert(0, [value; 2]);
        self.standard_errors.insert(0, 0.0);
        self.white_standard_errors.insert(0, 0.0);
        self.covariance.iter_mut().for_each(|row| row.insert(0, 0.0));
        self.covariance.insert(0, vec![0.0; self.coefficients.len()]);
    }
}

/// Least squares of `measured` over `columns`. Rows follow each other in time.
///
/// # Errors
/// Not more rows than columns, or dependent columns: the motion does not determine the coefficients.
pub fn fit_linear(columns: &[Vec<f64>], measured: &[f64]) -> Result<LinearFit, Error> {
    let (n, k) = (measured.len(), columns.len());
    if n <= k {
        let remedy = "Record longer, or decimate less.";
        return Err(Error::TooFew { what: "rows for the least squares", found: n, needed: k + 1, remedy });
    }
    let regressors = DMatrix::from_fn(n, k, |i, j| columns[j][i]);
    let measured = DVector::from_column_slice(measured);
    let condition = condition(&regressors);
    // Columns are scaled to one norm: singularity then depends on the motion, not on units.
    let scales: Vec<f64> = (0..k).map(|j| regressors.column(j).norm().max(f64::MIN_POSITIVE)).collect();
    let mut scaled = regressors.clone();
    scales.iter().enumerate().for_each(|(j, s)| scaled.column_mut(j).unscale_mut(*s));
    // Householder's QR: the singular vectors of nalgebra 0.35 had errors of 1e-6 on such columns.
    let qr = scaled.qr();
    let upper = qr.r();
    // Independent part of each column of norm 1.
    let smallest = upper.diagonal().abs().min();
    if smallest < 1e-9 {
        return Err(FitError::Dependent { smallest }.into());
    }
    let solved = upper.solve_upper_triangular(&qr.q().transpose()).expect("no zero on the diagonal");
    let pseudo_inverse = DMatrix::from_fn(k, n, |i, t| solved[(i, t)] / scales[i]);
    Ok(finish(&pseudo_inverse, &regressors, &measured, condition, LongRun::of))
}

/// Least squares by instruments: Zᵀ·(y − X·β) = 0 with a column of `instruments` for each of `columns`.
///
/// Noise in the regressors, and disturbances that a controller feeds back into the force, bias ordinary least squares.
/// Instruments are free of both, for example the same regressors of the motion that the set-point causes; they leave
/// the estimate unbiased, at the price of a larger variance. With `instruments` equal to `columns` this is `fit_linear`
/// with another covariance: that of [`LongRun::cosines`].
///
/// # Errors
/// As [`fit_linear`].
pub fn fit_instrumented(columns: &[Vec<f64>], instruments: &[Vec<f64>], measured: &[f64]) -> Result<LinearFit, Error> {
    Ok(Instrumented::solve(columns, instruments, measured)?.fit())
}

/// Coefficients by instruments whose errors are not yet computed: for an iteration, of which the last step counts.
#[derive(Clone, Debug)]
pub struct Instrumented {
    coefficients: DVector<f64>,
    pseudo_inverse: DMatrix<f64>,
    regressors: DMatrix<f64>,
    measured: DVector<f64>,
}

impl Instrumented {
    /// The coefficients of [`fit_instrumented`].
    ///
    /// # Errors
    /// As [`fit_linear`].
    pub fn solve(columns: &[Vec<f64>], instruments: &[Vec<f64>], measured: &[f64]) -> Result<Self, Error> {
        let (n, k) = (measured.len(), columns.len());
        // Fewer rows give the covariance too few cosines.
        let needed = (k + 1).max(32);
        if n < needed {
            let remedy = "Record longer, or decimate less.";
            return Err(Error::TooFew { what: "rows for the least squares", found: n, needed, remedy });
        }
        let [regressors, instruments] = [columns, instruments].map(|all| DMatrix::from_fn(n, k, |i, j| all[j][i]));
        let scales = |matrix: &DMatrix<f64>| -> Vec<f64> {
            (0..k).map(|j| matrix.column(j).norm().max(f64::MIN_POSITIVE)).collect()
        };
        let [across, along] = [&regressors, &instruments].map(scales);
        let product = instruments.transpose() * &regressors;
        let scaled = DMatrix::from_fn(k, k, |i, j| product[(i, j)] / (along[i] * across[j]));
        let smallest = scaled.singular_values().min();
        // The product squares the condition of the regressors.
        if smallest.is_nan() || smallest < 1e-12 {
            return Err(FitError::Dependent { smallest }.into());
        }
        let inverse = scaled.try_inverse().ok_or(FitError::Dependent { smallest })?;
        let inverse = DMatrix::from_fn(k, k, |i, j| inverse[(i, j)] / (across[i] * along[j]));
        let pseudo_inverse = inverse * instruments.transpose();
        let measured = DVector::from_column_slice(measured);
        let coefficients = &pseudo_inverse * &measured;
        Ok(Instrumented { coefficients, pseudo_inverse, regressors, measured })
    }

    /// One for each column.
    pub fn coefficients(&self) -> &[f64] {
        self.coefficients.as_slice()
    }

    /// ‖residuals‖ / ‖measured‖.
    pub fn relative_error(&self) -> f64 {
        (&self.measured - &self.regressors * &self.coefficients).norm() / self.measured.norm()
    }

    /// With their errors.
    pub fn fit(&self) -> LinearFit {
        let condition = condition(&self.regressors);
        finish(&self.pseudo_inverse, &self.regressors, &self.measured, condition, LongRun::cosines)
    }
}

/// Coefficients and errors from the matrix that maps the measured values to the coefficients.
fn finish(
    pseudo_inverse: &DMatrix<f64>,
    regressors: &DMatrix<f64>,
    measured: &DVector<f64>,
    condition: f64,
    long_run: fn(&DMatrix<f64>) -> LongRun,
) -> LinearFit {
    let (n, k) = regressors.shape();
    let coefficients = pseudo_inverse * measured;
    let residuals = measured - regressors * &coefficients;

    let bread = pseudo_inverse * pseudo_inverse.transpose();
    let white = residuals.norm_squared() / (n - k) as f64;
    let influence = DMatrix::from_fn(k, n, |i, t| pseudo_inverse[(i, t)] * residuals[t]);
    let LongRun { covariance, lag, critical } = long_run(&influence);
    let standard_errors: Vec<f64> = (0..k).map(|i| covariance[(i, i)].sqrt()).collect();
    LinearFit {
        covariance: (0..k).map(|i| (0..k).map(|j| covariance[(i, j)]).collect()).collect(),
        white_standard_errors: (0..k).map(|i| (white * bread[(i, i)]).sqrt()).collect(),
        ci95: (0..k).map(|i| [-1.0, 1.0].map(|sign| coefficients[i] + sign * critical * standard_errors[i])).collect(),
        coefficients: coefficients.as_slice().to_vec(),
        standard_errors,
        lag,
        condition,
        relative_error: residuals.norm() / measured.norm(),
        residuals: residuals.as_slice().to_vec(),
    }
}

fn condition(regressors: &DMatrix<f64>) -> f64 {
    let values = regressors.singular_values();
    values.max() / values.min()
}

/// Half-width of a 95 % interval in Newey-West standard errors when the lag is this share of the record: Kiefer and
/// Vogelsang (2005), table 1, Bartlett's weights. 1.96 for a record that is long against the lag.
fn critical95(share: f64) -> f64 {
    1.96 + share * (2.9694 + share * (0.4160 - 0.5324 * share))
}

/// Covariance of parameters from the influence of each row in time.
pub struct LongRun {
    /// Covariance of the parameters.
    pub covariance: DMatrix<f64>,
    /// Rows.
    pub lag: usize,
    /// Half-width of a 95 % interval in standard errors.
    pub critical: f64,
}

impl LongRun {
    /// `influence` has a row for each parameter and a column for each row in time.
    pub fn of(influence: &DMatrix<f64>) -> Self {
        let (k, n) = influence.shape();
        let lag = ((1.3 * (n as f64).sqrt()).ceil() as usize).min(n - 1);
        let mut covariance = influence * influence.transpose();
        for l in 1..=lag {
            let product = influence.columns(l, n - l) * influence.columns(0, n - l).transpose();
            covariance += (&product + product.transpose()) * (1.0 - l as f64 / (lag + 1) as f64);
        }
        covariance *= n as f64 / (n - k) as f64;
        LongRun { covariance, lag, critical: critical95(lag as f64 / n as f64) }
    }

    /// The same from the lowest frequencies of the influence, by equal weights on B = 0.25·n^⅔ cosines and Student's t
    /// with B degrees of freedom: Lazarus, Lewis, Stock and Watson (2018), with fewer
    /// cosines than their 0.41·n^⅔: intervals hold better for strongly correlated residuals.
    pub fn cosines(influence: &DMatrix<f64>) -> Self {
        let (k, n) = influence.shape();
        let count = ((0.25 * libm::pow(n as f64, 2.0 / 3.0)) as usize).clamp(4, n - 1);
        let mut covariance = DMatrix::zeros(k, k);
        for j in 1..=count {
            // cos(ω·(t + ½)) for rising t by Chebyshev's recurrence.
            let omega = std::f64::consts::PI * j as f64 / n as f64;
            let twice = 2.0 * libm::cos(omega);
            let (mut now, mut last) = (libm::cos(0.5 * omega), libm::cos(0.5 * omega));
            let mut sum = DVector::zeros(k);
            for t in 0..n {
                sum.axpy(now, &influence.column(t), 1.0);
                (now, last) = (twice * now - last, now);
            }
            covariance += &sum * sum.transpose() * (2.0 / count as f64);
        }
        covariance *= n as f64 / (n - k) as f64;
        LongRun { covariance, lag: n / count, critical: student_t95(count as f64) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::normal;
    use super::*;

    fn experiment(memory: f64, seed: u64) -> LinearFit {
        let n = 1000;
        let mut noise = 0.0;
        let slow: Vec<f64> = (0..n).map(|t| (0.01 * t as f64).sin()).collect();
        let measured: Vec<f64> = (0..n)
            .map(|t| {
                noise = memory * noise + normal(seed, t as u64);
                2.0 + 3.0 * slow[t] + noise
            })
            .collect();
        fit_linear(&[vec![1.0; n], slow], &measured).unwrap()
    }

    /// How often our interval of the slope and the white one contain the truth.
    fn coverage(memory: f64) -> [f64; 2] {
        let mut hits = [0.0; 2];
        for fit in (0..500).map(|seed| experiment(memory, seed)) {
            let half_widths = [0.5 * (fit.ci95[1][1] - fit.ci95[1][0]), 1.96 * fit.white_standard_errors[1]];
            for (hit, half_width) in hits.iter_mut().zip(half_widths) {
                *hit += f64::from(u8::from((fit.coefficients[1] - 3.0).abs() <= half_width)) / 500.0;
            }
        }
        hits
    }

    #[test]
    fn intervals_hold_for_correlated_residuals_where_white_ones_fail() {
        let ([free, _], [correlated, white]) = (coverage(0.0), coverage(0.7));
        // 95 % expected. Bartlett's weights miss a few: 1000 runs gave 92.6 and 91.2 %; 1.2 % is the standard
        // deviation.
        assert!((0.90..=0.97).contains(&free), "{free}");
        assert!((0.88..=0.97).contains(&correlated), "{correlated}");
        assert!(white < 0.70, "{white}");
    }

    #[test]
    fn instruments_remove_the_bias_of_noisy_regressors_and_their_intervals_hold() {
        let (n, seeds) = (800, 300);
        let mut hits = [0.0; 2];
        let mut middle = [0.0; 2];
        for seed in 0..seeds {
            let truth: Vec<f64> = (0..n).map(|t| (0.03 * t as f64).sin()).collect();
            let mut drift = 0.0;
            let (mut seen, mut measured) = (Vec::new(), Vec::new());
            for (t, x) in truth.iter().enumerate() {
                // The regressor has noise, and the disturbance acts on it too, as in a closed loop.
                drift = 0.8 * drift + 0.1 * normal(seed, t as u64);
                seen.push(x + 0.3 * normal(seed + 1000, t as u64) + drift);
                measured.push(2.0 * x + drift);
            }
            let columns = [seen, vec![1.0; n]];
            let plain = fit_linear(&columns, &measured).unwrap();
            let free = fit_instrumented(&columns, &[truth, vec![1.0; n]], &measured).unwrap();
            for (k, fit) in [plain, free].iter().enumerate() {
                middle[k] += fit.coefficients[0] / seeds as f64;
                let [low, high] = fit.ci95[0];
                hits[k] += f64::from(u8::from(low <= 2.0 && 2.0 <= high)) / seeds as f64;
            }
        }
        assert!(middle[0] < 1.8 && hits[0] < 0.05, "{middle:?} {hits:?}");
        // 1.3 % is the standard deviation of a share of 95 % over 300 seeds.
        assert!((middle[1] - 2.0).abs() < 0.01 && (0.91..=0.985).contains(&hits[1]), "{middle:?} {hits:?}");
    }

    #[test]
    fn a_law_without_noise_is_found() {
        let columns = [vec![1.0, 2.0, 4.0, 7.0], vec![1.0, -1.0, 1.0, 5.0]];
        let measured: Vec<f64> = (0..4).map(|i| 2.0 * columns[0][i] - 0.5 * columns[1][i]).collect();
        let fit = fit_linear(&columns, &measured).unwrap();
        assert!((fit.coefficients[0] - 2.0).abs() < 1e-14 && (fit.coefficients[1] + 0.5).abs() < 1e-14);
        assert!(fit.relative_error < 1e-14);
    }

    #[test]
    fn dependent_columns_are_refused() {
        let ramp: Vec<f64> = (0..9).map(f64::from).collect();
        let twice = ramp.iter().map(|x| 2.0 * x).collect();
        assert!(matches!(
            fit_linear(&[ramp.clone(), twice], &ramp).as_ref().err().and_then(|error| error.of()),
            Some(FitError::Dependent { .. })
        ));
        assert!(matches!(
            fit_linear(&[ramp.clone(), vec![0.0; 9]], &ramp).as_ref().err().and_then(|error| error.of()),
            Some(FitError::Dependent { .. })
        ));
        let many: Vec<f64> = (0..64).map(f64::from).collect();
        let twice: Vec<f64> = many.iter().map(|x| 2.0 * x).collect();
        let both = [many.clone(), twice];
        assert!(
            fit_instrumented(&both, &both, &many).is_err()
                && fit_instrumented(std::slice::from_ref(&ramp), std::slice::from_ref(&ramp), &ramp).is_err()
        );
        assert!(matches!(fit_linear(&[ramp[..1].to_vec()], &ramp[..1]), Err(Error::TooFew { found: 1, .. })));
    }
}
