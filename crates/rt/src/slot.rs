//! A slot for one message in shared memory, with its number.
//!
//! Only one side writes: first the words, then the number. The other side reads the number and then the words. The
//! writer writes again only after a reply shows that the reader is done. Messages are therefore never mixed, and
//! neither side waits. Both sides count the numbers.

use crate::sync::{AtomicU64, Ordering};

/// Words of a slot before its message: the number and the length of the message.
pub(crate) const HEAD: usize = 2;

/// Writes a message; words beyond the room are dropped.
pub(crate) fn put(place: &[AtomicU64], number: u64, words: impl IntoIterator<Item = u64>) {
    let (head, room) = place.split_at(HEAD);
    let mut count = 0;
    for (place, word) in room.iter().zip(words) {
        place.store(word, Ordering::Relaxed);
        count += 1;
    }
    head[1].store(count, Ordering::Relaxed);
    // Release: a reader of the number also reads the words.
    head[0].store(number, Ordering::Release);
}

/// Number of the present message.
pub(crate) fn number(place: &[AtomicU64]) -> u64 {
    place[0].load(Ordering::Acquire)
}

/// Copies the words of the message whose number was read. Returns how many, limited by the room.
pub(crate) fn take(place: &[AtomicU64], into: &mut [u64]) -> usize {
    let (head, room) = place.split_at(HEAD);
    // The other process may have written any value.
    let length = usize::try_from(head[1].load(Ordering::Relaxed)).unwrap_or(usize::MAX);
    let count = length.min(room.len()).min(into.len());
    for (word, place) in into.iter_mut().zip(&room[..count]) {
        *word = place.load(Ordering::Relaxed);
    }
    count
}
