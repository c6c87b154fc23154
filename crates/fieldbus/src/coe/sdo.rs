//! Access to the object dictionary by the mailbox: expedited, normal and segmented SDO transfers, complete access.

use super::object::{Abort, LONGEST_TEXT, Objects};
use crate::esc::state::State;

/// Request and response as services of CoE.
const REQUEST: u16 = 2 << 12;
const RESPONSE: u16 = 3 << 12;
/// Bytes of mailbox header, CoE header and SDO header before the data of a normal transfer.
const OVERHEAD: usize = 16;
/// Bytes before the data of a segment.
const SEGMENT_OVERHEAD: usize = 9;

/// A transfer in segments.
#[derive(Debug)]
enum Transfer {
    Upload { rest: Vec<u8> },
    Download { index: u16, subindex: u8, complete: bool, bytes: Vec<u8>, size: usize },
}

/// The server of a device.
#[derive(Debug, Default)]
pub(crate) struct Server {
    transfer: Option<Transfer>,
    toggle: bool,
}

impl Server {
    /// Answers a request: CoE header and SDO. `room` is the size of the mailbox.
    pub(crate) fn answer(&mut self, request: &[u8], objects: &mut Objects, state: State, room: usize) -> Vec<u8> {
        let Some([command, low, high, subindex]) = request.first_chunk::<4>().copied() else { return Vec::new() };
        let (index, data) = (u16::from_le_bytes([low, high]), &request[4..]);
        let complete = command & 0x10 != 0;
        let result = match command >> 5 {
            0 => self.download_segment(command, &request[1..], objects, state),
            1 => self.download(command, index, subindex, data, objects, state),
            2 => read(objects, index, subindex, complete).map(|bytes| self.upload(index, subindex, bytes, room)),
            3 => self.upload_segment(command, room),
            4 => {
                self.transfer = None;
                return Vec::new();
            }
            _ => Err(Abort::Command),
        };
        let (service, answer) = result.map_or_else(
            |abort| {
                self.transfer = None;
                let code = (abort as u32).to_le_bytes();
                (REQUEST, [&[0x80, low, high, subindex], &code[..]].concat())
            },
            |answer| (RESPONSE, answer),
        );
        [&service.to_le_bytes()[..], &answer].concat()
    }

    fn upload(&mut self, index: u16, subindex: u8, bytes: Vec<u8>, room: usize) -> Vec<u8> {
        let [low, high] = index.to_le_bytes();
        if (1..=4).contains(&bytes.len()) {
            let mut answer = vec![0x43 | (4 - bytes.len() as u8) << 2, low, high, subindex];
            answer.extend(&bytes);
            answer.resize(8, 0);
            return answer;
        }
        let mut answer = vec![0x41, low, high, subindex];
        answer.extend((bytes.len() as u32).to_le_bytes());
        if bytes.len() + OVERHEAD <= room {
            answer.extend(bytes);
        } else {
            // Segments carry all data, as two of three main devices expect.
            (self.transfer, self.toggle) = (Some(Transfer::Upload { rest: bytes }), false);
        }
        answer
    }

    fn upload_segment(&mut self, command: u8, room: usize) -> Result<Vec<u8>, Abort> {
        self.check_toggle(command)?;
        let Some(Transfer::Upload { rest }) = &mut self.transfer else { return Err(Abort::Command) };
        let length = rest.len().min(room.saturating_sub(SEGMENT_OVERHEAD)).max(1).min(rest.len());
        let segment: Vec<u8> = rest.drain(..length).collect();
        let is_last = rest.is_empty();
        let unused = 7_usize.saturating_sub(length);
        let mut answer = vec![command & 0x10 | (unused as u8) << 1 | u8::from(is_last)];
        answer.extend(segment);
        answer.resize(answer.len() + unused, 0);
        if is_last {
            self.transfer = None;
        }
        Ok(answer)
    }

