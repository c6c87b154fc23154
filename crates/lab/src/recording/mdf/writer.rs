//! Writing while a bench runs.

use std::fs::{File, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use flate2::{Compress, Compression, FlushCompress, Status};

use super::block::{
    Blocks, CYCLES, DATA_LIST, FINISHED, FLAGS, HEADER_LIST, IDENTIFICATION, OURS, ROW_HEAD, UNCOUNTED, UNFINISHED,
    link_place,
};
use super::{Channel, Event, Header, Summary, unreadable};
use crate::Error;
use crate::figure::symbol::escape;

/// No block holds rows of a longer time [s]: what a crash can take.
const BLOCK_TIME: f64 = 0.1;
/// Nor more bytes of rows, before they are compressed; others read blocks up to 4 MB.
const BLOCK_SIZE: usize = 1 << 20;

/// A recording that grows.
///
/// Rows are collected, and written as one compressed block when they span 0.1 s, when they fill a megabyte, or on
/// [`flush`](Self::flush); call that each 100 ms of your clock where the stream may pause. No call needs memory that
/// grows with the recording. If the disk is full, calls fail and change nothing: make room and go on. A row that was
/// refused is missing; the channel `cycle` shows it.
pub struct Writer {
    path: PathBuf,
    file: Box<dyn Storage>,
    tick_time: f64,
    /// Values a row.
    width: usize,
    /// Rows not yet written, and in which cycle they begin.
    rows: Vec<u8>,
    first: u64,
    last: Option<u64>,
    /// Bytes of the rows written.
    written: u64,
    /// Where the next block goes.
    end: u64,
    group: u64,
    /// Places of the links that the next data, event and attachment go to.
    next_data: u64,
    next_event: u64,
    next_attachment: u64,
    deflate: Compress,
    transposed: Vec<u8>,
    zipped: Vec<u8>,
    blocks: Blocks,
}

/// A file, or what stands for it in a test.
pub(super) trait Storage: Write + Seek + Send {
    /// Ends it at a length and brings it to the disk.
    fn settle(&mut self, length: u64) -> io::Result<()>;
}

impl Storage for File {
    fn settle(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)?;
        self.sync_all()
    }
}

impl Writer {
    /// Begins a recording of rows that are multiples of `tick_time` [s] apart; a file that is there is replaced.
    ///
    /// # Errors
    /// Two channels of one name, or one called `time` or `cycle`; a file that cannot be written, or that another
    /// process is writing.
    pub fn create(path: &Path, header: &Header, channels: &[Channel], tick_time: f64) -> Result<Self, Error> {
        let failed = |source| Error::file(path, "create", source);
        let file = File::options().write(true).create(true).truncate(false).open(path).map_err(failed)?;
        lock(path, &file)?;
        if file.metadata().map_err(failed)?.is_file() {
            file.set_len(0).map_err(failed)?;
        }
        Self::on(path, Box::new(file), header, channels, tick_time)
    }

