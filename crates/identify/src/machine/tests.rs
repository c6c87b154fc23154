use crate::IdentifyError;
use std::f64::consts::TAU;

use super::*;
use stickslip_recording::Column;
use stickslip_recording::Recording;

const EMPS: &str = include_str!("../../../../data/emps/emps-machine.toml");

fn parse(text: &str) -> Result<Machine, Error> {
    Machine::parse(Path::new("machine.toml"), text)
}

fn recording() -> Recording {
    let ramp = |scale: f64| (0..50).map(|i| scale * f64::from(i)).collect();
    let columns = [("t", 1e-3), ("qm", 0.1), ("qg", 0.2), ("vir", 0.3)];
    Recording::from_columns("axis.csv", columns.map(|(name, scale)| Column::new(name, ramp(scale))).into())
}

#[test]
fn the_committed_machine_file_is_read_in_si_units() {
    let machine = parse(EMPS).unwrap();
    assert_eq!((machine.axis, machine.sampling_period, machine.screw_lead), (Axis::Linear, 1e-3, Some(2.5e-3)));
    let Controller::Cascade(cascade) = machine.controller else { panic!("{:?}", machine.controller) };
    assert_eq!((cascade.position_gain, cascade.velocity_gain, cascade.limit), (160.18, 243.45, 10.0));
    assert_eq!(machine.published["symmetric"]["mass"], [95.1089, 0.1085]);
}

