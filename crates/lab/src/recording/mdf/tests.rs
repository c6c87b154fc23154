//! What is written comes back, whatever interrupts the writer; hostile files are refused.

use std::io::{self, Cursor, ErrorKind, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, UNIX_EPOCH};

use proptest::prelude::{ProptestConfig, any, proptest};

use super::block::Blocks;
use super::recovery::repaired;
use super::writer::Storage;
use super::*;

const TICK_TIME: f64 = 250e-6;

/// A disk with limited room, whose contents outlive the writer.
#[derive(Clone, Default)]
struct Disk {
    bytes: Arc<Mutex<Cursor<Vec<u8>>>>,
    room: Arc<Mutex<usize>>,
}

impl Disk {
    fn with_room(room: usize) -> Self {
        Disk { room: Arc::new(Mutex::new(room)), ..Disk::default() }
    }

    fn contents(&self) -> Vec<u8> {
        self.bytes.lock().unwrap().get_ref().clone()
    }

    fn make_room(&self) {
        *self.room.lock().unwrap() = usize::MAX;
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut room = self.room.lock().unwrap();
        let taken = bytes.len().min(*room);
        if taken == 0 && !bytes.is_empty() {
            return Err(ErrorKind::StorageFull.into());
        }
        *room -= taken;
        self.bytes.lock().unwrap().write(&bytes[..taken])
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, place: SeekFrom) -> io::Result<u64> {
        self.bytes.lock().unwrap().seek(place)
    }
}

impl Storage for Disk {
    fn settle(&mut self, length: u64) -> io::Result<()> {
        self.bytes.lock().unwrap().settle(length)
    }
}

fn header() -> Header {
    Header {
        start: UNIX_EPOCH + Duration::from_nanos(1_763_812_345_678_901_234),
        program: "stickslip".into(),
        version: "0.1.0".into(),
        comment: "M_S < 0.3 N·m & \"quiet\"\nsecond line\twith a tab".into(),
        properties: vec![("preset".into(), "clm-bench".into()), ("a <b> & \"c\"".into(), "ü\r\n".into())],
    }
}

fn channel(name: &str, unit: &str, comment: &str) -> Channel {
    Channel { name: name.into(), unit: unit.into(), comment: comment.into() }
}

fn channels() -> Vec<Channel> {
    vec![channel("Ω_est", "rad/s", "estimated velocity"), channel("torque", "N m", "")]
}

fn event(cycle: u64) -> Event {
    Event { cycle, name: "fault".into(), comment: "limit < 2 rad/s".into(), cause: Cause::Error }
}

/// Values that are hard to keep, and ordinary ones.
fn values(cycle: u64) -> [f64; 2] {
    let odd = [f64::NAN, -0.0, f64::INFINITY, 5e-324, -f64::MAX];
    [libm::sin(cycle as f64 * 0.37), odd.get(cycle as usize % 20).copied().unwrap_or(cycle as f64 * 0.1)]
}

fn writer(disk: &Disk) -> Result<Writer, Error> {
    Writer::on(Path::new("run.mf4"), Box::new(disk.clone()), &header(), &channels(), TICK_TIME)
}

/// Cycles recorded, after a check of all their values to the bit.
fn cycles(contents: &Contents) -> Vec<u64> {
    let [group] = &contents.groups[..] else { panic!("{} groups", contents.groups.len()) };
    let names: Vec<_> = group.signals.iter().map(|signal| signal.channel.name.as_str()).collect();
    assert_eq!(names, ["time", "cycle", "Ω_est", "torque"]);
    let [time, cycle, first, second] = &group.signals[..] else { panic!("four signals") };
    let cycles: Vec<u64> = cycle.values.iter().map(|cycle| *cycle as u64).collect();
    for (row, cycle) in cycles.iter().enumerate() {
        let wanted = values(*cycle);
        assert_eq!(time.values[row], *cycle as f64 * TICK_TIME);
        assert_eq!(first.values[row].to_bits(), wanted[0].to_bits(), "cycle {cycle}");
        assert_eq!(second.values[row].to_bits(), wanted[1].to_bits(), "cycle {cycle}");
    }
    cycles
}

fn contents(bytes: &[u8]) -> Result<Contents, Fault> {
    reader::contents(bytes)
}

