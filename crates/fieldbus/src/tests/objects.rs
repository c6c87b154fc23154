//! Object dictionary over the mailbox.

use super::bus::Bus;
use crate::esc::memory::SYNC_MANAGER;

fn bus() -> Bus {
    let mut bus = Bus::new(1, 1);
    bus.reach_pre_operational();
    bus
}

#[test]
fn entries_are_read_and_written_within_their_access_and_range() {
    let mut bus = bus();
    assert_eq!(bus.upload(0, 0x6076, 0), Ok(500));
    assert_eq!(bus.upload(0, 0x1018, 0), Ok(4));
    assert_eq!(bus.download(0, 0x6072, 0, &[0xE8, 3]), Ok(()));
    assert_eq!(bus.upload(0, 0x6072, 0), Ok(1000));
    for (index, subindex, bytes, code) in [
        (0x6076, 0, &[0; 4][..], 0x0601_0002),
        (0x6072, 0, &[0; 1], 0x0607_0010),
        (0x6072, 1, &[0; 2], 0x0609_0011),
        (0x5000, 0, &[0; 2], 0x0602_0000),
        (0x6060, 0, &[7], 0x0609_0030),
    ] {
        assert_eq!(bus.download(0, index, subindex, bytes), Err(code), "{index:#x}");
    }
    assert_eq!(bus.upload(1, 0x6040, 0), Err(0x0602_0000));
}

