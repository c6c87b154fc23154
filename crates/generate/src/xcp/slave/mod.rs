//! A session of a master: a state machine from commands to responses.

mod calibration;
mod measurement;
mod session;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::Consumer;

use super::ascii::ascii;
use super::lists::Lists;
use super::packet::{Command, EVENT_PENDING, Refusal, Response, SERVICE_TEXT, pid};
use super::pages::Pages;
use super::{Bench, Change, Layout, MAX_CTO, PARAMETERS, Sampler, frame};
use stickslip_base::Error;
use stickslip_recording::capture::Tap;

/// Longest text of a refusal [bytes].
const TEXT: usize = 1000;

/// The slave of one master. It appends whole frames to an output, which must be sent in that order: their counter
/// increases by one from frame to frame.
pub struct Slave {
    layout: Arc<Layout>,
    /// The description that a master may upload.
    description: Arc<str>,
    connected: bool,
    counter: u16,
    pointer: Pointer,
    pages: Pages,
    lists: Lists,
    stream: Option<(Tap<Sampler>, Consumer<u8>)>,
    lost: Arc<AtomicU64>,
    waiting: Option<Waiting>,
    /// Code of an error that only the bench knows.
    denial: fn(&Error) -> Option<Refusal>,
}

/// Start of the next upload, download or checksum.
#[derive(Clone, Debug)]
enum Pointer {
    Nowhere,
    Address(u32),
    Text(Arc<str>, usize),
}

/// A command that waits for the bench.
#[derive(Clone, Debug)]
struct Waiting {
    then: Then,
    /// Whether the master still waits for the response.
    answer: bool,
}

/// Action after the bench has changed its parameters.
#[derive(Clone, Debug)]
enum Then {
    Nothing,
    /// Select this page for the master, and for the bench, which had these values before.
    Page {
        page: u8,
        of_master: bool,
        before: Option<Vec<f64>>,
    },
}

/// Outcome of a command.
enum Outcome {
    Answer(Response),
    /// Answer after the bench has made this change.
    Later(Change, Then),
    /// Refusal with the reason in words.
    Refused(Error),
}

type Result<T> = std::result::Result<T, Refusal>;

impl Slave {
    /// For a layout and its description. Lost rows of measurements are counted.
    pub fn new(layout: Arc<Layout>, description: Arc<str>, lost: Arc<AtomicU64>) -> Self {
        Slave {
            layout,
            description,
            connected: false,
            counter: 0,
            pointer: Pointer::Nowhere,
            pages: Pages::default(),
            lists: Lists::default(),
            stream: None,
            lost,
            waiting: None,
            denial: |_| None,
        }
    }

    /// Whether a master is connected.
    pub fn is_connected(&self) -> bool {
        self.connected
    }

    /// Whether measurements run.
    pub fn is_measuring(&self) -> bool {
        self.lists.any_runs()
    }

    /// Whether a command waits for [`done`](Self::done).
    pub fn is_waiting(&self) -> bool {
        self.waiting.is_some()
    }

    /// Handles a command. If it returns a change, the answer follows by [`done`](Self::done) with the result of the change.
    pub fn receive(&mut self, packet: &[u8], bench: &dyn Bench, out: &mut Vec<u8>) -> Option<Change> {
        let command = Command(packet);
        let code = *packet.first()?;
        // Without a connection, commands are not answered.
        if !self.connected && code != 0xff {
            return None;
        }
        bench.note_activity();
        let outcome = match (code, &mut self.waiting) {
            (0xfc, waiting) => {
                // The master no longer waits for the response.
                waiting.iter_mut().for_each(|waiting| waiting.answer = false);
                Err(Refusal::Synch)
            }
            (_, Some(_)) => Err(Refusal::Busy),
            (code, None) => self.dispatch(code, command, bench),
        };
        match outcome {
            Ok(Outcome::Answer(response)) => frame::push(out, &mut self.counter, [&response.0, &[]]),
            Ok(Outcome::Later(change, then)) => {
                self.waiting = Some(Waiting { then, answer: true });
                return Some(change);
            }
            Ok(Outcome::Refused(error)) => self.explain(&error, out),
            Err(refusal) => self.refuse(refusal, out),
        }
        None
    }

    /// Answers a command with the result of its change.
    pub fn done(&mut self, changed: std::result::Result<(), Error>, out: &mut Vec<u8>) {
        let Some(Waiting { then, answer }) = self.waiting.take() else { return };
        if changed.is_ok() {
            self.follow(then);
        }
        match changed {
            _ if !answer || !self.connected => {}
            Ok(()) => frame::push(out, &mut self.counter, [&Response::ok().0, &[]]),
            Err(error) => self.explain(&error, out),
        }
    }

    /// Notifies the master that its command takes longer.
    pub fn pending(&mut self, out: &mut Vec<u8>) {
        if self.waiting.as_ref().is_some_and(|waiting| waiting.answer) {
            frame::push(out, &mut self.counter, [&[pid::EVENT, EVENT_PENDING], &[]]);
        }
    }

    /// Appends measurements, up to a limit of the output [bytes].
    pub fn measurements(&mut self, out: &mut Vec<u8>, limit: usize) {
        let Some((_, rows)) = &mut self.stream else { return };
        while let Ok(length) = rows.read_chunk(2) {
            // Packets are complete, each after its length.
            let length: Vec<u8> = [length.as_slices().0, length.as_slices().1].concat();
            let size = usize::from(u16::from_le_bytes([length[0], length[1]]));
            if out.len() + frame::HEADER + size > limit {
                return;
            }
            let Ok(chunk) = rows.read_chunk(2 + size) else { return };
            let (first, second) = chunk.as_slices();
            let skipped = first.len().min(2);
            let parts = [&first[skipped..], &second[2 - skipped..]];
            frame::push(out, &mut self.counter, parts);
            chunk.commit_all();
        }
    }

    /// The slave of a bench with errors of its own: `denial` returns their codes.
    pub fn with_denials(self, denial: fn(&Error) -> Option<Refusal>) -> Self {
        Slave { denial, ..self }
    }

    /// Ends the session. Collected values are dropped; the active parameters stay.
    pub fn end(&mut self, bench: &dyn Bench) {
        self.stop(bench);
        self.lists = Lists::default();
        self.pages = Pages::default();
        self.pointer = Pointer::Nowhere;
        if std::mem::take(&mut self.connected) {
            bench.left();
        }
        self.waiting.iter_mut().for_each(|waiting| waiting.answer = false);
    }

    /// Refuses with the reason in words and as a code.
    fn explain(&mut self, error: &Error, out: &mut Vec<u8>) {
        self.send_text(&error.to_string(), out);
        self.refuse(calibration::refusal(error, (self.denial)(error)), out);
    }

    fn refuse(&mut self, refusal: Refusal, out: &mut Vec<u8>) {
        frame::push(out, &mut self.counter, [&[pid::ERROR, refusal as u8], &[]]);
    }

    /// Sends a text for the user in as many packets as necessary; the last one ends with 0.
    fn send_text(&mut self, text: &str, out: &mut Vec<u8>) {
        let mut bytes = ascii(text).into_bytes();
        bytes.truncate(TEXT);
        bytes.extend_from_slice(b"\n\0");
        for part in bytes.chunks(MAX_CTO - 2) {
            frame::push(out, &mut self.counter, [&[pid::SERVICE, SERVICE_TEXT], part]);
        }
    }

    /// Number of lost rows of measurements.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}
