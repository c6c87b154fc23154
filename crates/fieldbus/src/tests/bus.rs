//! A small main device within the test: no network, and time as the test wants it.

use crate::esc::memory::{AL_CONTROL, AL_STATUS, AL_STATUS_CODE, FMMU, STATION, SYNC_MANAGER};
use crate::{DriveSheet, Machine, Rotors, Segment};

pub(super) const APRD: u8 = 1;
pub(super) const APWR: u8 = 2;
pub(super) const BRD: u8 = 7;
pub(super) const BWR: u8 = 8;
pub(super) const LRD: u8 = 10;
pub(super) const LWR: u8 = 11;
pub(super) const LRW: u8 = 12;
pub(super) const FRMW: u8 = 14;

/// Period of the process data [ns].
pub(super) const CYCLE: u64 = 1_000_000;
/// Lengths of the process data of a drive, inputs first in the logical addresses.
pub(super) const INPUTS: u16 = 16;
pub(super) const OUTPUTS: u16 = 6;

pub(super) struct Bus {
    pub(super) segment: Segment,
    pub(super) now: u64,
    counter: u8,
}

/// An Ethernet frame with datagrams of command, device, offset and data.
pub(super) fn frame(datagrams: &[(u8, u16, u16, &[u8])]) -> Vec<u8> {
    let mut body = Vec::new();
    for (at, (command, device, offset, data)) in datagrams.iter().enumerate() {
        let more = if at + 1 < datagrams.len() { 0x8000 } else { 0 };
        body.extend([*command, at as u8]);
        for word in [*device, *offset, data.len() as u16 | more, 0] {
            body.extend(word.to_le_bytes());
        }
        body.extend(*data);
        body.extend([0, 0]);
    }
    let header = (0x1000 | body.len() as u16).to_le_bytes();
    [&[0xFF; 6][..], &[0x10; 6], &[0x88, 0xA4], &header, &body].concat()
}

impl Bus {
    pub(super) fn new(drives: usize, terminals: usize) -> Self {
        Bus::with(drives, terminals, Box::new(Rotors { inertia: 1e-3, friction: 1e-3 }))
    }

    pub(super) fn with(drives: usize, terminals: usize, machine: Box<dyn Machine>) -> Self {
        let segment = Segment::new(&vec![DriveSheet::default(); drives], terminals, machine);
        Bus { segment, now: 5_000_000_000, counter: 0 }
    }

    /// One datagram: data and working counter; `None` if the frame was lost.
    pub(super) fn try_send(&mut self, command: u8, device: u16, offset: u16, data: &[u8]) -> Option<(Vec<u8>, u16)> {
        let mut frame = frame(&[(command, device, offset, data)]);
        self.now += 20_000;
        let end = frame.len();
        self.segment
            .pass(&mut frame, self.now)
            .then(|| (frame[26..end - 2].to_vec(), u16::from_le_bytes([frame[end - 2], frame[end - 1]])))
    }

    pub(super) fn send(&mut self, command: u8, device: u16, offset: u16, data: &[u8]) -> (Vec<u8>, u16) {
        self.try_send(command, device, offset, data).expect("the frame comes back")
    }

    pub(super) fn read(&mut self, position: u16, offset: u16, length: usize) -> Vec<u8> {
        let (data, counter) = self.send(APRD, 0_u16.wrapping_sub(position), offset, &vec![0; length]);
        assert_eq!(counter, 1, "offset {offset:#06x}");
        data
    }

    pub(super) fn word(&mut self, position: u16, offset: u16) -> u16 {
        let bytes = self.read(position, offset, 2);
        u16::from_le_bytes([bytes[0], bytes[1]])
    }

    pub(super) fn write(&mut self, position: u16, offset: u16, data: &[u8]) {
        let (_, counter) = self.send(APWR, 0_u16.wrapping_sub(position), offset, data);
        assert_eq!(counter, 1, "offset {offset:#06x}");
    }

    /// State with error bit, and status code.
    pub(super) fn status(&mut self, position: u16) -> (u16, u16) {
        (self.word(position, AL_STATUS), self.word(position, AL_STATUS_CODE))
    }

    pub(super) fn request(&mut self, position: u16, state: u16) -> (u16, u16) {
        self.write(position, AL_CONTROL, &state.to_le_bytes());
        self.status(position)
    }

    pub(super) fn manager(&mut self, position: u16, number: u16, start: u16, length: u16, control: u8) {
        let [a, b] = start.to_le_bytes();
        let [c, d] = length.to_le_bytes();
        self.write(position, SYNC_MANAGER + 8 * number, &[a, b, c, d, control, 0, u8::from(length > 0), 0]);
    }

    fn unit(&mut self, position: u16, number: u16, logical: u32, length: u16, physical: u16, kind: u8) {
        let [a, b, c, d] = logical.to_le_bytes();
        let [e, f] = length.to_le_bytes();
        let [g, h] = physical.to_le_bytes();
        self.write(position, FMMU + 16 * number, &[a, b, c, d, e, f, 0, 7, g, h, 0, kind, 1, 0, 0, 0]);
    }

