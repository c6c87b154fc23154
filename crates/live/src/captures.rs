//! The captures and streams of all clients, by number.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use super::protocol::{Answer, Captured, Point};
use stickslip_base::Error;
use stickslip_base::parameters::schema::nearest;
use stickslip_bench::run::channels;
use stickslip_recording::capture::{
    Batch, Batches, Capture, Envelope, History, Keep, Plan, Segment, Stage, Stream, Tap, Trigger,
};

/// Maximum number of captures and streams.
const MAX_RUNNING: usize = 16;
/// Maximum number of unread points of a stream.
const MAX_POINTS: usize = 4096;
/// Maximum number of signals of a stream of every cycle, and the time for which its rows are buffered [s].
const MAX_SIGNALS: usize = 64;
const BUFFER_TIME: f64 = 2.0;
/// Memory of a capture or stream [bytes].
const LIMIT: usize = 64 << 20;
/// A capture or stream that was not read for this time may be ended.
const UNREAD_LIMIT: Duration = Duration::from_secs(60);

/// Memory of the history [bytes].
const HISTORY: usize = 128 << 20;
/// Time before and after the standstill that follows a fault, in the capture of each fault [s].
const AROUND_FAULT: [f64; 2] = [4.0, 0.5];
/// The state of supervision after a fault.
const FAULT: &str = "state becomes 4";

/// The captures and streams.
pub(super) struct Captures {
    /// Distributes the rows.
    pub(super) stream: Stream,
    names: Vec<String>,
    running: BTreeMap<u64, Running>,
    last_number: u64,
    /// Tick rate, fixed while the bench runs [Hz].
    rate: f64,
    history: Option<Tap<History>>,
    /// The signals around the last fault; `None` if they exceed the memory.
    fault: Option<Tap<Capture>>,
}

/// A capture or stream.
struct Running {
    kind: Kind,
    last_read: Instant,
}

enum Kind {
    Capture { tap: Tap<Capture>, signals: Vec<String>, tick_time: f64 },
    Stream(Tap<Envelope>),
    Samples(Tap<Batches>),
}

impl Captures {
    /// For a tick rate [Hz].
    pub(super) fn new(rate: f64) -> Self {
        let names: Vec<_> = channels().into_iter().map(|entry| entry.path).collect();
        let mut stream = Stream::new(names.len());
        let history = stream.add(History::new(names.len(), HISTORY)).ok();
        let [before, after] = AROUND_FAULT.map(|time| (time * rate).round() as u64);
        let plan = Plan { signals: (0..names.len()).collect(), decimation: 1, before, after, keep: Keep::Latest(1) };
        let trigger: Option<Trigger> = FAULT.parse().ok();
        let capture = trigger.and_then(|trigger| Capture::new(plan, &trigger, &names, LIMIT).ok());
        let fault = capture.and_then(|capture| stream.add(capture).ok());
        Captures { stream, names, running: BTreeMap::new(), last_number: 0, rate, history, fault }
    }

    /// The signals around a fault, once they are complete.
    pub(super) fn around_fault(&mut self) -> Option<Segment> {
        self.stream.get_mut(self.fault.as_ref()?)?.take()
    }

