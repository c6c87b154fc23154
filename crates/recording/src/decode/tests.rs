//! Each format as its tool writes it.

mod binary;

use std::path::Path;

use super::*;

fn parse(text: &str) -> Recording {
    Recording::parse(Path::new("axis.csv"), text.as_bytes()).unwrap()
}

fn refusal(text: &str) -> String {
    Recording::parse(Path::new("axis.csv"), text.as_bytes()).unwrap_err().to_string()
}

/// Names and units.
fn heads(recording: &Recording) -> Vec<(&str, Option<&str>)> {
    recording.columns().iter().map(|column| (&*column.name, column.unit.as_deref())).collect()
}

fn values<'a>(recording: &'a Recording, name: &str) -> &'a [f64] {
    &recording.column(name).unwrap_or_else(|error| panic!("{error}")).values
}

fn assert_note(recording: &Recording, part: &str) {
    assert!(recording.notes().iter().any(|note| note.contains(part)), "{part}: {:?}", recording.notes());
}

fn assert_close(found: &[f64], expected: impl IntoIterator<Item = f64>) {
    let expected: Vec<f64> = expected.into_iter().collect();
    assert_eq!(found.len(), expected.len());
    found.iter().zip(expected).for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{a} {b}"));
}

/// Rows 0 to 99, cell by cell.
fn rows(row: impl Fn(u32) -> String) -> String {
    (0..100).map(|i| row(i) + "\n").collect()
}

const PROJECT: &str = "Name\tYT Scope\t\nFile\tC:\\x.csv\t\nStarttime of export\t133546915600040000\tTuesday\n\n\n";

#[test]
fn a_twincat_export_has_stamps_for_each_sample_time() {
    let properties = "Name\tActPos\tSetPos\tName\tCmd\r\nSymbolComment\t\t\tSymbolComment\t\r\n\
        Data-Type\tREAL64\tREAL64\tData-Type\tREAL32\r\nSampleTime[ms]\t1\t1\tSampleTime[ms]\t2\r\n\
        Offset\t0\t0\tOffset\t3\r\nUnit\tmm (Length)\tmm (Length)\tUnit\t(None)\r\n\r\n";
    let slow = |i: u32| if i < 50 { format!("{}\t{},5", 2 * i, 2 * i) } else { "\t".into() };
    let body = rows(|i| format!("{i}\t0,{i:03}\t-{i},25\t{}", slow(i)));
    let read = parse(&format!("{PROJECT}{properties}{body}EOF\n"));
    assert_eq!(heads(&read), [("time", Some("ms")), ("ActPos", Some("mm")), ("SetPos", Some("mm")), ("Cmd", None)]);
    // The last stamp of the slow channel is 98 ms.
    assert_eq!(read.rows(), 99);
    assert_close(values(&read, "Cmd"), (0..99).map(|i| f64::from(i) + 0.5));
    assert_close(values(&read, "ActPos"), (0..99).map(|i| f64::from(i) * 1e-3));
    assert_note(&read, "From group \"2 ms\" (1 signal, step 2 ms), interpolated linearly at these stamps: `Cmd`.");
    assert_note(&read, "Channel `Cmd` states Offset");
    let slow = Recording::parse(Path::new("axis.csv"), format!("{PROJECT}{properties}{body}").as_bytes());
    assert!(slow.is_ok(), "a file without EOF");
}

#[test]
fn full_stamps_and_repeated_rows_of_twincat_are_read() {
    let full = rows(|i| format!("{};{i},5", 133_546_915_600_040_001_u64 + 10_000 * u64::from(i)));
    let read = parse(&format!("Name;Scope\nFile;x\n\nName;ActPos\nUnit;mm\n\n{full}EOF\n"));
    let time = read.column("time").unwrap();
    assert_eq!(time.unit.as_deref(), Some("ms"));
    assert!((time.origin() - 13_354_691_560_004.0).abs() < 1.0, "{}", time.origin());
    assert!(time.values.windows(2).all(|w| (w[1] - w[0] - 1.0).abs() < 1e-9));
    // "Fill with the previous value": the slow channel repeats its rows. The header has names only.
    let filled = rows(|i| format!("{i},{i}.5,{},{}.25", i / 4 * 4, i / 4 * 4));
    let read = parse(&format!("Name,ActPos,Name,Cmd\n{filled}"));
    assert_eq!(read.rows(), 97);
    assert_close(values(&read, "Cmd"), (0..97).map(|i| f64::from(i) + 0.25));
    let error = refusal(&format!("{PROJECT}ActPos\t\n{full}"));
    assert!(error.starts_with("axis.csv") && !error.contains("ort the rows"), "{error}");
}

