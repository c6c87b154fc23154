//! Writing while a bench runs.

use std::fs::{File, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use flate2::{Compress, Compression};

use super::block::{Blocks, CYCLES, DATA_LIST, FINISHED, FLAGS, HEADER_LIST, IDENTIFICATION, ROW_HEAD, link_place};
use super::data::{TRANSPOSED, deflate, transpose};
use super::head::head;
use super::{Channel, Event, Header, Summary, unreadable};
use stickslip_base::Error;

/// Longest time of the rows of a block [s], which is the loss of a crash.
const BLOCK_TIME: f64 = 0.1;
/// Largest size of the rows of a block before compression [bytes]; other programs read blocks up to 4 MB.
const BLOCK_SIZE: usize = 1 << 20;

/// The writer of a recording.
///
/// Rows are collected, and written as one compressed block when they span 0.1 s, when they fill a megabyte, or on
/// [`flush`](Self::flush); call it every 100 ms if the stream may pause. The memory does not grow with the recording.
/// If the disk is full, calls fail and change nothing: free space and continue. A refused row is missing; the channel
/// `cycle` shows it.
pub struct Writer {
    path: PathBuf,
    file: Box<dyn Storage>,
    tick_time: f64,
    /// Values per row.
    width: usize,
    /// Rows not yet written, and their first cycle.
    rows: Vec<u8>,
    first: u64,
    last: Option<u64>,
    /// Bytes of the written rows.
    written: u64,
    /// Address of the next block.
    end: u64,
    group: u64,
    /// Places of the links to the next data, event and attachment.
    next_data: u64,
    next_event: u64,
    next_attachment: u64,
    deflate: Compress,
    transposed: Vec<u8>,
    zipped: Vec<u8>,
    blocks: Blocks,
}

/// A file, or its replacement in a test.
pub(super) trait Storage: Write + Seek + Send {
    /// Truncates it to a length and syncs it to the disk.
    fn settle(&mut self, length: u64) -> io::Result<()>;
}

impl Storage for File {
    fn settle(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)?;
        self.sync_all()
    }
}

impl Writer {
    /// Begins a recording of rows that are multiples of `tick_time` [s] apart; an existing file is replaced.
    ///
    /// # Errors
    /// Two channels of one name, one without a name, or one with the name `time` or `cycle`; a period that is not above
    /// 0; a file that cannot be written, or that another process is writing.
    pub fn create(path: &Path, header: &Header, channels: &[Channel], tick_time: f64) -> Result<Self, Error> {
        let failed = |source| Error::file(path, "create", source);
        let file = File::options().write(true).create(true).truncate(false).open(path).map_err(failed)?;
        lock(path, &file)?;
        if file.metadata().map_err(failed)?.is_file() {
            file.set_len(0).map_err(failed)?;
        }
        Self::on(path, Box::new(file), header, channels, tick_time)
    }

    /// Starts a recording on any storage; messages use `path`.
    pub(super) fn on(
        path: &Path,
        file: Box<dyn Storage>,
        header: &Header,
        channels: &[Channel],
        tick_time: f64,
    ) -> Result<Self, Error> {
        if !(tick_time > 0.0 && tick_time.is_finite()) {
            let fault = format!("invalid tick time of {tick_time} s");
            return Err(unreadable(path, &fault, "It must be above 0 s."));
        }
        // Channels without a name or with equal names would be ambiguous.
        let mut names: Vec<_> = channels.iter().map(|c| c.name.as_str()).chain(["", "time", "cycle"]).collect();
        names.sort_unstable();
        if let Some(duplicate) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            let fault = format!("channel name `{}` is empty or not unique", duplicate[0]);
            return Err(unreadable(path, &fault, "Rename the channel; `time` and `cycle` are reserved."));
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

    /// Adds one row: all channels of a cycle.
    ///
    /// # Errors
    /// A cycle that is not after the last one; a block that cannot be written. The row is then not recorded, and the
    /// next one tries to write the block again.
    ///
    /// # Panics
    /// If the numbers of values and channels differ.
    pub fn row(&mut self, cycle: u64, values: &[f64]) -> Result<(), Error> {
        assert_eq!(values.len(), self.width, "one value per channel");
        if let Some(last) = self.last.filter(|last| cycle <= *last) {
            let fault = format!("cycle {cycle} is not after cycle {last}");
            return Err(unreadable(&self.path, &fault, "Record each cycle once, in order."));
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

    /// Writes the rows so far. After its return they survive the end of this process.
    ///
    /// # Errors
    /// [`Error::File`]; the rows are kept, and written when there is space.
    pub fn flush(&mut self) -> Result<(), Error> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let row = self.row_length();
        transpose(&self.rows, row, &mut self.transposed);
        deflate(&mut self.deflate, &self.transposed, &mut self.zipped);
        self.blocks.restart(self.end);
        // The first data list follows the head of the list.
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

    /// Writes an event at once. Its cycle may be missing in the rows.
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
        // Time is base times factor: cycle and time in one, with the bits of the channel `time`.
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

    /// Length of the file [bytes], without rows that are not yet written.
    pub fn bytes(&self) -> u64 {
        self.end
    }

    /// Writes the remaining rows, marks the file as complete and syncs it to the disk.
    ///
    /// # Errors
    /// [`Error::File`]; the previous data can be [recovered](super::recover).
    pub fn finish(mut self) -> Result<Summary, Error> {
        self.flush()?;
        let rows = self.written / self.row_length() as u64;
        self.put(self.group + CYCLES, &rows.to_le_bytes())?;
        self.settle()?;
        // A complete file has no flag, and the name in its first bytes.
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
        let result = self.put(self.end, &bytes).and_then(|()| self.put(place, &target.to_le_bytes()));
        // Only on success: failed blocks are written again at the same place.
        self.end += result.as_ref().map_or(0, |()| bytes.len() as u64);
        self.blocks.bytes = bytes;
        result
    }

    fn put(&mut self, place: u64, bytes: &[u8]) -> Result<(), Error> {
        let result = self.file.seek(SeekFrom::Start(place)).and_then(|_| self.file.write_all(bytes));
        result.map_err(|source| Error::file(&self.path, "write", source))
    }

    fn settle(&mut self) -> Result<(), Error> {
        self.file.settle(self.end).map_err(|source| Error::file(&self.path, "write", source))
    }
}

/// Prevents two writers, or a writer and a recovery, on one file, if the file system has locks.
pub(super) fn lock(path: &Path, file: &File) -> Result<(), Error> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            Err(unreadable(path, "another process is recording to it", "End that process, or choose another name."))
        }
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}
