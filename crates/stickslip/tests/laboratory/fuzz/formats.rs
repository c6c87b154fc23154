//! The formats that users hand in: small seeds of each, and the reader.

use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use stickslip::capture::Trigger;
use stickslip::curve_file::CurveColumns;
use stickslip::live::protocol::Call;
use stickslip::machine::Machine;
use stickslip::recording::Recording;
use stickslip::recording::export::{Part, export};
use stickslip::recording::mdf::{Channel, Header, Opened, Writer};
use stickslip::report::Report;
use stickslip::run::Stored;
use stickslip::table::{Column, write_parquet};
use stickslip::workflow::fit::fit_file;
use stickslip::{Preset, Watch, identify, library, parameters, study, uncertainty};

/// A kind of file.
pub(super) struct Format {
    pub(super) name: &'static str,
    pub(super) extension: &'static str,
    /// Valid files.
    pub(super) seeds: fn(&Path) -> Vec<Vec<u8>>,
    /// Reads a file, given by path and by contents; the message of a refusal.
    pub(super) read: fn(&Path, &[u8]) -> Result<(), String>,
}

/// All formats.
pub(super) const FORMATS: [Format; 16] = [
    Format { name: "csv", extension: "csv", seeds: tables, read: recording },
    Format { name: "logger", extension: "csv", seeds: loggers, read: recording },
    Format { name: "mat", extension: "mat", seeds: mat, read: groups },
    Format { name: "parquet", extension: "parquet", seeds: parquet, read: recording },
    Format { name: "mdf", extension: "mf4", seeds: mdf, read: run },
    Format { name: "groups", extension: "mf4", seeds: rasters, read: groups },
    Format { name: "curve", extension: "csv", seeds: curves, read: curve },
    Format { name: "machine", extension: "toml", seeds: machines, read: machine },
    Format { name: "model", extension: "toml", seeds: models, read: model },
    Format { name: "uncertainty", extension: "toml", seeds: fits, read: known },
    Format { name: "preset", extension: "toml", seeds: presets, read: preset },
    Format { name: "study", extension: "toml", seeds: studies, read: plan },
    Format { name: "library", extension: "toml", seeds: entries, read: entry },
    Format { name: "trigger", extension: "txt", seeds: triggers, read: trigger },
    Format { name: "call", extension: "json", seeds: calls, read: call },
    Format { name: "report", extension: "json", seeds: reports, read: report },
];

fn message<T, E: ToString>(result: Result<T, E>) -> Result<(), String> {
    result.map(drop).map_err(|error| error.to_string())
}

/// A text as the program takes it: invalid UTF-8 is refused before.
fn text(bytes: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(bytes).map_err(|error| error.to_string())
}

fn file(path: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)).expect("a file of the repository")
}

fn rows() -> impl Iterator<Item = [f64; 3]> {
    (0..40).map(|k| f64::from(k) * 1e-3).map(|t| [t, libm::sin(40.0 * t), libm::cos(40.0 * t)])
}

fn tables(_: &Path) -> Vec<Vec<u8>> {
    let with = |header: &str, separator: &str, comma: bool| {
        let number = |value: &f64| if comma { value.to_string().replace('.', ",") } else { value.to_string() };
        let row = |row: [f64; 3]| row.iter().map(number).collect::<Vec<_>>().join(separator) + "\n";
        (header.to_owned() + &rows().map(row).collect::<String>()).into_bytes()
    };
    vec![
        with("time [s],position [rad],command [V]\n", ",", false),
        with("Zeit;Position;Strom\ns;mm;A\n", ";", true),
        with("# logger 7\nt (ms)\tq\tu\n", "\t", false),
    ]
}

