//! SDO information: lists and descriptions of objects and entries.

use super::object::{Abort, Access, Entry, Object, Objects, Shape};

/// SDO information as a service of CoE.
const SERVICE: u16 = 8 << 12;
/// Bytes of mailbox header, CoE header and header of the service.
const OVERHEAD: usize = 12;
const FAILED: u8 = 7;

/// Answers a request, in fragments that fit into mailboxes of `room` bytes.
pub(crate) fn answer(request: &[u8], objects: &Objects, room: usize) -> Vec<Vec<u8>> {
    let Some((head, data)) = request.split_first_chunk::<4>() else { return Vec::new() };
    let operation = head[0] & 0x7F;
    let (operation, content) = content(operation, data, objects)
        .map_or_else(|abort| (FAILED, (abort as u32).to_le_bytes().to_vec()), |content| (operation + 1, content));
    let parts: Vec<&[u8]> = content.chunks(room.saturating_sub(OVERHEAD).max(1)).collect();
    let fragment = |(number, part): (usize, &&[u8])| {
        let left = (parts.len() - 1 - number) as u16;
        let incomplete = u8::from(left > 0) << 7;
        let [low, high] = left.to_le_bytes();
        [&SERVICE.to_le_bytes()[..], &[operation | incomplete, 0, low, high], part].concat()
    };
    parts.iter().enumerate().map(fragment).collect()
}

fn content(operation: u8, data: &[u8], objects: &Objects) -> Result<Vec<u8>, Abort> {
    let index = data.first_chunk::<2>().map(|bytes| u16::from_le_bytes(*bytes)).ok_or(Abort::Length)?;
    match operation {
        1 => list(index, objects),
        3 => objects.object(index).map(describe_object),
        5 => {
            let subindex = *data.get(2).ok_or(Abort::Length)?;
            let object = objects.object(index)?;
            let entry = objects.entry(index, subindex)?;
            Ok(describe_entry(object, subindex, entry, objects))
        }
        _ => Err(Abort::Unsupported),
    }
}

/// List 0 has the lengths of the others, 1 has all objects, 2 and 3 those for outputs and inputs.
fn list(kind: u16, objects: &Objects) -> Result<Vec<u8>, Abort> {
    let members = |kind: u16| {
        let belongs = move |object: &&Object| {
            object.entries.iter().any(|entry| match kind {
                1 => true,
                2 => entry.access == Access::Command,
                3 => matches!(entry.access, Access::Signal | Access::Command),
                _ => false,
            })
        };
        objects.all().filter(belongs).map(|object| object.index)
    };
    let words: Vec<u16> = match kind {
        0 => (1..=5).map(|kind| members(kind).count() as u16).collect(),
        1..=5 => members(kind).collect(),
        _ => return Err(Abort::Value),
    };
    Ok([kind].into_iter().chain(words).flat_map(u16::to_le_bytes).collect())
}

fn describe_object(object: &Object) -> Vec<u8> {
    let last = object.entries.last();
    // A record has no type of its own.
    let kind = match object.shape {
        Shape::Record => 0,
        _ => last.map_or(0, |entry| entry.kind.code()),
    };
    let highest = (object.entries.len() - 1) as u8;
    [&object.index.to_le_bytes()[..], &kind.to_le_bytes(), &[highest, object.shape as u8], object.name.as_bytes()]
        .concat()
}

fn describe_entry(object: &Object, subindex: u8, entry: &Entry, objects: &Objects) -> Vec<u8> {
    let bytes = objects.read(object.index, subindex).map_or(0, |bytes| bytes.len());
    let bits = (8 * if entry.kind.length() > 0 { entry.kind.length() } else { bytes }) as u16;
    [
        &object.index.to_le_bytes()[..],
        &[subindex, 0],
        &entry.kind.code().to_le_bytes(),
        &bits.to_le_bytes(),
        &entry.access.code().to_le_bytes(),
        entry.name.as_bytes(),
    ]
    .concat()
}
