//! The few distributions that intervals and tests need.

use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

/// Half-width of a two-sided 95 % interval in standard errors, with so many degrees of freedom (≥ 1).
pub fn student_t95(degrees_of_freedom: f64) -> f64 {
    let t = StudentsT::new(0.0, 1.0, degrees_of_freedom).expect("at least one degree of freedom");
    // Its last bits depend on the system's logarithm, the quantile itself on ten digits at most.
    (t.inverse_cdf(0.975) * 1e9).round() / 1e9
}

/// Probability that noise alone makes the sum of squares fall from `simple` to `full` with `extra` more parameters and
/// `degrees_of_freedom` left: the F test of nested linear models.
pub fn f_test(simple: f64, full: f64, extra: f64, degrees_of_freedom: f64) -> f64 {
    let statistic = (simple - full).max(0.0) / extra / (full / degrees_of_freedom);
    if !statistic.is_finite() {
        return if simple > full { 0.0 } else { 1.0 };
    }
    let f = FisherSnedecor::new(extra, degrees_of_freedom).expect("positive degrees of freedom");
    1.0 - f.cdf(statistic)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_and_tails_are_those_of_scipy() {
        // scipy.stats.t.ppf(0.975, 3), scipy.stats.f.sf(3.2, 2, 10); statrs inverts by search, hence 1e-9.
        assert!((student_t95(3.0) - 3.182446305283708).abs() < 1e-9);
        assert!((f_test(16.4, 10.0, 2.0, 10.0) - 0.08429091335387388).abs() < 1e-9);
    }
}
