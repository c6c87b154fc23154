//! The datagrams between the software of a bench and a machine in another process.
//!
//! Little endian: mark `SSIO`, version (u16), kind (u16), sequence number (u64), the kind's numbers (f64 each, in the
//! order of their struct), CRC-32 of all before. `docs/src/frame.md` has the tables.

use std::fmt;

use flate2::Crc;
use stickslip_core::Fields;
use stickslip_core::fields::Fields as Numbers;
use stickslip_core::tick::Measurement;

use stickslip_core::cycle::Voltages;

/// First bytes of every datagram.
pub(crate) const MARK: [u8; 4] = *b"SSIO";
/// Version of the layout.
pub(crate) const VERSION: u16 = 1;
/// Bytes before the numbers.
pub(crate) const HEAD: usize = 16;
/// Bytes behind them.
const TAIL: usize = 4;
/// Longer than any datagram.
pub(crate) const LONGEST: usize = 512;

/// What the software says at the begin.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct Begin<T> {
    /// Time of its tick.
    #[field(symbol = "T_s", unit = "s")]
    pub(crate) tick_time: T,
}

/// What the machine answers: it is at rest.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct Begun<T> {
    /// How far the linings are pressed on.
    #[field(unit = "1")]
    pub(crate) preload: T,
    /// Readings before the first tick.
    pub(crate) measurement: Measurement<T>,
}

/// Presses the linings on.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct Preload<T> {
    /// How far, 0 … 1.
    #[field(unit = "1")]
    pub(crate) preload: T,
}

/// Why a request was not done: as [`Reason`] says, with what was due and what came.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct Refusal<T> {
    /// The place of the reason in [`Reason::ALL`].
    #[field(unit = "1")]
    pub(crate) reason: T,
    /// What was due.
    #[field(unit = "1")]
    pub(crate) due: T,
    /// What came.
    #[field(unit = "1")]
    pub(crate) came: T,
}

/// Why a machine refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reason {
    /// The datagram could not be read.
    Garbled,
    /// The sequence number is not the next.
    Sequence,
    /// The tick is not the machine's.
    TickTime,
    /// Linings cannot be pressed on so far.
    Preload,
    /// Another bench has the machine, or none has begun.
    Stranger,
    /// A machine does not take this kind.
    Kind,
}

impl Reason {
    /// In the order of their codes.
    pub(crate) const ALL: [Reason; 6] =
        [Reason::Garbled, Reason::Sequence, Reason::TickTime, Reason::Preload, Reason::Stranger, Reason::Kind];

    /// As a message.
    pub(crate) fn message(self, due: f64, came: f64) -> Message {
        let code = Reason::ALL.iter().position(|reason| *reason == self).expect("all are there");
        Message::Refusal(Refusal { reason: code as f64, due, came })
    }
}

impl fmt::Display for Refusal<f64> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Refusal { reason, due, came } = self;
        match Reason::ALL.get(*reason as usize) {
            Some(Reason::Garbled) => write!(f, "a datagram reached it garbled"),
            Some(Reason::Sequence) => write!(
                f,
                "datagram {came} reached it where {due} was due: one was {}",
                if came < due { "doubled or late" } else { "lost" }
            ),
            Some(Reason::TickTime) => {
                write!(f, "its tick is {due} s, this bench's {came} s. Give both the same preset and bench.tick_rate")
            }
            Some(Reason::Preload) => write!(f, "linings cannot be pressed on by {came}, 0 … 1 can be"),
            Some(Reason::Stranger) => write!(f, "another bench has begun with it"),
            Some(Reason::Kind) => write!(f, "it does not take datagrams of kind {came}"),
            None => write!(f, "for a reason of number {reason}, which is unknown here"),
        }
    }
}

/// What a datagram says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Message {
    /// To the machine: start afresh, at rest.
    Begin(Begin<f64>),
    /// Its answer.
    Begun(Begun<f64>),
    /// To the machine: one tick under these voltages.
    Voltages(Voltages<f64>),
    /// Its answer: the readings at the tick's end.
    Readings(Measurement<f64>),
    /// To the machine: press the linings on.
    Preload(Preload<f64>),
    /// Its answer.
    Pressed(Preload<f64>),
    /// Its answer to what it does not do.
    Refusal(Refusal<f64>),
    /// To the machine: no more; it does not answer.
    End,
}

