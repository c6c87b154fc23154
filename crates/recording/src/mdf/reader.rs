//! Reading a file by its links, each of which may be invalid.

use std::borrow::Cow;
use std::time::{Duration, UNIX_EPOCH};

use roxmltree::Document;

use super::block::{Block, FINISHED, FLAGS, IDENTIFICATION, damaged, number};
use super::channel::Layout;
use super::data::{Budget, Records, inflate};
use super::{Attachment, Cause, Channel, Contents, Event, Fault, Group, Header, Signal, recovery};

/// Largest number of values of all signals together that is read into memory.
const LARGEST: usize = 1 << 29;
/// Largest size of a name or a unit [bytes].
const LONGEST_NAME: usize = 4096;

/// The contents of a file.
pub(super) fn contents(file: &[u8]) -> Result<Contents, Fault> {
    let (complete, finished) = complete(file)?;
    let mut file = File { bytes: &complete, budget: Budget::of(&complete) };
    let (mut contents, groups) = file.head(finished)?;
    contents.groups = groups.into_iter().map(|group| group.read(&complete)).collect::<Result<_, _>>()?;
    Ok(contents)
}

/// The contents without values, and the places of the values.
pub(super) fn head(file: &[u8], finished: bool) -> Result<(Contents, Vec<Layouts>), Fault> {
    File { bytes: file, budget: Budget::of(file) }.head(finished)
}

/// The file, repaired if its writer was interrupted; and whether it was finished.
pub(super) fn complete(file: &[u8]) -> Result<(Cow<'_, [u8]>, bool), Fault> {
    let version = number(file, 28).map_or(0, u16::from_le_bytes);
    let flags = number(file, FLAGS as usize).map_or(0, u16::from_le_bytes);
    if flags == 0 && file.starts_with(FINISHED) && (300..400).contains(&version) {
        return Err(Fault::new("this is MDF 3", "Save it as MDF 4: with asammdf, MDF(…).convert('4.10').save(…)."));
    }
    let finished = file.starts_with(FINISHED) && flags == 0;
    Ok((if finished { file.into() } else { recovery::repaired(file)?.into() }, finished))
}

/// Places of the values of a group.
pub(super) struct Layouts {
    name: String,
    master: Option<usize>,
    pub(super) channels: Vec<(Channel, Layout)>,
    pub(super) rows: usize,
    /// Length of a record [bytes].
    length: usize,
    data: u64,
}

impl Layouts {
    /// Its rows, one after the other.
    pub(super) fn rows<'a>(&self, file: &'a [u8]) -> Rows<'a> {
        let records = Records::behind(file, self.data);
        Rows { records, bytes: Vec::new(), consumed: 0, length: self.length, row: 0, of: self.rows }
    }

    fn read(self, file: &[u8]) -> Result<Group, Fault> {
        if self.rows.saturating_mul(self.channels.len()) > LARGEST {
            let fault = format!("{} rows of {} signals are too many", self.rows, self.channels.len());
            return Err(Fault::new(fault, "Export a part of it, or fewer signals."));
        }
        let mut rows = self.rows(file);
        // The number of rows in a file is not trusted before they are read.
        let mut columns = vec![Vec::new(); self.channels.len()];
        let mut channels = self.channels;
        while let Some((row, record)) = rows.take()? {
            let values = columns.iter_mut().zip(&mut channels);
            values.for_each(|(values, (_, layout))| {
                if row == 0 {
                    layout.set_origin(record);
                }
                values.push(layout.value(row, record));
            });
        }
        let signals = channels.into_iter().zip(columns).map(|((channel, layout), values)| Signal {
            channel,
            values,
            origin: layout.origin(),
            fault: layout.fault(),
        });
        Ok(Group { name: self.name, master: self.master, signals: signals.collect() })
    }
}

/// The records of a group, from block to block.
pub(super) struct Rows<'a> {
    records: Records<'a>,
    /// Bytes of the current blocks, and the number of consumed ones.
    bytes: Vec<u8>,
    consumed: usize,
    length: usize,
    row: usize,
    of: usize,
}

