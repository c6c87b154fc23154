//! Recordings that outlive their process, and their check by asammdf.
//!
//! `tests/interop/mdf.py` is the check by asammdf; without it (`pip install asammdf`) that part reports that it was
//! left out. The Python to take is named by `STICKSLIP_PYTHON`, or is `python3`.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, UNIX_EPOCH};

use serde_json::{Value, json};
use stickslip::Error;
use stickslip::recording::mdf::{self, Cause, Channel, Contents, Event, Header, Writer};

const TICK_TIME: f64 = 250e-6;
/// Names the file to record to; only the test that starts this program as its child sets it.
const CHILD: &str = "STICKSLIP_RECORD_TO";

fn header() -> Header {
    Header {
        start: UNIX_EPOCH + Duration::from_nanos(1_763_812_345_678_901_234),
        program: "stickslip".into(),
        version: "0.1.0".into(),
        comment: "M_S < 0.3 N·m & \"quiet\"\nof two lines".into(),
        properties: vec![("preset".into(), "clm-bench".into()), ("seed".into(), "<7>".into())],
    }
}

fn channels() -> Vec<Channel> {
    let channel = |i: usize| Channel {
        name: format!("Ω_{i}"),
        unit: ["rad/s", "N m", ""][i % 3].into(),
        comment: if i == 0 { "of the screw & its nut".into() } else { String::new() },
    };
    (0..30).map(channel).collect()
}

fn row(cycle: u64) -> [f64; 30] {
    std::array::from_fn(|i| libm::sin(cycle as f64 * 1e-3 * (i + 1) as f64) / 3.0)
}

/// Number of rows, which are those from cycle 0 on, to the bit.
fn rows(contents: &Contents) -> usize {
    let signals = &contents.groups[0].signals;
    assert_eq!(signals.len(), 32);
    let rows = signals[0].values.len();
    for cycle in 0..rows {
        assert_eq!(signals[0].values[cycle], cycle as f64 * TICK_TIME);
        for (signal, expected) in signals[2..].iter().zip(row(cycle as u64)) {
            assert_eq!(signal.values[cycle].to_bits(), expected.to_bits(), "{} in cycle {cycle}", signal.channel.name);
        }
    }
    rows
}

/// The child of a test: records until it is killed, and prints the number of promised rows after each flush.
#[test]
fn child_that_records_until_it_is_killed() {
    let Some(path) = std::env::var_os(CHILD) else { return };
    let mut writer = Writer::create(Path::new(&path), &header(), &channels(), TICK_TIME).unwrap();
    for cycle in 0.. {
        writer.row(cycle, &row(cycle)).unwrap();
        if cycle % 317 == 316 {
            writer.flush().unwrap();
            println!("\npromised {}", cycle + 1);
        }
    }
}

#[test]
fn a_killed_process_leaves_all_that_it_had_flushed() {
    for after in [1, 2, 7, 30, 90] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mf4");
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "mdf::child_that_records_until_it_is_killed", "--nocapture"])
            .env(CHILD, &path)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines().map(Result::unwrap);
        let mut promises = lines.filter_map(|line| line.strip_prefix("promised ")?.parse::<usize>().ok());
        let before = promises.nth(after - 1).unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
        // The lines before it was killed.
        let promised = promises.last().unwrap_or(before);
        let contents = mdf::read(&path).unwrap();
        assert!(!contents.finished && rows(&contents) >= promised, "{} of {promised} rows", rows(&contents));
        let summary = mdf::recover(&path).unwrap();
        let recovered = mdf::read(&path).unwrap();
        assert!(recovered.finished && rows(&recovered) == rows(&contents) && summary.rows == rows(&contents) as u64);
        // Rows beyond the promise were in flight: at most the block in hand.
        assert!(rows(&recovered) < promised + 2 * 400, "{} of {promised}", rows(&recovered));
    }
}

