use crate::RecordingError;
use std::io::Write;

use super::*;

fn parse(text: &str) -> Result<Recording, Error> {
    Recording::parse(Path::new("axis.csv"), text.as_bytes())
}

fn message<T: std::fmt::Debug>(result: Result<T, Error>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn columns_have_names_units_and_numbers() {
    for text in [
        "\u{feff}t [ms],x\n0,1.5\n1,-2e-3\n",
        "# made by hand\nt [ms]; x\n0; 1.5\n1; -2e-3\n",
        "t [ms]\tx\n0\t1.5\n1\t-2e-3",
    ] {
        let recording = parse(text).unwrap();
        assert_eq!(recording.rows(), 2);
        assert_eq!(recording.column("t").unwrap().unit.as_deref(), Some("ms"));
        assert_eq!(recording.column("x").unwrap().values, [1.5, -2e-3]);
    }
}

#[test]
fn gzip_reads_as_its_content_and_a_broken_one_is_refused() {
    let folder = std::env::temp_dir().join(format!("stickslip-recording-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("axis.csv.gz");
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(b"t,x\n0,1\n1,2\n").unwrap();
    let bytes = encoder.finish().unwrap();
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(Recording::read(&path).unwrap().column("x").unwrap().values, [1.0, 2.0]);
    std::fs::write(&path, &bytes[..bytes.len() - 6]).unwrap();
    assert!(matches!(Recording::read(&path), Err(Error::File { action: "read", .. })));
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(matches!(Recording::read(&path), Err(Error::File { action: "read", .. })));
}

#[test]
fn a_missing_column_is_reported_with_all_and_the_nearest() {
    let error = message(parse("time,position,vir\n0,0,0\n").unwrap().column("positon"));
    assert!(
        error.contains("positon") && error.contains("time, position, vir") && error.contains("`position`?"),
        "{error}"
    );
}

#[test]
fn a_bad_cell_is_reported_by_line_and_column_and_only_if_used() {
    for bad in ["nan", "1,5 mm", "", "inf", "1,2,3"] {
        for end in ["\n", "\r\n", ""] {
            let recording = parse(&format!("t;x;y\n0;1;2\n\n1;{bad};3{end}")).unwrap();
            assert!(message(recording.column("x")).starts_with("axis.csv:4: "), "{bad:?} {end:?}");
        }
        let recording = parse(&format!("t;x;y\n0;1;2\n\n1;{bad};3\n")).unwrap();
        assert!(recording.column("y").is_ok());
        let error = message(recording.column("x"));
        assert!(
            error.starts_with("axis.csv:4: ") && error.contains("`x`") && error.contains(&format!("\"{bad}\"")),
            "{error}"
        );
    }
}

#[test]
fn a_table_from_a_german_spreadsheet_is_read() {
    let text = "Zeit;Weg;Kommentar\ns;mm;\n0,000;1,5;x\n0,001;-2,25;y\n";
    let recording = parse(text).unwrap();
    assert_eq!(recording.rows(), 2);
    let column = recording.column("Weg").unwrap();
    assert_eq!((column.unit.as_deref(), column.values.as_slice()), (Some("mm"), &[1.5, -2.25][..]));
    // The row of units is a line of the file: the following lines keep their numbers.
    assert!(message(parse("Zeit;Weg\ns;mm\n0;1\n1;?\n").unwrap().column("Weg")).starts_with("axis.csv:4: "));
    // A first row without units is a row without values.
    assert!(parse("t,x\nfoo,bar\n0,1\n").unwrap().column("x").is_err());
    // With both separators the last one is that of decimals.
    assert_eq!(parse("t;x\n0;1.234,5\n").unwrap().column("x").unwrap().values, [1234.5]);
}

#[test]
fn round_brackets_hold_a_unit_or_belong_to_the_name() {
    let recording = parse("t (s),x (actual),u (mm) [V]\n0,1,2\n").unwrap();
    let columns: Vec<_> = recording.columns().iter().map(|c| (c.name.as_str(), c.unit.as_deref())).collect();
    assert_eq!(columns, [("t", Some("s")), ("x (actual)", None), ("u (mm)", Some("V"))]);
}

#[test]
fn windows_encodings_are_read_and_other_bytes_are_refused() {
    let file = |bytes: &[u8]| Recording::parse(Path::new("axis.csv"), bytes);
    let latin = file(b"t,x [\xb5m],a [\xb0]\n0,1,2\n").unwrap();
    assert_eq!(latin.columns()[1].unit.as_deref(), Some("µm"));
    assert_eq!(latin.columns()[2].unit.as_deref(), Some("°"));
    let wide: Vec<u8> = "\u{feff}t\tx\n0\t1,5\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(file(&wide).unwrap().column("x").unwrap().values, [1.5]);
    for (bytes, part) in [
        (&b"t,x\n0,\0\n"[..], "neither text nor"),
        (b"\x89HDF\r\n\x1a\n", "'-v7'"),
        (b"MATLAB 7.3 MAT-file, Platform", "'-v7'"),
        (b"MDF     4.10    ", "copy it again"),
        (b"0,1\n1,2\n", "a row of names"),
    ] {
        let error = message(file(bytes));
        assert!(error.starts_with("axis.csv: ") && error.contains(part), "{error}");
    }
}

#[test]
fn a_ragged_row_a_duplicate_name_and_an_empty_file_are_refused() {
    let error = message(parse("t,x\n0,1\n1\n"));
    assert!(error.starts_with("axis.csv:3: cells in this row: 1, in the header: 2"), "{error}");
    let error = message(parse("t,x,x\n0,1,2\n").unwrap().column("x"));
    assert!(error.contains("`x` is not unique"), "{error}");
    for text in ["", "t,x\n", "# nothing\n"] {
        assert!(
            matches!(
                parse(text).as_ref().err().and_then(|error| error.of()),
                Some(RecordingError::EmptyRecording { .. })
            ),
            "{text:?}"
        );
    }
}

/// A recording of another tool, written by `tests/reference/recording/make.py`.
fn foreign(name: &str) -> Result<Recording, Error> {
    Recording::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/recording").join(name))
}

fn position(i: usize) -> f64 {
    0.1 * libm::sin(40.0 * (i as f64 * 1e-3))
}

#[test]
fn vectors_and_matrices_of_mat_files_are_columns() {
    for name in ["plain.mat", "compressed.mat"] {
        let recording = foreign(name).unwrap();
        let names: Vec<_> = recording.columns().iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["t", "x", "n", "both_1", "both_2"]);
        for i in 0..50 {
            let row: Vec<f64> = recording.columns().iter().map(|c| c.values[i]).collect();
            let expected = [i as f64 * 1e-3, position(i), (position(i) * 1e4).round(), position(i), 2.0 * position(i)];
            // NumPy's sine differs in the last bits.
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{name} {i}: {row:?}");
        }
    }
}

#[test]
fn a_mat_file_cut_anywhere_is_refused_or_has_fewer_columns() {
    for name in ["plain.mat", "compressed.mat"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/recording").join(name);
        let bytes = std::fs::read(&path).unwrap();
        let mut refused = 0;
        for end in 0..bytes.len() {
            match Recording::parse(&path, &bytes[..end]) {
                Err(_) => refused += 1,
                Ok(recording) => assert!(recording.columns().len() <= 5),
            }
        }
        assert!(refused > bytes.len() / 2, "{refused}");
        // A wrong byte may give any result; nothing may panic.
        for place in 0..bytes.len() {
            let mut wrong = bytes.clone();
            wrong[place] ^= 0xff;
            let _ = Recording::parse(&path, &wrong);
        }
    }
}

#[test]
fn parquet_of_other_programs_has_units_time_stamps_and_empty_cells() {
    let recording = foreign("snappy.parquet").unwrap();
    let names: Vec<_> = recording.columns().iter().map(|c| (c.name.as_str(), c.unit.as_deref())).collect();
    assert_eq!(names, [("t", Some("us")), ("x", Some("mm")), ("n", None), ("lost", None)]);
    for i in 0..50 {
        let [t, x, n] = ["t", "x", "n"].map(|name| recording.column(name).unwrap().values[i]);
        assert!(t == i as f64 * 1e3 && n == (position(i) * 1e4).round() && (x - 1e3 * position(i)).abs() < 1e-12);
    }
    assert!(message(recording.column("lost")).contains("snappy.parquet:31: column `lost`"));
    let error = message(foreign("zstd.parquet"));
    assert!(error.contains("zstd.parquet: ") && error.contains("with Snappy"), "{error}");
}

#[test]
fn our_own_parquet_is_read_with_its_units() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("measured.parquet");
    let column = |name: &str, unit: &str| stickslip_base::table::Column {
        name: name.into(),
        unit: unit.into(),
        values: vec![0.5, -1.5],
    };
    crate::table::write_parquet(&path, &[column("velocity", "rad/s"), column("torque", "N m")]).unwrap();
    let recording = Recording::read(&path).unwrap();
    assert_eq!(recording.column("torque").unwrap().unit.as_deref(), Some("N m"));
    assert_eq!(recording.column("velocity").unwrap().values, [0.5, -1.5]);
    std::fs::write(&path, b"PAR1 and no more").unwrap();
    assert!(message(Recording::read(&path)).contains("measured.parquet: "));
}

#[test]
fn uneven_time_is_refused_at_its_line() {
    let even: Vec<f64> = (0..100).map(|i| f64::from(i) * 1e-3).collect();
    let recording = Recording::from_columns("axis.csv", vec![Column::new("t", even.clone())]);
    let spacing = recording.spacing(&even).unwrap();
    assert!((spacing.period - 1e-3).abs() < 1e-15 && spacing.jitter < 1e-9);
    let with = |change: fn(&mut Vec<f64>)| {
        let mut time = even.clone();
        change(&mut time);
        message(recording.spacing(&time))
    };
    let repeated = with(|t| t[40] = t[39]);
    assert!(repeated.starts_with("axis.csv:42: time does not advance"), "{repeated}");
    let gap = with(|t| t[60..].iter_mut().for_each(|t| *t += 7e-3));
    assert!(gap.starts_with("axis.csv:62: gap in time"), "{gap}");
    let jitter = with(|t| t[50] += 1e-4);
    assert!(jitter.starts_with("axis.csv:52: jitter") && jitter.contains("resample = true"), "{jitter}");
    assert!(matches!(recording.spacing(&even[..1]), Err(Error::TooFew { .. })));
}

#[test]
fn the_committed_recording_is_even() {
    let recording = Recording::read(Path::new("../../data/emps/emps.csv.gz")).unwrap();
    assert_eq!(recording.rows(), 24_841);
    let spacing = recording.spacing(&recording.column("t").unwrap().values).unwrap();
    // The time stamps contain the drift of their clock: 3e-8 s per step, see the README of the data.
    assert!((spacing.period - 1e-3).abs() < 1e-9, "{spacing:?}");
}
