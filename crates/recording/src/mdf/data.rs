//! The records of a group: one block, or lists of blocks, compressed or not.

use std::io::Read;

use flate2::read::ZlibDecoder;
use flate2::{Compress, FlushCompress, Status};

use super::Fault;
use super::block::{Block, HEAD, ZIPPED, damaged};

/// Remaining bytes of a file for chains of blocks: in a valid file no byte belongs to two blocks, and no chain is a
/// circle.
pub(super) struct Budget {
    remaining: u64,
}

impl Budget {
    /// All bytes of the file.
    pub(super) fn of(file: &[u8]) -> Self {
        Budget { remaining: file.len() as u64 }
    }

    /// Counts a block of a chain.
    pub(super) fn spend(&mut self, block: Block) -> Result<(), Fault> {
        let remaining = self.remaining.checked_sub(block.length);
        self.remaining = remaining.ok_or_else(|| damaged("its blocks are linked in a circle"))?;
        Ok(())
    }
}

/// The blocks of records behind a link, in their order.
pub(super) struct Records<'a> {
    file: &'a [u8],
    budget: Budget,
    /// Links of the current list, the next one last.
    links: Vec<u64>,
    /// The next element: a list, the head of one, or a single block; 0 at the end.
    next: u64,
}

impl<'a> Records<'a> {
    /// The blocks of this link.
    pub(super) fn behind(file: &'a [u8], link: u64) -> Self {
        Records { file, budget: Budget::of(file), links: Vec::new(), next: link }
    }

    /// Appends the next block's records; returns whether there was one.
    pub(super) fn append_next(&mut self, bytes: &mut Vec<u8>) -> Result<bool, Fault> {
        loop {
            if let Some(link) = self.links.pop() {
                append(Block::at(self.file, link)?, bytes, &mut self.budget)?;
                return Ok(true);
            }
            if self.next == 0 {
                return Ok(false);
            }
            let block = Block::at(self.file, self.next)?;
            match &block.name {
                b"HL" => {
                    self.budget.spend(block)?;
                    self.next = block.link(0);
                }
                b"DL" => {
                    self.budget.spend(block)?;
                    self.links
                        .extend((1..block.links()).rev().map(|index| block.link(index)).filter(|link| *link != 0));
                    self.next = block.link(0);
                }
                _ => self.links.push(std::mem::take(&mut self.next)),
            }
        }
    }
}

fn append(block: Block, bytes: &mut Vec<u8>, budget: &mut Budget) -> Result<(), Fault> {
    budget.spend(block)?;
    match &block.name {
        b"DT" => bytes.extend(block.data),
        b"DZ" => unzip(block, bytes)?,
        name => {
            let fault = format!("unsupported records in blocks of the kind {}", String::from_utf8_lossy(name));
            return Err(Fault::new(fault, "Save it as MDF 4.10, rows sorted: with asammdf, MDF(…).save(…)."));
        }
    }
    Ok(())
}

fn unzip(block: Block, bytes: &mut Vec<u8>) -> Result<(), Fault> {
    let (kind, columns) = (block.byte(2)?, block.word(4)? as usize);
    if kind > 1 {
        let fault = format!("rows with unsupported compression method {kind}");
        return Err(Fault::new(fault, "Save it with deflate: with asammdf, MDF(…).save(…, compression=2)."));
    }
    let zipped = block.data.get((ZIPPED - HEAD) as usize..).unwrap_or_default();
    let plain = inflate(zipped, block.long(16)?, block.long(8)?)?;
    let rows = plain.len().checked_div(columns).unwrap_or(0);
    if kind == 0 || rows == 0 {
        bytes.extend(plain);
        return Ok(());
    }
    // Bytes that do not fill a row follow unchanged.
    let (complete, remainder) = plain.split_at(rows * columns);
    let start = bytes.len();
    bytes.resize(start + complete.len(), 0);
    for (place, column) in complete.chunks_exact(rows).enumerate() {
        let places = bytes[start + place..].iter_mut().step_by(columns);
        places.zip(column).for_each(|(place, byte)| *place = *byte);
    }
    bytes.extend(remainder);
    Ok(())
}

/// Deflate over the transposed rows: all first bytes, all second bytes, …
pub(super) const TRANSPOSED: u8 = 1;

/// Transposes rows of a length to columns.
pub(super) fn transpose(rows: &[u8], length: usize, columns: &mut Vec<u8>) {
    columns.clear();
    for byte in 0..length {
        columns.extend(rows[byte..].iter().step_by(length));
    }
}

/// Compresses into existing memory.
pub(super) fn deflate(deflate: &mut Compress, plain: &[u8], zipped: &mut Vec<u8>) {
    zipped.clear();
    deflate.reset();
    loop {
        // Incompressible data grow by a few bytes per 16 kB.
        zipped.reserve(plain.len() / 1024 + 64);
        let consumed = deflate.total_in() as usize;
        let status = deflate.compress_vec(&plain[consumed..], zipped, FlushCompress::Finish);
        if status.expect("deflate takes all bytes") == Status::StreamEnd {
            return;
        }
    }
}

/// Decompresses the first `length` bytes. The result must have `size` bytes; no more memory is used.
pub(super) fn inflate(bytes: &[u8], length: u64, size: u64) -> Result<Vec<u8>, Fault> {
    let wrong = || damaged("a compressed block has a wrong length or checksum");
    let zipped = usize::try_from(length).ok().and_then(|length| bytes.get(..length)).ok_or_else(wrong)?;
    let mut plain = Vec::new();
    let mut decoder = ZlibDecoder::new(zipped).take(size.saturating_add(1));
    decoder.read_to_end(&mut plain).map_err(|_| wrong())?;
    (plain.len() as u64 == size).then_some(plain).ok_or_else(wrong)
}
