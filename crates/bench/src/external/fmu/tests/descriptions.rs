//! Invalid descriptions, and FMUs that are not a controller.

use super::*;

fn refusal(text: &str) -> String {
    description::read(text).map(drop).expect_err("it is refused")
}

/// The refusal of a mapping.
fn unmapped(version: u32, pairs: &[(&str, &str)]) -> String {
    let model = description::read(&description(version, SIMULATION)).expect("it is right");
    mapped(&model, Role::Controller, &map(pairs)).map(drop).expect_err("it is refused")
}

#[test]
fn broken_xml_is_refused() {
    let right = description(2, SIMULATION);
    for broken in ["", "<", "<a>", "not XML", &right[..right.len() - 30], &"<a>".repeat(100_000)] {
        assert!(refusal(broken).contains("cannot be read"), "{}", &broken[..broken.len().min(20)]);
    }
    assert!(refusal("<html/>").contains("begins with html"));
    // Entities that would grow a thousandfold.
    let entities = "<!DOCTYPE a [<!ENTITY b \"bbbbbbbbbb\"><!ENTITY c \"&b;&b;&b;&b;\">]><a>&c;</a>";
    assert!(refusal(entities).contains("cannot be read"));
    assert!(refusal(&format!("<a>{}</a>", "<b/>".repeat(1_000_001))).contains("cannot be read"));
    for (attribute, there) in
        [("guid", "guid"), ("modelIdentifier", "modelIdentifier"), ("valueReference", "valueReference")]
    {
        let without = right.replace(attribute, "other");
        assert!(refusal(&without).contains(&format!("has no {there}")), "{attribute}");
    }
    assert!(
        refusal(&right.replace("valueReference=\"3\"", "valueReference=\"-3\""))
            .contains("not an unsigned 32-bit integer")
    );
    assert!(
        refusal(&right.replace("valueReference=\"3\"", "valueReference=\"99999999999\""))
            .contains("not an unsigned 32-bit integer")
    );
    assert!(
        refusal(&right.replace("name=\"bias\"", &format!("name=\"{}\"", "b".repeat(600)))).contains("600 characters")
    );
    assert!(refusal(&right.replace("\"servo\"", "\"../servo\"")).contains("is not a valid library name"));
}

#[test]
fn an_unsupported_fmu_is_refused_with_the_required_export() {
    let exchange = description(2, "<ModelExchange modelIdentifier=\"servo\"/>");
    assert!(refusal(&exchange).contains("ModelExchange only. Export it for co-simulation"));
    let scheduled = description(3, "<ScheduledExecution modelIdentifier=\"servo\"/>");
    assert!(refusal(&scheduled).contains("ScheduledExecution only"));
    for needs in ["true", "1"] {
        let tool = format!("<CoSimulation modelIdentifier=\"servo\" needsExecutionTool=\"{needs}\"/>");
        assert!(refusal(&description(2, &tool)).contains("requires its tool while it runs"));
    }
    let right = description(2, SIMULATION);
    for version in ["1.0", "4.0"] {
        let message = refusal(&right.replace("fmiVersion=\"2.0\"", &format!("fmiVersion=\"{version}\"")));
        assert!(message.contains(&format!("has FMI version {version}; 2.0 and 3.0 are supported")), "{message}");
    }
}

#[test]
fn an_fmu_without_a_library_for_this_computer_is_refused() {
    let model = description::read(&description(2, SIMULATION)).unwrap();
    let refused = |names: &[&str]| {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        library(&model, &names).expect_err("there is none")
    };
    let sources = refused(&["modelDescription.xml", "sources/servo.c"]);
    assert!(sources.contains("C sources and no library") && sources.contains("fmpy compile"), "{sources}");
    assert!(refused(&["modelDescription.xml"]).contains("Export it with a binary"));
    let others = refused(&["binaries/win32/servo.dll", "binaries/amiga/servo.lib", "binaries/amiga/", "sources/a.c"]);
    assert!(
        others.contains("libraries for amiga, win32; this computer requires") && others.contains("compile"),
        "{others}"
    );
    assert!(library(&model, &[library_path(2)]).is_ok());
}