impl Rows<'_> {
    /// The next record with its number; `None` after the last.
    pub(super) fn take(&mut self) -> Result<Option<(usize, &[u8])>, Fault> {
        if self.row == self.of {
            // Blocks after the last row must be complete as well, or the file is damaged.
            while self.records.append_next(&mut self.bytes)? {
                self.bytes.clear();
            }
            return Ok(None);
        }
        while self.bytes.len() - self.consumed < self.length {
            self.bytes.drain(..self.consumed);
            self.consumed = 0;
            if !self.records.append_next(&mut self.bytes)? {
                return Err(damaged(&format!("a group has {} rows, fewer than stated", self.row)));
            }
        }
        let begin = self.consumed;
        self.consumed += self.length;
        self.row += 1;
        Ok(Some((self.row - 1, &self.bytes[begin..self.consumed])))
    }
}

struct File<'a> {
    bytes: &'a [u8],
    budget: Budget,
}

impl<'a> File<'a> {
    /// The contents without values.
    fn head(&mut self, finished: bool) -> Result<(Contents, Vec<Layouts>), Fault> {
        let head = Block::named(self.bytes, IDENTIFICATION, b"HD")?;
        let groups = self.chain(head.link(0), b"DG")?;
        let groups = groups.into_iter().map(|block| self.groups(block)).collect::<Result<Vec<_>, _>>()?;
        let groups = groups.into_iter().flatten().collect();
        let events = self.chain(head.link(4), b"EV")?;
        let events = events.into_iter().map(|block| self.event(block)).collect::<Result<_, _>>()?;
        let attachments = self.chain(head.link(3), b"AT")?;
        let attachments = attachments.into_iter().filter_map(|block| self.attachment(block).transpose());
        let attachments = attachments.collect::<Result<_, _>>()?;
        let header = self.header(head)?;
        Ok((Contents { header, groups: Vec::new(), events, attachments, finished }, groups))
    }

