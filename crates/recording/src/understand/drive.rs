//! Rows in which the drive does not move the axis: drive off, brake closed.

use std::ops::Range;

use super::{Finding, quantile};

/// Shortest stretch that is judged, in rows: shorter ones do not matter.
const SHORTEST: usize = 50;

/// The longest stretch of enabled rows, and what was left out; `None` for the range if no row is enabled.
pub fn enabled(flags: &[f64]) -> (Option<Range<usize>>, Option<Finding>) {
    let used = stretches(flags.len(), |row| flags[row] > 0.5);
    let Some(longest) = used.iter().max_by_key(|range| range.len()).cloned() else { return (None, None) };
    if longest.len() == flags.len() {
        return (Some(longest), None);
    }
    let others = used.iter().map(ExactSizeIterator::len).sum::<usize>() - longest.len();
    let more =
        if others == 0 { String::new() } else { format!(" {others} enabled rows in other stretches were not used.") };
    let text = format!("The drive is not enabled in all rows: the longest enabled stretch was used.{more}");
    (Some(longest.clone()), Some(Finding { text, rows: outside(&longest, flags.len()) }))
}

/// The longest stretch in which command and motion do not contradict each other, and what was left out.
///
/// A drive is off where the command is constant while the axis gains speed; a brake is closed where the axis stands
/// still under a command that elsewhere moves it. `lifts`: a weight may accelerate the axis.
pub fn contradictions(position: &[f64], command: &[f64], lifts: bool) -> (Range<usize>, Vec<Finding>) {
    let rows = position.len().min(command.len());
    let mut faults: Vec<(Range<usize>, &str)> = Vec::new();
    if !lifts {
        faults.extend(off(position, command).into_iter().map(|range| (range, "the drive is off")));
    }
    faults.extend(braked(position, command).into_iter().map(|range| (range, "a brake is closed")));
    let clear = |row: usize| !faults.iter().any(|(range, _)| range.contains(&row));
    let longest = stretches(rows, clear).into_iter().max_by_key(ExactSizeIterator::len);
    // A recording without any clear stretch is judged by the identification.
    let Some(longest) = longest.filter(|range| 3 * range.len() > rows) else { return (0..rows, Vec::new()) };
    let reasons: Vec<&str> = ["the drive is off", "a brake is closed"]
        .into_iter()
        .filter(|reason| faults.iter().any(|(_, is)| is == reason))
        .collect();
    if reasons.is_empty() {
        return (0..rows, Vec::new());
    }
    let text = format!(
        "Command and motion contradict each other, as if {}: the longest stretch without such rows was used.",
        reasons.join(" or ")
    );
    let findings = vec![Finding { text, rows: outside(&longest, rows) }];
    (longest, findings)
}

/// Stretches of constant command in which the axis gains more than a tenth of its largest speed.
fn off(position: &[f64], command: &[f64]) -> Vec<Range<usize>> {
    let speed = speeds(position);
    let fastest = quantile(speed.clone(), 0.99);
    let gains = |range: &Range<usize>| {
        let mut slowest = f64::INFINITY;
        range.clone().any(|row| {
            slowest = slowest.min(speed[row]);
            speed[row] > slowest + 0.1 * fastest
        })
    };
    equal(command).into_iter().filter(|range| range.len() >= SHORTEST && gains(range)).collect()
}

/// Stretches without motion in which the command changes and exceeds, for a while, nearly all commands during motion.
fn braked(position: &[f64], command: &[f64]) -> Vec<Range<usize>> {
    let speed = speeds(position);
    let fastest = quantile(speed.clone(), 0.99);
    let moving: Vec<f64> =
        (0..command.len()).filter(|row| speed[*row] > 0.02 * fastest).map(|row| command[row]).collect();
    if moving.len() < SHORTEST {
        return Vec::new();
    }
    let middle = quantile(moving.clone(), 0.5);
    let large = quantile(moving.iter().map(|u| (u - middle).abs()).collect(), 0.9);
    let pressed = |range: &Range<usize>| {
        command[range.clone()].iter().filter(|u| (*u - middle).abs() > large).count() >= SHORTEST
    };
    // Noise and quantisation move a position that rests.
    let still = stretches(speed.len(), |row| speed[row] <= 0.005 * fastest);
    still.into_iter().filter(|range| range.len() >= SHORTEST && pressed(range)).collect()
}

