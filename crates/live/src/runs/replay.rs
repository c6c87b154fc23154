//! Recorded runs once more: replayed, simulated with other parameters, and compared. One replay at a time, on its own
//! thread.

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

/// Of a record that is read beside a bench that runs: its memory is locked [bytes].
const LARGEST: u64 = 500_000_000;

/// Of a record that stays open [bytes].
const KEPT: u64 = 100_000_000;

/// How far the replay of a run is, or what it found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReplayProgress {
    /// Number of the run.
    pub run: i64,
    /// The part that is done, 0 … 1.
    pub fraction: f64,
    /// Whether it has ended.
    pub ended: bool,
    /// Whether the whole run was replayed and every bit is the same; `null` until then.
    pub identical: Option<bool>,
    /// What was found, or why it ended.
    pub sentence: Option<String>,
}

/// The last replay that was requested.
#[derive(Clone, Default)]
pub(super) struct Replay {
    seen: Arc<Mutex<ReplayProgress>>,
    cancelled: Arc<AtomicBool>,
}

impl Replay {
    fn begin(run: i64, file: PathBuf) -> Self {
        let seen = Arc::new(Mutex::new(ReplayProgress { run, ..ReplayProgress::default() }));
        let replay = Replay { seen, cancelled: Arc::default() };
        let Replay { seen, cancelled } = replay.clone();
        thread::spawn(move || {
            let progress = seen.clone();
            let watch = Watch::new(cancelled, move |_, fraction| lock(&progress).fraction = fraction);
            let replayed = Stored::open(&file).and_then(|stored| stored.replay(&watch));
            let mut seen = lock(&seen);
            seen.ended = true;
            match replayed {
                Ok(replayed) => {
                    seen.fraction = 1.0;
                    seen.identical = Some(replayed.identical());
                    seen.sentence = Some(replayed.to_string());
                }
                Err(error) => seen.sentence = Some(error.to_string()),
            }
        });
        replay
    }
}

impl Runs {
    /// Replays a run, unless that is under way or has been done; how far it is.
    pub(crate) fn replay(&self, number: i64) -> Result<Answer, Error> {
        let mut current = lock(&self.replay);
        let seen = lock(&current.seen).clone();
        if seen.run == number && (!seen.ended || seen.identical.is_some()) {
            return Ok(Answer::Replay(seen));
        }
        if seen.run != 0 && !seen.ended {
            return Err(LiveError::Busy { what: format!("the replay of run {}", seen.run) }.into());
        }
        *current = Replay::begin(number, self.record_of(number)?);
        let seen = lock(&current.seen).clone();
        Ok(Answer::Replay(seen))
    }

    /// Ends a replay that is under way.
    pub(crate) fn end_replay(&self) -> Answer {
        lock(&self.replay).cancelled.store(true, Ordering::Relaxed);
        Answer::Done {}
    }

    /// What happened in a recorded run.
    pub(crate) fn story(&self, number: i64) -> Result<Answer, Error> {
        story(&self.record_of(number)?).map(|happened| Answer::Story { happened })
    }

    /// A signal of runs over time, laid over each other; a run without it has a note.
    pub(crate) fn courses(
        &self,
        numbers: &[i64],
        signal: &str,
        align: &Alignment,
        range: Option<(f64, f64)>,
        parts: u64,
    ) -> Result<Answer, Error> {
        let bounds: [(&'static str, u64, u64); 2] =
            [("parts of a course", parts, 4000), ("runs beside each other", numbers.len() as u64, 6)];
        for (name, value, maximum) in bounds {
            if !(1..=maximum).contains(&value) {
                let (value, maximum, remedy) = (value as f64, maximum as f64, "Ask for fewer.");
                return Err(Error::OutOfRange { name, value, unit: "1", minimum: 1.0, maximum, remedy });
            }
        }
        let read =
            |number: i64, range| course(&self.record_of(number)?, signal, range, parts as usize, &Watch::silent());
        let whole: Vec<_> = numbers.iter().map(|&number| read(number, None)).collect();
        let known: Vec<_> = whole.iter().flatten().cloned().collect();
        let mut shifts = run::align(&known, align).into_iter();
        let laid = whole.into_iter().zip(numbers).map(|(whole, &number)| match whole {
            Err(error) => OverlaidRun { number, shift: None, course: None, trouble: Some(error.to_string()) },
            Ok(whole) => {
                let shift = shifts.next().flatten();
                let part = shift.zip(range).map(|(shift, (from, to))| read(number, Some((from - shift, to - shift))));
                let course = part.unwrap_or(Ok(whole));
                let trouble = course.as_ref().err().map(ToString::to_string);
                OverlaidRun { number, shift, course: course.ok(), trouble }
            }
        });
        Ok(Answer::Courses { courses: laid.collect() })
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
            ("parts of a trace", parts as f64, "1", 4000.0),
            ("signals of a simulation", signals.len() as f64, "1", 16.0),
        ];
        for (name, value, unit, maximum) in bounds {
            if !(value > 0.0 && value <= maximum) {
                let remedy = "A longer run is simulated from its begin on, so far.";
                return Err(Error::OutOfRange { name, value, unit, minimum: 0.0, maximum, remedy });
            }
        }
        let stored = self.opened(number)?;
        let values: Vec<_> = values.into_iter().collect();
        let request = SimulationRequest { values: &values, signals, length, parts: parts as usize };
        let (simulated, differences) = stored.simulate(&request, &Watch::silent())?;
        Ok(Answer::Simulated { simulated: Box::new(simulated), differences: Changed::all(&differences) })
    }

    /// A record; one that is looked at again and again stays open.
    fn opened(&self, number: i64) -> Result<Arc<Stored>, Error> {
        let file = self.record_of(number)?;
        let mut opened = lock(&self.opened);
        if let Some((_, stored)) = opened.as_ref().filter(|(known, _)| *known == number) {
            return Ok(stored.clone());
        }
        *opened = None;
        let stored = Arc::new(Stored::open(&file)?);
        if std::fs::metadata(&file).is_ok_and(|about| about.len() < KEPT) {
            *opened = Some((number, stored.clone()));
        }
        Ok(stored)
    }

    fn record_of(&self, number: i64) -> Result<PathBuf, Error> {
        let record = self.catalogue.details(number)?.run.record;
        let remedy = "It was not recorded: record with `bench record`, or measure with --record.";
        let record = record.ok_or(LiveError::RunGone { number, how: "it has no record of its cycles", remedy })?;
        let folder = self.catalogue.folder(number)?;
        // Of a record alone the run is the file itself.
        let file = if folder.is_dir() { folder.join(record) } else { folder };
        if std::fs::metadata(&file).is_ok_and(|about| about.len() > LARGEST) {
            let how = "its record is larger than 500 MB and would crowd the memory of the bench that runs";
            let remedy = "`stickslip replay` does it in a process of its own.";
            return Err(LiveError::RunGone { number, how, remedy }.into());
        }
        Ok(file)
    }
}
