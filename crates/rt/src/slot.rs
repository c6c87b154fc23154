//! A place for one message in memory that two sides see, a word its number.
//!
//! One side alone writes: the words first, then the number. The other side takes the words of a number that it sees. The
//! writer writes again when it knows, by what comes back, that the reader is done: so that no message is ever half of one
//! and half of another, and nobody waits for anybody. Which number is whose message, both count for themselves.

use crate::sync::{AtomicU64, Ordering};

/// Words of a place besides those of its message: its number, how many words the message has.
pub(crate) const HEAD: usize = 2;

/// Puts a message in; words for which there is no room are left out.
pub(crate) fn put(place: &[AtomicU64], number: u64, words: impl IntoIterator<Item = u64>) {
    let (head, room) = place.split_at(HEAD);
    let mut count = 0;
    for (place, word) in room.iter().zip(words) {
        place.store(word, Ordering::Relaxed);
        count += 1;
    }
    head[1].store(count, Ordering::Relaxed);
    // Whoever sees the number sees the words.
    head[0].store(number, Ordering::Release);
}

/// The number of the message that is there.
pub(crate) fn number(place: &[AtomicU64]) -> u64 {
    place[0].load(Ordering::Acquire)
}

/// Takes the words of the message whose number was seen: how many it has, as far as there is room.
pub(crate) fn take(place: &[AtomicU64], into: &mut [u64]) -> usize {
    let (head, room) = place.split_at(HEAD);
    // Another process may have written any number there.
    let said = usize::try_from(head[1].load(Ordering::Relaxed)).unwrap_or(usize::MAX);
    let count = said.min(room.len()).min(into.len());
    for (word, place) in into.iter_mut().zip(&room[..count]) {
        *word = place.load(Ordering::Relaxed);
    }
    count
}
