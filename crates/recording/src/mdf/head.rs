//! The head of a file, before the first row.

use std::time::{SystemTime, UNIX_EPOCH};

use super::block::{Blocks, OURS, ROW_HEAD, UNCOUNTED, UNFINISHED, link_place};
use super::{Channel, Header};
use stickslip_base::figure::symbol::escape;

/// The head of a file, the channel group, and the place of the link to the data.
pub(super) fn head(header: &Header, channels: &[Channel]) -> (Blocks, u64, u64) {
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
    // The last block of the head: if it is complete, the head is.
    let dg = blocks.push(b"DG", &[0, cg, 0, 0], &[&[0; 8]]);
    for (index, target) in [(0, dg), (1, fh), (5, comment)] {
        blocks.set_link(hd, index, target);
    }
    (blocks, cg, link_place(dg, 2))
}

/// Appends time, cycle and the channels; returns the first.
fn channels_of_a_row(blocks: &mut Blocks, channels: &[Channel]) -> u64 {
    // Kind of channel, synchronisation, kind of number, first bit.
    const TIME: [u8; 4] = [2, 1, 4, 0];
    const COUNTER: [u8; 4] = [0, 0, 0, 0];
    const VALUE: [u8; 4] = [0, 0, 4, 0];
    const BITS: u32 = 64;
    let new_channel = |name: &str, unit: &str, comment: &str| Channel {
        name: name.into(),
        unit: unit.into(),
        comment: comment.into(),
    };
    let (time, cycle) = (new_channel("time", "s", "since the start"), new_channel("cycle", "1", "number of the tick"));
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

/// Time since 1970, UTC [ns]; 0 for earlier times.
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

/// Text for XML, without the control characters that XML cannot represent; line ends as references, which readers do not
/// change.
fn xml(text: &str) -> String {
    let printable =
        |letter: char| letter >= ' ' && !matches!(letter, '\u{fffe}' | '\u{ffff}') || "\t\n\r".contains(letter);
    let text: String = text.chars().map(|letter| if printable(letter) { letter } else { '\u{fffd}' }).collect();
    escape(&text).replace('\t', "&#9;").replace('\n', "&#10;").replace('\r', "&#13;")
}