/// Speed over about ten rows, per row.
fn speeds(position: &[f64]) -> Vec<f64> {
    const HALF: usize = 5;
    let last = position.len().saturating_sub(1);
    let speed = |row: usize| {
        let (from, to) = (row.saturating_sub(HALF), (row + HALF).min(last));
        (position[to] - position[from]).abs() / (to - from).max(1) as f64
    };
    (0..position.len()).map(speed).collect()
}

/// Runs of equal values.
fn equal(values: &[f64]) -> Vec<Range<usize>> {
    let mut start = 0;
    let range = |run: &[f64]| {
        start += run.len();
        start - run.len()..start
    };
    values.chunk_by(|a, b| a == b).map(range).collect()
}

/// Stretches of rows for which something holds.
fn stretches(rows: usize, holds: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for row in (0..rows).filter(|row| holds(*row)) {
        match found.last_mut().filter(|range| range.end == row) {
            Some(range) => range.end += 1,
            None => found.push(row..row + 1),
        }
    }
    found
}

fn outside(range: &Range<usize>, rows: usize) -> Vec<Range<usize>> {
    [0..range.start, range.end..rows].into_iter().filter(|range| !range.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Strokes of an axis under a force that overcomes inertia and friction.
    fn strokes() -> (Vec<f64>, Vec<f64>) {
        let position = (0..4000).map(|i| 0.1 * (1.0 - libm::cos(f64::from(i) * 0.005))).collect();
        let command = |i: i32| {
            let velocity = libm::sin(f64::from(i) * 0.005);
            0.3 * libm::cos(f64::from(i) * 0.005) + 0.5 * velocity.signum() + 0.4 * velocity
        };
        (position, (0..4000).map(command).collect())
    }

    #[test]
    fn only_the_longest_enabled_stretch_is_used() {
        let flags: Vec<f64> = (0..1000).map(|i| f64::from(u8::from(i >= 200 && i != 300 && i < 900))).collect();
        let (range, finding) = enabled(&flags);
        assert_eq!(range, Some(301..900));
        let finding = finding.unwrap();
        assert!(finding.rows == [0..301, 900..1000] && finding.text.contains("100 enabled rows"), "{finding:?}");
        assert_eq!(enabled(&[1.0; 5]), (Some(0..5), None));
        assert_eq!(enabled(&[0.0; 5]), (None, None));
    }

    #[test]
    fn a_drive_that_is_off_while_the_axis_is_pushed_is_left_out() {
        let (position, mut command) = strokes();
        command[3000..].iter_mut().for_each(|u| *u = 0.0);
        let (range, findings) = contradictions(&position, &command, false);
        assert!(range == (0..3000) && findings[0].text.contains("the drive is off"), "{range:?} {findings:?}");
        assert_eq!(contradictions(&position, &command, true).0, 0..4000);
    }

    #[test]
    fn a_closed_brake_is_left_out() {
        let (mut position, mut command) = strokes();
        position.splice(0..0, vec![position[0]; 800]);
        command.splice(0..0, (0..800).map(|i| 1.2 * libm::sin(f64::from(i) * 0.02)));
        let (range, findings) = contradictions(&position, &command, false);
        // The speed is a mean over ten rows, and the start of the stroke is slow.
        assert!((780..1000).contains(&range.start) && range.end == 4800, "{range:?}");
        assert!(findings[0].text.contains("a brake is closed") && findings[0].rows.first() == Some(&(0..range.start)));
    }

    #[test]
    fn strokes_coasting_and_an_axis_that_sticks_are_not_contradictions() {
        let (position, command) = strokes();
        assert_eq!(contradictions(&position, &command, false), (0..4000, Vec::new()));
        // The axis coasts to rest with the drive at 0.
        let mut coasts = (position.clone(), command.clone());
        coasts.0.extend((0..500).map(|i| position[3999] + 1e-4 * (1.0 - libm::exp(-f64::from(i) * 0.01))));
        coasts.1.extend([0.0; 500]);
        assert_eq!(contradictions(&coasts.0, &coasts.1, false).1, []);
        // The command rises to the breakaway force while the axis sticks.
        let mut sticks = (vec![position[0]; 300], (0..300).map(|i| 0.6 * f64::from(i) / 300.0).collect::<Vec<_>>());
        sticks.0.extend(&position);
        sticks.1.extend(&command);
        assert_eq!(contradictions(&sticks.0, &sticks.1, false).1, []);
    }
}