/// Exports of TwinCAT Scope, ControlDesk, the Simulation Data Inspector and halscope, a table of topics with stamps of their
/// own, and one with separators of thousands.
fn loggers(_: &Path) -> Vec<Vec<u8>> {
    let table = |head: &str, row: &dyn Fn(u32) -> String| {
        (head.to_owned() + &(0..40).map(|i| row(i) + "\n").collect::<String>()).into_bytes()
    };
    vec![
        table(
            "Name\tYT Scope\t\nStarttime of export\t133546915600040000\tTuesday\n\nName\tActPos\tName\tCmd\n\
             SampleTime[ms]\t1\tSampleTime[ms]\t2\nUnit\tmm (Length)\tUnit\t(None)\n\n",
            &|i| format!("{i}\t0,{i:03}\t{}\t{i},5", 2 * i),
        ),
        table("Name;Scope\n\nName;ActPos\nUnit;mm\n\n", &|i| {
            format!("{};{i},5", 133_546_915_600_040_001_u64 + 10_000 * u64::from(i))
        }),
        table("version,3\npath,,\"Model Root/Axis/pos\",cmd\nunit,s,mm,V\ntrace_values,0,0,5\n", &|i| {
            format!(",0.{i:03},{i}.5,{i}")
        }),
        table("time,pos,time,cmd\n,Type: double,,Type: single\n,Unit: mm,,Unit: V\n", &|i| {
            format!("{:.3},{i}.5,{:.3},{i}.25", f64::from(i) * 1e-3, f64::from(i) * 4e-3)
        }),
        table("Sampling period is 1000000 ns\n\n", &|i| format!("a +{i}.5 b -{i}.0 ")),
        table(",t,pos [mm],cmd [V]\n", &|i| format!("{},{i}.0,{i}.5,\n{},{i}.3,,{i}.25", 2 * i, 2 * i + 1)),
        table("t (s),pos (um)\n", &|i| format!("0.{i:03},\"{},345\"", 100 + i)),
    ]
}

/// A file of other programs.
fn foreign(name: &str) -> Vec<u8> {
    file(&format!("tests/reference/recording/{name}"))
}

fn rasters(_: &Path) -> Vec<Vec<u8>> {
    vec![foreign("rasters.mf4")]
}

fn mdf(folder: &Path) -> Vec<Vec<u8>> {
    let path = folder.join("seed-run.mf4");
    let header = Header {
        start: UNIX_EPOCH + Duration::from_secs(1_700_000_000),
        program: "stickslip".into(),
        version: "0".into(),
        comment: "a run".into(),
        properties: vec![("preset".into(), "clm-bench".into())],
    };
    let channel = |name: &str, unit: &str| Channel { name: name.into(), unit: unit.into(), comment: "a signal".into() };
    let channels = [channel("position", "rad"), channel("torque", "N m")];
    let mut writer = Writer::create(&path, &header, &channels, 1e-3).unwrap();
    for (cycle, [_, a, b]) in rows().enumerate() {
        writer.row(cycle as u64, &[a, b]).unwrap();
    }
    writer.finish().unwrap();
    vec![std::fs::read(path).unwrap()]
}

fn mat(folder: &Path) -> Vec<Vec<u8>> {
    let (run, to) = (folder.join("of.mf4"), folder.join("seed-of.mat"));
    std::fs::write(&run, mdf(folder).remove(0)).unwrap();
    export(&run, &to, &Part::default(), &Watch::silent()).unwrap();
    let of_others = ["simulink.mat", "to_file.mat", "controldesk.mat", "longer.mat"].map(foreign);
    [vec![std::fs::read(to).unwrap()], of_others.into()].concat()
}

fn parquet(folder: &Path) -> Vec<Vec<u8>> {
    let path = folder.join("seed-of.parquet");
    let column = |name: &str, unit: &str, index: usize| Column {
        name: name.into(),
        unit: unit.into(),
        values: rows().map(|row| row[index]).collect(),
    };
    write_parquet(&path, &[column("time", "s", 0), column("position", "rad", 1), column("torque", "N m", 2)]).unwrap();
    vec![std::fs::read(path).unwrap(), foreign("types.parquet"), foreign("int96.parquet")]
}