#[test]
fn units_are_converted_at_the_door() {
    let text = EMPS
        .replace(r#""qm", unit = "m""#, r#""qm", unit = "mm""#)
        .replace(r#""vir", unit = "V""#, r#""vir", unit = "mV""#);
    let signals = parse(&text).unwrap().signals(&recording()).unwrap();
    assert!((signals.position[10] - 1e-3).abs() < 1e-15);
    assert!((signals.command[10] - 3e-3).abs() < 1e-15);
    assert_eq!(signals.reference.unwrap()[10], 2.0);
}

#[test]
fn a_torque_gain_at_the_screw_becomes_a_force_gain_by_the_lead() {
    let torque =
        parse(&EMPS.replace(r#"value = 35.15065188248547, unit = "N/V""#, r#"value = 13.986, unit = "mN m/V""#));
    assert!((torque.unwrap().gain - 35.15).abs() < 0.01);
}

#[test]
fn a_rotary_axis_is_measured_in_degrees_and_newton_metres() {
    let lead = EMPS.lines().find(|line| line.starts_with("screw_lead")).unwrap();
    let text = EMPS
        .replace(lead, "")
        .replace("linear", "rotary")
        .replace(r#""N/V""#, r#""N m/V""#)
        .replace(r#""qm", unit = "m""#, r#""qm", unit = "deg""#)
        .replace(r#""qg", unit = "m""#, r#""qg", unit = "rev""#)
        .replace(r#"5e-8, unit = "m""#, r#"5e-8, unit = "rad""#);
    let signals = parse(&text).unwrap().signals(&recording()).unwrap();
    assert!((signals.position[10] - 1f64.to_radians()).abs() < 1e-15);
    assert!((signals.reference.unwrap()[10] - 2.0 * TAU).abs() < 1e-12);
    // A length on a rotary axis is refused.
    let error = parse(&EMPS.replace("linear", "rotary").replace(r#""N/V""#, r#""N m/V""#)).unwrap_err().to_string();
    assert!(error.contains("encoder_grid") && error.contains("rad, mrad, deg"), "{error}");
}

#[test]
fn an_injected_signal_reaches_the_drive() {
    let text = EMPS.replace("[drive]", "injected = { name = \"qg\", unit = \"V\" }\n\n[drive]");
    let signals = parse(&text).unwrap().signals(&recording()).unwrap();
    assert!((signals.drive_input()[10] - (3.0 + 2.0)).abs() < 1e-15);
    assert_eq!(signals.command[10], 3.0);
}

#[test]
fn invalid_values_are_refused_with_their_place() {
    for (from, to, expected) in [
        ("axis = ", "axes = ", "unknown field `axes`"),
        ("position_gain = 160.18", "position_gain = -1.0", "controller.position_gain = -1"),
        ("value = 1.0, unit = \"ms\"", "value = nan, unit = \"ms\"", "sampling_period = NaN"),
        ("35.15065188248547", "0.0", "drive.gain = 0"),
        ("order = 4", "order = 40", "recipe.order = 40"),
        ("low_pass = 100.0", "low_pass = 0.0", "recipe.low_pass = 0"),
        ("\"p-p\"", "\"pid\"", "unknown variant `pid`"),
        ("unit = \"N/V\"", "unit = \"kN/V\"", "machine.toml: drive.gain: unit \"kN/V\""),
        ("unit = \"N/V\"", "unit = \"N/A\"", "Use one of N/V, N m/V"),
        ("gain = {", "rated = {", "drive.rated is for commands in %"),
        ("gain = { value = 35.15065188248547, unit = \"N/V\" }", "", "drive.gain is missing"),
        ("{ name = \"vir\", unit = \"V\" }", "{ name = \"vir\", unit = \"mm\" }", "columns.command: unit \"mm\""),
        ("[columns]", "gear_ratio = -2.0\n[columns]", "gear_ratio = -2"),
        ("[columns]", "inertia = { value = 0.0, unit = \"kg\" }\n[columns]", "inertia = 0"),
        ("[columns]", "inertia = { value = 1.0, unit = \"kg m^2\" }\n[columns]", "inertia: unit \"kg m^2\""),
    ] {
        assert!(EMPS.contains(from), "{from}");
        let error = parse(&EMPS.replace(from, to)).unwrap_err().to_string();
        assert!(error.starts_with("machine.toml: ") && error.contains(expected), "{error}");
    }
}

#[test]
fn a_recording_of_another_period_or_unit_is_refused() {
    let other = parse(&EMPS.replace("value = 1.0, unit = \"ms\"", "value = 0.5, unit = \"ms\"")).unwrap();
    assert!(matches!(
        other.signals(&recording()).as_ref().err().and_then(|error| error.of()),
        Some(IdentifyError::OtherPeriod { .. })
    ));
    let mut text = "t [s],qm [mm],qg [m],vir [V]\n".to_owned();
    (0..9).for_each(|i| text += &format!("{},{i},{i},{i}\n", f64::from(i) * 1e-3));
    let header = Recording::parse(Path::new("axis.csv"), text.as_bytes()).unwrap();
    assert!(matches!(
        parse(EMPS).unwrap().signals(&header).as_ref().err().and_then(|error| error.of()),
        Some(IdentifyError::TwoUnits { .. })
    ));
    let without = parse(&EMPS.replace(r#""qm", unit = "m""#, r#""qm""#)).unwrap();
    assert!((without.signals(&header).unwrap().position[1] - 1e-3).abs() < 1e-18);
    assert!(matches!(without.signals(&recording()), Err(Error::Unit { .. })));
}

#[test]
fn an_unknown_controller_needs_no_gains() {
    let (before, rest) = EMPS.split_once("[controller]").unwrap();
    let (_, after) = rest.split_once("[recipe]").unwrap();
    for controller in ["", "[controller]\nkind = \"unknown\"\n\n"] {
        let machine = parse(&format!("{before}{controller}[recipe]{after}")).unwrap();
        assert_eq!(machine.controller, Controller::Unknown);
    }
}

/// A short machine file, and a recording with its columns.
fn signals(head: &str, columns: &str, drive: &str, recording: &Recording) -> Result<Signals, Error> {
    let text = format!(
        "name = \"axis\"\nsampling_period = {{ value = 1, unit = \"ms\" }}\n{head}\n[columns]\n{columns}\n[drive]\n{drive}"
    );
    parse(&text)?.signals(recording)
}

fn table(columns: &[(&str, &dyn Fn(usize) -> f64)]) -> Recording {
    let values = |f: &dyn Fn(usize) -> f64| (0..500).map(f).collect();
    Recording::from_columns("axis.csv", columns.iter().map(|(name, f)| Column::new(name, values(f))).collect())
}

fn sine(i: usize) -> f64 {
    libm::sin(i as f64 * 0.02)
}

#[test]
fn every_chain_from_the_command_to_the_axis_is_one_product() {
    for (head, unit, drive, gain) in [
        ("axis = \"linear\"", "V", "gain = { value = 35.0, unit = \"N/V\" }", 35.0),
        ("axis = \"linear\"", "kN", "", 1.0),
        ("axis = \"rotary\"", "Nm", "", 1.0),
        ("axis = \"rotary\"\ngear_ratio = 50", "A", "gain = { value = 80, unit = \"mNm/A\" }", 4.0),
        ("axis = \"rotary\"", "A", "gain = { value = -0.5, unit = \"N m/A\" }", -0.5),
        ("axis = \"rotary\"", "%", "rated = { value = 2.4, unit = \"N m\" }", 2.4),
        ("axis = \"rotary\"", "%", "gain = { value = 2.4, unit = \"N m\" }", 2.4),
        (
            "axis = \"linear\"\nscrew_lead = { value = 10, unit = \"mm\" }\ngear_ratio = 2",
            "‰",
            "rated = { value = 5, unit = \"A\" }\ngain = { value = 0.1, unit = \"N m/A\" }",
            5.0 * 0.1 * 2.0 * TAU / 0.01,
        ),
        (
            "axis = \"linear\"\nscrew_lead = { value = 10, unit = \"mm\" }",
            "A",
            "gain = { value = 20, unit = \"N/A\" }",
            20.0,
        ),
        (
            "axis = \"linear\"\nscrew_lead = { value = 10, unit = \"mm\" }",
            "N m",
            "gain = { value = -1, unit = \"1\" }",
            -TAU / 0.01,
        ),
    ] {
        let text = format!(
            "name = \"axis\"\nsampling_period = {{ value = 1, unit = \"ms\" }}\n{head}\n[columns]\n\
             position = {{ name = \"x\" }}\ncommand = {{ name = \"u\", unit = \"{unit}\" }}\n[drive]\n{drive}"
        );
        let machine = parse(&text).unwrap();
        assert!((machine.gain / gain - 1.0).abs() < 1e-12, "{head} {unit} {drive}: {}", machine.gain);
        assert_eq!(machine.drive.unit, unit);
    }
}

#[test]
fn a_position_is_that_of_the_load_at_either_side_of_the_gear() {
    let recording = table(&[("x", &|i| 1000.0 * sine(i)), ("u", &sine)]);
    let lead = "axis = \"linear\"\nscrew_lead = { value = 5, unit = \"mm\" }";
    let geared = &format!("{lead}\ngear_ratio = 4");
    for (head, position, factor) in [
        ("axis = \"linear\"", "unit = \"um\"", 1e-6),
        (lead, "unit = \"rev\"", 5e-3),
        (geared, "unit = \"rev\", at = \"motor\"", 5e-3 / 4.0),
        (lead, "unit = \"counts\", counts_per_rev = 4096", 5e-3 / 4096.0),
        (
            "axis = \"rotary\"\ngear_ratio = 4",
            "unit = \"counts\", counts_per_rev = 4096, at = \"motor\"",
            TAU / 16384.0,
        ),
        ("axis = \"linear\"\nencoder_grid = { value = 50, unit = \"nm\" }", "unit = \"counts\"", 5e-8),
    ] {
        let columns = format!("position = {{ name = \"x\", {position} }}\ncommand = {{ name = \"u\" }}");
        // Without a unit the command has that of the axis; here the column has one.
        let columns = columns.replace("name = \"u\"", "name = \"u\", unit = \"V\"");
        let drive = if head.contains("rotary") {
            "gain = { value = 1, unit = \"N m/V\" }"
        } else {
            "gain = { value = 1, unit = \"N/V\" }"
        };
        let signals = signals(head, &columns, drive, &recording).unwrap();
        assert!((signals.position[50] / (factor * 1000.0 * sine(50)) - 1.0).abs() < 1e-12, "{head} {position}");
    }
}

const PLAIN: &str = "position = { name = \"x\", unit = \"mm\" }\ncommand = { name = \"u\", unit = \"V\" }";
const GAIN: &str = "gain = { value = 35.0, unit = \"N/V\" }";

#[test]
fn counts_with_a_unit_of_length_are_noticed() {
    let linear = "axis = \"linear\"";
    let counts = table(&[("x", &|i| (1000.0 * sine(i)).round()), ("u", &sine)]);
    let error = signals(linear, PLAIN, GAIN, &counts).unwrap_err().to_string();
    assert!(error.contains("`x` holds whole numbers") && error.contains("counts_per_rev"), "{error}");
    let told = "axis = \"linear\"\nencoder_grid = { value = 1.0, unit = \"mm\" }";
    assert!(signals(told, PLAIN, GAIN, &counts).is_ok());
    let micrometres = PLAIN.replace("\"mm\"", "\"um\"");
    assert!(signals(linear, &micrometres, GAIN, &counts).is_ok());
    let unknown = PLAIN.replace("\"mm\"", "\"counts\"");
    let error = signals(linear, &unknown, GAIN, &counts).unwrap_err().to_string();
    assert!(error.contains("counts of unknown size"), "{error}");
}

#[test]
fn a_signal_that_never_changes_and_a_command_at_its_limit_are_noticed() {
    let linear = "axis = \"linear\"";
    for (x, u, name) in
        [(&(|_| 0.3) as &dyn Fn(usize) -> f64, &sine as &dyn Fn(usize) -> f64, "x"), (&sine, &|_| 2.0, "u")]
    {
        let error = signals(linear, PLAIN, GAIN, &table(&[("x", x), ("u", u)])).unwrap_err().to_string();
        assert!(error.contains(&format!("`{name}` never changes")), "{error}");
    }
    let limited = |limit: f64| table(&[("x", &sine), ("u", &move |i| sine(i).clamp(-limit, limit))]);
    let error = signals(linear, PLAIN, GAIN, &limited(0.5)).unwrap_err().to_string();
    assert!(error.contains("`u` is at its largest or smallest value in 6") && error.contains("drive.limit"), "{error}");
    let told = format!("{GAIN}\nlimit = {{ value = 0.5, unit = \"V\" }}");
    assert!(signals(linear, PLAIN, &told, &limited(0.5)).unwrap().notes[0].contains("is at its limit"));
    assert!(signals(linear, PLAIN, GAIN, &limited(0.98)).unwrap().notes[0].contains("is at its limit"));
    assert!(signals(linear, PLAIN, GAIN, &limited(2.0)).unwrap().notes.is_empty());
    // A drive that is switched off and on, and one that is reversed.
    let steps = table(&[("x", &sine), ("u", &|i| f64::from(u8::from(i % 100 < 50)))]);
    assert!(signals(linear, PLAIN, GAIN, &steps).unwrap().notes.is_empty());
}

#[test]
fn uneven_time_is_resampled_on_request_and_noted() {
    let jittered = |i: usize| (i as f64 + 0.3 * libm::sin((i * i) as f64)) * 1e-3;
    let recording = table(&[("t", &jittered), ("x", &|i| libm::sin(jittered(i) * 20.0)), ("u", &sine)]);
    let columns = format!("time = {{ name = \"t\", unit = \"s\" }}\n{PLAIN}");
    let error = signals("axis = \"linear\"", &columns, GAIN, &recording).unwrap_err().to_string();
    assert!(error.contains("resample = true"), "{error}");
    let resampled = signals("axis = \"linear\"\nresample = true", &columns, GAIN, &recording).unwrap();
    assert!(resampled.notes[0].contains("interpolated on an even grid"), "{:?}", resampled.notes);
    let start = jittered(0);
    for (k, x) in resampled.position.iter().enumerate() {
        // The curve bends by 400 1/s² of its height: a cubic over 1.6 ms misses 1e-8 of it.
        assert!((x - 1e-3 * libm::sin((start + k as f64 * 1e-3) * 20.0)).abs() < 1e-9, "{k}");
    }
    let slow = table(&[("t", &|i| jittered(i) * 3.0), ("x", &sine), ("u", &sine)]);
    let other = signals("axis = \"linear\"\nresample = true", &columns, GAIN, &slow);
    assert!(matches!(other.as_ref().err().and_then(|error| error.of()), Some(IdentifyError::OtherPeriod { .. })));
}

#[test]
fn two_encoders_show_twist_and_backlash() {
    // 0.2 mm of backlash: the load follows 0.1 mm behind, whichever way.
    let motor = |i: usize| sine(i) + 0.1 * (sine(i + 1) - sine(i)).signum();
    let recording = table(&[("x", &sine), ("m", &motor), ("u", &sine)]);
    let columns = format!("motor_position = {{ name = \"m\", unit = \"mm\" }}\n{PLAIN}");
    let noted = signals("axis = \"linear\"", &columns, GAIN, &recording).unwrap();
    assert!(noted.notes[0].contains("a span of 0.2000 mm"), "{:?}", noted.notes);
    assert_eq!(noted.position[7], sine(7) * 1e-3);
}

#[test]
fn a_key_without_effect_is_refused() {
    let plain = |head: &str, columns: &str| {
        let text = format!(
            "name = \"axis\"\naxis = \"linear\"\nsampling_period = {{ value = 1, unit = \"ms\" }}\n{head}\n[columns]\n{columns}\n\
             [drive]\n{GAIN}"
        );
        parse(&text).map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(plain("", PLAIN), Ok(()));
    let more = |line: &str| format!("{PLAIN}\n{line}");
    for (head, columns, key) in [
        ("gear_ratio = 3", PLAIN.into(), "gear_ratio"),
        ("lifted_mass = { value = 3, unit = \"kg\" }", PLAIN.into(), "lifted_mass"),
        ("", more("time = { name = \"t\", unit = \"s\", wraps = 65536 }"), "columns.time.wraps"),
        ("", more("run = { name = \"n\" }"), "columns.run"),
        ("", more("enabled = { name = \"on\", counts_per_rev = 3 }"), "columns.enabled"),
        ("", PLAIN.replace("\"mm\"", "\"mm\", counts_per_rev = 7"), "columns.position.counts_per_rev"),
        ("", PLAIN.replace("\"mm\"", "\"mm\", at = \"motor\""), "columns.position.at"),
        ("", more("reference = { name = \"r\", unit = \"mm\", wraps = 360 }"), "columns.reference.wraps"),
        ("", more("[controller]\nkind = \"p-p\"\nposition_gain = 1\nvelocity_gain = 1\nlimit = 1"), "[controller]"),
    ] {
        let error = plain(head, &columns).unwrap_err();
        assert!(error.contains(&format!("{key} has no effect")), "{key}: {error}");
    }
    let rotary = "name = \"a\"\naxis = \"rotary\"\nsampling_period = { value = 1, unit = \"ms\" }\nscrew_lead = { value = 5, unit = \"mm\" }\n\
                  [columns]\nposition = { name = \"x\", unit = \"rad\" }\ncommand = { name = \"u\", unit = \"N m\" }\n";
    assert!(parse(rotary).unwrap_err().to_string().contains("screw_lead has no effect"));
}

/// Long enough for the checks: strokes and a command that moves them.
fn long(position: &dyn Fn(usize) -> f64, command: &dyn Fn(usize) -> f64) -> Recording {
    let column = |name: &str, f: &dyn Fn(usize) -> f64| Column::new(name, (0..4000).map(f).collect());
    let on = |i: usize| f64::from(u8::from((500..3700).contains(&i)));
    let stamp = |i: usize| i as f64 * 1e-3;
    Recording::from_columns(
        "axis.csv",
        vec![column("t", &stamp), column("x", position), column("u", command), column("on", &on)],
    )
}

fn stroke(i: usize) -> f64 {
    100.0 * (1.0 - libm::cos(i as f64 * 0.005))
}

fn push(i: usize) -> f64 {
    let velocity = libm::sin(i as f64 * 0.005);
    0.3 * libm::cos(i as f64 * 0.005) + 0.5 * velocity.signum() + 0.4 * velocity
}

#[test]
fn corrections_are_listed_with_column_and_lines_and_the_rest_is_left_out() {
    let linear = "axis = \"linear\"";
    let plain = long(&stroke, &push);
    let expected = signals(linear, PLAIN, GAIN, &plain).unwrap();
    assert!(expected.findings.is_empty(), "{:?}", expected.findings);
    let near = |found: &[f64], true_values: &[f64]| {
        found.len() == true_values.len() && found.iter().zip(true_values).all(|(a, b)| (a - b).abs() < 1e-5)
    };
    let broken = signals(linear, PLAIN, GAIN, &long(&|i| if i % 900 == 700 { 0.0 } else { stroke(i) }, &push)).unwrap();
    assert!(near(&broken.position, &expected.position));
    assert!(
        broken.findings[0].starts_with("Column `x`, lines 702, 1602, 2502, 3402: 4 positions"),
        "{:?}",
        broken.findings
    );
    assert_eq!(broken.recorded.corrected[0], 700..701);

    let wrapped = PLAIN.replace("\"mm\"", "\"mm\", wraps = 50");
    let wrapped = signals(linear, &wrapped, GAIN, &long(&|i| stroke(i).rem_euclid(50.0), &push)).unwrap();
    assert!(near(&wrapped.position, &expected.position) && wrapped.findings[0].contains("modulo 50"));

    let enabled = format!("{PLAIN}\nenabled = {{ name = \"on\" }}");
    let enabled = signals(linear, &enabled, GAIN, &plain).unwrap();
    assert!(near(&enabled.position, &expected.position[500..3700]));
    assert_eq!(enabled.recorded.left_out, [0..500, 3700..4000]);
    assert!(
        enabled.findings[0].starts_with("Column `on`, lines 2–501, 3702–4001: The drive"),
        "{:?}",
        enabled.findings
    );

    let held = signals(linear, PLAIN, GAIN, &long(&stroke, &|i| push(i / 8 * 8))).unwrap();
    assert!(held.findings[0].contains("every 8.0 rows") && held.held.is_some(), "{:?}", held.findings);
    let off = signals(linear, PLAIN, GAIN, &long(&stroke, &|i| if i < 3000 { push(i) } else { 0.0 })).unwrap();
    assert!(near(&off.position, &expected.position[..3000]) && off.findings[0].contains("the drive is off"));
}

#[test]
fn a_reference_after_the_position_is_refused() {
    let mut columns = long(&stroke, &push).columns().to_vec();
    let named = |position: &str, reference: &str| {
        PLAIN.replace("\"x\"", &format!("\"{position}\""))
            + &format!("\nreference = {{ name = \"{reference}\", unit = \"mm\" }}")
    };
    columns[3] = Column::new("r", (20..4020).map(stroke).collect());
    let recording = Recording::from_columns("axis.csv", columns);
    assert!(signals("axis = \"linear\"", &named("x", "r"), GAIN, &recording).is_ok());
    let error = signals("axis = \"linear\"", &named("r", "x"), GAIN, &recording).unwrap_err().to_string();
    assert!(error.contains("`x` comes 0.02000 s after") && error.contains("swapped"), "{error}");
}

#[test]
fn a_jump_and_time_that_steps_back_are_refused_with_their_line() {
    let jump = long(&|i| stroke(i) + if i < 2000 { 0.0 } else { 77.0 }, &push);
    let error = signals("axis = \"linear\"", PLAIN, GAIN, &jump).unwrap_err().to_string();
    assert!(error.contains("line 2002: column `x`: jumps by"), "{error}");
    let mut columns = long(&stroke, &push).columns().to_vec();
    columns[0].values[1000..].iter_mut().for_each(|t| *t -= 0.3);
    let time = format!("time = {{ name = \"t\", unit = \"s\" }}\n{PLAIN}");
    let back = signals("axis = \"linear\"", &time, GAIN, &Recording::from_columns("axis.csv", columns));
    let error = back.unwrap_err().to_string();
    assert!(error.contains("line 1002") && error.contains("steps back") && !error.contains("Sort"), "{error}");
}
