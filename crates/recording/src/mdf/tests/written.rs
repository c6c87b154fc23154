//! Finished files.

use super::super::{Summary, read, recover};
use super::*;
use crate::Recording;

#[test]
fn a_file_reads_back_bit_identically() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    std::fs::write(&path, [b'x'; 100_000]).unwrap();
    let mut writer = Writer::create(&path, &header(), &channels(), TICK_TIME).unwrap();
    writer.attach("clm-bench.toml", "application/toml", &[7; 70_000]).unwrap();
    writer.attach("empty", "", b"").unwrap();
    for cycle in 3..2_003 {
        writer.row(cycle, &values(cycle)).unwrap();
    }
    writer.event(&event(700)).unwrap();
    writer.event(&Event { comment: String::new(), cause: Cause::User, ..event(2_000) }).unwrap();
    let summary = writer.finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(summary, Summary { rows: 2_000, bytes: bytes.len() as u64, discarded: 0 });
    let read = read(&path).unwrap();
    assert!(read.finished);
    assert_eq!(read.header, header());
    assert_eq!(cycles(&read), (3..2_003).collect::<Vec<_>>());
    assert_eq!(read.groups[0].signals[2].channel, channels()[0]);
    assert_eq!(read.groups[0].signals[0].channel.unit, "s");
    assert_eq!(read.events[0], (700.0 * TICK_TIME, event(700)));
    assert_eq!((read.events[1].1.cause, read.events.len()), (Cause::User, 2));
    assert_eq!(read.attachments[0].bytes, [7; 70_000]);
    assert_eq!((&*read.attachments[1].name, &*read.attachments[1].bytes), ("empty", &b""[..]));
    // Read as a recording.
    let recording = Recording::parse(&path, &bytes).unwrap();
    assert_eq!(recording.columns()[2].unit.as_deref(), Some("rad/s"));
    assert_eq!(recording.columns()[1].unit.as_deref(), Some("1"));
}

#[test]
fn a_recording_may_have_no_rows_or_channels() {
    let disk = full_disk();
    let summary = writer(&disk).unwrap().finish().unwrap();
    assert_eq!(summary.rows, 0);
    assert_eq!(cycles(&contents(&disk.contents()).unwrap()), [0; 0]);
    let disk = full_disk();
    let mut without_channels = Writer::on(Path::new("x"), Box::new(disk.clone()), &header(), &[], 1.0).unwrap();
    without_channels.row(7, &[]).unwrap();
    without_channels.finish().unwrap();
    assert_eq!(contents(&disk.contents()).unwrap().groups[0].signals[0].values, [7.0]);
}

#[test]
fn a_block_ends_after_a_tenth_of_a_second_or_a_megabyte() {
    let blocks = |disk: &Disk| disk.contents().windows(4).filter(|name| name == b"##DZ").count();
    let disk = full_disk();
    let mut by_time = writer(&disk).unwrap();
    // 0.1 s are 400 ticks; the last block is not full and not yet written.
    for cycle in 0..4_001 {
        by_time.row(cycle, &values(cycle)).unwrap();
    }
    assert_eq!(blocks(&disk), 10);
    let disk = full_disk();
    let wide: Vec<_> = (0..1_000).map(|i| channel(&format!("x{i}"), "m", "")).collect();
    let mut by_size = Writer::on(Path::new("x"), Box::new(disk.clone()), &header(), &wide, 1e-6).unwrap();
    for cycle in 0..1_000 {
        by_size.row(cycle, &[1.0; 1_000]).unwrap();
    }
    // 130 rows of 8016 bytes fit.
    assert_eq!(blocks(&disk), 7);
}

#[test]
fn two_writers_and_a_recovery_do_not_share_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    let mut first = Writer::create(&path, &header(), &channels(), TICK_TIME).unwrap();
    first.row(1, &values(1)).unwrap();
    first.flush().unwrap();
    let second = Writer::create(&path, &header(), &channels(), TICK_TIME).map(drop).unwrap_err();
    let recovery = recover(&path).unwrap_err();
    for error in [second, recovery] {
        assert!(error.to_string().contains("another process is recording"), "{error}");
    }
    // Reading it is possible.
    assert_eq!(cycles(&read(&path).unwrap()), [1]);
    first.finish().unwrap();
    assert_eq!(recover(&path).unwrap().rows, 1);
}

#[test]
fn cycles_increase_and_names_are_unique() {
    let disk = full_disk();
    let mut writer = writer(&disk).unwrap();
    writer.row(5, &values(5)).unwrap();
    let error = writer.row(5, &values(5)).unwrap_err().to_string();
    assert!(error.starts_with("run.mf4: cycle 5 is not after cycle 5"), "{error}");
    for names in [["x", "x"], ["time", "x"], ["x", "cycle"], ["x", ""]] {
        let channels = names.map(|name| channel(name, "", ""));
        let error = Writer::on(Path::new("x"), Box::new(disk.clone()), &header(), &channels, 1.0).map(drop);
        assert!(error.unwrap_err().to_string().contains("is empty or not unique"));
    }
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = Writer::on(Path::new("x"), Box::new(disk.clone()), &header(), &channels(), period).map(drop);
        assert!(error.unwrap_err().to_string().contains("invalid tick time"));
    }
}