    /// Addresses, mailboxes, PRE-OP.
    pub(super) fn reach_pre_operational(&mut self) {
        for position in 0..self.segment.states().len() as u16 {
            self.write(position, STATION, &(0x1001 + position).to_le_bytes());
            self.manager(position, 0, 0x1000, 128, 0x26);
            self.manager(position, 1, 0x1080, 128, 0x22);
            assert_eq!(self.request(position, 0x12), (2, 0));
        }
    }

    /// Process data of the drives with default mapping: outputs at 0, inputs at 0x100; SAFE-OP.
    pub(super) fn reach_safe_operational(&mut self, drives: u16) {
        for position in 0..drives {
            self.manager(position, 2, 0x1100, OUTPUTS, 0x64);
            self.manager(position, 3, 0x1200, INPUTS, 0x20);
            self.unit(position, 0, u32::from(position * OUTPUTS), OUTPUTS, 0x1100, 2);
            self.unit(position, 1, 0x100 + u32::from(position * INPUTS), INPUTS, 0x1200, 1);
            assert_eq!(self.request(position, 0x14), (4, 0));
        }
    }

    pub(super) fn reach_operational(&mut self, drives: u16) {
        self.reach_pre_operational();
        self.reach_safe_operational(drives);
        for position in 0..drives {
            self.request(position, 8);
        }
        self.cycle(&vec![(0, 0, 10); drives.into()]);
        self.cycle(&vec![(0, 0, 10); drives.into()]);
        for position in 0..drives {
            assert_eq!(self.status(position), (8, 0));
        }
    }

    /// One cycle of process data: controlword, torque, mode of each drive. Returns the inputs of each.
    pub(super) fn cycle(&mut self, outputs: &[(u16, i16, i8)]) -> Vec<Inputs> {
        let bytes = outputs.iter().flat_map(|(control, torque, mode)| {
            let ([a, b], [c, d]) = (control.to_le_bytes(), torque.to_le_bytes());
            [a, b, c, d, *mode as u8, 0]
        });
        let drives = outputs.len() as u16;
        let (_, counter) = self.send(LWR, 0, 0, &bytes.collect::<Vec<_>>());
        assert_eq!(counter, drives);
        self.now += CYCLE - 40_000;
        let (data, counter) = self.send(LRD, 0x100, 0, &vec![0; usize::from(INPUTS) * outputs.len()]);
        assert_eq!(counter, drives);
        data.chunks(INPUTS.into()).map(Inputs::new).collect()
    }

    /// Runs cycles with equal outputs; the last inputs of the first drive.
    pub(super) fn cycles(&mut self, count: usize, outputs: &[(u16, i16, i8)]) -> Inputs {
        (0..count).map(|_| self.cycle(outputs)[0]).last().expect("at least one")
    }

    /// Sends a message of CoE and returns the answer from the service on.
    pub(super) fn message(&mut self, position: u16, content: &[u8]) -> Vec<u8> {
        self.counter = self.counter % 7 + 1;
        let [low, high] = (content.len() as u16).to_le_bytes();
        let mut message = vec![low, high, 0, 0, 0, 3 | self.counter << 4];
        message.extend(content);
        message.resize(128, 0);
        self.write(position, 0x1000, &message);
        self.answer(position)
    }

    pub(super) fn answer(&mut self, position: u16) -> Vec<u8> {
        assert_eq!(self.read(position, SYNC_MANAGER + 13, 1)[0] & 8, 8, "an answer is waiting");
        let answer = self.read(position, 0x1080, 128);
        let length = usize::from(u16::from_le_bytes([answer[0], answer[1]]));
        answer[6..6 + length].to_vec()
    }

    /// Expedited upload of a number; the abort code otherwise.
    pub(super) fn upload(&mut self, position: u16, index: u16, subindex: u8) -> Result<i64, u32> {
        let [low, high] = index.to_le_bytes();
        let answer = self.message(position, &[0, 0x20, 0x40, low, high, subindex, 0, 0, 0, 0]);
        let number = answer[6..].iter().take(4).rev().fold(0, |number: u32, byte| number << 8 | u32::from(*byte));
        if answer[2] == 0x80 { Err(number) } else { Ok(i64::from(number)) }
    }

    /// Expedited download of a number.
    pub(super) fn download(&mut self, at: u16, index: u16, subindex: u8, bytes: &[u8]) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let mut request = vec![0, 0x20, 0x23 | (4 - bytes.len() as u8) << 2, low, high, subindex];
        request.extend(bytes);
        request.resize(10, 0);
        let answer = self.message(at, &request);
        match answer[2] {
            0x60 => Ok(()),
            _ => Err(u32::from_le_bytes(*answer[6..].first_chunk().expect("a code"))),
        }
    }
}

/// Inputs of a drive in the default mapping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inputs {
    pub(super) status: u16,
    pub(super) position: i32,
    pub(super) velocity: i32,
    pub(super) torque: i16,
    pub(super) error: u16,
}

impl Inputs {
    fn new(bytes: &[u8]) -> Self {
        let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let long = |at: usize| (u32::from(word(at)) | u32::from(word(at + 2)) << 16) as i32;
        Inputs { status: word(0), position: long(2), velocity: long(6), torque: word(10) as i16, error: word(12) }
    }

    /// Bits of the state.
    pub(super) fn state(&self) -> u16 {
        self.status & 0x6F
    }
}