    /// A part of the history: extremes of these signals.
    pub(super) fn past(&self, signals: &[String], from: u64, to: u64, points: u64) -> Result<Answer, Error> {
        let bounds: [(&'static str, u64, u64); 2] = [
            ("number of blocks", points, MAX_POINTS as u64),
            ("number of signals", signals.len() as u64, MAX_SIGNALS as u64),
        ];
        for (name, value, maximum) in bounds {
            if !(1..=maximum).contains(&value) {
                let (value, maximum, remedy) = (value as f64, maximum as f64, "Choose a number within this range.");
                return Err(Error::OutOfRange { name, value, unit: "1", minimum: 1.0, maximum, remedy });
            }
        }
        let signals = self.indices(signals)?;
        let history = self.history.as_ref().and_then(|history| self.stream.get(history));
        let found = history.map(|history| history.query(&signals, from..to, points)).unwrap_or_default();
        Ok(Answer::Past(Box::new(found)))
    }

    /// Starts a capture around a trigger, from `span[0]` before to `span[1]` after it [s].
    pub(super) fn begin(
        &mut self,
        signals: Vec<String>,
        trigger: &str,
        span: [f64; 2],
        decimation: u64,
    ) -> Result<Answer, Error> {
        let trigger: Trigger = trigger.parse()?;
        let indices = self.indices(&signals)?;
        let (before, after) = (ticks(span[0], self.rate)?, ticks(span[1], self.rate)?);
        let plan = Plan { signals: indices, decimation, before, after, keep: Keep::First(1) };
        let capture = Capture::new(plan, &trigger, &self.names, LIMIT)?;
        self.make_room()?;
        let tap = self.stream.add(capture)?;
        Ok(self.run(Kind::Capture { tap, signals, tick_time: 1.0 / self.rate }, stage(Stage::Filling)))
    }

    /// Starts a stream with a point in each interval of `every` [s].
    pub(super) fn watch(&mut self, signals: &[String], every: f64) -> Result<Answer, Error> {
        let envelope = Envelope::new(self.indices(signals)?, ticks(every, self.rate)?.max(1), MAX_POINTS, LIMIT)?;
        self.make_room()?;
        let tap = self.stream.add(envelope)?;
        Ok(self.run(Kind::Stream(tap), "streaming"))
    }

    /// Starts a stream of every cycle.
    pub(super) fn sample(&mut self, signals: &[String]) -> Result<Answer, Error> {
        let refused = |answer: String, remedy: &str| {
            Err(Error::Answer { question: "signals of a stream".into(), answer, remedy: remedy.into() })
        };
        if signals.len() > MAX_SIGNALS {
            return refused(signals.len().to_string(), &format!("At most {MAX_SIGNALS}."));
        }
        if let Some(twice) = repeated(signals) {
            return refused(format!("{twice} twice"), "Name each signal once.");
        }
        let room = (BUFFER_TIME * self.rate).ceil() as usize;
        let batches = Batches::new(self.indices(signals)?, room, LIMIT)?;
        self.make_room()?;
        let tap = self.stream.add(batches)?;
        Ok(Answer::Samples { capture: self.number(Kind::Samples(tap)) })
    }

    fn run(&mut self, kind: Kind, stage: &str) -> Answer {
        Answer::Capture { capture: self.number(kind), stage: stage.into() }
    }

    fn number(&mut self, kind: Kind) -> u64 {
        self.last_number += 1;
        self.running.insert(self.last_number, Running { kind, last_read: Instant::now() });
        self.last_number
    }

    fn indices(&self, signals: &[String]) -> Result<Vec<usize>, Error> {
        let index = |name: &String| {
            self.names.iter().position(|other| other == name).ok_or_else(|| Error::Unknown {
                what: "signal",
                name: name.clone(),
                remedy: match nearest(name, self.names.iter().map(String::as_str)) {
                    Some(nearest) => format!("Did you mean {nearest}?"),
                    None => "`stickslip bench signals` lists them.".into(),
                },
            })
        };
        signals.iter().map(index).collect()
    }

    /// The unread points of a stream.
    pub(super) fn points(&mut self, number: u64) -> Result<Answer, Error> {
        let running = self.running.get_mut(&number).ok_or_else(|| unknown(number))?;
        running.last_read = Instant::now();
        let Kind::Stream(tap) = &running.kind else { return Err(unknown(number)) };
        let envelope = self.stream.get_mut(tap).ok_or_else(|| unknown(number))?;
        let point = |point: stickslip_recording::capture::Point| Point {
            from: point.from,
            to: point.to,
            missing: point.missing,
            min: point.extremes.iter().map(|extremes| finite(extremes.min)).collect(),
            max: point.extremes.iter().map(|extremes| finite(extremes.max)).collect(),
            last: point.last.iter().copied().map(finite).collect(),
            nan: point.extremes.iter().map(|extremes| extremes.nan).collect(),
        };
        Ok(Answer::Points { points: std::iter::from_fn(|| envelope.take()).map(point).collect() })
    }

    /// The oldest unread batch of a stream of every cycle.
    pub(super) fn batch(&mut self, number: u64) -> Result<Option<Batch>, Error> {
        let running = self.running.get_mut(&number).ok_or_else(|| unknown(number))?;
        running.last_read = Instant::now();
        let Kind::Samples(tap) = &running.kind else { return Err(unknown(number)) };
        Ok(self.stream.get_mut(tap).ok_or_else(|| unknown(number))?.take())
    }

    /// Reads a capture; a complete one ends.
    pub(super) fn fetch(&mut self, number: u64) -> Result<Answer, Error> {
        let running = self.running.get_mut(&number).ok_or_else(|| unknown(number))?;
        running.last_read = Instant::now();
        let Kind::Capture { tap, signals, tick_time } = &running.kind else { return Err(unknown(number)) };
        let capture = self.stream.get_mut(tap).ok_or_else(|| unknown(number))?;
        let Some(segment) = capture.take() else {
            return Ok(Answer::Capture { capture: number, stage: stage(capture.stage()).into() });
        };
        let answer = captured(segment, signals, *tick_time);
        self.end(number)?;
        Ok(Answer::Captured(Box::new(answer)))
    }

    /// Ends a capture or stream.
    pub(super) fn end(&mut self, number: u64) -> Result<(), Error> {
        let running = self.running.remove(&number).ok_or_else(|| unknown(number))?;
        match running.kind {
            Kind::Capture { tap, .. } => drop(self.stream.remove(tap)),
            Kind::Stream(tap) => drop(self.stream.remove(tap)),
            Kind::Samples(tap) => drop(self.stream.remove(tap)),
        }
        Ok(())
    }

    /// If the maximum number runs, ends the one that has not been read for longest, after [`UNREAD_LIMIT`].
    fn make_room(&mut self) -> Result<(), Error> {
        if self.running.len() < MAX_RUNNING {
            return Ok(());
        }
        let oldest = self.running.iter().min_by_key(|(_, running)| running.last_read);
        match oldest.filter(|(_, running)| running.last_read.elapsed() > UNREAD_LIMIT).map(|(number, _)| *number) {
            Some(number) => self.end(number),
            None => Err(Error::Answer {
                question: "number of captures and streams".into(),
                answer: (MAX_RUNNING + 1).to_string(),
                remedy: format!("At most {MAX_RUNNING}: fetch or drop one."),
            }),
        }
    }
}

/// A number of ticks; the memory limit refuses too large ones.
fn ticks(seconds: f64, rate: f64) -> Result<u64, Error> {
    if seconds >= 0.0 { Ok((seconds * rate).round() as u64) } else { Err(negative(seconds)) }
}

fn repeated(names: &[String]) -> Option<&String> {
    let mut distinct = BTreeSet::new();
    names.iter().find(|name| !distinct.insert(*name))
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn captured(segment: Segment, signals: &[String], tick_time: f64) -> Captured {
    Captured {
        signals: signals.to_vec(),
        times: segment.times(tick_time).collect(),
        trigger: segment.trigger,
        lost: segment.lost(),
        missing: segment.missing,
        columns: segment.columns.iter().map(|column| column.iter().copied().map(finite).collect()).collect(),
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
        name: "a time of a capture or stream",
        value: seconds,
        unit: "s",
        minimum: 0.0,
        maximum: f64::INFINITY,
        remedy: "Give a time in seconds.",
    }
}

fn unknown(number: u64) -> Error {
    Error::Unknown {
        what: "capture",
        name: number.to_string(),
        remedy: "It was fetched, dropped, or ended because it was not read for 60 s. Start a new one.".into(),
    }
}