#[test]
fn a_controldesk_export_begins_at_its_mark() {
    for (delimiter, point, name) in [(',', '.', "\"Model Root/Axis/pos\""), (';', ',', "Model Root/Axis/pos")] {
        let text = format!(
            "version|3\ndatetime|5/3/2024\npath||{name}|cmd\ndescription|||\nunit|s|mm|V\ntrace_values|0|0|5\n{}",
            rows(|i| format!("|0@{:03}|{i}@5|{i}", i + 1))
        );
        let read = parse(&text.replace('|', &delimiter.to_string()).replace('@', &point.to_string()));
        assert_eq!(heads(&read), [("time", Some("s")), ("Model Root/Axis/pos", Some("mm")), ("cmd", Some("V"))]);
        assert_eq!((read.rows(), values(&read, "cmd")[0]), (101, 5.0));
        assert_close(values(&read, "time"), (0..101).map(|i| f64::from(i) * 1e-3));
    }
    assert!(refusal("version,3\nunit,s,mm\ntrace_values,0,1\n").contains("the row `path`"));
}

#[test]
fn a_table_of_the_data_inspector_has_labelled_rows_and_repeated_stamps() {
    let labels = ",Type: double,,Type: single\n,Unit: mm,,Unit: V\n,Interp: linear,,Interp: zoh\n,BlockPath: m/a,,BlockPath: m/b\n";
    let cmd = |i: u32| if i < 25 { format!("{:.4},{i}.5", f64::from(i) * 4e-3) } else { ",".into() };
    let read = parse(&format!(
        "time,pos,time,cmd\n{labels}{}",
        rows(|i| format!("{:.3},{i}.5,{}", f64::from(i) * 1e-3, cmd(i)))
    ));
    assert_eq!(heads(&read), [("time", None), ("pos", Some("mm")), ("cmd", Some("V"))]);
    assert_eq!(read.rows(), 97);
    assert_close(values(&read, "cmd"), (0..97).map(|i| f64::from(i) / 4.0 + 0.5));
    let single = parse("time,pos\n,Type: double\n,Unit: mm\n0,1\n1,2\n");
    assert_eq!((heads(&single), single.rows()), (vec![("time", None), ("pos", Some("mm"))], 2));
    let pairs = parse(&format!("Zeit [ms];x [mm];Zeit [ms];u [V]\n{}", rows(|i| format!("{i};{i},5;{i};{i},25"))));
    assert_eq!(heads(&pairs), [("Zeit", Some("ms")), ("x", Some("mm")), ("u", Some("V"))]);
    assert_note(&pairs, "whose stamps agree: `u`");
}

#[test]
fn logs_of_halscope_are_read_in_both_forms() {
    let read = parse("Sampling period is 1000000 ns \n\na +0.5 b -1.0 \na +1.5 b -2.0 \na +9.9 b +9.9 \n");
    assert_eq!(heads(&read), [("time", Some("s")), ("a", None), ("b", None)]);
    assert_eq!((values(&read, "time"), values(&read, "b")), (&[0.0, 1e-3][..], &[-1.0, -2.0][..]));
    assert_note(&read, "sampling period in the head of the log, 1 ms");
    let table = parse("joint.0.pos-fb;pid.x.output\n+0.5;-1.0\n+1.5;+2.0\n");
    assert_eq!(values(&table, "pid.x.output"), [-1.0, 2.0]);
    for (text, part) in [
        ("Sampling period is soon\na +1\n", "axis.csv:1: no period"),
        ("Sampling period is 1000 ns\n\na +1 b +2\na +1 b\n", "axis.csv:4: A row has a name and a number"),
        (
            "Sampling period is 1000 ns\n\na +1 b +2\na +1 c +2\n",
            "axis.csv:4: other names than in the first row: `a`, `b`",
        ),
    ] {
        assert!(refusal(text).starts_with(part), "{}", refusal(text));
    }
}

#[test]
fn an_index_without_a_name_is_a_row_number_unless_it_is_a_time() {
    let read = parse("\u{feff},pos_mm,cmd_V\n0,1.5,2\n1,1.25,3\n2,1,4\n");
    assert_eq!(heads(&read), [("row", Some("1")), ("pos_mm", None), ("cmd_V", None)]);
    assert!(read.columns()[0].is_row_number() && !read.columns()[1].is_row_number());
    assert_note(&read, "`row`, which has no name in the file, counts the rows");
    let gaps = parse(&format!(",x\n{}", rows(|i| format!("{},1.5", i + i / 10))));
    assert_note(&gaps, "do not rise evenly: rows were removed");
    assert_eq!(heads(&parse(",x\n0.000,1\n0.001,2\n0.002,3\n"))[0], ("index", None));
    assert_eq!(heads(&parse("time,x\n0,1\n1,2\n2,3\n"))[0], ("time", None));
    let dates = parse(",x\n2024-03-05 09:12:40.004,1\n2024-03-05 09:12:40.005,2\n");
    let time = dates.column("time").unwrap();
    assert_eq!((time.unit.as_deref(), time.origin()), (Some("s"), 1_709_629_960.0));
    assert_close(&time.values, [0.004, 0.005]);
}

