//! Packets in datagrams and byte streams: ASAM MCD-1 XCP, part 3 (Ethernet). A frame is the length of its packet, a
//! counter, both of 16 bits little-endian, and the packet; several may share a datagram.

/// Bytes before the packet.
pub const HEADER: usize = 4;

/// What a stream of bytes begins with.
#[derive(Debug, PartialEq)]
pub enum Next<'a> {
    /// A packet, and what is behind it.
    Packet(&'a [u8], &'a [u8]),
    /// The begin of one.
    Incomplete,
    /// A length that no command has. Where the next frame begins is lost with it.
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
    fn frames_are_taken_apart_as_they_were_put_together() {
        let (mut bytes, mut counter) = (Vec::new(), u16::MAX);
        push(&mut bytes, &mut counter, [&[1, 2], &[3]]);
        push(&mut bytes, &mut counter, [&[4], &[]]);
        assert_eq!((bytes[2..4].to_vec(), counter), (vec![0xff, 0xff], 1));
        let Next::Packet(first, rest) = next(&bytes, 8) else { panic!("a frame") };
        assert_eq!((first, next(rest, 8)), (&[1, 2, 3][..], Next::Packet(&[4], &[])));
    }

    #[test]
    fn a_length_that_cannot_be_is_told_from_one_that_is_not_there_yet() {
        assert_eq!(next(&[], 8), Next::Incomplete);
        assert_eq!(next(&[1, 0, 0, 0], 8), Next::Incomplete);
        assert_eq!(next(&[0, 0, 0, 0], 8), Next::Corrupt);
        assert_eq!(next(&[9, 0], 8), Next::Corrupt);
    }
}
