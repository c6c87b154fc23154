//! Time stamps: check for an even grid, and resampling.

use super::Recording;
use crate::RecordingError;
use stickslip_base::Error;

/// Spacing of a time column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing {
    /// Mean step [s].
    pub period: f64,
    /// Largest deviation of a time stamp from the even grid, as a share of the period.
    pub jitter: f64,
    /// Largest step, in median steps.
    pub largest: f64,
}

/// Largest deviation of a time stamp as a share of the period; jitter becomes noise of differentiated signals.
const JITTER_LIMIT: f64 = 0.05;
/// A longer step, in median steps, is a gap if samples are not interpolated …
const GAP: f64 = 1.5;
/// … and if samples are interpolated: more than two lost samples of a bent curve cannot be interpolated.
const GAP_TO_RESAMPLE: f64 = 4.0;
/// The remedy for jitter.
const RESAMPLE: &str = "Write `resample = true` in the machine file: the samples are then interpolated on an even grid, \
                        which attenuates the highest frequencies.";

impl Recording {
    /// Checks that time stamps [s] are on an even grid.
    ///
    /// # Errors
    /// Fewer than two rows, a step that is not positive, a gap, or jitter beyond 5 % of the period.
    pub fn spacing(&self, time: &[f64]) -> Result<Spacing, Error> {
        let spacing = self.advance(time, GAP)?;
        if spacing.jitter > JITTER_LIMIT {
            let departure = |row: &usize| (time[*row] - time[0] - *row as f64 * spacing.period).abs();
            let worst = (1..time.len()).max_by(|a, b| departure(a).total_cmp(&departure(b))).unwrap_or(1);
            return Err(self.uneven(time, worst, "jitter", spacing.period, RESAMPLE));
        }
        Ok(spacing)
    }

    /// Checks time stamps [s] for interpolation, for which only the order matters.
    ///
    /// # Errors
    /// Fewer than two rows, a step that is not positive, or a gap of four steps.
    pub fn order(&self, time: &[f64]) -> Result<Spacing, Error> {
        self.advance(time, GAP_TO_RESAMPLE)
    }

    fn advance(&self, time: &[f64], gap: f64) -> Result<Spacing, Error> {
        let last = time.len().saturating_sub(1);
        if last == 0 {
            let remedy = "Record longer.";
            return Err(Error::TooFew { what: "rows in the recording", found: time.len(), needed: 2, remedy });
        }
        let period = (time[last] - time[0]) / last as f64;
        // The median step: a gap increases the mean, and would not be detected.
        let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
        let median = *steps.select_nth_unstable_by(last / 2, f64::total_cmp).1;
        let mut largest = 0.0f64;
        let varied = time.windows(2).filter(|w| (w[1] - w[0] - median).abs() > 2.0 * JITTER_LIMIT * median).count();
        for row in 1..=last {
            let step = time[row] - time[row - 1];
            if step <= 0.0 {
                let remedy = "If only the stamps are wrong and the rows are even, remove `time` under [columns] and \
                state sampling_period; otherwise split the file at this row.";
                return Err(self.uneven(time, row, "time does not advance", period, remedy));
            }
            if step > gap * median {
                // Where many steps vary, a long one does not mean a gap.
                if gap < GAP_TO_RESAMPLE && varied * 20 > last {
                    return Err(self.uneven(time, row, "jitter", period, RESAMPLE));
                }
                let remedy = "Cut the recording there, or record without losses.";
                return Err(self.uneven(time, row, "gap in time", period, remedy));
            }
            largest = largest.max(step / median);
        }
        let departure = |row: usize| (time[row] - time[0] - row as f64 * period).abs() / period;
        Ok(Spacing { period, jitter: (1..=last).map(departure).fold(0.0, f64::max), largest })
    }