/// Why a datagram cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Garbled {
    /// It does not begin with the mark.
    Mark,
    /// It is of another version.
    Version(u16),
    /// Its kind is unknown.
    Kind(u16),
    /// It has not the length of its kind.
    Length(usize),
    /// Its bytes are not those that were sent.
    Checksum,
}

impl fmt::Display for Garbled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Garbled::Mark => write!(f, "it does not begin with SSIO"),
            Garbled::Version(version) => write!(f, "its version is {version}, here it is {VERSION}"),
            Garbled::Kind(kind) => write!(f, "its kind is {kind}"),
            Garbled::Length(length) => write!(f, "its length of {length} bytes is not that of its kind"),
            Garbled::Checksum => write!(f, "its checksum is wrong"),
        }
    }
}

/// The numbers of a struct, in the order of its fields.
fn numbers<N: Numbers<f64>>(of: &N) -> Vec<f64> {
    let mut numbers = Vec::new();
    of.map(&mut |number: f64| {
        numbers.push(number);
        number
    });
    numbers
}

/// The struct of these numbers; `None` where there are more or fewer.
fn made_of<N: Numbers<f64> + Default>(mut numbers: impl ExactSizeIterator<Item = f64>) -> Option<N> {
    let (blank, mut enough) = (N::default(), true);
    let made = blank.merge(&blank, &mut |_, _| {
        numbers.next().unwrap_or_else(|| {
            enough = false;
            0.0
        })
    });
    (enough && numbers.len() == 0).then_some(made)
}

impl Message {
    /// Its kind.
    pub(crate) fn kind(&self) -> u16 {
        match self {
            Message::Begin(_) => 1,
            Message::Begun(_) => 2,
            Message::Voltages(_) => 3,
            Message::Readings(_) => 4,
            Message::Preload(_) => 5,
            Message::Pressed(_) => 6,
            Message::Refusal(_) => 7,
            Message::End => 8,
        }
    }

    fn numbers(&self) -> Vec<f64> {
        match self {
            Message::Begin(begin) => numbers(begin),
            Message::Begun(begun) => numbers(begun),
            Message::Voltages(voltages) => numbers(voltages),
            Message::Readings(readings) => numbers(readings),
            Message::Preload(preload) | Message::Pressed(preload) => numbers(preload),
            Message::Refusal(refusal) => numbers(refusal),
            Message::End => Vec::new(),
        }
    }

