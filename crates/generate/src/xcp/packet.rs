//! Codes and numbers of packets: ASAM MCD-1 XCP, part 2 (protocol layer), little-endian, one byte an address.

/// First byte of each packet of the slave.
pub mod pid {
    /// A positive response.
    pub const RESPONSE: u8 = 0xff;
    /// An error, followed by its code.
    pub const ERROR: u8 = 0xfe;
    /// An event, followed by its code.
    pub const EVENT: u8 = 0xfd;
    /// A service request, followed by its code.
    pub const SERVICE: u8 = 0xfc;
}

/// The slave needs more time for a command.
pub const EVENT_PENDING: u8 = 0x05;
/// Text for the user.
pub const SERVICE_TEXT: u8 = 0x01;

/// Why a command is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Response to a synchronisation of the command processor.
    Synch = 0x00,
    /// The previous command is not complete yet.
    Busy = 0x10,
    /// Not while a measurement runs.
    DaqActive = 0x11,
    /// Unknown command.
    Unknown = 0x20,
    /// The packet is too short for its command.
    Syntax = 0x21,
    /// A number is outside of its range.
    OutOfRange = 0x22,
    /// Read-only.
    WriteProtected = 0x23,
    /// Unknown address, or not accessible by this master.
    AccessDenied = 0x24,
    /// Unknown page.
    PageNotValid = 0x26,
    /// Unknown mode.
    ModeNotValid = 0x27,
    /// Unknown segment.
    SegmentNotValid = 0x28,
    /// Wrong sequence of commands.
    Sequence = 0x29,
    /// Incomplete list of measurements.
    DaqConfig = 0x2a,
    /// No more memory for lists.
    MemoryOverflow = 0x30,
    /// Any other error, described by a text.
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

    /// `count` bytes from a place on.
    pub fn bytes(self, at: usize, count: usize) -> Result<&'a [u8], Refusal> {
        let end = at.checked_add(count).ok_or(Refusal::Syntax)?;
        self.0.get(at..end).ok_or(Refusal::Syntax)
    }
}

/// A positive response, written part by part.
#[derive(Clone, Debug)]
pub struct Response(pub Vec<u8>);

impl Response {
    /// An empty response.
    pub fn ok() -> Self {
        Response(vec![pid::RESPONSE])
    }

    /// Appends bytes.
    pub fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend_from_slice(bytes);
        self
    }

    /// Appends 16 bits.
    pub fn word(self, word: u16) -> Self {
        self.bytes(&word.to_le_bytes())
    }

    /// Appends 32 bits.
    pub fn long(self, long: u32) -> Self {
        self.bytes(&long.to_le_bytes())
    }
}
