//! Two trials over each other: their curves, the difference, and the table of their scores.

use std::ops::Range;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::stored::DATA;
use super::{ROW, TrialRow, TrialStore};
use stickslip_base::Error;
use stickslip_recording::Recording;

/// Largest number of points of a curve.
const MOST_PARTS: u64 = 4000;

/// A signal of a trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TrialSignal {
    /// Set-point minus measured angle.
    #[default]
    Deviation,
    /// Measured angle from the start.
    Position,
    /// Measured speed.
    Velocity,
    /// Torque of the controller.
    Torque,
}

/// One or two trials for a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialPair {
    /// Unit of the curves.
    pub unit: String,
    /// The curves, A first.
    pub courses: Vec<TrialCourse>,
    /// B minus A; `null` for one trial or different motions.
    pub difference: Option<TrialTrace>,
    /// RMS of the difference.
    pub difference_rms: Option<f64>,
    /// The scores of both.
    pub rows: Vec<PairRow>,
    /// Reason for a missing difference.
    pub note: Option<String>,
}

/// A trial in a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialCourse {
    /// Number of its run.
    pub run: u64,
    /// Controller and friction.
    pub name: String,
    /// Number of its repetitions.
    pub repetitions: u64,
    /// The curve.
    pub trace: TrialTrace,
}

/// A curve as extremes of intervals of time, which keep every spike.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialTrace {
    /// Start of each interval [s].
    pub time: Vec<f64>,
    /// Smallest value in each interval.
    pub least: Vec<f64>,
    /// Largest value in each interval.
    pub largest: Vec<f64>,
}

/// A score of two trials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PairRow {
    /// Its title.
    pub title: String,
    /// The unit of the numbers.
    pub unit: String,
    /// Value of A; `null` if it is not defined for its motion.
    pub a: Option<f64>,
    /// Value of B.
    pub b: Option<f64>,
    /// B over A, less 1 [%].
    pub percent: Option<f64>,
    /// Whether the 95 % intervals overlap; `null` without intervals.
    pub overlaps: Option<bool>,
}

/// The samples of a trial.
pub(super) struct Samples {
    row: TrialRow,
    period: f64,
    /// Rows of each repetition.
    repetitions: Vec<Range<usize>>,
    setpoint: Vec<f64>,
    deviation: Vec<f64>,
    velocity: Vec<f64>,
    torque: Vec<f64>,
}

impl Samples {
    /// Reads those of a run.
    pub(super) fn read(folder: &Path) -> Result<Self, Error> {
        let row = TrialRow::read(folder).ok_or_else(|| Error::Unknown {
            what: "trial",
            name: folder.join(ROW).display().to_string(),
            remedy: "Its file is damaged. Repeat the trial.".into(),
        })?;
        let recording = Recording::read(&folder.join(DATA))?;
        let column = |name: &str| recording.column(name).map(|column| column.values.clone());
        let (number, time) = (column("repetition")?, column("time")?);
        let mut repetitions: Vec<Range<usize>> = Vec::new();
        for (index, value) in number.iter().enumerate() {
            match repetitions.last_mut() {
                Some(last) if number[last.start] == *value => last.end = index + 1,
                _ => repetitions.push(index..index + 1),
            }
        }
        Ok(Samples {
            row,
            period: if time.len() > 1 { time[1] - time[0] } else { 1.0 },
            repetitions,
            setpoint: column("setpoint")?,
            deviation: column("deviation")?,
            velocity: column("velocity")?,
            torque: column("commanded_torque")?,
        })
    }

    /// A signal in a repetition, counted from 1; the last one if there are fewer.
    fn signal(&self, signal: TrialSignal, repetition: u64) -> Vec<f64> {
        let index = usize::try_from(repetition.saturating_sub(1)).unwrap_or(usize::MAX);
        let last = self.repetitions.len().saturating_sub(1);
        let Some(rows) = self.repetitions.get(index.min(last)).cloned() else { return Vec::new() };
        match signal {
            TrialSignal::Deviation => self.deviation[rows].iter().map(|value| 1e3 * value).collect(),
            TrialSignal::Velocity => self.velocity[rows].to_vec(),
            TrialSignal::Torque => self.torque[rows].to_vec(),
            TrialSignal::Position => {
                let start = self.setpoint[rows.start];
                let pairs = self.setpoint[rows.clone()].iter().zip(&self.deviation[rows]);
                pairs.map(|(setpoint, deviation)| setpoint - deviation - start).collect()
            }
        }
    }

    fn name(&self) -> String {
        format!("{}, {}", self.row.controller, self.row.friction)
    }
}

impl TrialSignal {
    fn unit(self) -> &'static str {
        match self {
            TrialSignal::Deviation => "mrad",
            TrialSignal::Position => "rad",
            TrialSignal::Velocity => "rad/s",
            TrialSignal::Torque => "N·m",
        }
    }
}

