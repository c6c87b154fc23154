use crate::RecordingError;
use std::time::{Duration, UNIX_EPOCH};

use super::*;
use crate::Recording;
use crate::mdf::{Header, Writer};

const ROWS: u64 = 70_000;

/// A run with more rows than a group of a Parquet file.
fn run(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("run.mf4");
    let header = Header {
        start: UNIX_EPOCH + Duration::from_secs(1_700_000_000),
        program: "stickslip".into(),
        version: "0".into(),
        comment: String::new(),
        properties: Vec::new(),
    };
    let channel = |name: &str, unit: &str| Channel { name: name.into(), unit: unit.into(), comment: "a signal".into() };
    let channels = [channel("software.Ω", "rad/s"), channel("torque", "N m"), channel("units", "")];
    let mut writer = Writer::create(&path, &header, &channels, 1e-3).unwrap();
    for cycle in 0..ROWS {
        writer.row(cycle, &values(cycle)).unwrap();
    }
    writer.finish().unwrap();
    path
}

fn values(cycle: u64) -> [f64; 3] {
    let x = cycle as f64;
    [libm::sin(x), -1.0 / (x + 3.0), if cycle == 5 { f64::NAN } else { x }]
}

fn exported(kind: &str, part: &Part) -> (Exported, tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join(format!("out.{kind}"));
    let exported = export(&run(folder.path()), &to, part, &Watch::silent()).unwrap();
    (exported, folder, to)
}

#[test]
fn exported_files_read_back_bit_identically() {
    for (kind, names) in [
        ("csv", ["software.Ω", "torque", "units"]),
        ("parquet", ["software.Ω", "torque", "units"]),
        ("mat", ["software__", "torque", "units_2"]),
    ] {
        let (all, _folder, path) = exported(kind, &Part::default());
        assert_eq!(all, Exported { rows: ROWS, columns: 5 }, "{kind}");
        let read = Recording::read(&path).unwrap();
        let nan = read.column(names[2]).unwrap_err();
        assert!(matches!(nan.of(), Some(RecordingError::BadCell { line, .. }) if *line >= 5), "NaN stays NaN: {nan}");
        for (place, name) in names[..2].iter().enumerate() {
            let column = read.column(name).unwrap();
            assert_eq!(column.values.len() as u64, ROWS, "{kind} {name}");
            for (cycle, value) in column.values.iter().enumerate() {
                let expected = values(cycle as u64)[place];
                assert!(
                    value.to_bits() == expected.to_bits() || value.is_nan() && expected.is_nan(),
                    "{kind} {name} {cycle}"
                );
            }
        }
        assert_eq!(read.column("time").unwrap().values[2], 2.0 * 1e-3);
        if kind != "mat" {
            assert_eq!(read.column("torque").unwrap().unit.as_deref(), Some("N m"), "{kind}");
        }
    }
}

#[test]
fn an_mcap_has_one_message_per_row_with_time_and_units() {
    let part = Part { from: 0.004, until: 0.007, ..Part::default() };
    let (some, _folder, path) = exported("mcap", &part);
    assert_eq!(some.rows, 3);
    let bytes = std::fs::read(path).unwrap();
    let messages: Vec<_> = ::mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.len(), 3);
    let second: serde_json::Value = serde_json::from_slice(&messages[1].data).unwrap();
    assert_eq!(second["torque"].as_f64(), Some(values(5)[1]));
    assert!(second["units"].is_null(), "NaN: {second}");
    assert_eq!(messages[1].log_time, 1_700_000_000_005_000_000);
    assert_eq!(messages[1].channel.metadata["unit.torque"], "N m");
}

#[test]
fn a_part_is_as_requested() {
    let part = Part { signals: vec!["torque".into()], from: 1.0, until: 2.0, every: 10 };
    let (some, _folder, path) = exported("csv", &part);
    assert_eq!(some, Exported { rows: 100, columns: 2 });
    let read = Recording::read(&path).unwrap();
    assert_eq!(read.column("torque").unwrap().values[1].to_bits(), values(1010)[1].to_bits());
}

#[test]
fn a_failed_export_is_reported_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let from = run(folder.path());
    let refused = |name: &str, part: &Part| {
        let to = folder.path().join(name);
        let error = export(&from, &to, part, &Watch::silent()).unwrap_err();
        assert!(!to.exists(), "{name}");
        error.to_string()
    };
    let kind = refused("out.xlsx", &Part::default());
    assert!(kind.contains(".mat") && kind.contains("out.xlsx"), "{kind}");
    let signal = refused("out.csv", &Part { signals: vec!["torqe".into()], ..Part::default() });
    assert!(signal.contains("Did you mean torque"), "{signal}");
    let cancelled = Watch::new(std::sync::Arc::new(true.into()), |_, _| {});
    let to = folder.path().join("out.parquet");
    assert!(matches!(export(&from, &to, &Part::default(), &cancelled), Err(Error::Cancelled)));
    assert!(!to.exists());
}
