//! Distributions of the intervals and tests.

use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

/// Half-width of a two-sided 95 % interval in standard errors, with this number of degrees of freedom (≥ 1).
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

/// Probability of a number of runs of equal signs as far from its mean, either way, as that of the sequence if its order
/// were chance: Wald and Wolfowitz (1940), normal approximation; 1 where there is only one sign.
pub fn runs_test(signs: impl Iterator<Item = bool>) -> f64 {
    let (mut counts, mut runs, mut last) = ([0.0f64; 2], 0.0, None);
    for sign in signs {
        counts[usize::from(sign)] += 1.0;
        runs += f64::from(u8::from(last != Some(sign)));
        last = Some(sign);
    }
    let [a, b] = counts;
    let n = a + b;
    if a * b == 0.0 {
        return 1.0;
    }
    let mean = 2.0 * a * b / n + 1.0;
    let variance = (mean - 1.0) * (mean - 2.0) / (n - 1.0);
    // Half a run off towards the mean: runs come in whole numbers.
    let distance = ((runs - mean).abs() - 0.5).max(0.0);
    if variance > 0.0 { libm::erfc(distance / (2.0 * variance).sqrt()) } else { 1.0 }
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

    #[test]
    fn too_few_and_too_many_runs_are_improbable_and_a_usual_number_is_not() {
        let signs = |period: usize| (0..20).map(move |i: usize| (i / period).is_multiple_of(2));
        // 10 of each: 11 runs are the mean, deviation √(10·9/19) = 2.18.
        assert!((runs_test(signs(10)) - libm::erfc(8.5 / (2.0f64 * 90.0 / 19.0).sqrt())).abs() < 1e-15);
        assert!(runs_test(signs(10)) < 1e-3 && runs_test(signs(1)) < 1e-3);
        assert!(runs_test(signs(2)) > 0.5);
        assert_eq!(runs_test([true; 5].into_iter()), 1.0);
    }
}
