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
fn a_missing_column_names_those_there_are_and_the_nearest() {
    let error = message(parse("time,position,vir\n0,0,0\n").unwrap().column("positon"));
    assert!(
        error.contains("positon") && error.contains("time, position, vir") && error.contains("`position`?"),
        "{error}"
    );
}

#[test]
fn a_bad_cell_is_found_by_line_and_column_and_only_if_used() {
    for bad in ["nan", "1,5 mm", "", "inf"] {
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
fn a_ragged_row_a_foreign_encoding_and_an_empty_file_are_refused() {
    let error = message(parse("t,x\n0,1\n1\n"));
    assert!(error.starts_with("axis.csv:3: 1 cells, the header has 2"), "{error}");
    let latin = Recording::parse(Path::new("axis.csv"), b"t,x\n0,\xe4\n");
    assert!(message(latin).contains("UTF-8"));
    for text in ["", "t,x\n", "# nothing\n"] {
        assert!(matches!(parse(text), Err(Error::EmptyRecording { .. })), "{text:?}");
    }
}

#[test]
fn time_that_is_not_even_is_refused_at_its_line() {
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
    assert!(gap.starts_with("axis.csv:62: a gap"), "{gap}");
    let jitter = with(|t| t[50] += 1e-4);
    assert!(jitter.starts_with("axis.csv:52: jitter"), "{jitter}");
    assert!(matches!(recording.spacing(&even[..1]), Err(Error::TooFew { .. })));
}

#[test]
fn the_committed_recording_is_even() {
    let recording = Recording::read(Path::new("../../data/emps/emps.csv.gz")).unwrap();
    assert_eq!(recording.rows(), 24_841);
    let spacing = recording.spacing(&recording.column("t").unwrap().values).unwrap();
    // The time stamps carry the drift of their clock: 3e-8 s a step, as the README of the data says.
    assert!((spacing.period - 1e-3).abs() < 1e-9, "{spacing:?}");
}