#[test]
fn topics_with_stamps_of_their_own_are_joined_on_those_of_the_densest() {
    let topics = |i: u32| format!("{i}.0,{i}.5,\n{i}.3,,{}", f64::from(i) + 0.3);
    for number in ["", "n"] {
        let body = rows(topics);
        let body = body
            .lines()
            .enumerate()
            .map(|(i, line)| if number.is_empty() { line.into() } else { format!("{i},{line}") });
        let head = if number.is_empty() { "t,pos [mm],cmd [V]" } else { ",t,pos [mm],cmd [V]" };
        let read = parse(&format!("{head}\n{}\n", body.collect::<Vec<String>>().join("\n")));
        assert_eq!(read.rows(), 99);
        // The command is a ramp over its own stamps.
        assert_close(values(&read, "cmd"), (1..100).map(f64::from));
        assert_close(values(&read, "pos"), (1..100).map(|i| f64::from(i) + 0.5));
        assert_note(&read, "stamps of their own: `cmd`");
        assert_note(&read, "1 at the start");
    }
    // A lost cell is not a topic.
    let lost = parse(&format!("t,x\n{}", rows(|i| if i == 7 { "7,".into() } else { format!("{i},1.5") })));
    assert!(lost.column("x").unwrap_err().to_string().starts_with("axis.csv:9: column `x` holds \"\""));
}

#[test]
fn separators_of_thousands_are_read_as_the_file_shows_or_refused() {
    let read = parse("t (s),pos (um)\n0.000,\"0\"\n0.001,\"112,345\"\n");
    assert_eq!(values(&read, "pos"), [0.0, 112_345.0]);
    assert_note(&read, "Column `pos` has separators of thousands: \"112,345\" was read as 112345.");
    let german = parse("t;pos\n0,000;0\n0,001;112.345\n");
    assert_eq!(values(&german, "pos"), [0.0, 112_345.0]);
    let unclear = parse("t,pos\n0,\"0\"\n1,\"112,345\"\n").column("pos").unwrap_err().to_string();
    assert!(unclear.starts_with("axis.csv:3: column `pos` holds \"112,345\", which has two readings"), "{unclear}");
}

#[test]
fn a_long_cell_is_shortened_in_the_message() {
    let error = parse(&format!("t,x\n0,{}\n", "y".repeat(300_000))).column("x").unwrap_err().to_string();
    assert!(error.len() < 500 && error.contains("yyy… (300000 characters)"), "{}", error.len());
}

#[test]
fn large_stamps_keep_their_differences() {
    let read = parse("t,x\n1709632360004000000,1\n1709632360004250000,2\n1709632360004500001,3\n");
    let time = read.column("t").unwrap();
    assert!(time.values.windows(2).map(|w| w[1] - w[0]).eq([250_000.0, 250_001.0]), "{:?}", time.values);
    assert_eq!(time.origin(), 1_709_632_360_004_000_000.0);
    assert_eq!(read.rows_of(1..3).column("t").unwrap().origin(), time.origin());
}

#[test]
fn rows_of_units_and_types_and_empty_cells_at_the_end_are_not_samples() {
    let read = parse("t;x;y;\nfloat64;REAL;INT;\ns;mm;1;\n0,5;1;2;\n1,5;2;3;\n;;;\n;;;\n");
    assert_eq!(heads(&read), [("t", Some("s")), ("x", Some("mm")), ("y", Some("1"))]);
    assert_eq!(read.rows(), 2);
    let error = refusal("Logger 3\nDate,2024\nt,x\n0,1\n");
    assert!(error.starts_with("axis.csv:2: cells in this row: 2") && error.contains("begin the file"), "{error}");
}

#[test]
fn known_formats_that_are_not_read_are_refused_with_a_way() {
    for (bytes, part) in [
        (&b"# Created by Octave 8.4\n# name: x\n"[..], "save -v7"),
        (b"PK\x03\x04xl", "Export the sheet as CSV"),
        (b"TDSm", "npTDMS"),
        (b"\0\0\0\0\x01\0\0\0\x02\0\0\0\0\0\0\0\x02\0\0\0t\0", "level 4"),
        (b"MATLAB 7.3 MAT-file", "'-v7'"),
    ] {
        let error = Recording::parse(Path::new("axis.mat"), bytes).unwrap_err().to_string();
        assert!(error.starts_with("axis.mat: ") && error.contains(part), "{error}");
    }
}
