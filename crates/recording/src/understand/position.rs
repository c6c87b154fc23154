//! Positions that no axis can take: modulo angles, counters that wrap, dropouts.

use super::{Finding, Refusal, quantile};

/// A column of positions.
#[derive(Clone, Copy, Debug)]
pub struct Position<'a> {
    /// Its values.
    pub values: &'a [f64],
    /// Modulus that the user has stated.
    pub wraps: Option<f64>,
    /// A turn in the unit of the column, where it is an angle or in counts of a known number.
    pub turn: Option<f64>,
}

/// Dropouts in a row that are interpolated.
const DROPOUT: usize = 3;
/// Share of dropouts beyond which the column is refused.
const DROPOUTS: f64 = 0.005;
/// A jump is longer than this number of usual long steps.
const JUMP: f64 = 10.0;
/// Moduli of registers and counters.
const REGISTERS: [f64; 9] = [
    256.0,
    1024.0,
    4096.0,
    16_384.0,
    65_536.0,
    1_048_576.0,
    16_777_216.0,
    4_294_967_296.0,
    18_446_744_073_709_551_616.0,
];

/// Positions without dropouts and wraps.
#[derive(Clone, Debug, PartialEq)]
pub struct Continued {
    /// One for each row.
    pub values: Vec<f64>,
    /// The modulus over which they were continued.
    pub modulus: Option<f64>,
    /// What was found.
    pub findings: Vec<Finding>,
}

impl Position<'_> {
    /// The positions without dropouts and wraps.
    ///
    /// # Errors
    /// Too many dropouts, or a jump of unknown cause.
    pub fn understand(&self) -> Result<Continued, Refusal> {
        let mut values = self.values.to_vec();
        let mut findings = Vec::new();
        if values.len() < 8 {
            return Ok(Continued { values, modulus: None, findings });
        }
        findings.extend(dropouts(&mut values)?);
        findings.extend(grid(&values));
        let jumps = jumps(&values);
        let Some(first) = jumps.first().copied() else { return Ok(Continued { values, modulus: None, findings }) };
        let Some(modulus) = self.modulus(&values, &jumps) else {
            let usual = quantile(steps(&values), 0.99);
            return Err(Refusal {
                row: first,
                fault: format!(
                    "jumps by {:.6} from {:.6} to {:.6}; usual steps are up to {usual:.3}",
                    values[first] - values[first - 1],
                    values[first - 1],
                    values[first],
                ),
                remedy: "An axis cannot jump. If the value counts modulo a number, state it as `wraps` of the column; \
                         otherwise cut the file before and after this row."
                    .into(),
            });
        };
        unwrap(&mut values, &jumps, modulus);
        let text = format!("The position counts modulo {modulus}: it was continued over the wraps.");
        findings.push(Finding { text, rows: jumps.iter().map(|row| *row..row + 1).collect() });
        Ok(Continued { values, modulus: Some(modulus), findings })
    }

    /// The modulus that explains all jumps.
    fn modulus(&self, values: &[f64], jumps: &[usize]) -> Option<f64> {
        let [low, high] = bounds(values);
        let usual = quantile(steps(values), 0.99);
        let sizes: Vec<f64> = jumps.iter().map(|row| (values[*row] - values[row - 1]).abs()).collect();
        let fits = |modulus: &f64| {
            high - low <= modulus * 1.001 + usual && sizes.iter().all(|size| (size - modulus).abs() <= 4.0 * usual)
        };
        let whole = values.iter().all(|v| v.fract() == 0.0);
        let registers = REGISTERS.into_iter().filter(|_| whole);
        let stated = self.wraps.into_iter().chain(self.turn).chain(registers).find(fits);
        // The mean of several equal jumps between both ends of the range.
        let mean = sizes.iter().sum::<f64>() / sizes.len() as f64;
        let repeated = sizes.len() >= 4 && high - low >= 0.9 * mean && fits(&mean);
        stated.or_else(|| repeated.then(|| readable(mean, usual)))
    }
}

/// Continues a reference over its wraps, with the modulus of the position; its steps may be intended. It begins in the
/// turn of the position.
pub fn unwrap_like(values: &mut [f64], modulus: f64, start: f64) {
    let jumps: Vec<usize> =
        (1..values.len()).filter(|row| (values[*row] - values[row - 1]).abs() > 0.75 * modulus).collect();
    unwrap(values, &jumps, modulus);
    let turns = ((values[0] - start) / modulus).round();
    values.iter_mut().for_each(|value| *value -= turns * modulus);
}

