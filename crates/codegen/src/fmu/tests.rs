use super::*;
use crate::c::project;
use stickslip_core::control::Pid;
use stickslip_core::friction::Stribeck;

fn of_pid(version: Version) -> Fmu {
    let pid = Pid::<f64>::default();
    fmu(&project::<_, f64>(&pid, "pid", 1e-3).expect("a name that C takes"), "pid", 1e-3, version)
}

fn text<'a>(fmu: &'a Fmu, name: &str) -> &'a str {
    &fmu.files.iter().find(|file| file.0 == name).expect("the FMU has it").1
}

#[test]
fn a_variable_has_its_unit_range_value_and_words() {
    for (version, start) in [(Version::Two, "<ScalarVariable"), (Version::Three, "<Float64")] {
        let fmu = of_pid(version);
        let xml = text(&fmu, "modelDescription.xml");
        let line = xml.lines().find(|line| line.contains("\"parameters.")).expect("a controller has parameters");
        assert!(line.trim().starts_with(start), "{line}");
        for word in
            ["causality=\"parameter\"", "variability=\"tunable\"", "unit=", "min=", "max=", "start=", "description="]
        {
            assert!(line.contains(word), "{word}: {line}");
        }
        let references: Vec<usize> = xml
            .lines()
            .filter(|line| line.trim().starts_with(start))
            .filter_map(|line| line.split("valueReference=\"").nth(1)?.split('"').next()?.parse().ok())
            .filter(|reference| *reference > 0)
            .collect();
        assert_eq!(references, (1..=references.len()).collect::<Vec<_>>());
        assert!(text(&fmu, "sources/model.h").contains(&format!("#define FMU_COUNT {}U", references.len())));
    }
}

#[test]
fn library_and_description_carry_the_same_token_and_other_models_another() {
    let two = of_pid(Version::Two);
    let header = text(&two, "sources/model.h");
    let token = header.split("FMU_TOKEN \"").nth(1).and_then(|rest| rest.split('"').next()).expect("it has one");
    assert_eq!(token.len(), 38);
    assert!(text(&two, "modelDescription.xml").contains(&format!("guid=\"{token}\"")));
    assert!(!text(&of_pid(Version::Three), "sources/model.h").contains(token));
    let other = Pid::<f64> { proportional_gain: 0.125, ..Pid::default() };
    let other = fmu(&project::<_, f64>(&other, "pid", 1e-3).expect("a name"), "pid", 1e-3, Version::Two);
    assert!(!text(&other, "sources/model.h").contains(token));
}

#[test]
fn a_block_without_state_has_none_in_c() {
    let curve = Stribeck::<f64>::default();
    let made = fmu(&project::<_, f64>(&curve, "curve", 1e-3).expect("a name"), "curve", 1e-3, Version::Three);
    let header = text(&made, "sources/model.h");
    assert!(
        !header.contains("curve_state") && header.contains("curve_step(&model->p, &model->in, FMU_STEP, &model->out)")
    );
}

#[test]
fn words_of_a_field_cannot_end_an_attribute() {
    assert_eq!(description::escape("a < \"b\" & c"), "a &lt; &quot;b&quot; &amp; c");
}
