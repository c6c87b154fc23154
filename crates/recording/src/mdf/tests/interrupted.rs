//! Unfinished files.

use super::super::recovery::repaired;
use super::super::{Summary, read, recover};
use super::*;

#[test]
fn a_file_cut_anywhere_gives_all_blocks_before_the_cut_and_no_wrong_sample() {
    let disk = full_disk();
    let (lengths, writer) = small_run(&disk);
    let unfinished = disk.contents();
    writer.finish().unwrap();
    let finished = disk.contents();
    for bytes in [&unfinished, &finished] {
        for end in 0..=bytes.len() {
            let rows_before = |end| lengths.iter().rev().find(|(length, _)| *length <= end).map(|(_, rows)| *rows);
            match (repaired(&bytes[..end]), rows_before(end)) {
                (Ok(complete), Some(rows)) => {
                    let read = contents(&complete).unwrap();
                    let cycles = cycles(&read);
                    // A block is complete without its padding of at most seven zeros.
                    assert!(cycles.len() == rows || Some(cycles.len()) == rows_before(end + 7), "cut at {end}");
                    assert!(cycles.into_iter().zip(5..).all(|(cycle, expected)| cycle == expected), "cut at {end}");
                    assert!(read.events.len() + 1 >= rows / 10 && read.header == header(), "cut at {end}");
                }
                (Err(fault), None) => assert!(fault.fault.contains("the file ends"), "{fault:?}"),
                (repaired, rows) => panic!("cut at {end}: {rows:?}, {:?}", repaired.map(|bytes| bytes.len())),
            }
        }
    }
    // A finished file that was cut is refused; an unfinished one is read as far as it goes.
    assert!(!contents(&unfinished).unwrap().finished);
    let cut = contents(&finished[..finished.len() - 8]).unwrap_err();
    assert!(cut.fault.contains("no complete block") && cut.remedy.contains("copy it again"), "{cut:?}");
}

#[test]
fn a_disk_that_is_full_after_any_byte_has_all_flushed_rows() {
    let complete = full_disk();
    small_run(&complete).1.finish().unwrap();
    let mut torn = 0;
    for room in 0.. {
        let disk = Disk::with_room(room);
        let mut flushed = 0;
        let mut run = || -> Result<(), Error> {
            let mut writer = writer(&disk)?;
            writer.attach("clm-bench.toml", "application/toml", b"[plant]\n")?;
            for cycle in 0..40 {
                writer.row(cycle, &values(cycle))?;
                if cycle % 10 == 9 {
                    writer.flush()?;
                    flushed = cycle as usize + 1;
                    writer.event(&event(cycle))?;
                }
            }
            writer.finish().map(drop)
        };
        let Err(error) = run() else { break };
        assert!(error.to_string().starts_with("run.mf4: cannot write it"), "{error}");
        match repaired(&disk.contents()) {
            Ok(repaired) => {
                let read = contents(&repaired).unwrap();
                let rows = cycles(&read).len();
                // A block is written before its link, so that there may be one more than flushed.
                assert!(rows == flushed || rows == flushed + 10, "{rows} of {flushed} after {room} bytes");
                torn += usize::from(rows > flushed);
            }
            Err(fault) => assert!(flushed == 0 && fault.fault.contains("the file ends"), "{room}: {fault:?}"),
        }
    }
    // The disk was full once at each byte of the four links of eight bytes, or within the padding of a block.
    assert!((4 * 8..4 * 16).contains(&torn), "{torn}");
}

#[test]
fn a_writer_continues_when_there_is_space() {
    for room in (600..4_000).step_by(97) {
        let disk = Disk::with_room(room);
        let Ok(mut writer) = writer(&disk) else { continue };
        let mut recorded = Vec::new();
        for cycle in 0..2_000 {
            match writer.row(cycle, &values(cycle)) {
                Ok(()) => recorded.push(cycle),
                Err(error) => assert!(error.to_string().contains("cannot write"), "{error}"),
            }
            if cycle == 1_500 {
                disk.make_room();
            }
        }
        writer.event(&event(1)).unwrap();
        writer.finish().unwrap();
        let read = contents(&disk.contents()).unwrap();
        assert!(read.finished && read.events.len() == 1);
        assert_eq!(cycles(&read), recorded, "{room}");
        // One block of 400 rows waits for space.
        assert!(recorded.contains(&1_501) && (500..1_200).contains(&recorded.len()), "{room}: {}", recorded.len());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_an_error_with_a_remedy() {
    let error = Writer::create(Path::new("/dev/full"), &header(), &channels(), 1.0).map(drop).unwrap_err();
    let message = error.to_string();
    assert!(message.starts_with("/dev/full: cannot write it") && message.contains("make room"), "{message}");
}

#[test]
fn recovery_in_place_finishes_a_file_and_changes_no_finished_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    let disk = full_disk();
    let writer = small_run(&disk).1;
    let mut unfinished = disk.contents();
    unfinished.extend(b"##DL torn");
    std::fs::write(&path, &unfinished).unwrap();
    let summary = recover(&path).unwrap();
    assert_eq!(summary, Summary { rows: 40, bytes: unfinished.len() as u64, discarded: 9 });
    let read = read(&path).unwrap();
    assert!(read.finished && read.events.len() == 4 && read.attachments.len() == 1);
    assert_eq!(cycles(&read).len(), 40);
    let once = std::fs::read(&path).unwrap();
    assert_eq!(recover(&path).unwrap(), summary);
    assert_eq!(std::fs::read(&path).unwrap(), once);
    writer.finish().unwrap();
    std::fs::write(&path, disk.contents()).unwrap();
    assert_eq!(recover(&path).unwrap().discarded, 0);
    assert_eq!(std::fs::read(&path).unwrap(), disk.contents());
}

#[test]
fn a_block_with_a_wrong_checksum_is_left_out_and_no_other() {
    let disk = full_disk();
    let (lengths, _writer) = small_run(&disk);
    for damaged in 0..4 {
        let mut bytes = disk.contents();
        bytes[lengths[damaged + 1].0 - 12] ^= 1;
        let repaired = repaired(&bytes).unwrap();
        let expected: Vec<u64> = (0..40).filter(|row| row / 10 != damaged as u64).map(|row| row + 5).collect();
        assert_eq!(cycles(&contents(&repaired).unwrap()), expected);
        // Marked as finished it is refused, not repaired silently.
        bytes[60] = 0;
        bytes[..8].copy_from_slice(b"MDF     ");
        assert!(contents(&bytes).unwrap_err().fault.contains("checksum"));
    }
}
