//! The frames between the software of a bench and a machine in another process.
//!
//! Little endian: mark `SI`, version (u8), kind (u8), sequence number (u64), the kind's numbers (f64 each, in the order
//! of their struct), CRC-32 of all preceding bytes. The frames of a tick have at most 64 bytes. `docs/src/frame.md` has
//! the tables.

use std::fmt;

use flate2::Crc;
use stickslip_core::Fields;
use stickslip_core::fields::{Fields as Numbers, each};
use stickslip_core::tick::Measurement;

use stickslip_software::cycle::Voltages;

/// First bytes of every frame.
pub(crate) const MARK: [u8; 2] = *b"SI";
/// Version of the layout.
pub(crate) const VERSION: u8 = 2;
/// Bytes before the numbers.
pub(crate) const HEAD: usize = 12;
/// Bytes after the numbers.
const TAIL: usize = 4;
/// Maximum length: the size of a slot of the shared memory.
pub(crate) const LONGEST: usize = 120;

/// Start request of the software.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct Begin<T> {
    /// Tick time of the software.
    #[field(symbol = "T_s", unit = "s")]
    pub(crate) tick_time: T,
}

/// Answer of the machine to the start; it is at rest.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct Begun<T> {
    /// Preload of the friction wheel.
    #[field(unit = "1")]
    pub(crate) preload: T,
    /// Readings before the first tick.
    pub(crate) measurement: Measurement<T>,
}

/// Sets the preload.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct Preload<T> {
    /// Preload, 0 … 1.
    #[field(unit = "1")]
    pub(crate) preload: T,
}

/// Refusal of a request: [`Reason`], expected and received value.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct Refusal<T> {
    /// Index of the reason in [`Reason::ALL`].
    #[field(unit = "1")]
    pub(crate) reason: T,
    /// Expected value.
    #[field(unit = "1")]
    pub(crate) due: T,
    /// Received value.
    #[field(unit = "1")]
    pub(crate) came: T,
}

/// Reason of a refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reason {
    /// The frame could not be read.
    FrameError,
    /// The sequence number is not the next.
    Sequence,
    /// The tick times differ.
    TickTime,
    /// The preload is outside its range.
    Preload,
    /// Another bench uses the machine (expected value 1), or none has started (0).
    Stranger,
    /// The machine does not accept this kind of frame.
    Kind,
}

impl Reason {
    /// In the order of their codes.
    pub(crate) const ALL: [Reason; 6] =
        [Reason::FrameError, Reason::Sequence, Reason::TickTime, Reason::Preload, Reason::Stranger, Reason::Kind];

    /// As a message.
    pub(crate) fn message(self, due: f64, came: f64) -> Message {
        let code = Reason::ALL.iter().position(|reason| *reason == self).expect("all are there");
        Message::Refusal(Refusal { reason: code as f64, due, came })
    }
}

impl Refusal<f64> {
    /// Its reason, if known.
    pub(crate) fn reason(&self) -> Option<Reason> {
        Reason::ALL.get(self.reason as usize).copied()
    }
}

impl fmt::Display for Refusal<f64> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Refusal { reason, due, came } = self;
        match self.reason() {
            Some(Reason::FrameError) => write!(f, "a frame arrived damaged"),
            Some(Reason::Sequence) => write!(
                f,
                "frame {came} arrived instead of frame {due}: a frame was {}",
                if came < due { "duplicated or late" } else { "lost" }
            ),
            Some(Reason::TickTime) => {
                write!(
                    f,
                    "its tick time is {due} s, that of this bench is {came} s. Use the same preset and \
                    bench.tick_rate for both"
                )
            }
            Some(Reason::Preload) => write!(f, "the preload {came} is outside 0 … 1"),
            Some(Reason::Stranger) if *due == 0.0 => write!(f, "no bench has started it"),
            Some(Reason::Stranger) => write!(f, "another bench uses it"),
            Some(Reason::Kind) => write!(f, "it does not accept frames of kind {came}"),
            None => write!(f, "unknown reason {reason}"),
        }
    }
}

/// Content of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Message {
    /// To the machine: restart at rest.
    Begin(Begin<f64>),
    /// Its answer.
    Begun(Begun<f64>),
    /// To the machine: one tick with these voltages.
    Voltages(Voltages<f64>),
    /// Its answer: the readings at the tick's end.
    Readings(Measurement<f64>),
    /// To the machine: set the preload.
    Preload(Preload<f64>),
    /// Its answer.
    Pressed(Preload<f64>),
    /// Its answer to a refused request.
    Refusal(Refusal<f64>),
    /// To the machine: end; without answer.
    End,
    /// To the machine: restart at rest, in real time; the answer is that to `Begin`.
    BeginRealTime(Begin<f64>),
}

/// Error of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FrameError {
    /// It does not begin with the mark.
    Mark,
    /// Another version.
    Version(u8),
    /// Its kind is unknown.
    Kind(u8),
    /// Wrong length for its kind.
    Length(usize),
    /// Wrong checksum.
    Checksum,
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FrameError::Mark => write!(f, "it does not begin with SI"),
            FrameError::Version(version) => write!(f, "its version is {version}, expected {VERSION}"),
            FrameError::Kind(kind) => write!(f, "its kind is {kind}"),
            FrameError::Length(length) => write!(f, "its length of {length} bytes does not match its kind"),
            FrameError::Checksum => write!(f, "its checksum is wrong"),
        }
    }
}

