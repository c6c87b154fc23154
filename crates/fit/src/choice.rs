//! Which model predicts what it has not seen: choice by cross-validation, and only beyond doubt.

use super::statistics::student_t95;

/// What cross-validation says of models, the simplest first.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The one with the smallest mean error.
    pub best: usize,
    /// The simplest that is not worse than it by more than the standard error of their difference: the one to use.
    pub chosen: usize,
    /// Mean over the folds of how much larger a model's error is than that of the best, and its standard error.
    pub behind: Vec<[f64; 2]>,
    /// The smallest mean error, to which the others are behind.
    pub least: f64,
    /// How many folds there were.
    pub folds: usize,
}

impl Choice {
    /// How far a model is behind the best as a share of the smallest mean error, and half the width of the 95 % interval of
    /// that by Student's t over the folds; at least so wide, as the standard error is a lower bound. `None` for the best.
    pub fn share_behind(&self, model: usize) -> Option<[f64; 2]> {
        let [middle, error] = self.behind[model];
        let critical = student_t95((self.folds - 1) as f64);
        (model != self.best).then(|| [middle / self.least, critical * error / self.least])
    }
}

/// Chooses by errors on folds: a row a model, from the simplest to the richest, a column a fold, which no model has seen
/// when it predicts it.
///
/// The differences are taken fold by fold, so that what makes a fold hard for all does not count. Fits to the rest of the
/// same recording are alike, so that the standard error is a lower bound (Bengio and Grandvalet 2004): a model that is not
/// better by it is not better. `None` without a model, with fewer than two folds, or with rows of different lengths.
pub fn choose(errors: &[Vec<f64>]) -> Option<Choice> {
    let folds = errors.first()?.len();
    if folds < 2 || errors.iter().any(|row| row.len() != folds) {
        return None;
    }
    let mean = |row: &[f64]| row.iter().sum::<f64>() / folds as f64;
    // What has failed somewhere is no better than anything.
    let all: Vec<f64> =
        errors.iter().map(|row| Some(mean(row)).filter(|it| it.is_finite()).unwrap_or(f64::MAX)).collect();
    let best = (0..all.len()).min_by(|a, b| all[*a].total_cmp(&all[*b]))?;
    let behind: Vec<[f64; 2]> = errors
        .iter()
        .map(|row| {
            let differences: Vec<f64> = row.iter().zip(&errors[best]).map(|(a, b)| a - b).collect();
            let middle = mean(&differences);
            let square = differences.iter().map(|d| (d - middle) * (d - middle)).sum::<f64>() / (folds - 1) as f64;
            [middle, (square / folds as f64).sqrt()]
        })
        .collect();
    let chosen = behind.iter().position(|[middle, error]| middle <= error).unwrap_or(best);
    Some(Choice { best, chosen, behind, least: all[best], folds })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_wins_only_by_more_than_the_standard_error_of_its_gain() {
        let simple = vec![1.0, 2.0, 3.0, 4.0];
        let surely = simple.iter().map(|error| error - 0.5).collect();
        let found = choose(&[simple.clone(), surely]).unwrap();
        assert_eq!((found.best, found.chosen, found.behind[0]), (1, 1, [0.5, 0.0]));
        // Better on average, by chance: −0.9, 0.5, 0.4, 0.4 have a mean of 0.1 and a standard error of 0.33.
        let perhaps = [1.9, 1.5, 2.6, 3.6].to_vec();
        let found = choose(&[simple.clone(), perhaps]).unwrap();
        assert_eq!((found.best, found.chosen), (1, 0));
        assert!((found.behind[0][0] - 0.1).abs() < 1e-12 && (found.behind[0][1] - 0.3342).abs() < 1e-3);
        // The best has a mean of 2.4, and 3.182 standard errors of four folds are 95 %.
        let [share, half_width] = found.share_behind(0).unwrap();
        assert!((share - 0.1 / 2.4).abs() < 1e-12 && (half_width - 3.182 * 0.3342 / 2.4).abs() < 1e-3);
        assert_eq!(found.share_behind(1), None);
        // Hard folds are hard for all: the differences count, not the scatter.
        assert_eq!(choose(&[vec![100.1, 1.1], vec![100.0, 1.0]]).unwrap().chosen, 1);
    }

    #[test]
    fn what_failed_never_wins_and_what_is_no_comparison_is_none() {
        assert_eq!(choose(&[vec![f64::NAN, 0.1], vec![1.0, 1.0]]).unwrap().chosen, 1);
        assert_eq!(choose(&[]), None);
        assert_eq!(choose(&[vec![1.0]]), None);
        assert_eq!(choose(&[vec![1.0, 2.0], vec![1.0]]), None);
    }
}
