//! A run into a file while it happens: every cycle a row, every change an event.

use std::path::Path;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime};

use stickslip_core::cycle::{Change, Parameters, Software};

use super::change::line;
use super::numbers::Restore;
use super::signals::{Signals, channels};
use crate::Keyframe;
use crate::tap::{Changed, Sample, Stream, Tap, What, tap};
use stickslip_base::{Error, Preset, parameters};
use stickslip_design as design;
use stickslip_recording::mdf::{Cause, Channel, Event, Header, Summary, Writer};

/// What a record's properties say that it is.
pub const SCHEMA: &str = "stickslip.run/1";
/// Name of the attached parameter file.
pub const PRESET: &str = "preset.toml";
/// Name of the attached state of a run that does not begin with the first cycle.
pub(super) const STATE: &str = "state.txt";
/// Names of events that a replay reads.
pub const BEGIN: &str = "begin";
pub(super) const LOST: &str = "lost";
pub(super) const CHANGED: [&str; 2] = ["change", "refused"];

/// At most so long after a cycle its row is in the file.
const FLUSH: Duration = Duration::from_millis(100);
/// From look to look.
const LOOK: Duration = Duration::from_millis(2);
/// Cycles that may wait for their row.
const ROOM: usize = 1 << 15;
/// Values of a change that are named for people.
const NAMED: usize = 20;

/// What a record says of its run.
#[derive(Clone, Debug)]
pub struct About {
    /// The command that made it.
    pub command: String,
    /// The bench as it is at the begin.
    pub preset: Preset<f64>,
    /// Seed of the virtual machine's noise; none where the machine is elsewhere.
    pub seed: Option<u64>,
}

/// Writes what it is given.
pub struct RunWriter {
    writer: Writer,
    parameters: Parameters<f64>,
    faulty: bool,
    lost: u64,
    flushed: Instant,
}

/// What was recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded {
    /// Rows and bytes.
    pub file: Summary,
    /// Cycles that found no room.
    pub lost: u64,
}

impl RunWriter {
    /// Into a new file, for a bench that is switched on with a preset.
    ///
    /// # Errors
    /// [`Error::File`]; what the design of the bench refuses.
    pub fn create(path: &Path, about: &About) -> Result<Self, Error> {
        let Preset { model, bench, .. } = &about.preset;
        Self::begin(path, about, design::parameters(model, bench)?, None)
    }

    /// Into a new file, for a bench that runs already, from a state of it on.
    ///
    /// # Errors
    /// [`Error::File`]; what the design of the bench refuses.
    pub fn create_from(path: &Path, about: &About, keyframe: &Keyframe) -> Result<Self, Error> {
        let parameters = *begin(about, keyframe)?.parameters();
        Self::begin(path, about, parameters, Some(keyframe))
    }

    fn begin(
        path: &Path,
        about: &About,
        parameters: Parameters<f64>,
        keyframe: Option<&Keyframe>,
    ) -> Result<Self, Error> {
        let Preset { bench, .. } = &about.preset;
        let mut properties = vec![
            ("schema".to_owned(), SCHEMA.to_owned()),
            ("command".to_owned(), about.command.clone()),
            ("tick_time".to_owned(), bench.tick_time().to_string()),
        ];
        properties.extend(about.seed.map(|seed| ("seed".to_owned(), seed.to_string())));
        let cycle = keyframe.map_or(0, |keyframe| keyframe.cycle);
        // A file tells the time of cycle 0.
        let since = Duration::try_from_secs_f64(cycle as f64 * bench.tick_time()).unwrap_or_default();
        let header = Header {
            start: SystemTime::now().checked_sub(since).unwrap_or(SystemTime::UNIX_EPOCH),
            program: "stickslip".into(),
            version: env!("CARGO_PKG_VERSION").into(),
            comment: about.command.clone(),
            properties,
        };
        let channel = |entry: parameters::Entry| Channel {
            name: entry.path,
            unit: entry.field.unit.into(),
            comment: entry.field.help.into(),
        };
        let channels: Vec<_> = channels().into_iter().map(channel).collect();
        let mut writer = Writer::create(path, &header, &channels, bench.tick_time())?;
        writer.attach(PRESET, "application/toml", parameters::write_commented(&about.preset).as_bytes())?;
        if let Some(Keyframe { numbers, .. }) = keyframe {
            let text: Vec<String> = numbers.iter().map(f64::to_string).collect();
            writer.attach(STATE, "text/plain", text.join("\n").as_bytes())?;
        }
        let begin = line(&What::Software(Change::Parameters(parameters), None));
        writer.event(&Event { cycle, name: BEGIN.into(), comment: begin, cause: Cause::Tool })?;
        Ok(RunWriter { writer, parameters, faulty: false, lost: 0, flushed: Instant::now() })
    }