/// A small run: its cycles, and the length of the file behind each part of it with the rows that it then has.
fn small_run(disk: &Disk) -> (Vec<(usize, usize)>, Writer) {
    let mut writer = writer(disk).unwrap();
    let mut lengths = vec![(disk.contents().len(), 0)];
    writer.attach("clm-bench.toml", "application/toml", b"[plant]\n").unwrap();
    for block in 0..4 {
        for cycle in 10 * block..10 * block + 10 {
            writer.row(cycle + 5, &values(cycle + 5)).unwrap();
        }
        writer.flush().unwrap();
        lengths.push((disk.contents().len(), 10 * (block as usize + 1)));
        writer.event(&event(10 * block)).unwrap();
    }
    (lengths, writer)
}

fn full_disk() -> Disk {
    Disk::with_room(usize::MAX)
}

#[test]
fn what_was_written_reads_back_to_the_bit() {
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
    // As any recording.
    let recording = Recording::parse(&path, &bytes).unwrap();
    assert_eq!(recording.columns()[2].unit.as_deref(), Some("rad/s"));
    assert_eq!(recording.columns()[1].unit, None);
}

#[test]
fn a_recording_without_rows_or_channels_is_one() {
    let disk = full_disk();
    let summary = writer(&disk).unwrap().finish().unwrap();
    assert_eq!(summary.rows, 0);
    assert_eq!(cycles(&contents(&disk.contents()).unwrap()), [0; 0]);
    let disk = full_disk();
    let mut none = Writer::on(Path::new("x"), Box::new(disk.clone()), &header(), &[], 1.0).unwrap();
    none.row(7, &[]).unwrap();
    none.finish().unwrap();
    assert_eq!(contents(&disk.contents()).unwrap().groups[0].signals[0].values, [7.0]);
}

#[test]
fn a_block_ends_after_a_tenth_of_a_second_and_a_megabyte() {
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
fn a_file_cut_anywhere_gives_all_blocks_before_the_cut_and_no_wrong_sample() {
    let disk = full_disk();
    let (lengths, writer) = small_run(&disk);
    let unfinished = disk.contents();
    writer.finish().unwrap();
    let finished = disk.contents();
    for bytes in [&unfinished, &finished] {
        for end in 0..=bytes.len() {
            let held = |end| lengths.iter().rev().find(|(length, _)| *length <= end).map(|(_, rows)| *rows);
            match (repaired(&bytes[..end]), held(end)) {
                (Ok(whole), Some(rows)) => {
                    let read = contents(&whole).unwrap();
                    let cycles = cycles(&read);
                    // A block is whole without the zeros, at most seven, that fill it up.
                    assert!(cycles.len() == rows || Some(cycles.len()) == held(end + 7), "cut at {end}");
                    assert!(cycles.into_iter().zip(5..).all(|(cycle, wanted)| cycle == wanted), "cut at {end}");
                    assert!(read.events.len() + 1 >= rows / 10 && read.header == header(), "cut at {end}");
                }
                (Err(fault), None) => assert!(fault.fault.contains("it ends"), "{fault:?}"),
                (repaired, rows) => panic!("cut at {end}: {rows:?}, {:?}", repaired.map(|bytes| bytes.len())),
            }
        }
    }
    // A finished file that was cut is not taken for whole; one that was not finished is taken for what it is.
    assert!(!contents(&unfinished).unwrap().finished);
    let cut = contents(&finished[..finished.len() - 8]).unwrap_err();
    assert!(cut.fault.contains("no whole block") && cut.remedy.contains("copy it again"), "{cut:?}");
}

#[test]
fn a_disk_that_fills_up_after_any_byte_leaves_all_that_was_flushed() {
    let whole = full_disk();
    small_run(&whole).1.finish().unwrap();
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
                // A block is there before its link is, so that there may be one more than was promised.
                assert!(rows == flushed || rows == flushed + 10, "{rows} of {flushed} after {room} bytes");
                torn += usize::from(rows > flushed);
            }
            Err(fault) => assert!(flushed == 0 && fault.fault.contains("it ends"), "{room}: {fault:?}"),
        }
    }
    // Within each of the four links of eight bytes the disk was full once a byte, or within zeros that fill a block.
    assert!((4 * 8..4 * 16).contains(&torn), "{torn}");
}