    /// The same on any storage; `path` stands in messages.
    pub(super) fn on(
        path: &Path,
        file: Box<dyn Storage>,
        header: &Header,
        channels: &[Channel],
        tick_time: f64,
    ) -> Result<Self, Error> {
        let mut names: Vec<_> = channels.iter().map(|channel| channel.name.as_str()).chain(["time", "cycle"]).collect();
        names.sort_unstable();
        if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            let fault = format!("there would be two channels `{}`", twice[0]);
            return Err(unreadable(path, &fault, "Rename one; `time` and `cycle` are always there."));
        }
        let (head, group, data) = head(header, channels);
        let mut writer = Writer {
            path: path.to_owned(),
            file,
            tick_time,
            width: channels.len(),
            rows: Vec::new(),
            first: 0,
            last: None,
            written: 0,
            end: 0,
            group,
            next_data: data,
            next_event: link_place(IDENTIFICATION, 4),
            next_attachment: link_place(IDENTIFICATION, 3),
            deflate: Compress::new(Compression::fast(), true),
            transposed: Vec::new(),
            zipped: Vec::new(),
            blocks: Blocks::at(0),
        };
        writer.put(0, &head.bytes)?;
        writer.end = head.end();
        Ok(writer)
    }

    /// Takes one row: all channels in a cycle.
    ///
    /// # Errors
    /// A cycle that does not come after the last one; a block that cannot be written. The row is then not taken.
    ///
    /// # Panics
    /// If there are not as many values as channels.
    pub fn row(&mut self, cycle: u64, values: &[f64]) -> Result<(), Error> {
        assert_eq!(values.len(), self.width, "one value a channel");
        if let Some(last) = self.last.filter(|last| cycle <= *last) {
            let fault = format!("cycle {cycle} was to be recorded behind cycle {last}");
            return Err(unreadable(&self.path, &fault, "Record each cycle once, in their order."));
        }
        let row = self.row_length();
        let spanned = (cycle - self.first) as f64 * self.tick_time >= BLOCK_TIME;
        if !self.rows.is_empty() && (spanned || self.rows.len() + row > BLOCK_SIZE) {
            self.flush()?;
        }
        if self.rows.is_empty() {
            self.first = cycle;
        }
        self.rows.extend((cycle as f64 * self.tick_time).to_le_bytes());
        self.rows.extend(cycle.to_le_bytes());
        self.rows.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self.last = Some(cycle);
        Ok(())
    }

    /// Writes the rows taken so far. Once it has returned, the end of this process takes none of them.
    ///
    /// # Errors
    /// [`Error::File`]; the rows are kept, and written when there is room.
    pub fn flush(&mut self) -> Result<(), Error> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let row = self.row_length();
        transpose(&self.rows, row, &mut self.transposed);
        deflate(&mut self.deflate, &self.transposed, &mut self.zipped);
        self.blocks.restart(self.end);
        // The first data list stands behind the list's head.
        let first = self.written == 0;
        if first {
            let list = self.end + HEADER_LIST;
            self.blocks.push(b"HL", &[list], &[&0u16.to_le_bytes(), &[TRANSPOSED, 0, 0, 0, 0, 0]]);
        }
        let list = self.blocks.end();
        let (count, offset) = (1u32.to_le_bytes(), self.written.to_le_bytes());
        self.blocks.push(b"DL", &[0, list + DATA_LIST], &[&[0; 4], &count, &offset]);
        let [parameter, plain, zipped] = [row, self.rows.len(), self.zipped.len()].map(|n| (n as u64).to_le_bytes());
        let sizes = [&b"DT"[..], &[TRANSPOSED, 0], &parameter[..4], &plain, &zipped, &self.zipped];
        self.blocks.push(b"DZ", &[], &sizes);
        let target = if first { self.end } else { list };
        self.append(self.next_data, target)?;
        self.next_data = link_place(list, 0);
        self.written += self.rows.len() as u64;
        self.rows.clear();
        Ok(())
    }

    /// Writes an event at once. Its cycle need not be recorded.
    ///
    /// # Errors
    /// [`Error::File`]; the event is then not recorded.
    pub fn event(&mut self, event: &Event) -> Result<(), Error> {
        const MARKER: u8 = 6;
        const AT_A_TIME: u8 = 1;
        const POINT: u8 = 0;
        self.blocks.restart(self.end);
        let name = self.blocks.text(b"TX", &event.name);
        let comment = self.blocks.text(b"TX", &event.comment);
        let kind = [MARKER, AT_A_TIME, POINT, event.cause as u8, 0, 0, 0, 0];
        // Time is base by factor: cycle and time in one, and the bits of the channel `time`.
        let time = [event.cycle.to_le_bytes(), self.tick_time.to_le_bytes()].concat();
        let target = self.blocks.push(b"EV", &[0, 0, 0, name, comment], &[&kind, &[0; 8], &time]);
        self.append(self.next_event, target)?;
        self.next_event = link_place(target, 0);
        Ok(())
    }

    /// Writes a file of the given name and media type into the recording, compressed.
    ///
    /// # Errors
    /// [`Error::File`]; it is then not attached.
    pub fn attach(&mut self, name: &str, mime: &str, bytes: &[u8]) -> Result<(), Error> {
        const EMBEDDED_AND_COMPRESSED: u16 = 3;
        self.blocks.restart(self.end);
        let (name, mime) = (self.blocks.text(b"TX", name), self.blocks.text(b"TX", mime));
        deflate(&mut self.deflate, bytes, &mut self.zipped);
        let flags = [EMBEDDED_AND_COMPRESSED.to_le_bytes(), [0; 2], [0; 2], [0; 2]].concat();
        let sizes = [bytes.len(), self.zipped.len()].map(|n| (n as u64).to_le_bytes()).concat();
        let data: [&[u8]; 4] = [&flags, &[0; 16], &sizes, &self.zipped];
        let target = self.blocks.push(b"AT", &[0, name, mime, 0], &data);
        self.append(self.next_attachment, target)?;
        self.next_attachment = link_place(target, 0);
        Ok(())
    }

    /// Writes what is left, marks the file as complete and brings it to the disk.
    ///
    /// # Errors
    /// [`Error::File`]; what was written before can be [recovered](super::recover).
    pub fn finish(mut self) -> Result<Summary, Error> {
        self.flush()?;
        let rows = self.written / self.row_length() as u64;
        self.put(self.group + CYCLES, &rows.to_le_bytes())?;
        self.settle()?;
        // Complete is what has both: no flag, and the name in its first bytes.
        self.put(FLAGS, &[0; 2])?;
        self.put(0, FINISHED)?;
        self.settle()?;
        Ok(Summary { rows, bytes: self.end, discarded: 0 })
    }

    fn row_length(&self) -> usize {
        ROW_HEAD + 8 * self.width
    }

    /// Writes the blocks, then the link to them.
    fn append(&mut self, place: u64, target: u64) -> Result<(), Error> {
        let bytes = std::mem::take(&mut self.blocks.bytes);
        let written = self.put(self.end, &bytes).and_then(|()| self.put(place, &target.to_le_bytes()));
        // Only now: what failed is written again at the same place.
        self.end += written.as_ref().map_or(0, |()| bytes.len() as u64);
        self.blocks.bytes = bytes;
        written
    }

    fn put(&mut self, place: u64, bytes: &[u8]) -> Result<(), Error> {
        let written = self.file.seek(SeekFrom::Start(place)).and_then(|_| self.file.write_all(bytes));
        written.map_err(|source| Error::file(&self.path, "write", source))
    }

    fn settle(&mut self) -> Result<(), Error> {
        self.file.settle(self.end).map_err(|source| Error::file(&self.path, "write", source))
    }
}

