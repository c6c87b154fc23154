//! Blocks: a name, the length, links and data, at addresses that are multiples of eight.

use super::Fault;

/// First bytes of a finished file.
pub(super) const FINISHED: &[u8; 8] = b"MDF     ";
/// First bytes of an unfinished file.
pub(super) const UNFINISHED: &[u8; 8] = b"UnFinMF ";
/// Version of the format and program; files with others are not appended to or recovered.
pub(super) const OURS: &[u8; 16] = b"4.10    stckslip";
/// Place of the flags of an unfinalised file, two bytes.
pub(super) const FLAGS: u64 = 60;
/// Flag "number of cycles not yet counted"; the links are always valid.
pub(super) const UNCOUNTED: u16 = 1;
/// Length of the identification; the header follows.
pub(super) const IDENTIFICATION: u64 = 64;
/// Name, length, number of links.
pub(super) const HEAD: u64 = 24;
/// Length of a header list, before the first data list.
pub(super) const HEADER_LIST: u64 = HEAD + 16;
/// Length of a data list of one block.
pub(super) const DATA_LIST: u64 = HEAD + 32;
/// Place of the offset of its rows in it.
pub(super) const OFFSET: u64 = HEAD + 24;
/// Start of the data in a compressed block.
pub(super) const ZIPPED: u64 = HEAD + 24;
/// Bytes of a row before the values: time and cycle.
pub(super) const ROW_HEAD: usize = 16;
/// Place of the number of cycles in a channel group.
pub(super) const CYCLES: u64 = HEAD + 6 * 8 + 8;

/// Place of link number `index` of the block at `address`.
pub(super) const fn link_place(address: u64, index: u64) -> u64 {
    address + HEAD + 8 * index
}

/// Blocks to be written at an address.
pub(super) struct Blocks {
    start: u64,
    pub(super) bytes: Vec<u8>,
}

impl Blocks {
    /// No blocks yet.
    pub(super) fn at(start: u64) -> Self {
        Blocks { start, bytes: Vec::new() }
    }

    /// Reuses the memory for blocks at another address.
    pub(super) fn restart(&mut self, start: u64) {
        self.start = start;
        self.bytes.clear();
    }

    /// Address of the next block.
    pub(super) fn end(&self) -> u64 {
        self.start + self.bytes.len() as u64
    }

    /// Appends a block, its data in parts; returns its address.
    pub(super) fn push(&mut self, name: &[u8; 2], links: &[u64], data: &[&[u8]]) -> u64 {
        let address = self.end();
        let length = HEAD + 8 * links.len() as u64 + data.iter().map(|part| part.len() as u64).sum::<u64>();
        self.bytes.extend([b'#', b'#', name[0], name[1], 0, 0, 0, 0]);
        self.bytes.extend(length.to_le_bytes());
        self.bytes.extend((links.len() as u64).to_le_bytes());
        self.bytes.extend(links.iter().flat_map(|link| link.to_le_bytes()));
        data.iter().for_each(|part| self.bytes.extend(*part));
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
        address
    }

    /// Appends a text, with `MD` an XML text; returns its address, or 0 (no link) for an empty text.
    pub(super) fn text(&mut self, name: &[u8; 2], text: &str) -> u64 {
        if text.is_empty() {
            return 0;
        }
        // A zero ends a text; up to seven fill the block.
        let text = text.replace('\0', "\u{fffd}");
        let zeros = &[0; 8][text.len() % 8..];
        self.push(name, &[], &[text.as_bytes(), zeros])
    }

    /// Sets a link of one of these blocks.
    pub(super) fn set_link(&mut self, address: u64, index: u64, target: u64) {
        let place = (link_place(address, index) - self.start) as usize;
        self.bytes[place..place + 8].copy_from_slice(&target.to_le_bytes());
    }
}

/// A block in a file.
#[derive(Clone, Copy)]
pub(super) struct Block<'a> {
    pub(super) name: [u8; 2],
    /// Length of the whole block.
    pub(super) length: u64,
    links: &'a [u8],
    pub(super) data: &'a [u8],
}

impl<'a> Block<'a> {
    /// The block at any address of a link.
    pub(super) fn at(file: &'a [u8], address: u64) -> Result<Self, Fault> {
        let block = || {
            let bytes = file.get(usize::try_from(address).ok()?..)?;
            let length = number(bytes, 8).map(u64::from_le_bytes)?;
            let block = bytes.get(..usize::try_from(length).ok()?)?;
            let [b'#', b'#', first, second] = number(block, 0)? else { return None };
            let links = number(block, 16).map(u64::from_le_bytes)?.checked_mul(8)?;
            let (links, data) = block.get(HEAD as usize..)?.split_at_checked(usize::try_from(links).ok()?)?;
            Some(Block { name: [first, second], length, links, data })
        };
        block().ok_or_else(|| {
            let fault = format!("no complete block at address {address} in {} bytes", file.len());
            Fault::new(fault, "The file is cut off or damaged: copy it again.")
        })
    }

    /// The block at an address, of a required name.
    pub(super) fn named(file: &'a [u8], address: u64, name: &[u8; 2]) -> Result<Self, Fault> {
        let block = Self::at(file, address)?;
        let text = |name: &[u8]| String::from_utf8_lossy(name).into_owned();
        (block.name == *name)
            .then_some(block)
            .ok_or_else(|| damaged(&format!("the block at {address} is {}, not {}", text(&block.name), text(name))))
    }

    /// A link; 0 if there is none.
    pub(super) fn link(&self, index: usize) -> u64 {
        number(self.links, 8 * index).map_or(0, u64::from_le_bytes)
    }

    /// Number of links.
    pub(super) fn links(&self) -> usize {
        self.links.len() / 8
    }

    /// The byte at a place of the data.
    pub(super) fn byte(&self, place: usize) -> Result<u8, Fault> {
        self.get(place).map(u8::from_le_bytes)
    }

    /// The number of two bytes at a place of the data.
    pub(super) fn short(&self, place: usize) -> Result<u16, Fault> {
        self.get(place).map(u16::from_le_bytes)
    }

    /// The number of four bytes at a place of the data.
    pub(super) fn word(&self, place: usize) -> Result<u32, Fault> {
        self.get(place).map(u32::from_le_bytes)
    }

    /// The number of eight bytes at a place of the data.
    pub(super) fn long(&self, place: usize) -> Result<u64, Fault> {
        self.get(place).map(u64::from_le_bytes)
    }

    /// The floating-point number at a place of the data.
    pub(super) fn float(&self, place: usize) -> Result<f64, Fault> {
        self.get(place).map(f64::from_le_bytes)
    }

    fn get<const N: usize>(&self, place: usize) -> Result<[u8; N], Fault> {
        number(self.data, place).ok_or_else(|| damaged(&format!("a block of {} bytes is too short", self.length)))
    }
}

/// The fault of an inconsistent file.
pub(super) fn damaged(fault: &str) -> Fault {
    Fault::new(fault, "The file is damaged: copy it again, or export it again.")
}

/// Some bytes at a place, if they exist.
pub(super) fn number<const N: usize>(bytes: &[u8], place: usize) -> Option<[u8; N]> {
    bytes.get(place..)?.first_chunk().copied()
}