fn recording(path: &Path, _: &[u8]) -> Result<(), String> {
    let read = Recording::read(path).map_err(|error| error.to_string())?;
    // A message names the columns.
    assert!(read.column("no such column").unwrap_err().to_string().len() <= super::MESSAGE);
    for column in read.columns() {
        message(read.column(&column.name))?;
    }
    Ok(())
}

/// A recording of several groups: a column that lacks values on the rows of another group is refused by itself.
fn groups(path: &Path, _: &[u8]) -> Result<(), String> {
    let read = Recording::read(path).map_err(|error| error.to_string())?;
    for column in read.columns() {
        if let Err(error) = read.column(&column.name) {
            assert!(error.to_string().len() <= super::MESSAGE, "{}", error.to_string().len());
        }
    }
    Ok(())
}

fn run(path: &Path, bytes: &[u8]) -> Result<(), String> {
    if let Err(error) = Stored::open(path) {
        assert!(error.to_string().len() <= super::MESSAGE, "{}", error.to_string().len());
    }
    message(Opened::open(path))?;
    recording(path, bytes)
}

fn curves(_: &Path) -> Vec<Vec<u8>> {
    let mut table = String::from("velocity [rad/s],torque [N m],standard_error [N m]\n");
    for speed in [0.1, 0.3, 1.0, 2.0, 5.0, 12.0, 20.0] {
        let torque = 0.2 + 0.1 * libm::exp(-speed / 2.0) + 2e-3 * speed;
        table += &format!("{speed},{torque},1e-3\n-{speed},-{torque},1e-3\n");
    }
    vec![table.into_bytes(), file("data/direct_drive_joint/friction_curve.csv")]
}

fn curve(path: &Path, _: &[u8]) -> Result<(), String> {
    message(fit_file(path, &CurveColumns::default(), true))
}

fn machines(_: &Path) -> Vec<Vec<u8>> {
    vec![file("data/emps/emps-machine.toml"), file("data/xl330_pendulum/xl330-machine.toml")]
}

fn machine(path: &Path, bytes: &[u8]) -> Result<(), String> {
    message(Machine::parse(path, text(bytes)?))
}

fn models(_: &Path) -> Vec<Vec<u8>> {
    let side = "breakaway = 25.0\ncoulomb = 20.0\nstribeck_velocity = 0.01\nviscous = 200.0\n";
    let text = format!(
        "[identified]\nmachine = \"a\"\naxis = \"linear\"\nkind = \"lugre\"\ninertia = 95.0\noffset = -3.0\nlag = 1e-3\n[identified.positive]\n{side}[identified.negative]\n{side}"
    );
    vec![text.into_bytes()]
}

fn model(path: &Path, _: &[u8]) -> Result<(), String> {
    message(identify::read_model(path))
}

fn fits(_: &Path) -> Vec<Vec<u8>> {
    let text = "[model.own]\nbreakaway_torque = 0.3\nkinetic_torque = 0.18\nstribeck_velocity = 3.0\n\
                viscous_friction = 2e-3\n[uncertainty]\nparameters = [\"model.own.breakaway_torque\", \
                \"model.own.kinetic_torque\"]\nlogarithmic = true\nsd = [0.01, 0.02]\n\
                correlation = [\n    [1.0, 0.2],\n    [0.2, 1.0],\n]\n";
    vec![text.into()]
}

fn known(path: &Path, _: &[u8]) -> Result<(), String> {
    message(uncertainty::read(path))
}

fn presets(_: &Path) -> Vec<Vec<u8>> {
    vec![file("presets/prototype.toml"), file("presets/clm-real.toml")]
}

