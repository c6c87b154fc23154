//! Time stamps: roll-over, rounding, lost rows and gaps.

use std::ops::Range;

use stickslip_base::quantity::Estimate;

use super::{Finding, Refusal, line, quantile};

/// Time of each row, and the rows to use.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// Time since the first row [s].
    pub time: Vec<f64>,
    /// The longest stretch without a gap.
    pub rows: Range<usize>,
    /// Whether rows are missing within that stretch: samples must be interpolated.
    pub lost: bool,
    /// What was found.
    pub findings: Vec<Finding>,
}

/// Moduli of clocks in ticks; the day is added in the unit of the stamps.
const MODULI: [f64; 4] = [65_536.0, 4_294_967_296.0, 2_147_483_648.0, 1e6];
/// A longer step, in median steps, lacks rows …
const LOST: f64 = 1.5;
/// … and a longer one cannot be interpolated.
const GAP: f64 = 4.0;
/// Deviation from even steps, as a share of the period, that stamps may have before rounding is suspected.
const JITTER: f64 = 0.05;

/// Understands stamps in ticks of `seconds`.
///
/// # Errors
/// Time that steps back, repeated stamps on rows that are not even, and a gap that leaves less than half of the rows.
pub fn understand(ticks: &[f64], seconds: f64) -> Result<Clock, Refusal> {
    let mut findings = Vec::new();
    let mut ticks = ticks.to_vec();
    let usual = usual_step(&ticks);
    roll_over(&mut ticks, seconds, usual, &mut findings);
    strays(&mut ticks, usual, &mut findings);
    let whole = 0..ticks.len();
    if let Some(row) = (1..ticks.len()).find(|row| ticks[*row] < ticks[row - 1]) {
        return Err(Refusal {
            row,
            fault: format!("time steps back by {}", second((ticks[row - 1] - ticks[row]) * seconds)),
            remedy: "The file may hold two recordings, or the clock was set: split the file at this row.".into(),
        });
    }
    if let Some((even, finding)) = rounded(&ticks, seconds)? {
        findings.push(finding);
        let time = even.iter().map(|t| (t - even[0]) * seconds).collect();
        return Ok(Clock { time, rows: whole, lost: false, findings });
    }
    let (rows, lost) = gaps(&ticks, seconds, usual, &mut findings)?;
    Ok(Clock { time: ticks.iter().map(|t| (t - ticks[0]) * seconds).collect(), rows, lost, findings })
}

/// The median of the steps that are not 0.
fn usual_step(ticks: &[f64]) -> f64 {
    quantile(ticks.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect(), 0.5)
}

/// Adds the modulus of a clock that starts again from 0.
fn roll_over(ticks: &mut [f64], seconds: f64, usual: f64, findings: &mut Vec<Finding>) {
    let [low, high] = ticks.iter().fold([f64::INFINITY, 0.0f64], |[low, high], t| [low.min(*t), high.max(*t)]);
    let day = 86_400.0 / seconds;
    let back: Vec<usize> = (1..ticks.len()).filter(|row| ticks[*row] < ticks[row - 1]).collect();
    let fits = |modulus: f64| {
        let continues = |row: &usize| (0.0..GAP * usual).contains(&(ticks[*row] - ticks[row - 1] + modulus));
        low >= 0.0 && high < modulus && !back.is_empty() && back.iter().all(continues)
    };
    let Some(modulus) = MODULI.into_iter().chain([day]).find(|modulus| fits(*modulus)) else { return };
    for start in &back {
        ticks[*start..].iter_mut().for_each(|t| *t += modulus);
    }
    let name = match modulus {
        65_536.0 => "of 16 bits".into(),
        2_147_483_648.0 => "of 31 bits".into(),
        4_294_967_296.0 => "of 32 bits".into(),
        m if m == day => "of the day".into(),
        m => format!("with the modulus {m}"),
    };
    findings.push(Finding {
        text: format!("The clock {name} rolled over: its modulus was added from there on."),
        rows: back.iter().map(|row| *row..row + 1).collect(),
    });
}

/// Replaces single stamps that do not match the even stamps around them.
fn strays(ticks: &mut [f64], usual: f64, findings: &mut Vec<Finding>) {
    let mut rows = Vec::new();
    for row in 1..ticks.len().saturating_sub(1) {
        let (before, now, after) = (ticks[row - 1], ticks[row], ticks[row + 1]);
        let matches = (after - before - 2.0 * usual).abs() < 0.1 * usual;
        if matches && !(before..=after).contains(&now) {
            ticks[row] = 0.5 * (before + after);
            rows.push(row..row + 1);
        }
    }
    if !rows.is_empty() {
        let text = "Single time stamps do not match their neighbours: they were replaced by the mean of both.".into();
        findings.push(Finding { text, rows });
    }
}

