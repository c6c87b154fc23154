//! Files that are not recordings, or damaged.

use proptest::prelude::{ProptestConfig, any, proptest};

use super::super::block::Blocks;
use super::super::recovery::repaired;
use super::other_programs::{cn, other_file};
use super::*;

#[test]
fn unsupported_files_are_reported_with_a_remedy() {
    let none = |_: &mut Blocks| 0;
    let one = |blocks: &mut Blocks| cn(blocks, 0, "x", [0, 0, 0], 0, 8, 0);
    let refused = |file: Vec<u8>, part: &str| {
        let fault = contents(&file).unwrap_err();
        assert!(fault.fault.contains(part) && !fault.remedy.is_empty(), "{fault:?}");
    };
    refused(other_file(1, 1, one, |blocks| blocks.push(b"LD", &[], &[&[0; 8]])), "blocks of the kind LD");
    refused(other_file(1, 1, one, |blocks| blocks.push(b"DZ", &[], &[b"DT", &[2; 22]])), "method 2");
    refused(other_file(1, 1, |blocks| cn(blocks, 0, "x", [0, 0, 0], 0, 8, 0), none), "fewer than stated");
    let narrow = |blocks: &mut Blocks| cn(blocks, 0, "x", [0, 4, 0], 0, 16, 0);
    refused(other_file(2, 0, narrow, none), "numbers of 16 bits");
    refused(other_file(1, 0, |blocks| cn(blocks, 0, "x", [0, 0, 0], 7, 8, 0), none), "outside its record");
    refused(other_file(0, 1 << 40, |blocks| cn(blocks, 0, "x", [3, 0, 0], 0, 0, 0), none), "has no bytes");
    // A list that links to itself; a list that contains one block several times.
    let circle = |blocks: &mut Blocks| {
        let own = blocks.end();
        blocks.push(b"DL", &[own], &[&[0; 16]])
    };
    refused(other_file(1, 1, one, circle), "in a circle");
    let twice = |blocks: &mut Blocks| {
        let data = blocks.push(b"DT", &[], &[&[1; 64]]);
        blocks.push(b"DL", &[0].into_iter().chain([data; 64]).collect::<Vec<_>>(), &[&[0; 16]])
    };
    refused(other_file(1, 1, one, twice), "in a circle");
    let mut unsorted = other_file(1, 1, one, none);
    let place = unsorted.len() - 8;
    unsorted[place] = 1;
    refused(unsorted, "not sorted");
    let mut unfinished = other_file(1, 1, one, none);
    unfinished[..8].copy_from_slice(b"UnFinMF ");
    refused(unfinished, "unfinished file of another program");
    let mut old = other_file(1, 1, one, none);
    old[28..30].copy_from_slice(&330u16.to_le_bytes());
    refused(old, "this is MDF 3");
}

#[test]
fn a_wrong_byte_anywhere_never_panics() {
    let disk = full_disk();
    let writer = small_run(&disk).1;
    let unfinished = disk.contents();
    writer.finish().unwrap();
    let finished = disk.contents();
    for bytes in [unfinished, finished] {
        for place in 0..bytes.len() {
            for change in [0xff, 0x01, 0x80] {
                let mut wrong = bytes.clone();
                wrong[place] ^= change;
                let _ = contents(&wrong);
                let _ = repaired(&wrong);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn wrong_bytes_behind_the_head_give_no_wrong_sample(changes in proptest::collection::vec((any::<u16>(), any::<u8>()), 1..6)) {
        let disk = full_disk();
        let (lengths, _writer) = small_run(&disk);
        let mut bytes = disk.contents();
        let head = lengths[0].0;
        for (place, value) in changes {
            let place = head + usize::from(place) % (bytes.len() - head);
            bytes[place] = value;
        }
        let repaired = repaired(&bytes).unwrap();
        // An event or an attachment may be damaged; then the file is refused.
        if let Ok(contents) = contents(&repaired) {
            let cycles = cycles(&contents);
            assert!(cycles.is_sorted() && cycles.len() <= 40);
        }
    }
}
