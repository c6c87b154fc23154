use super::*;
use crate::recording::Column;

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
    let text = EMPS
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
fn what_cannot_be_is_refused_with_its_place() {
    for (from, to, expected) in [
        ("axis = ", "axes = ", "unknown field `axes`"),
        ("position_gain = 160.18", "position_gain = -1.0", "controller.position_gain = -1"),
        ("value = 1.0, unit = \"ms\"", "value = nan, unit = \"ms\"", "sampling_period = NaN"),
        ("35.15065188248547", "0.0", "drive.gain = 0"),
        ("order = 4", "order = 40", "recipe.order = 40"),
        ("low_pass = 100.0", "low_pass = 0.0", "recipe.low_pass = 0"),
        ("\"p-p\"", "\"pid\"", "unknown variant `pid`"),
        ("unit = \"N/V\"", "unit = \"kN/V\"", "machine.toml: drive.gain: unit \"kN/V\""),
    ] {
        assert!(EMPS.contains(from), "{from}");
        let error = parse(&EMPS.replace(from, to)).unwrap_err().to_string();
        assert!(error.starts_with("machine.toml: ") && error.contains(expected), "{error}");
    }
}

#[test]
fn a_recording_of_another_period_or_unit_is_refused() {
    let other = parse(&EMPS.replace("value = 1.0, unit = \"ms\"", "value = 0.5, unit = \"ms\"")).unwrap();
    assert!(matches!(other.signals(&recording()), Err(Error::OtherPeriod { .. })));
    let mut text = "t [s],qm [mm],qg [m],vir [V]\n".to_owned();
    (0..9).for_each(|i| text += &format!("{},1,1,1\n", f64::from(i) * 1e-3));
    let header = Recording::parse(Path::new("axis.csv"), text.as_bytes()).unwrap();
    assert!(matches!(parse(EMPS).unwrap().signals(&header), Err(Error::TwoUnits { .. })));
    let without = parse(&EMPS.replace(r#""qm", unit = "m""#, r#""qm""#)).unwrap();
    assert!((without.signals(&header).unwrap().position[0] - 1e-3).abs() < 1e-18);
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
