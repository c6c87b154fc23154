//! The captures of all clients, by number.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::protocol::{Answer, Captured};
use crate::Error;
use crate::capture::{Capture, Keep, Plan, Segment, Stage, Stream, Tap, Trigger};
use crate::parameters::schema::nearest;
use crate::run::channels;

/// Captures at once.
const MOST: usize = 8;
/// Memory of one [bytes].
const LIMIT: usize = 64 << 20;
/// Nobody asks any more for one that was not asked for so long.
const FORGOTTEN: Duration = Duration::from_secs(60);

/// The captures.
pub(super) struct Captures {
    /// Where the rows go in.
    pub(super) stream: Stream,
    names: Vec<String>,
    running: BTreeMap<u64, Running>,
    begun: u64,
}

/// One of them.
struct Running {
    tap: Tap<Capture>,
    signals: Vec<String>,
    tick_time: f64,
    asked: Instant,
}

impl Captures {
    pub(super) fn new() -> Self {
        let names: Vec<_> = channels().into_iter().map(|entry| entry.path).collect();
        Captures { stream: Stream::new(names.len()), names, running: BTreeMap::new(), begun: 0 }
    }

    /// Begins one around a trigger, from `span[0]` before to `span[1]` after it [s].
    pub(super) fn begin(
        &mut self,
        signals: Vec<String>,
        trigger: &str,
        span: [f64; 2],
        decimation: u64,
        rate: f64,
    ) -> Result<Answer, Error> {
        let trigger: Trigger = trigger.parse()?;
        let index = |name: &String| {
            self.names.iter().position(|known| known == name).ok_or_else(|| Error::Unknown {
                what: "signal",
                name: name.clone(),
                remedy: match nearest(name, self.names.iter().map(String::as_str)) {
                    Some(nearest) => format!("Did you mean {nearest}?"),
                    None => "`stickslip bench signals` lists them.".into(),
                },
            })
        };
        let indices = signals.iter().map(index).collect::<Result<Vec<_>, _>>()?;
        let ticks = |seconds: f64| {
            // A number of ticks that none can have is refused with its memory.
            if seconds >= 0.0 { Ok((seconds * rate).round() as u64) } else { Err(negative(seconds)) }
        };
        let (before, after) = (ticks(span[0])?, ticks(span[1])?);
        let plan = Plan { signals: indices, decimation, before, after, keep: Keep::First(1) };
        let capture = Capture::new(plan, &trigger, &self.names, LIMIT)?;
        self.make_room()?;
        let tap = self.stream.add(capture)?;
        self.begun += 1;
        self.running.insert(self.begun, Running { tap, signals, tick_time: 1.0 / rate, asked: Instant::now() });
        Ok(Answer::Capture { capture: self.begun, stage: stage(Stage::Filling).into() })
    }

    /// What one has; complete, it ends.
    pub(super) fn fetch(&mut self, number: u64) -> Result<Answer, Error> {
        let running = self.running.get_mut(&number).ok_or_else(|| unknown(number))?;
        running.asked = Instant::now();
        let capture = self.stream.get_mut(&running.tap).ok_or_else(|| unknown(number))?;
        let Some(segment) = capture.take() else {
            return Ok(Answer::Capture { capture: number, stage: stage(capture.stage()).into() });
        };
        let answer = captured(segment, running);
        self.end(number)?;
        Ok(Answer::Captured(Box::new(answer)))
    }

    /// Ends one.
    pub(super) fn end(&mut self, number: u64) -> Result<(), Error> {
        let running = self.running.remove(&number).ok_or_else(|| unknown(number))?;
        self.stream.remove(running.tap);
        Ok(())
    }

    /// Ends what is forgotten, if there is no room.
    fn make_room(&mut self) -> Result<(), Error> {
        if self.running.len() < MOST {
            return Ok(());
        }
        let oldest = self.running.iter().min_by_key(|(_, running)| running.asked);
        match oldest.filter(|(_, running)| running.asked.elapsed() > FORGOTTEN).map(|(number, _)| *number) {
            Some(number) => self.end(number),
            None => Err(Error::Answer {
                question: "captures at once".into(),
                answer: (MOST + 1).to_string(),
                remedy: format!("At most {MOST}: fetch or drop one."),
            }),
        }
    }
}

fn captured(segment: Segment, running: &Running) -> Captured {
    let number = |value: f64| value.is_finite().then_some(value);
    Captured {
        signals: running.signals.clone(),
        times: segment.times(running.tick_time).collect(),
        trigger: segment.trigger,
        lost: segment.lost(),
        missing: segment.missing,
        columns: segment.columns.iter().map(|column| column.iter().copied().map(number).collect()).collect(),
        cycles: segment.cycles,
    }
}

fn stage(stage: Stage) -> &'static str {
    match stage {
        Stage::Filling => "filling",
        Stage::Armed => "armed",
        Stage::Delayed => "delayed",
        Stage::Triggered => "triggered",
        Stage::Complete => "complete",
    }
}

fn negative(seconds: f64) -> Error {
    Error::OutOfRange {
        name: "the time before or after a trigger",
        value: seconds,
        unit: "s",
        minimum: 0.0,
        maximum: f64::INFINITY,
        remedy: "0 keeps nothing on that side.",
    }
}

fn unknown(number: u64) -> Error {
    Error::Unknown {
        what: "capture",
        name: number.to_string(),
        remedy: "It was fetched, dropped or forgotten: begin another one.".into(),
    }
}