/// Contents of a file by asammdf, and the bytes of each signal; `None` without asammdf.
fn asammdf(path: &Path) -> Option<(Value, Vec<Vec<u8>>)> {
    let python = std::env::var("STICKSLIP_PYTHON").unwrap_or_else(|_| "python3".into());
    let available = Command::new(&python).args(["-c", "import asammdf"]).output().is_ok_and(|o| o.status.success());
    if !available {
        println!("NOT RUN: asammdf is missing (pip install asammdf)");
        return None;
    }
    let folder = tempfile::tempdir().expect("a folder for the signals");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop/mdf.py");
    let output = Command::new(&python).arg(script).args([path, folder.path()]).output().expect("it has just run");
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && messages.is_empty(), "{messages}");
    let contents: Value = serde_json::from_slice(&output.stdout).expect("the script prints JSON");
    let signals = contents["signals"].as_array().map_or(0, Vec::len);
    let bytes = (0..signals).map(|i| std::fs::read(folder.path().join(i.to_string())).expect("one file a signal"));
    Some((contents, bytes.collect()))
}

fn record(path: &Path) -> Result<Writer, Error> {
    let mut writer = Writer::create(path, &header(), &channels(), TICK_TIME)?;
    writer.attach("clm-bench.toml", "application/toml", "# größer\n[plant]\n".as_bytes())?;
    for cycle in 0..10_000 {
        writer.row(cycle, &row(cycle))?;
        let event = |cause| Event { cycle, name: "limit".into(), comment: "Ω < 2 rad/s".into(), cause };
        match cycle {
            777 => writer.event(&event(Cause::Error))?,
            8_000 => writer.event(&event(Cause::User))?,
            _ => {}
        }
    }
    Ok(writer)
}

#[test]
fn asammdf_reads_the_recorded_bits_without_complaints() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    // As a bench does it: on another thread than the starting one.
    let writer = record(&path).unwrap();
    std::thread::spawn(move || writer.finish()).join().unwrap().unwrap();
    let Some((contents, bytes)) = asammdf(&path) else { return };
    let event = |cycle: u64, cause: &str| json!({ "time": cycle as f64 * TICK_TIME, "index": cycle, "name": "limit", "comment": "Ω < 2 rad/s", "cause": cause });
    assert_eq!(contents["version"], "4.10");
    assert_eq!(contents["finalized"], true);
    assert_eq!(contents["start"], 1_763_812_345_678_901_234_u64);
    assert_eq!(contents["start_time"], "2025-11-22T11:52:25.678901+00:00");
    assert_eq!(contents["comment"], header().comment);
    assert_eq!(contents["properties"], json!({ "preset": "clm-bench", "seed": "<7>" }));
    let history = contents["history"][0].as_str().unwrap();
    assert!(history.contains("<tool_id>stickslip</tool_id>") && history.contains("<tool_version>0.1.0<"), "{history}");
    assert_eq!(
        (&contents["groups"], &contents["cycles"], &contents["rows"]),
        (&json!(1), &json!(10_000), &json!(10_000))
    );
    assert_eq!(contents["events"], json!([event(777, "Error"), event(8_000, "User")]));
    let attached = json!([{ "name": "clm-bench.toml", "mime": "application/toml", "text": "# größer\n[plant]\n" }]);
    assert_eq!(contents["attachments"], attached);
    let own = mdf::read(&path).unwrap();
    assert_eq!(rows(&own), 10_000);
    for ((theirs, bytes), own) in contents["signals"].as_array().unwrap().iter().zip(&bytes).zip(&own.groups[0].signals)
    {
        let Channel { name, unit, comment } = &own.channel;
        let kind = if name == "cycle" { "uint64" } else { "float64" };
        assert_eq!(*theirs, json!({ "name": name, "unit": unit, "comment": comment, "type": kind }));
        let number = |value: &f64| if name == "cycle" { (*value as u64).to_le_bytes() } else { value.to_le_bytes() };
        assert!(own.values.iter().flat_map(number).eq(bytes.iter().copied()), "{name}");
    }
}

#[test]
fn asammdf_reads_an_interrupted_recording_before_and_after_recovery() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    // Dropped: the rows of the last block are lost.
    drop(record(&path).unwrap());
    std::fs::File::options().append(true).open(&path).unwrap().write_all(b"##DZ torn").unwrap();
    let promised = rows(&mdf::read(&path).unwrap());
    assert_eq!(promised, 9_600);
    mdf::recover(&path).unwrap();
    let Some((contents, _)) = asammdf(&path) else { return };
    assert_eq!(
        (&contents["rows"], &contents["cycles"], &contents["finalized"]),
        (&json!(promised), &json!(promised), &json!(true))
    );
    assert_eq!(contents["events"].as_array().unwrap().len(), 2);
}
