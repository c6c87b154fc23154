//! A bench without a clock, and a master that decodes its packets.

use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use stickslip::LiveError;

use stickslip::Error;
use stickslip::capture::{Stream, Tap};
use stickslip::parameters::{Entry, presets};
use stickslip::run::channels;
use stickslip::tuning::Tuning;
use stickslip::xcp::a2l::{Doors, describe};
use stickslip::xcp::frame::{self, Next};
use stickslip::xcp::{Bench, Change, Layout, MAX_DTO, Sampler, Slave, denial};

/// Ticks in a second [Hz].
pub const RATE: f64 = 4000.0;

/// Parameters and rows.
pub struct Desk {
    tuning: RefCell<Tuning>,
    stream: RefCell<Stream>,
    /// All attempted changes.
    pub changes: RefCell<Vec<Change>>,
    /// Whether another client operates.
    pub operated: Cell<bool>,
    /// Number of disconnected masters.
    pub left: Cell<usize>,
}

impl Desk {
    pub fn new() -> Self {
        let tuning = Tuning::new(presets::find("clm-bench").unwrap()).unwrap();
        Desk {
            tuning: RefCell::new(tuning),
            stream: RefCell::new(Stream::new(channels().len())),
            changes: RefCell::default(),
            operated: Cell::default(),
            left: Cell::default(),
        }
    }

    /// Value of a signal in a cycle.
    pub fn value(signal: usize, cycle: u64) -> f64 {
        cycle as f64 + signal as f64 / 128.0
    }

    /// One cycle.
    pub fn row(&self, cycle: u64) {
        let row: Vec<f64> = (0..channels().len()).map(|signal| Desk::value(signal, cycle)).collect();
        self.stream.borrow_mut().push(cycle, &row).unwrap();
    }

    /// An active parameter as text.
    pub fn in_force(&self, path: &str) -> String {
        let entries = stickslip::parameters::flatten(self.tuning.borrow().preset());
        entries.iter().find(|entry| entry.path == path).map(ToString::to_string).unwrap_or_default()
    }
}

impl Bench for Desk {
    fn note_activity(&self) {}

    fn left(&self) {
        self.left.set(self.left.get() + 1);
    }

    fn newest(&self) -> (u64, Vec<f64>) {
        let cycle = self.stream.borrow().last().unwrap_or(0);
        (cycle, (0..channels().len()).map(|signal| Desk::value(signal, cycle)).collect())
    }

    fn in_force(&self) -> Vec<Entry> {
        self.tuning.borrow().entries()
    }

    fn reference(&self) -> Vec<Entry> {
        self.tuning.borrow().reference_entries()
    }

    fn attach(&self, sampler: Sampler) -> Result<Tap<Sampler>, Error> {
        self.stream.borrow_mut().add(sampler)
    }

    fn detach(&self, tap: Tap<Sampler>) {
        self.stream.borrow_mut().remove(tap);
    }

    fn change(&self, change: &Change) -> Result<(), Error> {
        self.changes.borrow_mut().push(change.clone());
        if self.operated.get() {
            return Err(LiveError::Operated { by: "ann".into() }.into());
        }
        let proposal = match change {
            Change::Set(changes) => self.tuning.borrow().set(changes)?,
            Change::Reset => self.tuning.borrow().reset()?,
        };
        self.tuning.borrow_mut().entered(proposal);
        Ok(())
    }
}

/// A slave with its bench, and the master's view of them.
pub struct Master {
    pub desk: Desk,
    pub slave: Slave,
    pub layout: Arc<Layout>,
    pub description: Arc<str>,
    /// Received texts.
    pub texts: String,
    /// Received packets of measurements.
    pub measured: Vec<Vec<u8>>,
    counter: u16,
}