#[test]
fn signals_are_mapped_to_numbers_of_the_right_causality_and_unit() {
    assert!(unmapped(2, &[]).contains("--map torque=NAME. Its outputs: Motor.'tau (out)'"));
    let inputs = unmapped(2, &MAP[3..]);
    assert!(
        inputs.ends_with("--map measured_angle=NAME. Its inputs: Encoder.phi, Command.phi[1], Command.w, bias"),
        "{inputs}"
    );
    assert!(unmapped(2, &[("mesured_angle", "x")]).contains("Did you mean measured_angle? Available: time, "));
    assert!(unmapped(2, &[("torque", "Motor.'tau (ot)'")]).contains("Did you mean Motor.'tau (out)'?"));
    assert!(unmapped(2, &[("torque", "Encoder.phi")]).contains("has the causality input"));
    assert!(unmapped(2, &[("measured_angle", "PI.k")]).contains("has the causality parameter"));
    assert!(unmapped(2, &[("measured_angle", "mode")]).contains("mode has the type Integer"));
    assert!(unmapped(3, &[("measured_angle", "mode")]).contains("mode has the type Int32"));
    assert!(unmapped(3, &[("measured_angle", "table")]).contains("table has the type array"));
    let unit = unmapped(2, &[("measured_angle", "Command.w")]);
    assert!(unit.contains("unit rpm, which is not a unit of an angle") && unit.contains("has the unit rad"), "{unit}");
    let twice = [("measured_angle", "Encoder.phi"), ("reference_position", "Encoder.phi")];
    assert!(unmapped(2, &twice).contains("is mapped to two signals"));
    assert!(unmapped(2, &[MAP[0], MAP[0]]).contains("mapped twice"));
}

#[test]
fn missing_units_and_signals_are_noted() {
    let text = ["unit=\"rpm\" ", "unit=\"mN.m\"", " unit=\"deg\""]
        .iter()
        .fold(description(2, SIMULATION), |text, unit| text.replace(unit, ""));
    let model = description::read(&text).unwrap();
    let mapped = mapped(&model, Role::Controller, &map(&[MAP[0], MAP[3]])).unwrap();
    let notes = describe(&model, Role::Controller, &mapped, &settable(&model, &mapped)).notes;
    assert_eq!(notes[0], "No unit is stated for Encoder.phi, Motor.'tau (out)': SI is assumed.");
    assert!(
        notes[1].contains("Command.phi[1] = 0.0") && notes[2].contains("None of its inputs is a set-point"),
        "{notes:?}"
    );
    let undefined = description(2, SIMULATION).replace("<Unit name=\"rpm\">", "<Unit name=\"rp\">");
    let undefined = undefined.replace("unit=\"rpm\"", "unit=\"furlong/s\"");
    let model = description::read(&undefined).unwrap();
    let refused = super::mapped(&model, Role::Controller, &map(&MAP)).map(drop).expect_err("an unknown unit");
    assert!(refused.contains("furlong/s, which is not a unit of an angular velocity or is not defined"), "{refused}");
}

#[test]
fn a_friction_has_its_own_signals_and_no_set_point() {
    let model = description::read(&description(2, SIMULATION)).expect("it is right");
    let refused =
        |role, pairs: &[(&str, &str)]| mapped(&model, role, &map(pairs)).map(drop).expect_err("it is refused");
    let message = refused(Role::Friction, &[("reference_position", "Command.phi[1]"), MAP[3]]);
    assert!(
        message.contains("a friction has no signal reference_position") && message.contains("estimated_velocity"),
        "{message}"
    );
    let message = refused(Role::Friction, &[MAP[0], MAP[3]]);
    assert!(
        message.contains("the estimated or measured velocity. Map it by --map estimated_velocity=NAME"),
        "{message}"
    );
    let message = refused(Role::Law, &[MAP[3]]);
    assert!(message.contains("the velocity or the angle"), "{message}");
    let message = refused(Role::Controller, &[("estimated_velocity", "Command.w"), MAP[0], MAP[3]]);
    assert!(message.contains("a controller has no signal estimated_velocity"), "{message}");
    let pairs = [("estimated_velocity", "Command.w"), MAP[3]];
    let mapped = mapped(&model, Role::Friction, &map(&pairs)).expect("it has a velocity");
    let names: Vec<&str> = mapped.signals.iter().map(|signal| signal.name.as_str()).collect();
    assert_eq!(names, ["estimated_velocity", "torque"]);
}

#[test]
fn a_fixed_parameter_is_marked() {
    let fixed = description(2, SIMULATION).replace("\"tunable\"", "\"fixed\"");
    let model = description::read(&fixed).unwrap();
    let mapped = super::mapped(&model, Role::Controller, &map(&MAP)).unwrap();
    let description = describe(&model, Role::Controller, &mapped, &settable(&model, &mapped));
    assert_eq!(description.parameters.iter().map(|it| it.fixed).collect::<Vec<_>>(), [true, false], "{description:?}");
}
