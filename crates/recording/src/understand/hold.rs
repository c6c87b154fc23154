//! Channels that are sampled more slowly than the recording, and held or repeated.

use crate::resample;

/// A channel that changes only every few rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold {
    /// Rows of a value, on average.
    pub rows: f64,
    /// Rows with a new value, the first row included.
    changes: Vec<usize>,
}

/// Runs needed to recognise a hold.
const RUNS: usize = 50;
/// Share of runs of the usual length or a multiple.
const REGULAR: f64 = 0.95;

impl Hold {
    /// Recognises a held channel: nearly all runs of equal values have the same length or a multiple of it. A quantised
    /// signal has runs of many lengths.
    pub fn of(values: &[f64]) -> Option<Hold> {
        let mut changes = vec![0];
        changes.extend((1..values.len()).filter(|row| values[*row] != values[row - 1]));
        // The run at the start may be cut, the one at the end is left out.
        let mut lengths: Vec<usize> = changes.windows(2).map(|w| w[1] - w[0]).skip(1).collect();
        if lengths.len() < RUNS {
            return None;
        }
        let sorted = {
            lengths.sort_unstable();
            &lengths
        };
        let usual = sorted[sorted.len() / 4];
        if usual < 2 {
            return None;
        }
        let slack = usual / 5;
        let alike = |length: &&usize| {
            let multiple = ((**length as f64 / usual as f64).round() as usize).max(1);
            length.abs_diff(multiple * usual) <= slack * multiple
        };
        let single: Vec<usize> = sorted.iter().copied().filter(|l| l.abs_diff(usual) <= slack).collect();
        let regular = sorted.iter().filter(alike).count() as f64;
        // At least half of the runs are single ones: multiples alone do not show a hold.
        let held = regular >= REGULAR * sorted.len() as f64 && 2 * single.len() >= sorted.len();
        let rows = single.iter().sum::<usize>() as f64 / single.len().max(1) as f64;
        held.then_some(Hold { rows, changes })
    }

    /// Mean delay of the held channel behind the signal that was sampled, in rows.
    pub fn delay(&self) -> f64 {
        0.5 * (self.rows - 1.0)
    }

    /// The signal between its new values, by cubic interpolation: a value is true in the row where it is new.
    pub fn released(&self, values: &[f64]) -> Vec<f64> {
        let mut rows = Vec::new();
        for pair in self.changes.windows(2) {
            rows.push(pair[0]);
            // A signal that rests, rests until shortly before its next value.
            let steps = ((pair[1] - pair[0]) as f64 / self.rows).round() as usize;
            rows.extend((1..steps).map(|k| pair[0] + (k as f64 * self.rows).round() as usize).filter(|r| *r < pair[1]));
        }
        let last = values.len() - 1;
        rows.extend(self.changes.last());
        let mut row = rows[rows.len() - 1] as f64 + self.rows;
        while row.round() <= last as f64 {
            rows.push(row.round() as usize);
            row += self.rows;
        }
        rows.dedup();
        if rows.len() < 3 {
            return values.to_vec();
        }
        let time: Vec<f64> = rows.iter().map(|row| *row as f64).collect();
        let sampled: Vec<f64> = rows.iter().map(|row| values[*row]).collect();
        let mut released = resample(&time, &sampled, 1.0);
        released.resize(values.len(), values[last]);
        released
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(row: usize) -> f64 {
        libm::sin(row as f64 * 0.01) + 0.3 * libm::sin(row as f64 * 0.037)
    }

    #[test]
    fn a_held_channel_is_recognised_and_released() {
        for hold in [2, 5, 8] {
            let held: Vec<f64> = (0..4000).map(|i| wave(i / hold * hold)).collect();
            let found = Hold::of(&held).unwrap();
            assert!(
                (found.rows - hold as f64).abs() < 1e-12 && (found.delay() - 0.5 * (hold as f64 - 1.0)).abs() < 1e-12
            );
            let released = found.released(&held);
            assert_eq!(released.len(), held.len());
            let worst = (0..3980).map(|i| (released[i] - wave(i)).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-3, "{hold}: {worst}");
        }
    }

    #[test]
    fn a_period_of_a_fraction_of_a_row_is_recognised() {
        let held: Vec<f64> = (0..4000).map(|i| wave(((i as f64 / 8.3).floor() * 8.3) as usize)).collect();
        assert!((Hold::of(&held).unwrap().rows - 8.3).abs() < 0.1);
    }

    #[test]
    fn quantised_and_constant_signals_are_not_held() {
        let quantised: Vec<f64> = (0..4000).map(|i| (wave(i) * 50.0).round()).collect();
        assert_eq!(Hold::of(&quantised), None);
        assert_eq!(Hold::of(&vec![1.0; 4000]), None);
        assert_eq!(Hold::of(&(0..4000).map(wave).collect::<Vec<_>>()), None);
    }
}
