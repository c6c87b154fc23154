//! Mailbox of a device: messages with a counter, answered from a queue.

use std::collections::VecDeque;

use super::object::Objects;
use super::{information, sdo};
use crate::esc::state::State;

/// Size of both mailboxes [bytes].
pub(crate) const SIZE: usize = 128;
/// Most waiting answers; further requests are not answered.
const MOST_WAITING: usize = 16;
const HEAD: usize = 6;
const COE: u8 = 3;

/// Messages of a device.
#[derive(Debug, Default)]
pub(crate) struct Mailbox {
    sdo: sdo::Server,
    waiting: VecDeque<Vec<u8>>,
    /// The last answer that was handed over, for repetition.
    last: Vec<u8>,
    /// Counter of the last request; the same again is a repetition.
    received: u8,
    sent: u8,
}

impl Mailbox {
    /// Takes a message of the main device.
    pub(crate) fn receive(&mut self, message: &[u8], objects: &mut Objects, state: State) {
        let Some((head, rest)) = message.split_first_chunk::<HEAD>() else { return };
        let (kind, counter) = (head[5] & 0xF, head[5] >> 4 & 7);
        if counter != 0 && std::mem::replace(&mut self.received, counter) == counter {
            return;
        }
        let length = usize::from(u16::from_le_bytes([head[0], head[1]]));
        let content = rest.get(..length);
        match content {
            Some([low, high, content @ ..]) if kind == COE => match u16::from_le_bytes([*low, *high]) >> 12 {
                2 => {
                    let answer = self.sdo.answer(content, objects, state, SIZE);
                    self.queue(COE, answer);
                }
                8 => {
                    for answer in information::answer(content, objects, SIZE) {
                        self.queue(COE, answer);
                    }
                }
                // Invalid service, see below.
                _ => self.queue(0, vec![1, 0, 6, 0]),
            },
            // Message errors: unsupported protocol, invalid size.
            Some(_) if kind != COE => self.queue(0, vec![1, 0, 2, 0]),
            _ => self.queue(0, vec![1, 0, 8, 0]),
        }
    }

    fn queue(&mut self, kind: u8, content: Vec<u8>) {
        if content.is_empty() || self.waiting.len() >= MOST_WAITING {
            return;
        }
        self.sent = self.sent % 7 + 1;
        let [low, high] = (content.len() as u16).to_le_bytes();
        let mut message = vec![low, high, 0, 0, 0, kind | self.sent << 4];
        message.extend(content);
        message.resize(SIZE, 0);
        self.waiting.push_back(message);
    }

    /// The next answer, if there is one.
    pub(crate) fn next(&mut self) -> Option<&[u8]> {
        self.last = self.waiting.pop_front()?;
        Some(&self.last)
    }

    /// The last answer again.
    pub(crate) fn repeat(&self) -> &[u8] {
        &self.last
    }
}