/// Keeps two writers, or a writer and a recovery, from one file; where the file system has locks.
pub(super) fn lock(path: &Path, file: &File) -> Result<(), Error> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            Err(unreadable(path, "another process is recording to it", "End that one, or choose another name."))
        }
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

/// Deflate over the transposed rows: all first bytes, all second bytes, …
pub(super) const TRANSPOSED: u8 = 1;

fn transpose(rows: &[u8], length: usize, columns: &mut Vec<u8>) {
    columns.clear();
    for byte in 0..length {
        columns.extend(rows[byte..].iter().step_by(length));
    }
}

fn deflate(deflate: &mut Compress, plain: &[u8], zipped: &mut Vec<u8>) {
    zipped.clear();
    deflate.reset();
    loop {
        // What does not compress grows by a few bytes in 16 kB.
        zipped.reserve(plain.len() / 1024 + 64);
        let taken = deflate.total_in() as usize;
        let status = deflate.compress_vec(&plain[taken..], zipped, FlushCompress::Finish);
        if status.expect("deflate takes all bytes") == Status::StreamEnd {
            return;
        }
    }
}

/// All that stands before the first row; with the channel group, and the place of the link to the data.
fn head(header: &Header, channels: &[Channel]) -> (Blocks, u64, u64) {
    const UTC: [u8; 4] = [2, 0, 0, 0];
    let mut blocks = Blocks::at(0);
    let [version, flags] = [410, UNCOUNTED].map(u16::to_le_bytes);
    blocks.bytes.extend([&UNFINISHED[..], OURS, &[0; 4], &version, &[0; 30], &flags, &[0; 2]].concat());
    let start = nanoseconds(header.start).to_le_bytes();
    let hd = blocks.push(b"HD", &[0; 6], &[&start, &[0; 4], &UTC, &[0; 16]]);
    let history = blocks.text(b"MD", &history(header));
    let fh = blocks.push(b"FH", &[0, history], &[&start, &[0; 4], &UTC]);
    let comment = blocks.text(b"MD", &comment(header));
    let length = (ROW_HEAD + 8 * channels.len()) as u32;
    let first = channels_of_a_row(&mut blocks, channels);
    let name = blocks.text(b"TX", "bench");
    let cg = blocks.push(b"CG", &[0, first, name, 0, 0, 0], &[&[0; 24], &length.to_le_bytes(), &[0; 4]]);
    // The last block of the head: where it is whole, all of it is.
    let dg = blocks.push(b"DG", &[0, cg, 0, 0], &[&[0; 8]]);
    for (index, target) in [(0, dg), (1, fh), (5, comment)] {
        blocks.set_link(hd, index, target);
    }
    (blocks, cg, link_place(dg, 2))
}