    fn download(
        &mut self,
        command: u8,
        index: u16,
        subindex: u8,
        data: &[u8],
        objects: &mut Objects,
        state: State,
    ) -> Result<Vec<u8>, Abort> {
        let (size, data) = data.split_first_chunk::<4>().ok_or(Abort::Length)?;
        let complete = command & 0x10 != 0;
        let [low, high] = index.to_le_bytes();
        let answer = vec![0x60, low, high, subindex, 0, 0, 0, 0];
        if command & 2 != 0 {
            let unused = if command & 1 != 0 { usize::from(command >> 2 & 3) } else { 0 };
            write(objects, index, subindex, complete, &size[..4 - unused], state)?;
            return Ok(answer);
        }
        let size = u32::from_le_bytes(*size) as usize;
        if size > LONGEST_TEXT {
            return Err(Abort::TooLong);
        }
        if data.len() >= size {
            write(objects, index, subindex, complete, &data[..size], state)?;
        } else {
            objects.entry(index, subindex)?;
            let bytes = data.to_vec();
            self.transfer = Some(Transfer::Download { index, subindex, complete, bytes, size });
            self.toggle = false;
        }
        Ok(answer)
    }

    fn download_segment(
        &mut self,
        command: u8,
        data: &[u8],
        objects: &mut Objects,
        state: State,
    ) -> Result<Vec<u8>, Abort> {
        self.check_toggle(command)?;
        let Some(Transfer::Download { index, subindex, complete, bytes, size }) = &mut self.transfer else {
            return Err(Abort::Command);
        };
        // A short segment is padded to seven bytes.
        let unused = if data.len() <= 7 { usize::from(command >> 1 & 7) } else { 0 };
        bytes.extend(&data[..data.len().saturating_sub(unused)]);
        if bytes.len() > *size {
            return Err(Abort::Length);
        }
        if command & 1 != 0 {
            if bytes.len() != *size {
                return Err(Abort::Length);
            }
            write(objects, *index, *subindex, *complete, bytes, state)?;
            self.transfer = None;
        }
        Ok(vec![0x20 | command & 0x10, 0, 0, 0, 0, 0, 0, 0])
    }

    /// Each segment has the opposite toggle bit of the one before.
    fn check_toggle(&mut self, command: u8) -> Result<(), Abort> {
        let expected = self.toggle;
        self.toggle = !expected;
        if (command & 0x10 != 0) == expected { Ok(()) } else { Err(Abort::Toggle) }
    }
}

/// One entry, or with complete access all from a subindex on; the count in entry 0 then has 16 bits.
fn read(objects: &Objects, index: u16, subindex: u8, complete: bool) -> Result<Vec<u8>, Abort> {
    if !complete {
        return objects.read(index, subindex);
    }
    let object = objects.object(index)?;
    let entries = subindex.min(1)..=objects.number(index, 0).min(object.entries.len() as i64 - 1) as u8;
    let mut bytes = Vec::new();
    for entry in entries {
        bytes.extend(objects.read(index, entry)?);
        bytes.resize(if entry == 0 { 2 } else { bytes.len() }, 0);
    }
    Ok(bytes)
}

/// Writes one entry, or with complete access all from a subindex on: the count becomes zero first.
fn write(
    objects: &mut Objects,
    index: u16,
    subindex: u8,
    complete: bool,
    bytes: &[u8],
    state: State,
) -> Result<(), Abort> {
    if !complete {
        return objects.write(index, subindex, bytes, state);
    }
    let mut rest = bytes;
    let mut count = objects.number(index, 0) as u8;
    if subindex == 0 {
        let (word, behind) = rest.split_at_checked(2).ok_or(Abort::Length)?;
        (count, rest) = (word[0], behind);
    }
    let is_list = objects.write(index, 0, &[0], state).is_ok();
    for entry in 1..=count {
        let length = objects.entry(index, entry)?.kind.length();
        let (part, behind) = rest.split_at_checked(length).ok_or(Abort::Length)?;
        objects.write(index, entry, part, state)?;
        rest = behind;
    }
    if is_list { objects.write(index, 0, &[count], state) } else { Ok(()) }
}
