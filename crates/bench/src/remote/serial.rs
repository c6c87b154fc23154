//! Frames over a serial port: a byte stream in which frames are detected by mark, kind and checksum.

use std::fs::File;
use std::io::{Error, ErrorKind, Read as _, Write as _};
use std::path::Path;

use super::frame::{LONGEST, MARK, Message};

/// Size of the receive buffer [bytes]: several frames.
const ROOM: usize = 4 * LONGEST;

/// A port with its receive buffer.
#[derive(Debug)]
pub(super) struct Serial {
    port: File,
    buffer: Buffer,
    /// Unsent rest of a frame.
    rest: Vec<u8>,
}

impl Serial {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let port = stickslip_rt::open_serial(path)?;
        Ok(Serial { port, buffer: Buffer::default(), rest: Vec::with_capacity(LONGEST) })
    }

    /// Sends a frame. If the port accepts only a part, the rest is sent in place of the next frame, which is lost.
    pub(super) fn send(&mut self, frame: &[u8]) -> Result<(), Error> {
        let last = if self.rest.is_empty() { frame } else { &self.rest };
        let sent = self.port.write(last)?;
        if self.rest.is_empty() {
            self.rest.extend_from_slice(&frame[sent..]);
            return Ok(());
        }
        self.rest.drain(..sent);
        Err(ErrorKind::WouldBlock.into())
    }

    /// Receives the next frame.
    pub(super) fn receive(&mut self, into: &mut [u8; LONGEST]) -> Result<usize, Error> {
        if let Some(length) = self.buffer.frame(into) {
            return Ok(length);
        }
        let count = self.port.read(self.buffer.room())?;
        self.buffer.add(count);
        self.buffer.frame(into).ok_or_else(|| ErrorKind::WouldBlock.into())
    }
}

/// Received bytes.
#[derive(Debug)]
struct Buffer {
    bytes: Box<[u8]>,
    length: usize,
}

impl Default for Buffer {
    fn default() -> Self {
        Buffer { bytes: vec![0; ROOM].into(), length: 0 }
    }
}

impl Buffer {
    /// Room for the next bytes. Complete frames are taken before, so that it is never empty.
    fn room(&mut self) -> &mut [u8] {
        &mut self.bytes[self.length..]
    }

    fn add(&mut self, bytes: usize) {
        self.length += bytes;
    }

    fn drop(&mut self, bytes: usize) {
        self.bytes.copy_within(bytes..self.length, 0);
        self.length -= bytes;
    }

    /// The first complete frame; bytes before it are dropped.
    fn frame(&mut self, into: &mut [u8; LONGEST]) -> Option<usize> {
        loop {
            let bytes = &self.bytes[..self.length];
            let begins = |from: &[u8]| from.iter().zip(&MARK).all(|(byte, mark)| byte == mark);
            let begin = (0..bytes.len()).find(|&at| begins(&bytes[at..])).unwrap_or(bytes.len());
            self.drop(begin);
            let bytes = &self.bytes[..self.length];
            // An incomplete head: wait for more bytes.
            match Message::length(*bytes.get(3)?) {
                Some(length) if bytes.len() < length => return None,
                Some(length) if Message::read(&bytes[..length]).is_ok() => {
                    into[..length].copy_from_slice(&bytes[..length]);
                    self.drop(length);
                    return Some(length);
                }
                // A mark by chance, or a damaged frame: the next frame may start inside.
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

    /// The numbers of the frames detected in bytes that arrive in pieces of one length.
    fn detected(bytes: &[u8], piece: usize) -> Vec<u64> {
        let (mut buffer, mut numbers) = (Buffer::default(), Vec::new());
        for piece in bytes.chunks(piece) {
            buffer.room()[..piece.len()].copy_from_slice(piece);
            buffer.add(piece.len());
            let mut into = [0; LONGEST];
            while let Some(length) = buffer.frame(&mut into) {
                numbers.push(Message::read(&into[..length]).unwrap().0);
            }
            assert!(!buffer.room().is_empty());
        }
        numbers
    }

    #[test]
    fn complete_frames_are_detected_for_any_split_of_their_bytes() {
        let bytes: Vec<u8> = (1..=20).flat_map(frame).collect();
        for piece in [1, 3, 28, 29, 119] {
            assert_eq!(detected(&bytes, piece), (1..=20).collect::<Vec<_>>(), "{piece}");
        }
    }

    #[test]
    fn the_next_frame_is_detected_after_noise_a_partial_frame_or_a_wrong_bit() {
        let mut garbled = frame(2);
        garbled[18] ^= 1;
        let half = &frame(3)[..17];
        let noise = b"SI SSI\x02";
        let bytes = [&frame(1), &noise[..], &frame(4), &garbled, half, &frame(5), b"SI\x02\x63", &frame(6)].concat();
        for piece in [1, 7, 100] {
            assert_eq!(detected(&bytes, piece), [1, 4, 5, 6], "{piece}");
        }
    }
}