fn unwrap(values: &mut [f64], jumps: &[usize], modulus: f64) {
    let mut shift = 0.0;
    let mut next = jumps.iter().peekable();
    let mut before = values[0];
    for (row, value) in values.iter_mut().enumerate() {
        if next.next_if(|jump| **jump == row).is_some() {
            shift += if *value < before { modulus } else { -modulus };
        }
        before = *value;
        *value += shift;
    }
}

/// A grid that is coarse beside the usual step: slow motion is not resolved.
fn grid(values: &[f64]) -> Option<Finding> {
    let steps = steps(values);
    let moving: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0).collect();
    let [smallest, usual] = [0.0, 0.5].map(|share| quantile(moving.clone(), share));
    let on_grid = |step: &f64| (step / smallest - (step / smallest).round()).abs() < 1e-3;
    // A constant speed has equal steps, too, but does not pause.
    let pauses = steps.windows(2).filter(|pair| (pair[0] == 0.0) != (pair[1] == 0.0)).count();
    let coarse = pauses > 50 && smallest > 0.3 * usual && moving.iter().all(on_grid);
    let text = format!("The position is quantised in steps of {}.", readable(smallest, 1e-6 * smallest));
    coarse.then(|| Finding::everywhere(text))
}

/// Replaces up to three rows that are off the lines through the rows before and behind them.
fn dropouts(values: &mut [f64]) -> Result<Option<Finding>, Refusal> {
    let bends: Vec<f64> = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    let grid = quantile(steps(values).into_iter().filter(|step| *step > 0.0).collect(), 0.01);
    // Accelerations and noise bend a position by far less; quantisation by up to two steps of its grid.
    let tolerance = 10.0 * quantile(bends, 0.9) + 2.5 * grid;
    let mut rows = Vec::new();
    let mut row = 2;
    while row + 2 < values.len() {
        let length = (1..=DROPOUT).find(|length| is_off(values, row, *length, tolerance));
        if let Some(length) = length {
            let (start, end) = (values[row - 1], values[row + length]);
            for k in 0..length {
                values[row + k] = start + (end - start) * (k + 1) as f64 / (length + 1) as f64;
            }
            rows.push(row..row + length);
            row += length;
        }
        row += 1;
    }
    let count: usize = rows.iter().map(ExactSizeIterator::len).sum();
    if count as f64 > DROPOUTS * values.len() as f64 {
        return Err(Refusal {
            row: rows[0].start,
            fault: format!("{count} of {} values do not match their neighbours, the first here", values.len()),
            remedy: "Check the sensor and its cable, and the unit and order of bytes of the column.".into(),
        });
    }
    let text = match count {
        1 => "One position does not match its neighbours (a dropout): it was interpolated.".into(),
        _ => format!("{count} positions do not match their neighbours (dropouts): they were interpolated."),
    };
    Ok((count > 0).then_some(Finding { text, rows }))
}

/// Whether `length` rows are off the lines through both pairs of neighbours and off their chord, on the same side.
fn is_off(values: &[f64], row: usize, length: usize, tolerance: f64) -> bool {
    let end = row + length;
    if end + 1 >= values.len() {
        return false;
    }
    let (left, right) = (values[row - 1], values[end]);
    let (left_slope, right_slope) = (left - values[row - 2], values[end + 1] - right);
    let side = (values[row] - left - left_slope).signum();
    // Behind a dropout the motion continues: otherwise it is a jump.
    let continues = (right - left - 0.5 * (left_slope + right_slope) * (length + 1) as f64).abs() < 3.0 * tolerance;
    continues
        && (0..length).all(|k| {
            let value = values[row + k];
            let ahead = left + left_slope * (k + 1) as f64;
            let behind = right - right_slope * (length - k) as f64;
            let chord = left + (right - left) * (k + 1) as f64 / (length + 1) as f64;
            [ahead, behind, chord].iter().all(|line| side * (value - line) > tolerance)
        })
}

/// Rows whose step is far longer than usual ones and than those before and behind it.
fn jumps(values: &[f64]) -> Vec<usize> {
    let usual = quantile(steps(values).into_iter().filter(|step| *step > 0.0).collect(), 0.99);
    let step = |row: usize| if row == 0 || row >= values.len() { 0.0 } else { (values[row] - values[row - 1]).abs() };
    let is_jump = |row: &usize| step(*row) > JUMP * usual && step(*row) > 5.0 * step(row - 1).max(step(row + 1));
    (1..values.len()).filter(is_jump).collect()
}

