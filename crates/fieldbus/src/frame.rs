//! Ethernet frames of EtherCAT: a header and datagrams, which the devices of a segment change in passing.

/// Type of the Ethernet frames.
pub(crate) const ETHER_TYPE: u16 = 0x88A4;
/// Bytes before the first datagram: Ethernet and EtherCAT header.
const HEAD: usize = 16;
/// Bytes of a datagram before its data.
const DATAGRAM_HEAD: usize = 10;
/// Bytes of the working counter after the data.
const COUNTER: usize = 2;
/// The longest Ethernet frame without checksum [bytes].
pub(crate) const LONGEST: usize = 1514;

/// Command of a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Command {
    /// No access; also an unknown command.
    Nothing,
    /// Access to registers or memory of one device or of all.
    Physical(Target, Access),
    /// Access to process data by logical addresses.
    Logical(Access),
    /// The addressed device is read, all others are written.
    ReadThenWrite(Target),
}

/// Addressed device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// By its position in the segment: each device increments the address; zero is addressed.
    Position,
    /// By its configured address.
    Station,
    /// All.
    All,
}

/// Kind of access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    Read,
    Write,
    ReadWrite,
}

impl Access {
    pub(crate) fn reads(self) -> bool {
        self != Access::Write
    }

    pub(crate) fn writes(self) -> bool {
        self != Access::Read
    }

    /// Increment of the working counter for a successful write.
    pub(crate) fn write_count(self) -> u16 {
        if self == Access::ReadWrite { 2 } else { 1 }
    }
}

impl Command {
    fn new(code: u8) -> Self {
        use Access::{Read, ReadWrite, Write};
        use Target::{All, Position, Station};
        let kind = [Read, Write, ReadWrite];
        match code {
            1..=3 => Command::Physical(Position, kind[usize::from(code - 1)]),
            4..=6 => Command::Physical(Station, kind[usize::from(code - 4)]),
            7..=9 => Command::Physical(All, kind[usize::from(code - 7)]),
            10..=12 => Command::Logical(kind[usize::from(code - 10)]),
            13 => Command::ReadThenWrite(Position),
            14 => Command::ReadThenWrite(Station),
            _ => Command::Nothing,
        }
    }
}

/// A datagram within a frame.
#[derive(Debug)]
pub(crate) struct Datagram<'a> {
    pub(crate) command: Command,
    /// Device address, for physical access.
    pub(crate) device: u16,
    /// Offset in the memory of the device, for physical access.
    pub(crate) offset: u16,
    pub(crate) data: &'a mut [u8],
    /// Working counter: grows with each successful access.
    pub(crate) counter: u16,
}

impl Datagram<'_> {
    /// Logical address: both halves together.
    pub(crate) fn logical(&self) -> u32 {
        u32::from(self.offset) << 16 | u32::from(self.device)
    }
}

/// Visits each datagram of a frame and writes its address and working counter back. Returns the number of datagrams, or
/// `None` if the frame does not contain EtherCAT datagrams. A datagram beyond the end of the frame ends the visit.
pub(crate) fn each_datagram(frame: &mut [u8], mut visit: impl FnMut(&mut Datagram)) -> Option<usize> {
    let head = frame.get(..HEAD)?;
    let header = u16::from_le_bytes([head[14], head[15]]);
    if u16::from_be_bytes([head[12], head[13]]) != ETHER_TYPE || header >> 12 != 1 {
        return None;
    }
    let (mut at, mut count) = (HEAD, 0);
    let end = (HEAD + usize::from(header & 0x7FF)).min(frame.len());
    while let Some(head) = frame.get(at..end).and_then(|rest| rest.first_chunk::<DATAGRAM_HEAD>()).copied() {
        let length = u16::from_le_bytes([head[6], head[7]]);
        let first = at + DATAGRAM_HEAD;
        let last = first + usize::from(length & 0x7FF);
        if last + COUNTER > end {
            break;
        }
        let mut datagram = Datagram {
            command: Command::new(head[0]),
            device: u16::from_le_bytes([head[2], head[3]]),
            offset: u16::from_le_bytes([head[4], head[5]]),
            counter: u16::from_le_bytes([frame[last], frame[last + 1]]),
            data: &mut frame[first..last],
        };
        visit(&mut datagram);
        let (device, counter) = (datagram.device, datagram.counter);
        frame[at + 2..at + 4].copy_from_slice(&device.to_le_bytes());
        frame[last..last + COUNTER].copy_from_slice(&counter.to_le_bytes());
        (at, count) = (last + COUNTER, count + 1);
        if length & 0x8000 == 0 {
            break;
        }
    }
    Some(count)
}

/// Whether a datagram of a frame has process data.
pub(crate) fn has_process_data(frame: &mut [u8]) -> bool {
    let mut found = false;
    each_datagram(frame, |datagram| found |= matches!(datagram.command, Command::Logical(_)));
    found
}