impl Master {
    /// A master without connection.
    pub fn new() -> Self {
        let layout = Arc::new(Layout::new(RATE));
        let doors = Doors { udp: "127.0.0.1:5555".parse().ok(), tcp: "[::1]:5556".parse().ok() };
        let description: Arc<str> = describe(&layout, doors).into();
        let slave = Slave::new(layout.clone(), description.clone(), Arc::new(AtomicU64::new(0))).with_denials(denial);
        let (texts, measured) = (String::new(), Vec::new());
        Master { desk: Desk::new(), slave, layout, description, texts, measured, counter: 0 }
    }

    /// A connected master.
    pub fn connected() -> Self {
        let mut master = Master::new();
        let answer = master.ask(&[0xff, 0]);
        assert_eq!(answer, [&[0xff, 0x05, 0x80, 248][..], &(MAX_DTO as u16).to_le_bytes(), &[1, 1]].concat());
        master
    }

    /// The response or the error to a command; empty without one.
    pub fn ask(&mut self, command: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        if let Some(change) = self.slave.receive(command, &self.desk, &mut out) {
            let changed = self.desk.change(&change);
            self.slave.done(changed, &mut out);
        }
        self.hear(&out)
    }

    /// The response to a command that must succeed, without its first byte.
    pub fn get(&mut self, command: &[u8]) -> Vec<u8> {
        let answer = self.ask(command);
        assert_eq!(answer.first(), Some(&0xff), "{command:02x?} {answer:02x?} {}", self.texts);
        answer[1..].to_vec()
    }

    /// The code of a command's refusal.
    pub fn refused(&mut self, command: &[u8]) -> u8 {
        let answer = self.ask(command);
        assert!(answer.len() == 2 && answer[0] == 0xfe, "{command:02x?} {answer:02x?}");
        answer[1]
    }

    /// Decodes frames with consecutive counters; returns the response among them.
    pub fn hear(&mut self, mut bytes: &[u8]) -> Vec<u8> {
        let mut response = Vec::new();
        while let Next::Packet(packet, rest) = frame::next(bytes, MAX_DTO) {
            assert_eq!(u16::from_le_bytes([bytes[2], bytes[3]]), self.counter, "no frame is lost");
            self.counter = self.counter.wrapping_add(1);
            bytes = rest;
            match packet[0] {
                0xff | 0xfe => {
                    assert!(response.is_empty(), "one response to a command");
                    response = packet.to_vec();
                }
                0xfd => assert_eq!(packet, [0xfd, 0x05]),
                0xfc => self.texts += str::from_utf8(&packet[2..]).unwrap(),
                _ => self.measured.push(packet.to_vec()),
            }
        }
        assert!(bytes.is_empty(), "whole frames");
        response
    }

    /// Receives the measurements.
    pub fn measure(&mut self) {
        loop {
            let mut out = Vec::new();
            self.slave.measurements(&mut out, 1452);
            if out.is_empty() {
                return;
            }
            self.hear(&out);
        }
    }

    /// Address of a parameter or a signal.
    pub fn address(&self, path: &str) -> u32 {
        let parameters = self.layout.parameters.iter().map(|parameter| &parameter.cell);
        let mut cells = self.layout.measurements.iter().chain(parameters);
        cells.find(|cell| cell.path == path).unwrap_or_else(|| panic!("{path} has no address")).address
    }

    pub fn read(&mut self, path: &str) -> f64 {
        let address = self.address(path);
        let bytes = self.get(&[&[0xf4, 8, 0, 0][..], &address.to_le_bytes()].concat());
        f64::from_le_bytes(bytes.try_into().unwrap())
    }

    /// Writes a value: the response or the error.
    pub fn write(&mut self, path: &str, value: f64) -> Vec<u8> {
        let address = self.address(path);
        self.get(&[&[0xf6, 0, 0, 0][..], &address.to_le_bytes()].concat());
        self.ask(&[&[0xf0, 8][..], &value.to_le_bytes()].concat())
    }

    /// Uploads a number of bytes from the pointer.
    pub fn upload(&mut self, mut count: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        while count > 0 {
            let part = count.min(247);
            bytes.extend(self.get(&[0xf5, part as u8]));
            count -= part;
        }
        bytes
    }
}
