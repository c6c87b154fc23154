//! Frames through a serial port: bytes without borders, in which a frame is found by its mark, its kind and its checksum.

use std::fs::File;
use std::io::{Error, ErrorKind, Read as _, Write as _};
use std::path::Path;

use super::frame::{LONGEST, MARK, Message};

/// Bytes that may wait: several frames.
const ROOM: usize = 4 * LONGEST;

/// A port, and what has come and is no whole frame yet.
#[derive(Debug)]
pub(super) struct Serial {
    port: File,
    found: Found,
    /// Of a frame that did not go out whole.
    rest: Vec<u8>,
}

impl Serial {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let port = stickslip_rt::open_serial(path)?;
        Ok(Serial { port, found: Found::default(), rest: Vec::with_capacity(LONGEST) })
    }

    /// Sends a frame. Where the port takes no more, what is left goes out before the next one, which is lost.
    pub(super) fn send(&mut self, frame: &[u8]) -> Result<(), Error> {
        let last = if self.rest.is_empty() { frame } else { &self.rest };
        let went = self.port.write(last)?;
        if self.rest.is_empty() {
            self.rest.extend_from_slice(&frame[went..]);
            return Ok(());
        }
        self.rest.drain(..went);
        Err(ErrorKind::WouldBlock.into())
    }

    /// Takes the next frame.
    pub(super) fn receive(&mut self, into: &mut [u8; LONGEST]) -> Result<usize, Error> {
        if let Some(length) = self.found.frame(into) {
            return Ok(length);
        }
        let came = self.port.read(self.found.room())?;
        self.found.came(came);
        self.found.frame(into).ok_or_else(|| ErrorKind::WouldBlock.into())
    }
}

/// What has come.
#[derive(Debug)]
struct Found {
    bytes: Box<[u8]>,
    length: usize,
}

impl Default for Found {
    fn default() -> Self {
        Found { bytes: vec![0; ROOM].into(), length: 0 }
    }
}

impl Found {
    /// Where the next bytes go. A whole frame is taken before: there is some.
    fn room(&mut self) -> &mut [u8] {
        &mut self.bytes[self.length..]
    }

    fn came(&mut self, bytes: usize) {
        self.length += bytes;
    }

    fn drop(&mut self, bytes: usize) {
        self.bytes.copy_within(bytes..self.length, 0);
        self.length -= bytes;
    }

    /// The first whole frame; what stands before it is none and goes.
    fn frame(&mut self, into: &mut [u8; LONGEST]) -> Option<usize> {
        loop {
            let bytes = &self.bytes[..self.length];
            let begins = |from: &[u8]| from.iter().zip(&MARK).all(|(byte, mark)| byte == mark);
            let begin = (0..bytes.len()).find(|&at| begins(&bytes[at..])).unwrap_or(bytes.len());
            self.drop(begin);
            let bytes = &self.bytes[..self.length];
            // Less than a head may become anything.
            match Message::length(*bytes.get(3)?) {
                Some(length) if bytes.len() < length => return None,
                Some(length) if Message::read(&bytes[..length]).is_ok() => {
                    into[..length].copy_from_slice(&bytes[..length]);
                    self.drop(length);
                    return Some(length);
                }
                // The mark by chance, or a frame that is garbled: the next one may begin within.
                _ => self.drop(1),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::frame::Preload;
    use super::*;

    fn frame(number: u64) -> Vec<u8> {
        Message::Preload(Preload { preload: 0.5 }).datagram(number).to_vec()
    }

    /// The numbers of the frames that are found where bytes come in pieces of a length.
    fn found(bytes: &[u8], piece: usize) -> Vec<u64> {
        let (mut found, mut numbers) = (Found::default(), Vec::new());
        for piece in bytes.chunks(piece) {
            found.room()[..piece.len()].copy_from_slice(piece);
            found.came(piece.len());
            let mut into = [0; LONGEST];
            while let Some(length) = found.frame(&mut into) {
                numbers.push(Message::read(&into[..length]).unwrap().0);
            }
            assert!(!found.room().is_empty());
        }
        numbers
    }

    #[test]
    fn whole_frames_are_found_however_their_bytes_come() {
        let bytes: Vec<u8> = (1..=20).flat_map(frame).collect();
        for piece in [1, 3, 28, 29, 119] {
            assert_eq!(found(&bytes, piece), (1..=20).collect::<Vec<_>>(), "{piece}");
        }
    }

    #[test]
    fn after_noise_half_a_frame_or_a_wrong_bit_the_next_frame_is_found() {
        let mut garbled = frame(2);
        garbled[18] ^= 1;
        let half = &frame(3)[..17];
        let noise = b"SI SSI\x02";
        let bytes = [&frame(1), &noise[..], &frame(4), &garbled, half, &frame(5), b"SI\x02\x63", &frame(6)].concat();
        for piece in [1, 7, 100] {
            assert_eq!(found(&bytes, piece), [1, 4, 5, 6], "{piece}");
        }
    }
}
