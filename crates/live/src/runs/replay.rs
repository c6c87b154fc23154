//! Recorded runs: replay, simulation with other parameters, comparison. One replay at a time, on its own thread.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Runs;
use crate::protocol::{Alignment, Answer, Changed, OverlaidRun};
use crate::{LiveError, lock};
use stickslip_base::{Error, Watch};
use stickslip_bench::run::{self, SimulationRequest, Stored, course, story};

/// Largest record that is read by a running bench, whose memory is locked [bytes].
const LARGEST: u64 = 500_000_000;

/// Largest record that stays open [bytes].
const LARGEST_OPEN: u64 = 100_000_000;

/// Progress or result of a replay.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReplayProgress {
    /// Number of the run.
    pub run: i64,
    /// Completed share, 0 … 1.
    pub fraction: f64,
    /// Whether it has ended.
    pub ended: bool,
    /// Whether the whole run was replayed and every bit is the same; `null` before the end.
    pub identical: Option<bool>,
    /// Result, or reason of the end.
    pub sentence: Option<String>,
}

/// The last replay that was requested.
#[derive(Clone, Default)]
pub(super) struct Replay {
    progress: Arc<Mutex<ReplayProgress>>,
    cancelled: Arc<AtomicBool>,
}

impl Replay {
    fn begin(run: i64, file: PathBuf) -> Self {
        let progress = Arc::new(Mutex::new(ReplayProgress { run, ..ReplayProgress::default() }));
        let replay = Replay { progress, cancelled: Arc::default() };
        let Replay { progress, cancelled } = replay.clone();
        thread::spawn(move || {
            let reported = progress.clone();
            let watch = Watch::new(cancelled, move |_, fraction| lock(&reported).fraction = fraction);
            let replayed = Stored::open(&file).and_then(|stored| stored.replay(&watch));
            let mut progress = lock(&progress);
            progress.ended = true;
            match replayed {
                Ok(replayed) => {
                    progress.fraction = 1.0;
                    progress.identical = Some(replayed.identical());
                    progress.sentence = Some(replayed.to_string());
                }
                Err(error) => progress.sentence = Some(error.to_string()),
            }
        });
        replay
    }
}

impl Runs {
    /// Starts the replay of a run, unless it is running or complete. Returns its progress.
    pub(crate) fn replay(&self, number: i64) -> Result<Answer, Error> {
        let mut current = lock(&self.replay);
        let progress = lock(&current.progress).clone();
        if progress.run == number && (!progress.ended || progress.identical.is_some()) {
            return Ok(Answer::Replay(progress));
        }
        if progress.run != 0 && !progress.ended {
            let what = format!("the replay of run {}", progress.run);
            return Err(LiveError::Busy { what, remedy: "Wait for its end, or cancel it." }.into());
        }
        *current = Replay::begin(number, self.record_of(number)?);
        let progress = lock(&current.progress).clone();
        Ok(Answer::Replay(progress))
    }

    /// Ends the running replay.
    pub(crate) fn end_replay(&self) -> Answer {
        lock(&self.replay).cancelled.store(true, Ordering::Relaxed);
        Answer::Done {}
    }

    /// Events of a recorded run.
    pub(crate) fn story(&self, number: i64) -> Result<Answer, Error> {
        story(&self.record_of(number)?).map(|happened| Answer::Story { happened })
    }

