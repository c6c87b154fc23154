//! Choice of a model by cross-validation, with the standard error of the difference.

use super::statistics::student_t95;

/// Result of a cross-validation of models, the simplest first.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The model with the smallest mean error.
    pub best: usize,
    /// The model to use: the simplest that is not worse than the best by more than the standard error of their
    /// difference.
    pub chosen: usize,
    /// Mean over the folds of how much larger a model's error is than that of the best, and its standard error.
    pub behind: Vec<[f64; 2]>,
    /// The smallest mean error.
    pub least: f64,
    /// Number of folds.
    pub folds: usize,
}

impl Choice {
    /// How far a model is behind the best as a share of the smallest mean error, and half the width of its 95 %
    /// interval by Student's t over the folds. The standard error is a lower bound, and so is this width. `None` for
    /// the best.
    pub fn share_behind(&self, model: usize) -> Option<[f64; 2]> {
        let [middle, error] = self.behind[model];
        let critical = student_t95((self.folds - 1) as f64);
        (model != self.best).then(|| [middle / self.least, critical * error / self.least])
    }
}

/// Chooses by errors on folds: a row for each model, from the simplest to the richest, a column for each fold, which
/// the model's fit did not use.
///
/// The differences are taken fold by fold, so that folds that are hard for all models do not count. Fits to the rest of
/// the same recording are correlated, so that the standard error is a lower bound (Bengio and Grandvalet 2004): a
/// smaller gain is not significant. `None` without a model, with fewer than two folds, or with rows of different
/// lengths.
pub fn choose(errors: &[Vec<f64>]) -> Option<Choice> {
    let folds = errors.first()?.len();
    if folds < 2 || errors.iter().any(|row| row.len() != folds) {
        return None;
    }
    let mean = |row: &[f64]| row.iter().sum::<f64>() / folds as f64;
    // A model that failed in a fold is never chosen.
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
        let choice = choose(&[simple.clone(), surely]).unwrap();
        assert_eq!((choice.best, choice.chosen, choice.behind[0]), (1, 1, [0.5, 0.0]));
        // Better on average, by chance: −0.9, 0.5, 0.4, 0.4 have a mean of 0.1 and a standard error of 0.33.
        let perhaps = [1.9, 1.5, 2.6, 3.6].to_vec();
        let choice = choose(&[simple.clone(), perhaps]).unwrap();
        assert_eq!((choice.best, choice.chosen), (1, 0));
        assert!((choice.behind[0][0] - 0.1).abs() < 1e-12 && (choice.behind[0][1] - 0.3342).abs() < 1e-3);
        // The best has a mean of 2.4, and 3.182 standard errors of four folds are 95 %.
        let [share, half_width] = choice.share_behind(0).unwrap();
        assert!((share - 0.1 / 2.4).abs() < 1e-12 && (half_width - 3.182 * 0.3342 / 2.4).abs() < 1e-3);
        assert_eq!(choice.share_behind(1), None);
        // Hard folds are hard for all: the differences count, not the scatter.
        assert_eq!(choose(&[vec![100.1, 1.1], vec![100.0, 1.0]]).unwrap().chosen, 1);
    }

    #[test]
    fn a_failed_model_never_wins_and_an_invalid_comparison_gives_none() {
        assert_eq!(choose(&[vec![f64::NAN, 0.1], vec![1.0, 1.0]]).unwrap().chosen, 1);
        assert_eq!(choose(&[]), None);
        assert_eq!(choose(&[vec![1.0]]), None);
        assert_eq!(choose(&[vec![1.0, 2.0], vec![1.0]]), None);
    }
}