    /// All blocks of a chain, whose first link is the next.
    fn chain(&mut self, mut link: u64, name: &[u8; 2]) -> Result<Vec<Block<'a>>, Fault> {
        let mut blocks = Vec::new();
        while link != 0 {
            let block = Block::named(self.bytes, link, name)?;
            self.budget.spend(block)?;
            blocks.push(block);
            link = block.link(0);
        }
        Ok(blocks)
    }

    /// A text, plain or XML, as in the file; empty without a link.
    fn text(&self, link: u64) -> Result<&'a str, Fault> {
        if link == 0 {
            return Ok("");
        }
        let block = Block::at(self.bytes, link)?;
        if !matches!(&block.name, b"TX" | b"MD") {
            return Err(damaged(&format!("the block at {link} is not a text")));
        }
        let text = block.data.split(|byte| *byte == 0).next().unwrap_or_default();
        std::str::from_utf8(text).map_err(|_| damaged(&format!("the text at {link} is not UTF-8")))
    }

    /// The plain text of both kinds.
    fn plain(&self, link: u64) -> Result<String, Fault> {
        let text = self.text(link)?;
        Ok(element(text, "TX").unwrap_or_else(|| text.to_owned()))
    }

    /// A name or unit, which must be short because many channels have one.
    fn name(&self, link: u64) -> Result<String, Fault> {
        let name = self.plain(link)?;
        let short = name.len() <= LONGEST_NAME;
        short.then_some(name).ok_or_else(|| damaged(&format!("the name at {link} has more than {LONGEST_NAME} bytes")))
    }

    fn header(&mut self, head: Block) -> Result<Header, Fault> {
        let start = UNIX_EPOCH.checked_add(Duration::from_nanos(head.long(0)?));
        let comment = self.text(head.link(5))?;
        // The first entry is of the program that wrote the file, later ones of programs that changed it.
        let history = self.chain(head.link(1), b"FH")?;
        let history = history.first().map_or(Ok(""), |block| self.text(block.link(1)))?;
        let tool = |name| element(history, name).unwrap_or_default();
        Ok(Header {
            start: start.unwrap_or(UNIX_EPOCH),
            program: tool("tool_id"),
            version: tool("tool_version"),
            comment: self.plain(head.link(5))?,
            properties: properties(comment),
        })
    }

    fn groups(&mut self, block: Block) -> Result<Vec<Layouts>, Fault> {
        let groups = self.chain(block.link(1), b"CG")?;
        if groups.len() > 1 || block.byte(0)? != 0 && !groups.is_empty() {
            let remedy = "Sort them: with asammdf, MDF(…).save(…).";
            return Err(Fault::new("its records are not sorted", remedy));
        }
        groups.into_iter().map(|group| self.group(group, block.link(2))).collect()
    }

    fn group(&mut self, group: Block, data: u64) -> Result<Layouts, Fault> {
        // The bits that mark invalid numbers follow the numbers.
        let width = group.word(24)? as usize;
        let length = width.saturating_add(group.word(28)? as usize);
        let rows = usize::try_from(group.long(8)?).unwrap_or(usize::MAX);
        // With only a virtual master, rows have no bytes.
        if length == 0 && rows > LARGEST {
            return Err(damaged(&format!("a group has no bytes but states {rows} rows")));
        }
        let (mut channels, mut master) = (Vec::new(), None);
        for channel in self.chain(group.link(1), b"CN")? {
            let conversion = match channel.link(4) {
                0 => None,
                link => Some(Block::named(self.bytes, link, b"CC")?),
            };
            let Some(layout) = Layout::of(channel, conversion, width)? else { continue };
            let unit = match (channel.link(6), conversion) {
                (0, Some(conversion)) => conversion.link(1),
                (unit, _) => unit,
            };
            let unit = self.name(unit)?;
            // A stored or virtual master whose quantity is time.
            if matches!(channel.byte(0)?, 2 | 3) && channel.byte(1)? <= 1 {
                master = Some(channels.len());
            }
            let channel = Channel { name: self.name(channel.link(2))?, unit, comment: self.plain(channel.link(7))? };
            channels.push((channel, layout));
        }
        let name = self.name_of_group(group)?;
        Ok(Layouts { name, master, channels, rows, length, data })
    }

    /// Name of the acquisition, of its source, or the first line of the comment.
    fn name_of_group(&self, group: Block) -> Result<String, Fault> {
        let name = self.name(group.link(2))?;
        let source = |link| Block::named(self.bytes, link, b"SI").and_then(|block| self.name(block.link(0)));
        if !name.is_empty() {
            return Ok(name);
        }
        let name = if group.link(3) == 0 { String::new() } else { source(group.link(3)).unwrap_or_default() };
        if !name.is_empty() {
            return Ok(name);
        }
        let comment = self.plain(group.link(5)).unwrap_or_default();
        Ok(comment.lines().next().unwrap_or_default().trim().chars().take(80).collect())
    }

    fn event(&mut self, event: Block) -> Result<(f64, Event), Fault> {
        // After kinds and counts: base and factor.
        let (base, factor) = (event.long(16)? as i64, event.float(24)?);
        let cause = match event.byte(3)? {
            1 => Cause::Error,
            2 => Cause::Tool,
            3 => Cause::Script,
            4 => Cause::User,
            _ => Cause::Other,
        };
        let (name, comment) = (self.plain(event.link(3))?, self.plain(event.link(4))?);
        Ok((base as f64 * factor, Event { cycle: base.max(0) as u64, name, comment, cause }))
    }

    /// `None` for an external file, or an unknown method of compression.
    fn attachment(&mut self, block: Block) -> Result<Option<Attachment>, Fault> {
        const EMBEDDED: u16 = 1;
        const COMPRESSED: u16 = 2;
        let flags = block.short(0)?;
        let (plain, length) = (block.long(24)?, block.long(32)?);
        let stored = block.data.get(40..).unwrap_or_default();
        let bytes = match (flags & EMBEDDED != 0, flags & COMPRESSED != 0, block.byte(4)?) {
            (true, true, 0) => inflate(stored, length, plain)?,
            (true, false, 0) => {
                let cut = usize::try_from(length).ok().and_then(|length| stored.get(..length));
                cut.ok_or_else(|| damaged("an attached file is longer than its block"))?.to_vec()
            }
            _ => return Ok(None),
        };
        Ok(Some(Attachment { name: self.plain(block.link(1))?, mime: self.plain(block.link(2))?, bytes }))
    }
}

/// The text of the first element of a name, if this is XML.
fn element(text: &str, name: &str) -> Option<String> {
    let document = Document::parse(text).ok()?;
    let node = document.descendants().find(|node| node.tag_name().name() == name)?;
    Some(node.text().unwrap_or_default().to_owned())
}

/// Names and values of the common properties of an XML comment.
fn properties(text: &str) -> Vec<(String, String)> {
    let Ok(document) = Document::parse(text) else { return Vec::new() };
    let entries = document.descendants().filter(|node| node.tag_name().name() == "e");
    let pair =
        |node: roxmltree::Node| Some((node.attribute("name")?.to_owned(), node.text().unwrap_or_default().to_owned()));
    entries.filter_map(pair).collect()
}
