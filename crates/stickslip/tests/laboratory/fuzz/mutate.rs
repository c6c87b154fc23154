//! Mutations of bytes and of lines, from a number.

/// Numbers from a seed (SplitMix64).
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5bd1_e995)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `count`, which is at least 1.
    fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }

    fn pick<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}

/// Texts that take the place of numbers, names and signs.
const TEXTS: [&str; 33] = [
    "",
    "0",
    "-1",
    "1e308",
    "-1e308",
    "5e-324",
    "1e-200",
    "NaN",
    "nan",
    "inf",
    "-inf",
    "Infinity",
    "9223372036854775807",
    "18446744073709551616",
    "4294967295",
    "0x7fffffff",
    "1e999",
    "true",
    "null",
    "\"",
    "'''",
    "[",
    "]",
    "{",
    "}",
    "=",
    "\0",
    "\u{feff}",
    "é\u{301}µ°",
    "1,234,567",
    "1.234,5",
    "2026-11-29T12:00:00Z",
    "-0",
];
/// Delimiters that are exchanged.
const DELIMITERS: [u8; 7] = *b",;\t |=:";
/// Integers that sizes, offsets and counts become.
const INTEGERS: [u64; 9] =
    [0, 1, 0xff, 0x7fff, 0xffff_ffff, 0x7fff_ffff, u64::MAX, i64::MAX as u64, 0x0000_0001_0000_0000];

/// Largest mutant [bytes].
const LARGEST: usize = 1 << 20;

/// One to four mutations of one of the seeds.
pub(super) fn mutant(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = random.pick(seeds).clone();
    for _ in 0..=random.below(4) {
        mutate(random, &mut bytes);
        // Repeated repetitions of a line would grow without bound.
        bytes.truncate(LARGEST);
    }
    bytes
}

fn mutate(random: &mut Random, bytes: &mut Vec<u8>) {
    let length = bytes.len();
    match random.below(13) {
        0 => bytes.truncate(random.below(length + 1)),
        1 => {
            for _ in 0..=random.below(8) {
                let place = random.below(length);
                if let Some(byte) = bytes.get_mut(place) {
                    *byte ^= 1 << random.below(8);
                }
            }
        }
        2 | 3 => {
            // A number of 1 to 8 bytes, anywhere.
            let number = random.pick(&INTEGERS).to_le_bytes();
            let width = *random.pick(&[1, 2, 4, 8]);
            let place = random.below(length.saturating_sub(width) + 1);
            for (byte, new) in bytes[place.min(length)..].iter_mut().zip(&number[..width]) {
                *byte = *new;
            }
        }
        4 | 5 => replace_word(random, bytes),
        6 | 7 => change_line(random, bytes),
        8 => {
            let (from, to) = (*random.pick(&DELIMITERS), *random.pick(&DELIMITERS));
            bytes.iter_mut().filter(|byte| **byte == from).for_each(|byte| *byte = to);
        }
        9 => {
            let cell = vec![*random.pick(b"x1,[\"\0"); 1 + random.below(30_000)];
            let place = random.below(length + 1);
            bytes.splice(place..place, cell);
        }
        10 => {
            let text = *random.pick(&TEXTS);
            let place = random.below(length + 1);
            bytes.splice(place..place, text.bytes());
        }
        11 => {
            // A part again at another place.
            let begin = random.below(length + 1);
            let part = bytes[begin..(begin + random.below(200)).min(length)].to_vec();
            let place = random.below(length + 1);
            bytes.splice(place..place, part);
        }
        _ => {
            let begin = random.below(length + 1);
            bytes.drain(begin..(begin + random.below(50)).min(length));
        }
    }
}

/// Replaces a word: a run of letters, digits and signs of a number.
fn replace_word(random: &mut Random, bytes: &mut Vec<u8>) {
    let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-._".contains(byte);
    let mut place = random.below(bytes.len());
    while place < bytes.len() && !is_word(&bytes[place]) {
        place += 1;
    }
    let begin = bytes[..place].iter().rposition(|byte| !is_word(byte)).map_or(0, |last| last + 1);
    let end = bytes[place..].iter().position(|byte| !is_word(byte)).map_or(bytes.len(), |count| place + count);
    let text = *random.pick(&TEXTS);
    bytes.splice(begin..end, text.bytes());
}

/// Removes, repeats or moves a line.
fn change_line(random: &mut Random, bytes: &mut Vec<u8>) {
    let mut lines: Vec<Vec<u8>> = bytes.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
    if lines.is_empty() {
        return;
    }
    let line = lines.remove(random.below(lines.len()));
    match random.below(4) {
        0 => {}
        1 => lines.insert(random.below(lines.len() + 1), line),
        2 => (0..2).for_each(|_| lines.insert(random.below(lines.len() + 1), line.clone())),
        _ => (0..300).for_each(|_| lines.push(line.clone())),
    }
    *bytes = lines.concat();
}