    /// A cycle.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn sample(&mut self, sample: &Sample) -> Result<(), Error> {
        let cycle = sample.frame.cycle;
        if sample.lost > 0 {
            self.lost += sample.lost;
            let comment = sample.lost.to_string();
            self.writer.event(&Event { cycle, name: LOST.into(), comment, cause: Cause::Error })?;
        }
        let fault = sample.frame.safety.fault();
        if let Some(fault) = fault.filter(|_| !self.faulty) {
            let comment = fault.to_string();
            self.writer.event(&Event { cycle, name: "fault".into(), comment, cause: Cause::Error })?;
        }
        self.faulty = fault.is_some();
        self.row(cycle, &Signals::of(&sample.frame))
    }

    pub(super) fn row(&mut self, cycle: u64, signals: &Signals<f64>) -> Result<(), Error> {
        self.writer.row(cycle, &signals.row())
    }

    /// A change. Its first line is for a replay, what follows for people.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn change(&mut self, changed: &Changed) -> Result<(), Error> {
        let mut comment = line(&changed.what);
        let [made, refused] = CHANGED;
        let mut name = made;
        match &changed.what {
            What::Software(_, Some(refusal)) => {
                name = refused;
                comment += &format!("\n{refusal}");
            }
            What::Software(Change::Parameters(parameters), None) => {
                let differences = parameters::diff(&self.parameters, parameters);
                for difference in differences.iter().take(NAMED) {
                    let text = |entry: &Option<parameters::Entry>| {
                        entry.as_ref().map_or("none".into(), parameters::Entry::to_string)
                    };
                    let (before, after) = (text(&difference.before), text(&difference.after));
                    comment += &format!("\n{}: {before} → {after}", difference.path);
                }
                if differences.len() > NAMED {
                    comment += &format!("\nand {} more", differences.len() - NAMED);
                }
                self.parameters = *parameters;
            }
            _ => {}
        }
        self.writer.event(&Event { cycle: changed.cycle, name: name.into(), comment, cause: Cause::Tool })
    }

    /// Length of the file [bytes], and the cycles that found no room.
    pub fn written(&self) -> (u64, u64) {
        (self.writer.bytes(), self.lost)
    }

    /// Called often: brings what came to the disk in time.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn look(&mut self) -> Result<(), Error> {
        if self.flushed.elapsed() >= FLUSH {
            self.writer.flush()?;
            self.flushed = Instant::now();
        }
        Ok(())
    }

    /// Completes the file.
    ///
    /// # Errors
    /// [`Error::File`]; what was written before is there.
    pub fn finish(self) -> Result<Recorded, Error> {
        Ok(Recorded { file: self.writer.finish()?, lost: self.lost })
    }
}

/// The software in the state of a keyframe.
fn begin(about: &About, keyframe: &Keyframe) -> Result<Software, Error> {
    let Preset { model, bench, .. } = &about.preset;
    let mut software = Software::new(design::parameters(model, bench)?, bench.tick_time());
    software.keep(&mut Restore::new(&keyframe.numbers));
    Ok(software)
}

/// A thread that records what comes through a tap.
pub struct Recorder {
    thread: JoinHandle<Result<Recorded, Error>>,
}

impl Recorder {
    /// Creates the file; the tap is for the bench.
    ///
    /// # Errors
    /// As [`RunWriter::create`].
    pub fn start(path: &Path, about: &About) -> Result<(Self, Tap), Error> {
        let mut writer = RunWriter::create(path, about)?;
        let (tap, mut stream) = tap(ROOM);
        // Where it fails the stream is dropped with it: a bench in lockstep then goes on without.
        let thread = thread::spawn(move || {
            record(&mut stream, &mut writer)?;
            writer.finish()
        });
        Ok((Recorder { thread }, tap))
    }

    /// Waits until all is in the file; the bench must be gone.
    ///
    /// # Errors
    /// [`Error::File`] where the disk took no more: what was written before is there.
    pub fn finish(self) -> Result<Recorded, Error> {
        self.thread.join().expect("what is recorded is data: nothing in it panics")
    }
}

fn record(stream: &mut Stream, writer: &mut RunWriter) -> Result<(), Error> {
    loop {
        // Asked before the cycles are taken: those that came last are not left behind.
        let last = stream.is_closed();
        while let Some(sample) = stream.sample() {
            writer.sample(&sample)?;
        }
        while let Some(changed) = stream.change() {
            writer.change(&changed)?;
        }
        writer.look()?;
        if last {
            return Ok(());
        }
        thread::sleep(LOOK);
    }
}