/// Appends time, cycle and the channels; gives the first.
fn channels_of_a_row(blocks: &mut Blocks, channels: &[Channel]) -> u64 {
    // Kind of channel, what it is a master of, kind of number, first bit.
    const TIME: [u8; 4] = [2, 1, 4, 0];
    const COUNTER: [u8; 4] = [0, 0, 0, 0];
    const VALUE: [u8; 4] = [0, 0, 4, 0];
    const BITS: u32 = 64;
    let own = |name: &str, unit: &str, comment: &str| Channel {
        name: name.into(),
        unit: unit.into(),
        comment: comment.into(),
    };
    let (time, cycle) = (own("time", "s", "since the start"), own("cycle", "", "number of the tick"));
    let all = [(TIME, &time), (COUNTER, &cycle)].into_iter().chain(channels.iter().map(|channel| (VALUE, channel)));
    let mut next = 0;
    // From the last to the first: each needs the address of the next.
    for (index, (kind, channel)) in all.collect::<Vec<_>>().into_iter().enumerate().rev() {
        let [name, unit, comment] = [&channel.name, &channel.unit, &channel.comment].map(|t| blocks.text(b"TX", t));
        let layout = [8 * index as u32, BITS].map(u32::to_le_bytes).concat();
        let links = [next, 0, name, 0, 0, 0, unit, comment];
        next = blocks.push(b"CN", &links, &[&kind, &layout, &[0; 12], &[0; 48]]);
    }
    next
}

/// Since 1970, UTC [ns]; 0 for what was before.
fn nanoseconds(time: SystemTime) -> u64 {
    time.duration_since(UNIX_EPOCH).map_or(0, |since| u64::try_from(since.as_nanos()).unwrap_or(u64::MAX))
}

fn history(header: &Header) -> String {
    format!(
        "<FHcomment xmlns=\"{NAMESPACE}\"><TX>recorded</TX><tool_id>{}</tool_id><tool_vendor>stickslip</tool_vendor>\
         <tool_version>{}</tool_version></FHcomment>",
        xml(&header.program),
        xml(&header.version),
    )
}

fn comment(header: &Header) -> String {
    let property = |(name, value): &(String, String)| format!("<e name=\"{}\">{}</e>", xml(name), xml(value));
    format!(
        "<HDcomment xmlns=\"{NAMESPACE}\"><TX>{}</TX><common_properties>{}</common_properties></HDcomment>",
        xml(&header.comment),
        header.properties.iter().map(property).collect::<String>(),
    )
}

const NAMESPACE: &str = "http://www.asam.net/mdf/v4";

/// Without the control characters that XML has no way to write; line ends as references, which no reader changes.
fn xml(text: &str) -> String {
    let printable =
        |letter: char| letter >= ' ' && !matches!(letter, '\u{fffe}' | '\u{ffff}') || "\t\n\r".contains(letter);
    let text: String = text.chars().map(|letter| if printable(letter) { letter } else { '\u{fffd}' }).collect();
    escape(&text).replace('\t', "&#9;").replace('\n', "&#10;").replace('\r', "&#13;")
}