fn preset(path: &Path, bytes: &[u8]) -> Result<(), String> {
    let name = path.to_str().expect("a path of the test");
    let found = parameters::presets::find(name).and_then(|source| source.read::<Preset<f64>>());
    let set = parameters::set::<Preset<f64>>(text(bytes)?, name, "bench.tick_rate", "2000");
    if let Err(error) = set {
        assert!(error.to_string().len() <= super::MESSAGE);
    }
    message(found)
}

fn studies(_: &Path) -> Vec<Vec<u8>> {
    let normal = "title = \"a\"\npreset = \"prototype\"\nmanoeuvres = [\"creep\", \"strokes\"]\nseeds = 2\nplaces = 3\n\
                  tolerance = 0.01\n[set]\nbench.tick_rate = 4000\n[design]\nkind = \"normal\"\nsamples = 20\nseed = 3\n\
                  correlation = [[1.0, 0.2], [0.2, 1.0]]\n[[axis]]\nname = \"inertia\"\npath = \"plant.drive.load_inertia\"\n\
                  mean = 1e-3\nsd = 1e-5\n[[axis]]\npath = [\"model.own.breakaway_torque\", \"model.own.kinetic_torque\"]\n\
                  mean = 0.2\nsd = 1e-3\n";
    let grid = "manoeuvres = [\"sine_2hz\"]\n[[axis]]\npath = \"plant.drive.load_inertia\"\nrange = [1e-3, 2e-3]\n\
                points = 9\nlogarithmic = true\n[[axis]]\npath = \"model.own.breakaway_torque\"\nfactor = true\n\
                values = [0.5, 1, 2]\n";
    let screening = "manoeuvres = [\"hold\"]\n[design]\nkind = \"morris\"\ntrajectories = 5\nlevels = 6\n[[axis]]\n\
                     path = \"plant.drive.load_inertia\"\nrange = [1e-3, 2e-3]\n";
    [normal, grid, screening].map(|text| text.as_bytes().to_vec()).to_vec()
}

fn plan(path: &Path, _: &[u8]) -> Result<(), String> {
    let plan = study::read(path).map_err(|error| error.to_string())?;
    // The values of the first and of the last case, without running them.
    let cases = plan.cases().map_err(|error| error.to_string())?;
    assert!([0, cases - 1].map(|case| plan.values(case).len()).iter().all(|count| *count > 0));
    Ok(())
}

fn entries(_: &Path) -> Vec<Vec<u8>> {
    vec![file("data/friction/emps.toml"), file("data/friction/panda-joint-1.toml")]
}

fn entry(path: &Path, _: &[u8]) -> Result<(), String> {
    message(library::find(path.to_str().expect("a path of the test")))
}

fn triggers(_: &Path) -> Vec<Vec<u8>> {
    [
        "velocity rises through 0.1, hysteresis 0.02, delay 200, hold-off 4000",
        "\"a b\" enters -1..1, auto 30",
        "state becomes 3",
    ]
    .map(|text| text.as_bytes().to_vec())
    .to_vec()
}

fn trigger(_: &Path, bytes: &[u8]) -> Result<(), String> {
    message(text(bytes)?.parse::<Trigger>())
}

fn calls(_: &Path) -> Vec<Vec<u8>> {
    ["{\"call\": \"set\", \"values\": {\"bench.law.kind\": \"bristle\"}}", "{\"call\": \"parameters\"}"]
        .map(|text| text.as_bytes().to_vec())
        .to_vec()
}

fn call(_: &Path, bytes: &[u8]) -> Result<(), String> {
    let value = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
    message(Call::from_json(value))
}

fn reports(folder: &Path) -> Vec<Vec<u8>> {
    let path = folder.join("seed-curve.csv");
    std::fs::write(&path, curves(folder).remove(0)).unwrap();
    let fits = fit_file(&path, &CurveColumns::default(), false).unwrap();
    fits.write(folder, "stickslip fit").unwrap();
    vec![std::fs::read(folder.join("report.json")).unwrap()]
}

fn report(path: &Path, _: &[u8]) -> Result<(), String> {
    message(Report::read(path))
}
