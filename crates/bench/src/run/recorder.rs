//! Recording of a run into a file: every cycle is a row, every change an event.

use std::path::Path;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime};

use stickslip_software::cycle::{Change, Parameters, Software};

use super::change::line;
use super::numbers::Restore;
use super::signals::{Signals, channels};
use crate::Keyframe;
use crate::tap::{ChangeKind, Changed, Sample, Stream, Tap, tap};
use stickslip_base::{Error, Preset, parameters};
use stickslip_design as design;
use stickslip_recording::mdf::{Cause, Channel, Event, Header, Summary, Writer};

/// Schema in the properties of a record.
pub const SCHEMA: &str = "stickslip.run/1";
/// Name of the attached parameter file.
pub const PRESET: &str = "preset.toml";
/// Name of the attached state of a run that does not start with the first cycle.
pub(super) const STATE: &str = "state.txt";
/// Names of events that a replay reads.
pub const BEGIN: &str = "begin";
pub(super) const LOST: &str = "lost";
pub(super) const CHANGED: [&str; 2] = ["change", "refused"];

/// Maximum delay between a cycle and its row in the file.
const FLUSH: Duration = Duration::from_millis(100);
/// Polling interval.
const LOOK: Duration = Duration::from_millis(2);
/// Capacity of the ring of cycles.
const ROOM: usize = 1 << 15;
/// Maximum number of changed values listed in an event.
const NAMED: usize = 20;

/// Description of a run.
#[derive(Clone, Debug)]
pub struct About {
    /// Command of the run.
    pub command: String,
    /// Preset at the start.
    pub preset: Preset<f64>,
    /// Seed of the noise of the virtual machine; `None` for another machine.
    pub seed: Option<u64>,
}

/// Writer of a record.
pub struct RunWriter {
    writer: Writer,
    parameters: Parameters<f64>,
    faulty: bool,
    lost: u64,
    flushed: Instant,
}

/// Result of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded {
    /// Rows and bytes.
    pub file: Summary,
    /// Lost cycles.
    pub lost: u64,
}

impl RunWriter {
    /// Creates a file for a bench that is switched on with a preset.
    ///
    /// # Errors
    /// [`Error::File`]; errors of the design of the bench.
    pub fn create(path: &Path, about: &About) -> Result<Self, Error> {
        let Preset { model, bench, .. } = &about.preset;
        Self::begin(path, about, design::parameters(model, bench)?, None)
    }

    /// Creates a file for a running bench, starting with a state.
    ///
    /// # Errors
    /// [`Error::File`]; errors of the design of the bench.
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
        // A file states the time of cycle 0.
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
        let begin = line(&ChangeKind::Software(Change::Parameters(parameters), None));
        writer.event(&Event { cycle, name: BEGIN.into(), comment: begin, cause: Cause::Tool })?;
        Ok(RunWriter { writer, parameters, faulty: false, lost: 0, flushed: Instant::now() })
    }

    /// Writes a cycle.
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

    /// Writes a change. Its first line is for replays, the following lines are for users.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn change(&mut self, changed: &Changed) -> Result<(), Error> {
        let mut comment = line(&changed.what);
        let [accepted, refused] = CHANGED;
        let mut name = accepted;
        match &changed.what {
            ChangeKind::Software(_, Some(refusal)) => {
                name = refused;
                comment += &format!("\n{refusal}");
            }
            ChangeKind::Software(Change::Parameters(parameters), None) => {
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

    /// Length of the file [bytes], and number of lost cycles.
    pub fn written(&self) -> (u64, u64) {
        (self.writer.bytes(), self.lost)
    }

    /// Flushes the file at regular intervals; called often.
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
    /// [`Error::File`]; previously written data remain.
    pub fn finish(self) -> Result<Recorded, Error> {
        Ok(Recorded { file: self.writer.finish()?, lost: self.lost })
    }
}

/// The software with the state of a keyframe.
fn begin(about: &About, keyframe: &Keyframe) -> Result<Software, Error> {
    let Preset { model, bench, .. } = &about.preset;
    let mut software = Software::new(design::parameters(model, bench)?, bench.tick_time());
    software.keep(&mut Restore::new(&keyframe.numbers));
    Ok(software)
}

/// A thread that records the data of a tap.
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
        // On an error the stream is closed, and a bench in lockstep continues without it.
        let thread = thread::spawn(move || {
            record(&mut stream, &mut writer)?;
            writer.finish()
        });
        Ok((Recorder { thread }, tap))
    }

    /// Waits until everything is in the file; the bench must have ended.
    ///
    /// # Errors
    /// [`Error::File`] for write errors; previously written data remain.
    pub fn finish(self) -> Result<Recorded, Error> {
        self.thread.join().expect("the recording thread does not panic")
    }
}

fn record(stream: &mut Stream, writer: &mut RunWriter) -> Result<(), Error> {
    loop {
        // Checked before the cycles are taken, so that the last ones are included.
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