/// Even stamps for even rows whose stamps are rounded or repeated.
fn rounded(ticks: &[f64], seconds: f64) -> Result<Option<(Vec<f64>, Finding)>, Refusal> {
    if ticks.len() < 3 {
        return Ok(None);
    }
    let repeated = ticks.windows(2).filter(|w| w[0] == w[1]).count();
    let (start, period, [low, high]) = line(ticks);
    if repeated == 0 && (high - low) < JITTER * period {
        return Ok(None);
    }
    let single = ticks.iter().all(|t| f64::from(*t as f32) == *t);
    let coarse = if repeated > 0 {
        // The smallest step is the grid, or the interval of a logger that stamps several rows at once.
        ticks.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min)
    } else {
        decimal_grid(ticks).max(if single { last_place(ticks) } else { 0.0 })
    };
    // Rounding moves a stamp by less than a step of the grid: a span of one, and the error of the fitted line.
    // Without repeated stamps a grid of a whole period shows lost rows, not rounding.
    let is_grid = repeated > 0 || coarse < 0.95 * period;
    if is_grid && high - low <= 1.2 * coarse {
        let even = (0..ticks.len()).map(|i| start + period * i as f64).collect();
        let why = if repeated > 0 {
            format!("{repeated} time stamps repeat the one before: they are rounded to {}.", second(coarse * seconds))
        } else if single && coarse == last_place(ticks) {
            "Time stamps are rounded, as single-precision numbers.".into()
        } else {
            format!("Time stamps are rounded to {}.", second(coarse * seconds))
        };
        let text =
            format!("{why} The rows are evenly spaced; their mean period, {}, was used.", second(period * seconds));
        return Ok(Some((even, Finding::everywhere(text))));
    }
    match (1..ticks.len()).find(|row| ticks[*row] == ticks[row - 1]) {
        None => Ok(None),
        Some(row) => Err(Refusal {
            row,
            fault: "a time stamp repeats, and the rows are not evenly spaced".into(),
            remedy: "If the rows are even and only the stamps are wrong, remove `time` under [columns] and state \
                     sampling_period. Otherwise record with finer time stamps."
                .into(),
        }),
    }
}

/// The grid of stamps with few decimal places: 1, 0.1, …; 0 for more than nine places.
fn decimal_grid(ticks: &[f64]) -> f64 {
    let on = |scale: f64| {
        ticks.iter().all(|t| (t * scale - (t * scale).round()).abs() < 1e-6 * (t * scale).abs().clamp(1.0, 100.0))
    };
    (0..=9).map(|places| 10f64.powi(places)).find(|scale| on(*scale)).map_or(0.0, |scale| 1.0 / scale)
}

/// The last place of single precision at the largest stamp.
fn last_place(ticks: &[f64]) -> f64 {
    let largest = ticks.iter().fold(0.0f64, |most, t| most.max(t.abs())) as f32;
    f64::from(largest.next_up() - largest)
}

/// The longest stretch without a gap, and whether single rows are missing in it.
fn gaps(ticks: &[f64], seconds: f64, usual: f64, findings: &mut Vec<Finding>) -> Result<(Range<usize>, bool), Refusal> {
    let step = |row: usize| ticks[row] - ticks[row - 1];
    let breaks: Vec<usize> = (1..ticks.len()).filter(|row| step(*row) > GAP * usual).collect();
    let edges: Vec<usize> = [0].into_iter().chain(breaks.iter().copied()).chain([ticks.len()]).collect();
    let stretches = edges.windows(2).map(|w| w[0]..w[1]);
    let rows = stretches.max_by_key(Range::len).unwrap_or(0..ticks.len());
    if let Some(first) = breaks.first() {
        let longest = breaks.iter().map(|row| step(*row)).fold(0.0, f64::max);
        if 2 * rows.len() < ticks.len() {
            return Err(Refusal {
                row: *first,
                fault: format!("a gap in time of {}, the first of {}", second(step(*first) * seconds), breaks.len()),
                remedy: "Record without losses, or cut the file at the gaps and identify each part.".into(),
            });
        }
        let text = format!(
            "Gaps in time of up to {}: only the longest stretch between them was used, {} of {} rows.",
            second(longest * seconds),
            rows.len(),
            ticks.len()
        );
        let left_out = [0..rows.start, rows.end..ticks.len()].into_iter().filter(|r| !r.is_empty()).collect();
        findings.push(Finding { text, rows: left_out });
    }
    let missing: Vec<usize> = (rows.start + 1..rows.end).filter(|row| step(*row) > LOST * usual).collect();
    // Where steps vary anyway, a long one does not mean a lost row.
    let even = |row: &usize| {
        let share = step(*row) / usual;
        (share - share.round()).abs() < JITTER
    };
    let lost = !missing.is_empty() && missing.len() * 20 < rows.len() && missing.iter().all(even);
    if lost {
        let count: f64 = missing.iter().map(|row| (step(*row) / usual).round() - 1.0).sum();
        findings.push(Finding {
            text: if count == 1.0 {
                "One row is missing: it was interpolated.".into()
            } else {
                format!("{count} rows are missing: they were interpolated.")
            },
            rows: missing.iter().map(|row| row - 1..row + 1).collect(),
        });
    }
    Ok((rows, lost))
}