    /// A signal of several runs over time, overlaid; a run without the signal has a note.
    pub(crate) fn courses(
        &self,
        numbers: &[i64],
        signal: &str,
        align: &Alignment,
        range: Option<(f64, f64)>,
        parts: u64,
    ) -> Result<Answer, Error> {
        let bounds: [(&'static str, u64, u64); 2] =
            [("number of points of a course", parts, 4000), ("number of overlaid runs", numbers.len() as u64, 6)];
        for (name, value, maximum) in bounds {
            if !(1..=maximum).contains(&value) {
                let (value, maximum, remedy) = (value as f64, maximum as f64, "Choose a number within this range.");
                return Err(Error::OutOfRange { name, value, unit: "1", minimum: 1.0, maximum, remedy });
            }
        }
        let read =
            |number: i64, range| course(&self.record_of(number)?, signal, range, parts as usize, &Watch::silent());
        let whole: Vec<_> = numbers.iter().map(|&number| read(number, None)).collect();
        let courses: Vec<_> = whole.iter().flatten().cloned().collect();
        let mut shifts = run::align(&courses, align).into_iter();
        let overlaid = whole.into_iter().zip(numbers).map(|(whole, &number)| match whole {
            Err(error) => OverlaidRun { number, shift: None, course: None, trouble: Some(error.to_string()) },
            Ok(whole) => {
                let shift = shifts.next().flatten();
                let part = shift.zip(range).map(|(shift, (from, to))| read(number, Some((from - shift, to - shift))));
                let course = part.unwrap_or(Ok(whole));
                let trouble = course.as_ref().err().map(ToString::to_string);
                OverlaidRun { number, shift, course: course.ok(), trouble }
            }
        });
        Ok(Answer::Courses { courses: overlaid.collect() })
    }

    /// A recorded run with other parameters, on the virtual bench.
    pub(crate) fn simulate(
        &self,
        number: i64,
        values: BTreeMap<String, String>,
        signals: &[String],
        length: f64,
        parts: u64,
    ) -> Result<Answer, Error> {
        let bounds: [(&'static str, f64, &'static str, f64); 3] = [
            ("the length of a simulation", length, "s", 120.0),
            ("number of points of a trace", parts as f64, "1", 4000.0),
            ("number of signals of a simulation", signals.len() as f64, "1", 16.0),
        ];
        for (name, value, unit, maximum) in bounds {
            if !(value > 0.0 && value <= maximum) {
                let remedy = "Choose a value within this range; a longer run is simulated from its start.";
                return Err(Error::OutOfRange { name, value, unit, minimum: 0.0, maximum, remedy });
            }
        }
        let stored = self.opened(number)?;
        let values: Vec<_> = values.into_iter().collect();
        let request = SimulationRequest { values: &values, signals, length, parts: parts as usize };
        let (simulated, differences) = stored.simulate(&request, &Watch::silent())?;
        Ok(Answer::Simulated { simulated: Box::new(simulated), differences: Changed::all(&differences) })
    }

    /// Opens a record; the last one stays open for further calls.
    fn opened(&self, number: i64) -> Result<Arc<Stored>, Error> {
        let file = self.record_of(number)?;
        let mut opened = lock(&self.opened);
        if let Some((_, stored)) = opened.as_ref().filter(|(of, _)| *of == number) {
            return Ok(stored.clone());
        }
        *opened = None;
        let stored = Arc::new(Stored::open(&file)?);
        if std::fs::metadata(&file).is_ok_and(|about| about.len() < LARGEST_OPEN) {
            *opened = Some((number, stored.clone()));
        }
        Ok(stored)
    }

    fn record_of(&self, number: i64) -> Result<PathBuf, Error> {
        let record = self.catalogue.details(number)?.run.record;
        let remedy = "Record with `stickslip bench record`, or measure with --record.";
        let record = record.ok_or(LiveError::RunGone { number, how: "it has no record of its cycles", remedy })?;
        let folder = self.catalogue.folder(number)?;
        // A record alone is a run without a folder.
        let file = if folder.is_dir() { folder.join(record) } else { folder };
        if std::fs::metadata(&file).is_ok_and(|about| about.len() > LARGEST) {
            let how = "its record is larger than 500 MB, too large for the memory of the running bench";
            let remedy = "Use `stickslip replay`, which runs in its own process.";
            return Err(LiveError::RunGone { number, how, remedy }.into());
        }
        Ok(file)
    }
}
