//! Intervals of a solved balance: what is added to the random error of the least squares.

use stickslip_fit::LinearFit;

/// Enlarges all intervals by the factor that simulated axes require.
pub(super) fn enlarge(fit: &mut LinearFit, factor: f64) {
    fit.covariance.iter_mut().flatten().for_each(|value| *value *= factor * factor);
    fit.standard_errors.iter_mut().for_each(|error| *error *= factor);
    for (ci95, value) in fit.ci95.iter_mut().zip(&fit.coefficients) {
        *ci95 = ci95.map(|bound| value + factor * (bound - value));
    }
}

/// Adds an error of one coefficient, given as half of a 95 % interval, to all: the others follow it as their covariance
/// states.
pub(super) fn widen(fit: &mut LinearFit, index: usize, half_width: f64) {
    let count = fit.coefficients.len();
    let critical = |fit: &LinearFit, i: usize| 0.5 * (fit.ci95[i][1] - fit.ci95[i][0]) / fit.standard_errors[i];
    let (factors, variance): (Vec<f64>, f64) =
        ((0..count).map(|i| critical(fit, i)).collect(), fit.covariance[index][index]);
    let error = half_width / factors[index];
    let follows: Vec<f64> = (0..count).map(|i| fit.covariance[i][index] / variance * error).collect();
    if follows.iter().chain(&factors).any(|value| !value.is_finite()) {
        return;
    }
    for i in 0..count {
        for j in 0..count {
            fit.covariance[i][j] += follows[i] * follows[j];
        }
        fit.standard_errors[i] = fit.covariance[i][i].sqrt();
        let wide = factors[i] * fit.standard_errors[i];
        fit.ci95[i] = [fit.coefficients[i] - wide, fit.coefficients[i] + wide];
    }
}

/// Adds a systematic error to one coefficient.
pub(crate) fn add(fit: &mut LinearFit, index: usize, error: f64) {
    let half_width = 0.5 * (fit.ci95[index][1] - fit.ci95[index][0]);
    let factor = 1.0 + error / half_width;
    // A known coefficient is exact.
    if !(half_width > 0.0 && factor.is_finite()) {
        return;
    }
    fit.ci95[index] = [fit.ci95[index][0] - error, fit.ci95[index][1] + error];
    fit.standard_errors[index] *= factor;
    fit.covariance[index].iter_mut().for_each(|value| *value *= factor);
    fit.covariance.iter_mut().for_each(|row| row[index] *= factor);
}
