//! Frames of any bytes.

use super::bus::{Bus, frame};

/// Numbers from a seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() >> 11) as usize % limit.max(1)
    }

    fn bytes(&mut self, most: usize) -> Vec<u8> {
        let length = self.below(most + 1);
        (0..length).map(|_| self.next() as u8).collect()
    }
}

/// Addresses at which something happens.
const PLACES: [u16; 24] = [
    0x0000, 0x0010, 0x0100, 0x0120, 0x0130, 0x0400, 0x0420, 0x0500, 0x0502, 0x0508, 0x0600, 0x0610, 0x0800, 0x080E,
    0x0810, 0x0900, 0x0910, 0x0920, 0x0981, 0x0990, 0x1000, 0x1080, 0x1FF0, 0xFFF8,
];

#[test]
fn no_frame_of_any_bytes_stops_the_segment() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let mut bus = Bus::new(2, 1);
    for round in 0..40_000 {
        if round % 4_000 == 0 {
            bus = Bus::new(2, 1);
            bus.reach_operational(2);
        }
        let data = random.bytes(160);
        let place = PLACES[random.below(PLACES.len())].wrapping_add(random.below(4) as u16);
        let device = [0, 0xFFFF, 0x1001, 0x1002, random.next() as u16][random.below(5)];
        let mut bytes = match random.below(4) {
            0 => random.bytes(1514),
            _ => frame(&[(random.below(16) as u8, device, place, &data), (random.next() as u8, 0, place, &data)]),
        };
        // Some bits of a valid frame are wrong, or its end is missing.
        for _ in 0..random.below(4) {
            let at = random.below(bytes.len());
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << random.below(8);
            }
        }
        if random.below(8) == 0 {
            bytes.truncate(random.below(bytes.len()));
        }
        let length = bytes.len();
        bus.now += random.next() % 300_000;
        bus.segment.pass(&mut bytes, bus.now);
        assert_eq!(bytes.len(), length);
    }
    assert!(bus.segment.counters().frames > 1000 && bus.segment.counters().foreign > 100);
}

#[test]
fn no_mailbox_message_of_any_bytes_stops_a_device() {
    let mut random = Random(0xD1B5_4A32_D192_ED03);
    let mut bus = Bus::new(1, 0);
    bus.reach_pre_operational();
    for round in 0..40_000_u32 {
        let services = [0x20, 0x80, random.next() as u8];
        let mut message = vec![random.below(140) as u8, 0, 0, 0, 0, 3 | ((round % 7) as u8 + 1) << 4];
        message.extend([0, services[random.below(3)], random.next() as u8]);
        let index = [0x1C12, 0x1600, 0x2001, 0x6072, 0x1C00, random.next() as u16][random.below(6)];
        message.extend(index.to_le_bytes());
        message.extend([random.below(10) as u8]);
        message.extend(random.bytes(130));
        message.resize(128, 0);
        let _ = bus.try_send(super::bus::APWR, 0, 0x1000, &message);
        let _ = bus.try_send(super::bus::APRD, 0, 0x1080, &[0; 128]);
    }
    // It still answers.
    while bus.try_send(super::bus::APRD, 0, 0x1080, &[0; 128]).is_none_or(|(_, counter)| counter > 0) {}
    assert_eq!(bus.upload(0, 0x6076, 0), Ok(500));
}
