//! Courses of a signal in recorded runs, and their alignment.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use stickslip_base::{Error, Watch};
use stickslip_recording::mdf::Opened;

/// Interval of the checks for cancellation [rows].
const LOOK: u64 = 16_384;
/// Number of steps of the grid for the correlation of two courses.
const GRID: usize = 4096;

/// Course of a signal of a run, with minimum and maximum in each part of the time, so that no spike is lost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Course {
    /// SI unit.
    pub unit: String,
    /// Time of the first row of the record [s].
    pub begin: f64,
    /// Time of the last row [s].
    pub end: f64,
    /// Middle of each part of the time [s].
    pub time: Vec<f64>,
    /// Minimum and maximum in each part; `null` for lost rows.
    pub values: [Vec<Option<f64>>; 2],
}

/// Alignment of several courses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "by", rename_all = "snake_case", deny_unknown_fields)]
pub enum Alignment {
    /// Each starts at 0.
    Begin {},
    /// 0 is the first rise through a level.
    Rise {
        /// Level in the unit of the signal.
        level: f64,
    },
    /// Best fit of each to the first one, which starts at 0.
    Correlation {},
    /// Manual shifts.
    Hand {
        /// Offset added to the time of each [s].
        shifts: Vec<f64>,
    },
}

/// Course of `signal` of the run in this file from `range.0` to `range.1` [s] (`None`: the whole run), in at most
/// `parts` parts, limited by the number of rows.
///
/// # Errors
/// An unreadable file, an unknown signal; [`Error::Cancelled`].
pub fn course(
    file: &Path,
    signal: &str,
    range: Option<(f64, f64)>,
    parts: usize,
    watch: &Watch,
) -> Result<Course, Error> {
    let opened = Opened::open(file)?;
    let unknown = || {
        let names: Vec<_> = opened.channels().map(|channel| channel.name.as_str()).collect();
        Error::Unknown { what: "signal", name: signal.into(), remedy: format!("Available: {}.", names.join(", ")) }
    };
    let unit = opened.channels().find(|channel| channel.name == signal).ok_or_else(unknown)?.unit.clone();
    let (begin, end, distance) = ends(&opened).unwrap_or(Ok((0.0, 0.0, 0.0)))?;
    let (from, to) = range.unwrap_or((begin, end));
    // A part without a row would be a gap: each part is slightly longer than the interval of the rows.
    let parts = if distance > 0.0 { parts.min((0.999 * (to - from) / distance) as usize).max(1) } else { parts.min(1) };
    let width = ((to - from) / parts.max(1) as f64).max(f64::MIN_POSITIVE);
    let mut values = [vec![None; parts], vec![None; parts]];
    let mut rows = opened.rows(&["time", signal]).ok_or_else(unknown)?;
    let mut number = 0_u64;
    while let Some(&[time, value]) = rows.take()? {
        if number.is_multiple_of(LOOK) {
            watch.check()?;
        }
        number += 1;
        if time > to {
            break;
        }
        if time >= from && value.is_finite() {
            // The last row belongs to the last part.
            let part = (((time - from) / width) as usize).min(parts.saturating_sub(1));
            let [least, largest] = &mut values;
            if let (Some(least), Some(largest)) = (least.get_mut(part), largest.get_mut(part)) {
                *least = Some(least.map_or(value, |least: f64| least.min(value)));
                *largest = Some(largest.map_or(value, |largest: f64| largest.max(value)));
            }
        }
    }
    let time = (0..parts).map(|part| from + (part as f64 + 0.5) * width).collect();
    Ok(Course { unit, begin, end, time, values })
}

/// Time of the first and the last row, and interval of the rows [s]; `None` without rows.
fn ends(file: &Opened) -> Option<Result<(f64, f64, f64), Error>> {
    let mut rows = file.rows(&["time"])?;
    let mut next = || rows.take().map(|row| row.map(|row| row[0]));
    let (first, second) = match next().and_then(|first| Ok((first, next()?))) {
        Ok((first, second)) => (first?, second),
        Err(error) => return Some(Err(error)),
    };
    let distance = second.map_or(0.0, |second| second - first);
    Some(Ok((first, first + distance * (file.len() - 1) as f64, distance)))
}

/// Offsets of the times of the courses [s] for an alignment; `None` for a course that cannot be aligned.
pub fn align(courses: &[Course], by: &Alignment) -> Vec<Option<f64>> {
    let Some(first) = courses.first() else { return Vec::new() };
    courses
        .iter()
        .enumerate()
        .map(|(at, course)| match by {
            Alignment::Begin {} => Some(-course.begin),
            Alignment::Rise { level } => rise(course, *level).map(|time| -time),
            Alignment::Correlation {} => lag(first, course).map(|lag| lag - first.begin),
            Alignment::Hand { shifts } => shifts.get(at).copied().filter(|shift| shift.is_finite()),
        })
        .collect()
}

