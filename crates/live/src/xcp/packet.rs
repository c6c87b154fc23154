//! Codes and numbers of packets: ASAM MCD-1 XCP, part 2 (protocol layer), little-endian, one byte an address.

/// What the slave answers with, the first byte of each of its packets.
pub mod pid {
    /// A positive response.
    pub const RESPONSE: u8 = 0xff;
    /// An error, its code behind it.
    pub const ERROR: u8 = 0xfe;
    /// An event, its code behind it.
    pub const EVENT: u8 = 0xfd;
    /// A request of a service, its code behind it.
    pub const SERVICE: u8 = 0xfc;
}

/// The slave needs longer for a command than the master may wait.
pub const EVENT_PENDING: u8 = 0x05;
/// Text for people.
pub const SERVICE_TEXT: u8 = 0x01;

/// Why a command is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// What the command processor answers where it is asked to synchronise.
    Synch = 0x00,
    /// The command before it is not done yet.
    Busy = 0x10,
    /// Not while a measurement runs.
    DaqActive = 0x11,
    /// There is no such command here.
    Unknown = 0x20,
    /// The packet is too short for its command.
    Syntax = 0x21,
    /// A number in it cannot be.
    OutOfRange = 0x22,
    /// It can be read alone.
    WriteProtected = 0x23,
    /// There is nothing at this address, or not for this master.
    AccessDenied = 0x24,
    /// No such page.
    PageNotValid = 0x26,
    /// No such mode.
    ModeNotValid = 0x27,
    /// No such segment.
    SegmentNotValid = 0x28,
    /// Not in this order.
    Sequence = 0x29,
    /// A list of measurements that is not whole.
    DaqConfig = 0x2a,
    /// No more memory for lists.
    MemoryOverflow = 0x30,
    /// Anything else; a text says what.
    Generic = 0x31,
    /// Not at this moment.
    NotNow = 0x33,
}

/// A command: numbers at their places.
#[derive(Clone, Copy, Debug)]
pub struct Command<'a>(pub &'a [u8]);

impl<'a> Command<'a> {
    /// The byte at a place.
    pub fn byte(self, at: usize) -> Result<u8, Refusal> {
        self.0.get(at).copied().ok_or(Refusal::Syntax)
    }

    /// 16 bits from a place on.
    pub fn word(self, at: usize) -> Result<u16, Refusal> {
        self.bytes(at, 2).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]))
    }

    /// 32 bits from a place on.
    pub fn long(self, at: usize) -> Result<u32, Refusal> {
        self.bytes(at, 4).map(|bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    /// So many bytes from a place on.
    pub fn bytes(self, at: usize, count: usize) -> Result<&'a [u8], Refusal> {
        let end = at.checked_add(count).ok_or(Refusal::Syntax)?;
        self.0.get(at..end).ok_or(Refusal::Syntax)
    }
}

/// A positive response, written behind each other.
#[derive(Clone, Debug)]
pub struct Response(pub Vec<u8>);

impl Response {
    /// With nothing in it yet.
    pub fn ok() -> Self {
        Response(vec![pid::RESPONSE])
    }

    /// Bytes more.
    pub fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend_from_slice(bytes);
        self
    }

    /// 16 bits more.
    pub fn word(self, word: u16) -> Self {
        self.bytes(&word.to_le_bytes())
    }

    /// 32 bits more.
    pub fn long(self, long: u32) -> Self {
        self.bytes(&long.to_le_bytes())
    }
}