#[test]
fn a_writer_goes_on_once_there_is_room() {
    for room in (600..4_000).step_by(97) {
        let disk = Disk::with_room(room);
        let Ok(mut writer) = writer(&disk) else { continue };
        let mut taken = Vec::new();
        for cycle in 0..2_000 {
            match writer.row(cycle, &values(cycle)) {
                Ok(()) => taken.push(cycle),
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
        assert_eq!(cycles(&read), taken, "{room}");
        // What waits for room is one block, of 400 rows.
        assert!(taken.contains(&1_501) && (500..1_200).contains(&taken.len()), "{room}: {}", taken.len());
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
    let mut bytes = disk.contents();
    bytes[lengths[2].0 - 12] ^= 1;
    let repaired = repaired(&bytes).unwrap();
    let wanted: Vec<u64> = (5..15).chain(25..45).collect();
    assert_eq!(cycles(&contents(&repaired).unwrap()), wanted);
    // Marked as finished it is refused, not mended in silence.
    bytes[60] = 0;
    bytes[..8].copy_from_slice(b"MDF     ");
    assert!(contents(&bytes).unwrap_err().fault.contains("checksum"));
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
    // A look at it does no harm.
    assert_eq!(cycles(&read(&path).unwrap()), [1]);
    first.finish().unwrap();
    assert_eq!(recover(&path).unwrap().rows, 1);
}

#[test]
fn cycles_go_up_and_names_are_unique() {
    let disk = full_disk();
    let mut writer = writer(&disk).unwrap();
    writer.row(5, &values(5)).unwrap();
    let error = writer.row(5, &values(5)).unwrap_err().to_string();
    assert!(error.starts_with("run.mf4: cycle 5 was to be recorded behind cycle 5"), "{error}");
    for names in [["x", "x"], ["time", "x"], ["x", "cycle"]] {
        let channels = names.map(|name| channel(name, "", ""));
        let error = Writer::on(Path::new("x"), Box::new(disk.clone()), &header(), &channels, 1.0).map(drop);
        assert!(error.unwrap_err().to_string().contains("two channels"));
    }
}

/// A file of another program: one group of records of `length` bytes, its channels and its data.
fn foreign(
    length: u32,
    rows: u64,
    channels: impl Fn(&mut Blocks) -> u64,
    data: impl Fn(&mut Blocks) -> u64,
) -> Vec<u8> {
    let mut blocks = Blocks::at(0);
    blocks.bytes.extend([&b"MDF     4.10    another "[..], &[0; 4], &410u16.to_le_bytes(), &[0; 34]].concat());
    let hd = blocks.push(b"HD", &[0; 6], &[&[0; 32]]);
    let first = channels(&mut blocks);
    let data = data(&mut blocks);
    let sizes = [length.to_le_bytes(), [0; 4]].concat();
    let cg = blocks.push(b"CG", &[0, first, 0, 0, 0, 0], &[&[0; 8], &rows.to_le_bytes(), &[0; 8], &sizes]);
    let dg = blocks.push(b"DG", &[0, cg, data, 0], &[&[0; 8]]);
    blocks.set_link(hd, 0, dg);
    blocks.bytes
}

/// A channel: kind, kind of number, first bit, first byte, bits, conversion.
fn cn(blocks: &mut Blocks, next: u64, name: &str, kind: [u8; 3], start: u32, bits: u32, conversion: u64) -> u64 {
    let name = blocks.text(b"TX", name);
    let data = [[kind[0], 0, kind[1], kind[2]], start.to_le_bytes(), bits.to_le_bytes()].concat();
    blocks.push(b"CN", &[next, 0, name, 0, conversion, 0, 0, 0], &[&data, &[0; 60]])
}

fn cc(blocks: &mut Blocks, kind: u8, parameters: &[f64]) -> u64 {
    let parameters: Vec<u8> = parameters.iter().flat_map(|p| p.to_le_bytes()).collect();
    let unit = blocks.text(b"MD", "<CCunit><TX>mm</TX></CCunit>");
    blocks.push(b"CC", &[0, unit, 0, 0], &[&[kind], &[0; 23], &parameters])
}

#[test]
fn numbers_of_any_width_order_and_conversion_are_read() {
    let channels = |blocks: &mut Blocks| {
        let linear = cc(blocks, 1, &[0.5, 2.0]);
        let rational = cc(blocks, 2, &[0.0, 1.0, 0.0, 0.0, 0.0, 4.0]);
        let formula = cc(blocks, 3, &[]);
        let texts = cc(blocks, 7, &[]);
        let mut next = 0;
        for (name, kind, start, bits, conversion) in [
            ("words", [0, 0, 0], 0, 16, texts),
            ("formula", [0, 0, 0], 0, 16, formula),
            ("text", [0, 6, 0], 0, 16, 0),
            ("row", [3, 0, 0], 0, 0, linear),
            ("float", [0, 5, 0], 4, 32, 0),
            ("quotient", [0, 3, 0], 2, 16, rational),
            ("bits", [0, 2, 3], 0, 10, 0),
            ("word", [2, 0, 0], 0, 16, linear),
        ] {
            next = cn(blocks, next, name, kind, start, bits, conversion);
        }
        next
    };
    let record =
        |word: u16, big: i16, float: f32| [&word.to_le_bytes()[..], &big.to_be_bytes(), &float.to_be_bytes()].concat();
    // Bits 3 to 12 of the second word are 1022, with their sign -2.
    let records = [record(100, -2, 1.5), record(1022 << 3 | 0b101, 6, -0.25)].concat();
    let plain = |blocks: &mut Blocks| blocks.push(b"DT", &[], &[&records]);
    let listed = |blocks: &mut Blocks| {
        // A record may lie in two blocks.
        let parts = [&records[..5], &records[5..]].map(|part| blocks.push(b"DT", &[], &[part]));
        let second = blocks.push(b"DL", &[0, parts[1]], &[&[0; 24]]);
        blocks.push(b"DL", &[second, parts[0]], &[&[0; 24]])
    };
    for file in [foreign(8, 2, channels, plain), foreign(8, 2, channels, listed)] {
        let read = contents(&file).unwrap();
        let signals = &read.groups[0].signals;
        let of = |name: &str| signals.iter().find(|s| s.channel.name == name).map(|s| &s.values[..]);
        assert_eq!(of("word"), Some(&[200.5, 2.0 * 8181.0 + 0.5][..]));
        assert_eq!(of("bits"), Some(&[12.0, -2.0][..]));
        assert_eq!(of("quotient"), Some(&[-0.5, 1.5][..]));
        assert_eq!(of("float"), Some(&[1.5, -0.25][..]));
        assert_eq!(of("row"), Some(&[0.5, 2.5][..]));
        assert_eq!((of("text"), of("words")), (None, None));
        assert_eq!(signals[0].channel.unit, "mm");
        let recording = Recording::parse(Path::new("axis.mf4"), &file).unwrap();
        assert!(recording.columns().iter().any(|c| c.name == "formula" && c.values[0].is_nan()));
    }
}

#[test]
fn what_is_not_read_is_named_with_what_to_do() {
    let none = |_: &mut Blocks| 0;
    let one = |blocks: &mut Blocks| cn(blocks, 0, "x", [0, 0, 0], 0, 8, 0);
    let refused = |file: Vec<u8>, says: &str| {
        let fault = contents(&file).unwrap_err();
        assert!(fault.fault.contains(says) && !fault.remedy.is_empty(), "{fault:?}");
    };
    refused(foreign(1, 1, one, |blocks| blocks.push(b"LD", &[], &[&[0; 8]])), "blocks of the kind LD");
    refused(foreign(1, 1, one, |blocks| blocks.push(b"DZ", &[], &[b"DT", &[2; 22]])), "method 2");
    refused(foreign(1, 1, |blocks| cn(blocks, 0, "x", [0, 4, 0], 0, 16, 0), none), "says that it has more");
    let narrow = |blocks: &mut Blocks| cn(blocks, 0, "x", [0, 4, 0], 0, 16, 0);
    refused(foreign(2, 0, narrow, none), "numbers of 16 bits");
    refused(foreign(1, 0, |blocks| cn(blocks, 0, "x", [0, 0, 0], 7, 8, 0), none), "outside its record");
    refused(foreign(0, 1 << 40, |blocks| cn(blocks, 0, "x", [3, 0, 0], 0, 0, 0), none), "says that it has more");
    // A list whose next is itself; a list that names one block twice.
    let circle = |blocks: &mut Blocks| {
        let own = blocks.end();
        blocks.push(b"DL", &[own], &[&[0; 16]])
    };
    refused(foreign(1, 1, one, circle), "in a circle");
    let twice = |blocks: &mut Blocks| {
        let data = blocks.push(b"DT", &[], &[&[1; 64]]);
        blocks.push(b"DL", &[0].into_iter().chain([data; 64]).collect::<Vec<_>>(), &[&[0; 16]])
    };
    refused(foreign(1, 1, one, twice), "in a circle");
    let mut unsorted = foreign(1, 1, one, none);
    let place = unsorted.len() - 8;
    unsorted[place] = 1;
    refused(unsorted, "not sorted");
    let mut unfinished = foreign(1, 1, one, none);
    unfinished[..8].copy_from_slice(b"UnFinMF ");
    refused(unfinished, "did not come to its end");
    let mut old = foreign(1, 1, one, none);
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
