//! Recovery of the file of an interrupted writer.

use std::fs::File;
use std::io::{self, BufReader, Cursor, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;

use flate2::read::ZlibDecoder;

use super::block::{
    CYCLES, DATA_LIST, FINISHED, FLAGS, HEAD, IDENTIFICATION, OFFSET, OURS, ZIPPED, damaged, link_place, number,
};
use super::data::TRANSPOSED;
use super::writer::{Storage, lock};
use super::{Fault, Summary};
use stickslip_base::Error;

/// Completes the file of an interrupted [`Writer`](super::Writer) in place; a finished file is not changed.
///
/// All written rows, events and attachments are recovered; those of the last 0.1 s before a crash, or since the last
/// flush, may be missing. A block of rows with a wrong checksum is omitted, as the channel `cycle` shows. Only links
/// and counters are changed, no byte is removed. An interrupted recovery can be repeated.
///
/// # Errors
/// A file that cannot be written, is not a recording of this program, is being recorded, or ends before its rows.
pub fn recover(path: &Path) -> Result<Summary, Error> {
    let failed = |source| Error::file(path, "recover", source);
    let mut file = File::options().read(true).write(true).open(path).map_err(failed)?;
    lock(path, &file)?;
    let bytes = file.metadata().map_err(failed)?.len();
    let repair = scan(&mut BufReader::new(&file), bytes).map_err(failed)?;
    let repair = repair.map_err(|fault| fault.of(path))?;
    repair.apply(&mut file, bytes).map_err(failed)?;
    Ok(Summary { rows: repair.rows, bytes, discarded: repair.discarded })
}

/// Recovers the contents of a file in memory.
pub(super) fn repaired(bytes: &[u8]) -> Result<Vec<u8>, Fault> {
    let unread = |error: io::Error| damaged(&error.to_string());
    let length = bytes.len() as u64;
    let repair = scan(&mut Cursor::new(bytes), length).map_err(unread)??;
    let mut file = Cursor::new(bytes.to_vec());
    repair.apply(&mut file, length).map_err(unread)?;
    Ok(file.into_inner())
}

impl Storage for Cursor<Vec<u8>> {
    fn settle(&mut self, length: u64) -> io::Result<()> {
        self.get_mut().resize(length as usize, 0);
        Ok(())
    }
}

/// The repair of a file.
struct Repair {
    /// Eight bytes each, with their places.
    patches: Vec<(u64, u64)>,
    rows: u64,
    /// Bytes of incomplete blocks.
    discarded: u64,
}

impl Repair {
    fn apply(&self, file: &mut impl Storage, length: u64) -> io::Result<()> {
        for (place, value) in &self.patches {
            put(file, *place, &value.to_le_bytes())?;
        }
        file.settle(length)?;
        put(file, FLAGS, &[0; 2])?;
        put(file, 0, FINISHED)?;
        file.settle(length)
    }
}

fn put(file: &mut (impl Write + Seek), place: u64, bytes: &[u8]) -> io::Result<()> {
    file.seek(SeekFrom::Start(place))?;
    file.write_all(bytes)
}

/// A chain of blocks, from the place of the link to its first.
struct Chain {
    place: u64,
    patches: Vec<(u64, u64)>,
}

impl Chain {
    fn at(place: u64) -> Self {
        Chain { place, patches: Vec::new() }
    }

    fn push(&mut self, block: u64) {
        self.patches.push((self.place, block));
        self.place = link_place(block, 0);
    }

    /// Ends the chain: the last block has no next.
    fn end(mut self) -> Vec<(u64, u64)> {
        self.patches.push((self.place, 0));
        self.patches
    }
}

/// Reads the blocks in the order of writing, up to the first incomplete one, and ignores links that were set later.
fn scan(file: &mut (impl Read + Seek), length: u64) -> io::Result<Result<Repair, Fault>> {
    let Some(identification) = read::<{ IDENTIFICATION as usize }>(file, 0, length)? else {
        return Ok(Err(damaged("the file ends within its first block")));
    };
    if identification[8..24] != *OURS {
        let fault = "unfinished file of another program";
        return Ok(Err(Fault::new(fault, "Open it with that program, or with asammdf, and save it again.")));
    }
    let mut group = None;
    let (mut data, mut list) = (None, None);
    let mut events = Chain::at(link_place(IDENTIFICATION, 4));
    let mut attachments = Chain::at(link_place(IDENTIFICATION, 3));
    let mut offsets = Vec::new();
    let (mut row, mut recovered, mut lost, mut damaged_bytes) = (0, 0, 0, 0);
    let mut end = 0;
    let mut at = IDENTIFICATION;
    while let Some(block) = head(file, at, length)? {
        // A data list and its data count as one block.
        let mut whole = block.length;
        match &block.name {
            b"HD" | b"FH" | b"MD" | b"TX" | b"CN" => {}
            b"HL" => list = Some(at),
            b"CG" => {
                group = Some(at);
                row = read::<4>(file, at + CYCLES + 16, length)?.map_or(0, u32::from_le_bytes).into();
            }
            b"DG" => data = Some(Chain::at(link_place(at, 2))),
            b"EV" => events.push(at),
            b"AT" => attachments.push(at),
            b"DL" => {
                let (Some(data), Some(rows)) = (&mut data, rows(file, at, length, row, recovered + lost)?) else {
                    break;
                };
                whole = DATA_LIST + rows.length;
                if rows.sound {
                    list.take().into_iter().for_each(|list| data.push(list));
                    data.push(at);
                    offsets.push((at + OFFSET, recovered));
                    recovered += rows.plain;
                } else {
                    lost += rows.plain;
                    damaged_bytes += whole;
                }
            }
            _ => break,
        }
        at = at.saturating_add(whole).next_multiple_of(8);
        if !matches!(&block.name, b"TX" | b"HL") {
            end = at;
        }
    }
    let (Some(group), Some(data)) = (group, data) else {
        let fault = format!("the file ends after {length} bytes, before the first row");
        return Ok(Err(Fault::new(fault, "It has no data: delete it.")));
    };
    let rows = recovered / row.max(1);
    let mut patches = [data.end(), events.end(), attachments.end(), offsets].concat();
    patches.push((group + CYCLES, rows));
    Ok(Ok(Repair { patches, rows, discarded: damaged_bytes + length.saturating_sub(end) }))
}

struct Head {
    name: [u8; 2],
    length: u64,
}

/// Name and length of the block at an address; `None` if it is incomplete.
fn head(file: &mut (impl Read + Seek), at: u64, end: u64) -> io::Result<Option<Head>> {
    let Some(bytes) = read::<{ HEAD as usize }>(file, at, end)? else { return Ok(None) };
    let [length, links] = [8, 16].map(|place| number(&bytes, place).map_or(0, u64::from_le_bytes));
    let least = links.saturating_mul(8).saturating_add(HEAD);
    let whole = bytes.starts_with(b"##") && length >= least && at.checked_add(length).is_some_and(|stop| stop <= end);
    Ok(whole.then_some(Head { name: [bytes[2], bytes[3]], length }))
}

/// A block of rows.
struct Rows {
    /// Bytes of the rows.
    plain: u64,
    /// Length of the block.
    length: u64,
    /// Whether the checksum is correct.
    sound: bool,
}

/// The rows of a data list; `None` unless they were written there, after `before` bytes of others.
fn rows(file: &mut (impl Read + Seek), list: u64, end: u64, row: u64, before: u64) -> io::Result<Option<Rows>> {
    let at = list + DATA_LIST;
    let Some(links) = read::<{ DATA_LIST as usize }>(file, list, end)? else { return Ok(None) };
    let Some(block) = head(file, at, end)? else { return Ok(None) };
    let Some(sizes) = read::<{ ZIPPED as usize }>(file, at, end)? else { return Ok(None) };
    let long = |bytes: &[u8], place: u64| number(bytes, place as usize).map_or(0, u64::from_le_bytes);
    let [plain, zipped] = [HEAD + 8, HEAD + 16].map(|place| long(&sizes, place));
    let is_next = long(&links, link_place(0, 1)) == at && long(&links, OFFSET) == before;
    // All bytes that describe the rows: the checksum covers only the rows.
    let kind = [b'D', b'T', TRANSPOSED, 0].into_iter().chain((row as u32).to_le_bytes());
    let is_ours = block.name == *b"DZ" && kind.eq(sizes[HEAD as usize..][..8].iter().copied());
    let is_whole = row > 0 && plain > 0 && plain % row == 0 && zipped.checked_add(ZIPPED) == Some(block.length);
    if !(is_next && is_ours && is_whole) {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(at + ZIPPED))?;
    // Up to the end, where the checksum is.
    let mut unzipped = ZlibDecoder::new(file.take(zipped)).take(plain.saturating_add(1));
    let sound = match io::copy(&mut unzipped, &mut io::sink()) {
        Ok(length) => length == plain,
        // An invalid deflate stream. A read error of the disk is another error, which must not discard rows.
        Err(error) => match error.kind() {
            ErrorKind::InvalidInput | ErrorKind::InvalidData | ErrorKind::UnexpectedEof => false,
            _ => return Err(error),
        },
    };
    Ok(Some(Rows { plain, length: block.length, sound }))
}

/// Bytes at a place; `None` if the file ends before.
fn read<const N: usize>(file: &mut (impl Read + Seek), at: u64, end: u64) -> io::Result<Option<[u8; N]>> {
    if at.checked_add(N as u64).is_none_or(|stop| stop > end) {
        return Ok(None);
    }
    let mut bytes = [0; N];
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(&mut bytes)?;
    Ok(Some(bytes))
}