fn second(value: f64) -> String {
    Estimate::new(value, "s").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamps(rows: usize, period: f64) -> Vec<f64> {
        (0..rows).map(|i| i as f64 * period).collect()
    }

    fn even(time: &[f64], period: f64, tolerance: f64) {
        for (i, t) in time.iter().enumerate() {
            assert!((t - i as f64 * period).abs() < tolerance, "{i}: {t}");
        }
    }

    #[test]
    fn clocks_roll_over() {
        for (modulus, start, tick, seconds) in [
            (65_536.0, 60_000.0, 100.0, 1e-5),
            (4_294_967_296.0, 4_294_000_000.0, 1000.0, 1e-6),
            (86_400.0, 86_399.5, 1e-3, 1.0),
        ] {
            let ticks: Vec<f64> = (0..2000).map(|i| (start + tick * f64::from(i)) % modulus).collect();
            let clock = understand(&ticks, seconds).unwrap();
            even(&clock.time, tick * seconds, 1e-9);
            assert!(clock.findings[0].text.contains("rolled over"), "{:?}", clock.findings);
            assert!(!clock.findings[0].rows.is_empty());
        }
    }

    #[test]
    fn rounded_and_repeated_stamps_are_even() {
        let rounded: Vec<f64> = stamps(4000, 0.25e-3).iter().map(|t| (t * 1e3).floor() / 1e3).collect();
        let clock = understand(&rounded, 1.0).unwrap();
        // The end of the last millisecond is not known: 1 ms in 4000 rows.
        even(&clock.time, 0.25e-3, 1.5e-3);
        assert!(clock.findings[0].text.contains("rounded to 1"), "{:?}", clock.findings);
        let thirds: Vec<f64> = stamps(3000, 1.0 / 3000.0).iter().map(|t| (t * 1e4).round() / 1e4).collect();
        even(&understand(&thirds, 1.0).unwrap().time, 1.0 / 3000.0, 1e-5);
    }

    #[test]
    fn single_precision_stamps_are_even() {
        let single: Vec<f64> = stamps(4000, 1e-3).iter().map(|t| f64::from((t + 20_000.0) as f32)).collect();
        let clock = understand(&single, 1.0).unwrap();
        even(&clock.time, 1e-3, 1e-3);
        assert_eq!(clock.findings.len(), 1, "{:?}", clock.findings);
    }

    #[test]
    fn repeated_stamps_on_uneven_rows_and_time_that_steps_back_are_refused_with_the_row() {
        let mut repeated = stamps(1000, 1e-3);
        (100..200).for_each(|i| repeated[i] = repeated[100]);
        let refusal = understand(&repeated, 1.0).unwrap_err();
        assert!(refusal.row == 101 && !refusal.remedy.contains("ort"), "{refusal:?}");
        let mut back = stamps(1000, 1e-3);
        (500..1000).for_each(|i| back[i] -= 0.4);
        let refusal = understand(&back, 1.0).unwrap_err();
        assert!(refusal.row == 500 && refusal.remedy.contains("split"), "{refusal:?}");
    }

    #[test]
    fn a_single_wrong_stamp_is_replaced() {
        let mut stray = stamps(1000, 1e-3);
        stray[300] = 0.0;
        let clock = understand(&stray, 1.0).unwrap();
        even(&clock.time, 1e-3, 1e-12);
        assert_eq!(clock.findings[0].rows.first(), Some(&(300..301)));
    }

    #[test]
    fn missing_rows_are_interpolated_and_gaps_cut() {
        let mut lost = stamps(1000, 1e-3);
        lost.remove(400);
        lost.remove(700);
        let clock = understand(&lost, 1.0).unwrap();
        assert!(clock.lost && clock.rows == (0..998) && clock.findings[0].text.starts_with("2 rows"), "{clock:?}");
        let mut gap = stamps(1000, 1e-3);
        gap.drain(100..200);
        let clock = understand(&gap, 1.0).unwrap();
        assert!(!clock.lost && clock.rows == (100..900), "{:?}", clock.rows);
        let mut gaps = stamps(1000, 1e-3);
        gaps.drain(700..750);
        gaps.drain(400..450);
        assert_eq!(understand(&gaps, 1.0).unwrap_err().row, 400);
    }

    #[test]
    fn even_and_jittered_stamps_stay_as_they_are() {
        let clock = understand(&stamps(1000, 1e-3), 1.0).unwrap();
        assert!(clock.findings.is_empty() && !clock.lost);
        let jitter: Vec<f64> = (0..1000).map(|i| 1e-3 * (f64::from(i) + 0.3 * libm::sin(f64::from(i * i)))).collect();
        let clock = understand(&jitter, 1.0).unwrap();
        assert!(clock.findings.is_empty() && clock.time[7] == jitter[7] - jitter[0], "{:?}", clock.findings);
    }
}