    fn uneven(&self, time: &[f64], row: usize, fault: &'static str, period: f64, remedy: &'static str) -> Error {
        let (path, line) = (self.path.clone(), self.lines[row]);
        RecordingError::UnevenTime { path, line, fault, step: time[row] - time[row - 1], period, remedy }.into()
    }
}

/// Values at `time[0] + k·period` up to the last time stamp, by cubic Hermite interpolation: through each sample, with
/// the slope of the parabola through it and its neighbours. Exact for parabolas; it does not amplify noise.
///
/// # Panics
/// If the lengths differ or there are fewer than three samples; `time` must rise.
pub fn resample(time: &[f64], values: &[f64], period: f64) -> Vec<f64> {
    assert!(time.len() == values.len() && time.len() >= 3, "one value per time, at least three");
    let last = time.len() - 1;
    let secant = |i: usize| (values[i + 1] - values[i]) / (time[i + 1] - time[i]);
    let slope = |i: usize| {
        let inner = i.clamp(1, last - 1);
        let (before, behind) = (time[inner] - time[inner - 1], time[inner + 1] - time[inner]);
        let (left, right) = (secant(inner - 1), secant(inner));
        // Slope of the parabola at the sample; at the ends it is the parabola of the neighbour.
        let bend = (right - left) / (before + behind);
        left + bend * (before + 2.0 * (time[i] - time[inner]))
    };
    let count = ((time[last] - time[0]) / period * (1.0 + 1e-12)) as usize + 1;
    let mut i = 0;
    let value = |k: usize| {
        let at = time[0] + k as f64 * period;
        while i + 1 < last && time[i + 1] <= at {
            i += 1;
        }
        let width = time[i + 1] - time[i];
        let s = ((at - time[i]) / width).clamp(0.0, 1.0);
        let (a, b) = (slope(i) * width, slope(i + 1) * width);
        let rise = values[i + 1] - values[i];
        values[i] + s * (a + s * ((3.0 * rise - 2.0 * a - b) + s * (a + b - 2.0 * rise)))
    };
    (0..count).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Column;
    use super::*;

    #[test]
    fn a_parabola_is_resampled_exactly_for_any_jitter() {
        let time: Vec<f64> = (0..200).map(|i| 5e-3 * (f64::from(i) + 0.4 * libm::sin(f64::from(i * i)))).collect();
        let curve = |t: f64| 3.0 - 2.0 * t + 7.0 * t * t;
        let even = resample(&time, &time.iter().map(|t| curve(*t)).collect::<Vec<_>>(), 5e-3);
        assert!((198..=200).contains(&even.len()), "{}", even.len());
        for (k, value) in even.iter().enumerate() {
            // Exact at the ends, too, which use the parabolas of their neighbours; rounding remains.
            assert!((value - curve(time[0] + k as f64 * 5e-3)).abs() < 1e-12, "{k}");
        }
    }

    #[test]
    fn even_samples_stay_unchanged() {
        let time: Vec<f64> = (0..50).map(|i| f64::from(i) * 1e-3).collect();
        let values: Vec<f64> = (0..50).map(|i| f64::from(i * 7 % 11)).collect();
        let same = resample(&time, &values, 1e-3);
        assert_eq!(same.len(), 50);
        assert!(same.iter().zip(&values).all(|(a, b)| (a - b).abs() < 1e-9));
    }

    #[test]
    fn four_lost_samples_are_too_many_to_interpolate() {
        let mut time: Vec<f64> = (0..100).map(|i| f64::from(i) * 5e-3).collect();
        let recording = Recording::from_columns("servo.csv", vec![Column::new("t", time.clone())]);
        time[50..].iter_mut().for_each(|t| *t += 12e-3);
        assert!((recording.order(&time).unwrap().largest - 3.4).abs() < 1e-9);
        time[50..].iter_mut().for_each(|t| *t += 10e-3);
        let error = recording.order(&time).unwrap_err().to_string();
        assert!(error.starts_with("servo.csv:52: gap in time"), "{error}");
    }
}
