//! Files of other programs, written by `tests/reference/recording/make.py`.

use super::*;

fn path(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/recording").join(name)
}

fn read(name: &str) -> Recording {
    Recording::read(&path(name)).unwrap_or_else(|error| panic!("{error}"))
}

fn position(i: u32) -> f64 {
    0.1 * libm::sin(0.04 * f64::from(i))
}

fn command(i: u32) -> f64 {
    libm::cos(0.04 * f64::from(i))
}

#[test]
fn structures_of_simulink_are_signals_over_their_time() {
    let logs = read("simulink.mat");
    assert_eq!(heads(&logs), [("time", Some("s")), ("pos", None), ("logs_2_1", None), ("logs_2_2", None)]);
    assert_close(values(&logs, "time"), (0..20).map(|i| f64::from(i) * 1e-3));
    assert_close(values(&logs, "pos"), (0..20).map(position));
    assert_close(values(&logs, "logs_2_2"), (0..20).map(|i| 2.0 * command(i)));
    let to_file = read("to_file.mat");
    assert_eq!(heads(&to_file), [("time", Some("s")), ("ans_1", None), ("ans_2", None)]);
    assert_close(values(&to_file, "ans_2"), (0..20).map(command));
    assert_note(&to_file, "The rows of `ans` were read as signals");
}

#[test]
fn structures_of_controldesk_have_rasters() {
    let both = read("controldesk.mat");
    let units = [("t", Some("s")), ("pos", Some("mm")), ("cmd", Some("V")), ("temperature", None)];
    assert_eq!(heads(&both), units);
    // The slow raster ends with 15 ms.
    assert_close(&both.columns()[3].values[..16], (0..16).map(|i| 20.0 + f64::from(i) * 1e-3));
    assert!(both.column("temperature").unwrap_err().to_string().contains("controldesk.mat:17: "));
    assert_note(&both, "From group \"exp_001.X(2)\" (1 signal, step 5 ms), interpolated linearly");
    let slow = Recording::read_group(&path("controldesk.mat"), Some("exp_001.X(2)")).unwrap();
    assert_eq!((slow.rows(), slow.columns().len()), (4, 2));
}

#[test]
fn a_time_that_is_a_sample_longer_loses_its_last_one() {
    let longer = read("longer.mat");
    assert_eq!(heads(&longer), [("t", None), ("x", None), ("u", None)]);
    assert_eq!(longer.rows(), 20);
    assert_note(&longer, "Variable `t` has 21 values, the others 20: its last one was omitted.");
    assert_note(&longer, "Variables of other lengths than 20 were not read: `other`.");
}

#[test]
fn the_fastest_raster_is_the_grid_of_the_others() {
    let all = read("rasters.mf4");
    let names: Vec<&str> = heads(&all).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["time", "pos", "cmd", "ramp", "temperature", "state", "spare"]);
    // The ramp has its own stamps, from 0.2 ms to 48.2 ms; the slow group ends at 40 ms, too early to cut all rows.
    assert_eq!(all.rows(), 48);
    assert_close(values(&all, "ramp"), (1..49).map(|i| 3.0 * f64::from(i) * 1e-3));
    assert!(all.column("temperature").unwrap_err().to_string().contains("--group NAME"));
    assert_note(&all, "Group \"1ms\" (2 signals, step 1 ms) of the file was read.");
    assert_note(&all, "Not read from group \"10ms\", as a faster group has the same names: `pos`.");
    assert_note(
        &all,
        "step 10 ms), interpolated linearly at these stamps, states held: `temperature`, `state`, `spare`.",
    );
}

#[test]
fn only_groups_with_the_wanted_columns_are_read() {
    let wanted = |group: Option<&str>, columns: &[&str]| {
        let columns = columns.iter().map(|name| (*name).to_owned()).collect();
        Recording::read_wanted(&path("rasters.mf4"), &Wanted { group: group.map(str::to_owned), columns })
    };
    let fast = wanted(None, &["time", "pos", "cmd"]).unwrap();
    assert_eq!((fast.rows(), fast.columns().len()), (50, 3));
    assert_note(&fast, "Groups of the file that were not read: \"other\" (1 signal, step 1 ms), \"10ms\"");
    // The slow group is the only one that has both.
    let slow = wanted(None, &["pos", "spare"]).unwrap();
    assert_eq!((slow.rows(), slow.columns().len()), (5, 5));
    assert_note(&slow, "Group \"10ms\"");
    let joined = wanted(None, &["cmd", "ramp"]).unwrap();
    assert_eq!((joined.rows(), joined.columns().len()), (48, 4));
    assert_note(&wanted(Some("10ms"), &[]).unwrap(), "as requested. Not read: `1ms`, `other`.");
    let error = wanted(Some("2ms"), &[]).unwrap_err().to_string();
    assert!(error.contains("unknown group \"2ms\". Groups: 1ms, 10ms, other."), "{error}");
}

#[test]
fn numbers_and_stamps_of_all_types_of_parquet_are_exact() {
    let types = read("types.parquet");
    for (name, first) in [
        ("u8", 250.0),
        ("u16", 65_000.0),
        ("u32", 2_147_483_638.0),
        ("u64", 9_223_372_036_854_775_798.0),
        ("raw", 1_709_632_360e9),
    ] {
        let column = types.column(name).unwrap();
        assert_eq!(column.origin() + column.values[0], first, "{name}");
        let step = match name {
            "u8" => -1.0,
            "raw" => 250_000.0,
            _ => 1.0,
        };
        assert!(column.values.windows(2).all(|w| w[1] - w[0] == step), "{name} {:?}", column.values);
    }
    for (name, unit, step) in [("s", "ms", 1000.0), ("ms", "ms", 1.0), ("ns", "ns", 250_000.0)] {
        let column = types.column(name).unwrap();
        assert_eq!((column.unit.as_deref(), column.values[1] - column.values[0]), (Some(unit), step), "{name}");
    }
    assert_close(values(&types, "levels"), (0..20).map(|i| (position(i) * 1e3).round() / 1e3));
    assert_note(&types, "not read: `words`");
    let old = read("int96.parquet");
    let stamps = old.column("ns").unwrap();
    assert_eq!((stamps.origin(), stamps.values[1]), (1_709_632_360e9, 250_000.0));
}