fn steps(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|w| (w[1] - w[0]).abs()).collect()
}

fn bounds(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)])
}

/// The roundest number within this distance.
fn readable(value: f64, within: f64) -> f64 {
    let scales = (-6..=9).rev().map(|power| 10f64.powi(power));
    scales
        .map(|scale| (value / scale).round() * scale)
        .find(|r| *r != 0.0 && (r - value).abs() <= within)
        .unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(scale: f64) -> Vec<f64> {
        (0..4000).map(|i| scale * (1.0 - libm::cos(f64::from(i) * 0.005)) + scale * 1e-3 * f64::from(i)).collect()
    }

    fn understood(values: &[f64], wraps: Option<f64>, turn: Option<f64>) -> Result<Continued, Refusal> {
        Position { values, wraps, turn }.understand()
    }

    #[test]
    fn angles_and_registers_are_continued_over_their_wraps() {
        for (modulus, wraps, turn, whole) in [
            (360.0, None, Some(360.0), false),
            (65_536.0, None, None, true),
            (1234.0, Some(1234.0), None, true),
            // A round axis of 100 mm, known from its jumps only.
            (100.0, None, None, false),
        ] {
            let true_values: Vec<f64> =
                motion(modulus).iter().map(|v| v + 0.3 * modulus).map(|v| if whole { v.round() } else { v }).collect();
            let wrapped: Vec<f64> = true_values.iter().map(|v| v.rem_euclid(modulus)).collect();
            let Continued { values, findings, modulus: found } = understood(&wrapped, wraps, turn).unwrap();
            let worst = values.iter().zip(&true_values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-6 * modulus && found.is_some(), "{modulus}: {worst}");
            assert!(findings[0].text.contains("modulo") && findings[0].rows.len() >= 4, "{findings:?}");
        }
    }

    #[test]
    fn dropouts_are_interpolated_with_their_rows() {
        let true_values = motion(0.1);
        let mut broken = true_values.clone();
        for row in [500, 1001, 1002, 1003, 2600] {
            broken[row] = 0.0;
        }
        let Continued { values, findings, .. } = understood(&broken, None, None).unwrap();
        assert!(values.iter().zip(&true_values).all(|(a, b)| (a - b).abs() < 1e-5));
        assert_eq!(findings[0].rows, [500..501, 1001..1004, 2600..2601]);
        (0..100).for_each(|k| broken[40 * k + 20] = 0.0);
        let refusal = understood(&broken, None, None).unwrap_err();
        assert!(refusal.fault.contains("do not match"), "{refusal:?}");
    }

    #[test]
    fn a_jump_of_unknown_cause_is_refused_with_its_row() {
        let mut jumped = motion(0.1);
        jumped[1500..].iter_mut().for_each(|v| *v += 0.07);
        let refusal = understood(&jumped, None, None).unwrap_err();
        assert!(refusal.row == 1500 && refusal.remedy.contains("wraps"), "{refusal:?}");
    }

    #[test]
    fn an_impact_noise_quantisation_and_sudden_motion_are_not_faults() {
        let impact: Vec<f64> = (0..4000).map(|i: i32| 1e-4 * f64::from((i - 2000).abs())).collect();
        let noisy: Vec<f64> =
            motion(0.1).iter().enumerate().map(|(i, v)| v + 1e-5 * libm::sin((i * i) as f64)).collect();
        let coarse: Vec<f64> = motion(0.1).iter().map(|v| (v * 1e3).round() / 1e3).collect();
        // At rest for most of the time, then a fast stroke.
        let stroke: Vec<f64> = (0..4000).map(|i| 1e-3 * f64::from((i - 3900).max(0))).collect();
        for (values, findings) in [(impact, 0), (noisy, 0), (coarse, 1), (stroke, 0)] {
            let same = understood(&values, None, Some(360.0)).unwrap();
            assert!(same.findings.len() == findings && same.values == values, "{:?}", same.findings);
        }
    }

    #[test]
    fn a_reference_is_continued_with_the_modulus_of_the_position_and_keeps_its_steps() {
        let mut reference = vec![350.0, 355.0, 0.0, 90.0, 180.0, 355.0];
        unwrap_like(&mut reference, 360.0, 1.0);
        assert_eq!(reference, [-10.0, -5.0, 0.0, 90.0, 180.0, 355.0]);
    }
}