/// First time at which it rises above the level after being below.
fn rise(course: &Course, level: f64) -> Option<f64> {
    let [least, largest] = &course.values;
    let mut below = false;
    for ((time, least), largest) in course.time.iter().zip(least).zip(largest) {
        if below && largest.is_some_and(|value| value >= level) {
            return Some(*time);
        }
        below |= least.is_some_and(|value| value < level);
    }
    None
}

/// Offset of the time of `other` for the best fit to `base`: the maximum correlation of the deviations from the means,
/// over all lags with an overlap of at least a quarter of the shorter course.
fn lag(base: &Course, other: &Course) -> Option<f64> {
    let longest = (base.end - base.begin).max(other.end - other.begin);
    let step = longest / GRID as f64;
    let (a, b) = (deviation(base, step)?, deviation(other, step)?);
    let needed = (a.len().min(b.len()) / 4).max(2);
    let score = |lag: isize| {
        let from = lag.max(0) as usize;
        let until = ((b.len() as isize + lag).min(a.len() as isize)).max(0) as usize;
        if until < from + needed {
            return None;
        }
        let pairs = || (from..until).map(|at| (a[at], b[(at as isize - lag) as usize]));
        let (product, own, others) =
            pairs().fold((0.0, 0.0, 0.0), |(p, o, t), (x, y)| (p + x * y, o + x * x, t + y * y));
        let size = (own * others).sqrt();
        // A short overlap may agree by chance: it is weighted by the square root of its length.
        (size > 0.0).then(|| product / size * ((until - from) as f64 / a.len().min(b.len()) as f64).sqrt())
    };
    let lags = -(b.len() as isize)..=a.len() as isize;
    let best = lags.filter_map(|lag| Some((score(lag)?, lag))).max_by(|x, y| x.0.total_cmp(&y.0))?;
    Some(best.1 as f64 * step + base.begin - other.begin)
}

/// Mean of minimum and maximum on a grid from the start on, minus the average; `None` for a constant course.
fn deviation(course: &Course, step: f64) -> Option<Vec<f64>> {
    let [least, largest] = &course.values;
    let middle = least.iter().zip(largest).map(|(low, high)| Some(0.5 * ((*low)? + (*high)?)));
    let points: Vec<_> = course.time.iter().zip(middle).filter_map(|(time, value)| Some((*time, value?))).collect();
    let count = ((course.end - course.begin) / step) as usize;
    let mut at = 0;
    let mut values: Vec<f64> = (0..count)
        .map(|point| {
            let time = course.begin + (point as f64 + 0.5) * step;
            while at + 1 < points.len() && points[at + 1].0 <= time {
                at += 1;
            }
            points.get(at).map_or(0.0, |points| points.1)
        })
        .collect();
    let mean = values.iter().sum::<f64>() / count.max(1) as f64;
    values.iter_mut().for_each(|value| *value -= mean);
    values.iter().any(|value| *value != 0.0).then_some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A decaying oscillation that starts at `start`, in a record from `begin` to `end`.
    fn swing(begin: f64, end: f64, start: f64) -> Course {
        let parts = 2000;
        let width = (end - begin) / f64::from(parts);
        let time: Vec<_> = (0..parts).map(|part| begin + (f64::from(part) + 0.5) * width).collect();
        let value = |t: f64| if t < start { 0.0 } else { (-(t - start)).exp() * (9.0 * (t - start)).sin() };
        let values: Vec<_> = time.iter().map(|&t| Some(value(t))).collect();
        Course { unit: "rad".into(), begin, end, time, values: [values.clone(), values] }
    }

    #[test]
    fn courses_are_aligned_by_start_rise_and_correlation() {
        let courses = [swing(0.0, 10.0, 2.0), swing(5.0, 13.0, 9.5), swing(1.0, 11.0, 2.25)];
        let shifts = |by: &Alignment| align(&courses, by).into_iter().collect::<Option<Vec<_>>>().unwrap();
        assert_eq!(shifts(&Alignment::Begin {}), [-0.0, -5.0, -1.0]);
        // The grids are 5 and 2.4 ms wide.
        for (by, expected) in
            [(Alignment::Rise { level: 0.5 }, [-2.06, -9.56, -2.31]), (Alignment::Correlation {}, [0.0, -7.5, -0.25])]
        {
            for (shift, expected) in shifts(&by).iter().zip(expected) {
                assert!((shift - expected).abs() < 0.02, "{by:?}: {shift} instead of {expected}");
            }
        }
    }

    #[test]
    fn a_constant_course_cannot_be_aligned() {
        let mut still = swing(0.0, 10.0, 20.0);
        assert_eq!(align(&[swing(0.0, 10.0, 2.0), still.clone()], &Alignment::Correlation {})[1], None);
        assert_eq!(align(&[still.clone()], &Alignment::Rise { level: 0.5 }), [None]);
        still.values = [vec![None; 2000], vec![None; 2000]];
        assert_eq!(align(&[still.clone(), still], &Alignment::Correlation {}), [None, None]);
        assert_eq!(align(&[], &Alignment::Begin {}), []);
    }
}