    /// The datagram with this number.
    pub(crate) fn datagram(&self, sequence: u64) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(LONGEST);
        bytes.extend(MARK);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(self.kind().to_le_bytes());
        bytes.extend(sequence.to_le_bytes());
        bytes.extend(self.numbers().iter().flat_map(|number| number.to_le_bytes()));
        let sum = checksum(&bytes);
        bytes.extend(sum.to_le_bytes());
        bytes
    }

    /// Number and content of a datagram.
    pub(crate) fn read(datagram: &[u8]) -> Result<(u64, Message), Garbled> {
        let length = Garbled::Length(datagram.len());
        let (bytes, sum) = datagram.split_last_chunk::<TAIL>().ok_or(length)?;
        let (head, payload) = bytes.split_first_chunk::<HEAD>().ok_or(length)?;
        let [a, b, c, d, version, version_high, kind, kind_high, sequence @ ..] = *head;
        if [a, b, c, d] != MARK {
            return Err(Garbled::Mark);
        }
        let version = u16::from_le_bytes([version, version_high]);
        if version != VERSION {
            return Err(Garbled::Version(version));
        }
        if checksum(bytes) != u32::from_le_bytes(*sum) {
            return Err(Garbled::Checksum);
        }
        let (eights, rest) = payload.as_chunks::<8>();
        if !rest.is_empty() {
            return Err(length);
        }
        let numbers = eights.iter().map(|bytes| f64::from_le_bytes(*bytes));
        let kind = u16::from_le_bytes([kind, kind_high]);
        let message = match kind {
            1 => made_of(numbers).map(Message::Begin),
            2 => made_of(numbers).map(Message::Begun),
            3 => made_of(numbers).map(Message::Voltages),
            4 => made_of(numbers).map(Message::Readings),
            5 => made_of(numbers).map(Message::Preload),
            6 => made_of(numbers).map(Message::Pressed),
            7 => made_of(numbers).map(Message::Refusal),
            8 => (numbers.len() == 0).then_some(Message::End),
            _ => return Err(Garbled::Kind(kind)),
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
mod tests {
    use super::*;

    fn readings() -> Measurement<f64> {
        let mut next = 0.0;
        made_of((0..6).map(|_| {
            next += 0.1;
            next
        }))
        .unwrap()
    }

    fn all() -> Vec<Message> {
        let preload = Preload { preload: 0.3 };
        vec![
            Message::Begin(Begin { tick_time: 250e-6 }),
            Message::Begun(Begun { preload: 1.0, measurement: readings() }),
            Message::Voltages(Voltages { servo_voltage: 0.1 + 0.2, amplifier_voltage: -0.0 }),
            Message::Readings(readings()),
            Message::Preload(preload),
            Message::Pressed(preload),
            Reason::TickTime.message(1.0, 2.0),
            Message::End,
        ]
    }

    #[test]
    fn every_message_comes_back_to_its_bits() {
        for (k, message) in all().into_iter().enumerate() {
            let datagram = message.datagram(u64::MAX - k as u64);
            let (sequence, back) = Message::read(&datagram).unwrap();
            assert_eq!((sequence, back.kind(), back), (u64::MAX - k as u64, k as u16 + 1, message));
            assert_eq!(back.datagram(sequence), datagram);
        }
    }

    #[test]
    fn every_flipped_bit_and_every_other_length_is_found() {
        for message in all() {
            let datagram = message.datagram(7);
            for bit in 0..8 * datagram.len() {
                let mut flipped = datagram.clone();
                flipped[bit / 8] ^= 1 << (bit % 8);
                assert!(Message::read(&flipped).is_err(), "{message:?}: bit {bit}");
            }
            for length in 0..datagram.len() {
                assert!(Message::read(&datagram[..length]).is_err(), "{message:?}: {length} bytes");
            }
        }
    }

    /// A datagram whose checksum is right and whose content is not.
    fn sealed(change: impl FnOnce(&mut Vec<u8>)) -> Result<(u64, Message), Garbled> {
        let mut bytes = Message::Voltages(Voltages::default()).datagram(1);
        bytes.truncate(bytes.len() - TAIL);
        change(&mut bytes);
        let sum = checksum(&bytes);
        bytes.extend(sum.to_le_bytes());
        Message::read(&bytes)
    }

    #[test]
    fn what_is_sealed_but_none_of_ours_is_named() {
        assert!(sealed(|_| ()).is_ok());
        assert_eq!(sealed(|bytes| bytes[0] = b'X'), Err(Garbled::Mark));
        assert_eq!(sealed(|bytes| bytes[4] = 2), Err(Garbled::Version(2)));
        assert_eq!(sealed(|bytes| bytes[6] = 99), Err(Garbled::Kind(99)));
        assert_eq!(sealed(|bytes| bytes.extend([0; 8])), Err(Garbled::Length(44)));
        assert_eq!(sealed(|bytes| bytes.extend([0; 3])), Err(Garbled::Length(39)));
        assert_eq!(sealed(|bytes| bytes.truncate(HEAD)), Err(Garbled::Length(20)));
    }

    #[test]
    fn the_guide_has_the_layout() {
        let page = include_str!("../../../../../docs/src/frame.md");
        let names = |shape: stickslip_core::fields::Shape| match shape {
            stickslip_core::fields::Shape::Group(fields) => fields.iter().map(|field| field.name).collect::<Vec<_>>(),
            _ => Vec::new(),
        };
        let rows = |kind: u16, names: Vec<&str>| {
            for (k, name) in names.into_iter().enumerate() {
                let row = format!("| {kind} | {} | f64 | `{name}` |", HEAD + 8 * k);
                assert!(page.contains(&row), "docs/src/frame.md lacks {row}");
            }
        };
        rows(1, names(<Begin<f64> as Numbers<f64>>::SHAPE));
        let measurement = || names(<Measurement<f64> as Numbers<f64>>::SHAPE);
        rows(2, ["preload"].into_iter().chain(measurement()).collect());
        rows(3, names(<Voltages<f64> as Numbers<f64>>::SHAPE));
        rows(4, measurement());
        rows(5, names(<Preload<f64> as Numbers<f64>>::SHAPE));
        rows(7, names(<Refusal<f64> as Numbers<f64>>::SHAPE));
        for message in all() {
            let length = message.datagram(0).len();
            let row = format!("| {} | {length} |", message.kind());
            assert!(page.contains(&row), "docs/src/frame.md lacks {row}");
        }
    }
}