impl TrialTrace {
    /// The extremes of a signal in a range of time [s].
    fn of(values: &[f64], period: f64, range: [f64; 2], parts: u64) -> Self {
        let index = |time: f64| ((time / period).max(0.0).round() as usize).min(values.len());
        let (from, to) = (index(range[0]), index(range[1]));
        let shown = &values[from..to.max(from)];
        let each = shown.len().div_ceil(usize::try_from(parts).unwrap_or(1).max(1)).max(1);
        let mut trace = TrialTrace::default();
        for (part, values) in shown.chunks(each).enumerate() {
            trace.time.push((from + part * each) as f64 * period);
            trace.least.push(values.iter().copied().fold(f64::INFINITY, f64::min));
            trace.largest.push(values.iter().copied().fold(f64::NEG_INFINITY, f64::max));
        }
        trace
    }
}

impl TrialStore {
    /// One or two trials for a picture; A first.
    ///
    /// # Errors
    /// An unknown trial; a file that cannot be read.
    pub fn pair(
        &self,
        runs: [Option<u64>; 2],
        signal: TrialSignal,
        repetition: u64,
        range: Option<[f64; 2]>,
        parts: u64,
    ) -> Result<TrialPair, Error> {
        let range = range.filter(|[from, to]| from < to).unwrap_or([0.0, f64::INFINITY]);
        let parts = parts.clamp(1, MOST_PARTS);
        let chosen = runs.into_iter().flatten();
        let chosen = chosen.map(|run| Ok((run, self.samples(run)?))).collect::<Result<Vec<_>, Error>>()?;
        let signals: Vec<Vec<f64>> = chosen.iter().map(|(_, samples)| samples.signal(signal, repetition)).collect();
        let courses = chosen.iter().zip(&signals).map(|((run, samples), values)| TrialCourse {
            run: *run,
            name: samples.name(),
            repetitions: samples.repetitions.len() as u64,
            trace: TrialTrace::of(values, samples.period, range, parts),
        });
        let mut pair = TrialPair {
            unit: signal.unit().into(),
            courses: courses.collect(),
            difference: None,
            difference_rms: None,
            rows: Vec::new(),
            note: None,
        };
        let [first, rest @ ..] = &chosen[..] else { return Ok(pair) };
        let second = rest.first();
        pair.rows = PairRow::all(&first.1.row, second.map(|(_, samples)| &samples.row));
        if let Some((_, other)) = second {
            let samples = &first.1;
            if samples.row.motion != other.row.motion {
                pair.note = Some(format!("A follows {}, B {}: no difference.", samples.row.motion, other.row.motion));
            } else if samples.period != other.period {
                pair.note = Some("The rates of the controllers differ: no difference.".into());
            } else {
                let values: Vec<f64> = signals[1].iter().zip(&signals[0]).map(|(b, a)| b - a).collect();
                let square: f64 = values.iter().map(|value| value * value).sum();
                pair.difference_rms = (!values.is_empty()).then(|| libm::sqrt(square / values.len() as f64));
                pair.difference = Some(TrialTrace::of(&values, samples.period, range, parts));
            }
        }
        Ok(pair)
    }
}

impl PairRow {
    /// The scores that at least one of the trials has.
    fn all(a: &TrialRow, b: Option<&TrialRow>) -> Vec<Self> {
        let rows = a.values.iter().enumerate().map(|(index, first)| {
            let second = b.and_then(|b| b.values.get(index));
            let values = (first.value, second.and_then(|second| second.value));
            let ratio = values.0.zip(values.1).filter(|(a, _)| *a != 0.0);
            let halves = first.half_width.zip(second.and_then(|second| second.half_width));
            let overlaps = ratio.zip(halves).map(|((a, b), (p, q))| (b - a).abs() <= p + q);
            PairRow {
                title: first.title.clone(),
                unit: first.unit.clone(),
                a: values.0,
                b: values.1,
                percent: ratio.map(|(a, b)| 100.0 * (b / a - 1.0)),
                overlaps,
            }
        });
        rows.filter(|row| row.a.is_some() || row.b.is_some()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_keep_a_spike_and_a_range_selects_samples() {
        let mut values = vec![0.0; 1000];
        values[537] = 5.0;
        let whole = TrialTrace::of(&values, 1e-3, [0.0, f64::INFINITY], 10);
        assert_eq!((whole.time.len(), whole.largest[5], whole.least[5]), (10, 5.0, 0.0));
        let part = TrialTrace::of(&values, 1e-3, [0.53, 0.54], 100);
        assert_eq!((part.time.len(), part.largest[7], part.time[7]), (10, 5.0, 0.537));
    }

    #[test]
    fn a_difference_is_in_percent_of_a() {
        let value = |value: f64, half_width| super::super::TrialValue {
            title: "tracking, RMS".into(),
            unit: "mrad".into(),
            value: Some(value),
            half_width,
        };
        let row = |values| TrialRow {
            run: 1,
            motion: "m".into(),
            controller: "c".into(),
            friction: "f".into(),
            repetitions: 1,
            complete: true,
            values,
        };
        let (a, b) = (row(vec![value(4.0, Some(0.2))]), row(vec![value(3.0, Some(0.1))]));
        let rows = PairRow::all(&a, Some(&b));
        assert_eq!((rows[0].percent, rows[0].overlaps), (Some(-25.0), Some(false)));
        assert_eq!(PairRow::all(&a, None)[0].percent, None);
    }
}