/// The bytes of a frame, without allocation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Datagram {
    bytes: [u8; LONGEST],
    length: usize,
}

impl Datagram {
    fn extend<const N: usize>(&mut self, bytes: [u8; N]) {
        self.bytes[self.length..self.length + N].copy_from_slice(&bytes);
        self.length += N;
    }

    /// The numbers of a struct, in the order of its fields.
    fn numbers<N: Numbers<f64>>(&mut self, of: &N) {
        let mut copy = *of;
        each(&mut copy, &mut |number: &mut f64| self.extend(number.to_le_bytes()));
    }
}

impl std::ops::Deref for Datagram {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

impl std::ops::DerefMut for Datagram {
    fn deref_mut(&mut self) -> &mut [u8] {
        &mut self.bytes[..self.length]
    }
}

/// The struct with these numbers; `None` for a different count.
fn from_numbers<N: Numbers<f64> + Default>(mut numbers: impl ExactSizeIterator<Item = f64>) -> Option<N> {
    let (mut value, mut complete) = (N::default(), true);
    each(&mut value, &mut |number| {
        *number = numbers.next().unwrap_or_else(|| {
            complete = false;
            0.0
        });
    });
    (complete && numbers.len() == 0).then_some(value)
}

impl Message {
    /// Its kind.
    pub(crate) fn kind(&self) -> u8 {
        match self {
            Message::Begin(_) => 1,
            Message::Begun(_) => 2,
            Message::Voltages(_) => 3,
            Message::Readings(_) => 4,
            Message::Preload(_) => 5,
            Message::Pressed(_) => 6,
            Message::Refusal(_) => 7,
            Message::End => 8,
            Message::BeginRealTime(_) => 9,
        }
    }

    /// Length of a frame [bytes] by its kind; `None` for an unknown kind.
    pub(crate) fn length(kind: u8) -> Option<usize> {
        let numbers = match kind {
            1 | 5 | 6 | 9 => 1,
            2 => 7,
            3 => 2,
            4 => 6,
            7 => 3,
            8 => 0,
            _ => return None,
        };
        Some(HEAD + 8 * numbers + TAIL)
    }

    /// The frame with this number.
    pub(crate) fn datagram(&self, sequence: u64) -> Datagram {
        let mut frame = Datagram { bytes: [0; LONGEST], length: 0 };
        frame.extend(MARK);
        frame.extend([VERSION, self.kind()]);
        frame.extend(sequence.to_le_bytes());
        match self {
            Message::Begin(begin) | Message::BeginRealTime(begin) => frame.numbers(begin),
            Message::Begun(begun) => frame.numbers(begun),
            Message::Voltages(voltages) => frame.numbers(voltages),
            Message::Readings(readings) => frame.numbers(readings),
            Message::Preload(preload) | Message::Pressed(preload) => frame.numbers(preload),
            Message::Refusal(refusal) => frame.numbers(refusal),
            Message::End => {}
        }
        frame.extend(checksum(&frame).to_le_bytes());
        frame
    }

    /// Number and content of a frame.
    pub(crate) fn read(frame: &[u8]) -> Result<(u64, Message), FrameError> {
        let length = FrameError::Length(frame.len());
        let (bytes, sum) = frame.split_last_chunk::<TAIL>().ok_or(length)?;
        let (head, payload) = bytes.split_first_chunk::<HEAD>().ok_or(length)?;
        let [a, b, version, kind, sequence @ ..] = *head;
        if [a, b] != MARK {
            return Err(FrameError::Mark);
        }
        if version != VERSION {
            return Err(FrameError::Version(version));
        }
        if checksum(bytes) != u32::from_le_bytes(*sum) {
            return Err(FrameError::Checksum);
        }
        let (eights, rest) = payload.as_chunks::<8>();
        if !rest.is_empty() {
            return Err(length);
        }
        let numbers = eights.iter().map(|bytes| f64::from_le_bytes(*bytes));
        let message = match kind {
            1 => from_numbers(numbers).map(Message::Begin),
            2 => from_numbers(numbers).map(Message::Begun),
            3 => from_numbers(numbers).map(Message::Voltages),
            4 => from_numbers(numbers).map(Message::Readings),
            5 => from_numbers(numbers).map(Message::Preload),
            6 => from_numbers(numbers).map(Message::Pressed),
            7 => from_numbers(numbers).map(Message::Refusal),
            8 => (numbers.len() == 0).then_some(Message::End),
            9 => from_numbers(numbers).map(Message::BeginRealTime),
            _ => return Err(FrameError::Kind(kind)),
        };
        Ok((u64::from_le_bytes(sequence), message.ok_or(length)?))
    }
}

/// CRC-32 as of gzip.
fn checksum(bytes: &[u8]) -> u32 {
    let mut crc = Crc::new();
    crc.update(bytes);
    crc.sum()
}

#[cfg(test)]
mod tests;
