//! Packets in datagrams and byte streams: ASAM MCD-1 XCP, part 3 (Ethernet). A frame consists of the length of its packet
//! and a counter, both 16 bits little-endian, and the packet; several frames may share a datagram.

/// Bytes before the packet.
pub const HEADER: usize = 4;

/// Start of a stream of bytes.
#[derive(Debug, PartialEq)]
pub enum Next<'a> {
    /// A packet, and the bytes after it.
    Packet(&'a [u8], &'a [u8]),
    /// An incomplete packet.
    Incomplete,
    /// An invalid length. The start of the next frame is then unknown.
    Corrupt,
}

/// The next frame of packets of at most `longest` bytes.
pub fn next(bytes: &[u8], longest: usize) -> Next<'_> {
    let Some((length, _)) = bytes.split_first_chunk::<2>() else { return Next::Incomplete };
    let length = usize::from(u16::from_le_bytes(*length));
    if length == 0 || length > longest {
        return Next::Corrupt;
    }
    match bytes.get(HEADER..HEADER + length) {
        Some(packet) => Next::Packet(packet, &bytes[HEADER + length..]),
        None => Next::Incomplete,
    }
}

/// Appends a frame; its counter is one more than that of the frame before.
pub fn push(out: &mut Vec<u8>, counter: &mut u16, packet: [&[u8]; 2]) {
    let length = packet[0].len() + packet[1].len();
    out.extend_from_slice(&(length as u16).to_le_bytes());
    out.extend_from_slice(&counter.to_le_bytes());
    packet.iter().for_each(|part| out.extend_from_slice(part));
    *counter = counter.wrapping_add(1);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_frames_read_back() {
        let (mut bytes, mut counter) = (Vec::new(), u16::MAX);
        push(&mut bytes, &mut counter, [&[1, 2], &[3]]);
        push(&mut bytes, &mut counter, [&[4], &[]]);
        assert_eq!((bytes[2..4].to_vec(), counter), (vec![0xff, 0xff], 1));
        let Next::Packet(first, rest) = next(&bytes, 8) else { panic!("a frame") };
        assert_eq!((first, next(rest, 8)), (&[1, 2, 3][..], Next::Packet(&[4], &[])));
    }

    #[test]
    fn invalid_and_incomplete_lengths_are_distinguished() {
        assert_eq!(next(&[], 8), Next::Incomplete);
        assert_eq!(next(&[1, 0, 0, 0], 8), Next::Incomplete);
        assert_eq!(next(&[0, 0, 0, 0], 8), Next::Corrupt);
        assert_eq!(next(&[9, 0], 8), Next::Corrupt);
    }
}