/// Upload in segments.
fn segmented(bus: &mut Bus, index: u16) -> String {
    let [low, high] = index.to_le_bytes();
    let answer = bus.message(0, &[0, 0x20, 0x40, low, high, 0, 0, 0, 0, 0]);
    assert_eq!(answer[2], 0x41);
    let size = u32::from_le_bytes(*answer[6..].first_chunk().unwrap()) as usize;
    let (mut bytes, mut toggle) = (answer[10..].to_vec(), 0);
    while bytes.len() < size {
        let answer = bus.message(0, &[0, 0x20, 0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(answer[2] & 0xF0, toggle);
        let unused = if answer.len() == 10 { usize::from(answer[2] >> 1 & 7) } else { 0 };
        bytes.extend(&answer[3..answer.len() - unused]);
        assert_eq!(answer[2] & 1 == 1, bytes.len() == size);
        toggle ^= 0x10;
    }
    String::from_utf8(bytes).unwrap()
}

#[test]
fn a_text_longer_than_the_mailbox_is_read_in_segments() {
    let mut bus = bus();
    let notice = segmented(&mut bus, 0x2000);
    assert!(notice.len() > 128 && notice.contains("without claim of conformance"), "{notice}");
}

#[test]
fn a_text_longer_than_the_mailbox_is_written_in_segments() {
    let mut bus = bus();
    let text: String = ('a'..='z').cycle().take(119 + 119 + 3).collect();
    let mut request = vec![0, 0x20, 0x21, 0x01, 0x20, 0];
    request.extend((text.len() as u32).to_le_bytes());
    assert_eq!(bus.message(0, &request)[2], 0x60);
    for (number, part) in text.as_bytes().chunks(119).enumerate() {
        let toggle = (number as u8 & 1) << 4;
        let (is_last, unused) = (u8::from(number == 2), if part.len() < 7 { 7 - part.len() as u8 } else { 0 });
        let mut segment = vec![0, 0x20, toggle | unused << 1 | is_last];
        segment.extend(part);
        segment.resize(segment.len() + usize::from(unused), 0);
        assert_eq!(bus.message(0, &segment)[2], 0x20 | toggle);
    }
    assert_eq!(segmented(&mut bus, 0x2001), text);
    // The same toggle bit twice.
    bus.message(0, &request);
    bus.message(0, &[0, 0x20, 0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(bus.message(0, &[0, 0x20, 0, 1, 2, 3, 4, 5, 6, 7])[6..], 0x0503_0000_u32.to_le_bytes());
}

#[test]
fn complete_access_reads_and_writes_whole_objects() {
    let mut bus = bus();
    let answer = bus.message(0, &[0, 0x20, 0x50, 0x00, 0x1C, 0, 0, 0, 0, 0]);
    assert_eq!(answer[6..], [6, 0, 0, 0, 4, 0, 1, 2, 3, 4]);
    let request = [0, 0x20, 0x31, 0x12, 0x1C, 0, 6, 0, 0, 0, 2, 0, 0x00, 0x16, 0x01, 0x16];
    assert_eq!(bus.message(0, &request)[2], 0x60);
    assert_eq!([0, 1, 2].map(|at| bus.upload(0, 0x1C12, at).unwrap()), [2, 0x1600, 0x1601]);
}

#[test]
fn process_data_is_assigned_and_mapped_in_pre_op_with_a_count_of_zero_first() {
    let mut bus = bus();
    assert_eq!(bus.download(0, 0x1C12, 1, &[0x01, 0x16]), Err(0x0601_0000));
    bus.download(0, 0x1C12, 0, &[0]).unwrap();
    assert_eq!(bus.download(0, 0x1C12, 1, &[0x00, 0x1A]), Err(0x0609_0030));
    bus.download(0, 0x1600, 0, &[0]).unwrap();
    // An input, a wrong length, an object that does not exist.
    for entry in [0x6041_0010_u32, 0x6040_0008, 0x5000_0010] {
        assert!(bus.download(0, 0x1600, 1, &entry.to_le_bytes()).is_err(), "{entry:#x}");
    }
    bus.download(0, 0x1600, 1, &0x6040_0010_u32.to_le_bytes()).unwrap();
    bus.download(0, 0x1600, 0, &[1]).unwrap();
    bus.download(0, 0x1C12, 1, &[0x00, 0x16]).unwrap();
    bus.download(0, 0x1C12, 0, &[1]).unwrap();
    bus.manager(0, 2, 0x1100, 2, 0x64);
    bus.manager(0, 3, 0x1200, 16, 0x20);
    assert_eq!(bus.request(0, 4), (4, 0));
    assert_eq!(bus.download(0, 0x1C12, 0, &[0]), Err(0x0800_0022));
}

#[test]
fn information_lists_and_describes_all_objects() {
    let mut bus = bus();
    let mut answer = bus.message(0, &[0, 0x80, 1, 0, 0, 0, 1, 0]);
    let mut list = answer[6..].to_vec();
    while answer[2] & 0x80 != 0 {
        answer = bus.answer(0);
        list.extend(&answer[6..]);
    }
    assert_eq!(answer[4..6], [0, 0]);
    let indices: Vec<u16> = list[2..].chunks(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
    assert!(indices.len() > 50 && indices.is_sorted() && indices.contains(&0x60B2), "{indices:x?}");
    for index in indices {
        let [low, high] = index.to_le_bytes();
        let object = bus.message(0, &[0, 0x80, 3, 0, 0, 0, low, high]);
        assert_eq!(object[2], 4);
        for subindex in 0..=object[10] {
            assert_eq!(bus.message(0, &[0, 0x80, 5, 0, 0, 0, low, high, subindex, 0])[2], 6);
        }
    }
    assert_eq!(bus.message(0, &[0, 0x80, 3, 0, 0, 0, 0, 0x50])[2], 7);
}

#[test]
fn a_lost_answer_is_repeated_and_a_repeated_request_is_not_executed_again() {
    let mut bus = bus();
    let mut request = vec![10, 0, 0, 0, 0, 0x73, 0, 0x20, 0x40, 0x76, 0x60, 0];
    request.resize(128, 0);
    bus.write(0, 0x1000, &request);
    let answer = bus.read(0, 0x1080, 128);
    bus.write(0, 0x1000, &request);
    assert_eq!(bus.send(super::bus::APRD, 0, 0x1080, &[0; 128]).1, 0, "nothing is waiting");
    bus.write(0, SYNC_MANAGER + 14, &[3]);
    assert_eq!(bus.read(0, SYNC_MANAGER + 15, 1)[0] & 2, 2);
    assert_eq!(bus.read(0, 0x1080, 128), answer);
}

#[test]
fn other_protocols_are_refused_by_a_mailbox_error() {
    let mut bus = bus();
    let mut request = vec![4, 0, 0, 0, 0, 0x12, 1, 2, 3, 4];
    request.resize(128, 0);
    bus.write(0, 0x1000, &request);
    assert_eq!(bus.read(0, 0x1080, 128)[..10], [4, 0, 0, 0, 0, 0x10, 1, 0, 2, 0]);
}
