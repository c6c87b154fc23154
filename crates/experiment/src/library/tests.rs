use super::*;
use stickslip_base::parameters::presets;

#[test]
fn every_entry_is_complete_with_its_source_and_can_be_drawn() {
    for name in names() {
        let entry = find(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        let About { title, source, licence, .. } = &entry.about;
        assert!([title, source, licence].iter().all(|text| !text.is_empty()), "{name}");
        // Its own numbers, not a default: sliding friction is on its curve.
        let sliding = entry.sliding().unwrap();
        assert_ne!(sliding, Stribeck::default(), "{name}");
        let (torque, deviation) = entry.torque(1.0);
        assert!(torque > 0.0 && deviation.is_finite(), "{name}: {torque} {deviation}");
        let folder = tempfile::tempdir().unwrap();
        let summary = entry.write(folder.path(), "stickslip friction").unwrap();
        assert!(folder.path().join("curve.svg").exists() && folder.path().join("report.html").exists(), "{name}");
        assert!(summary.to_json().contains("friction.kinetic_torque"), "{name}");
        // The caption describes a band only where there is one.
        let html = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
        assert_eq!(html.contains("The band contains"), !entry.about.deviations.is_empty(), "{name}");
    }
}

#[test]
fn deviations_of_the_parameters_add_up_to_that_of_the_torque() {
    // Far above the Stribeck velocity M = M_K + b·Ω: 12.56 + 3.35, with 0.36 and 0.45.
    let entry = find("robot-joint-1").unwrap();
    let (torque, deviation) = entry.torque(1.0);
    assert!((torque - 15.91).abs() < 1e-9, "{torque}");
    assert!((deviation - f64::hypot(0.36, 0.45)).abs() < 1e-9, "{deviation}");
    assert_eq!(find("dc-servo").unwrap().torque(1.0).1, 0.0);
}

#[test]
fn a_scaled_friction_is_the_same_at_the_same_speeds() {
    for name in ["robot-joint-1", "geared-servo", "emps"] {
        let entry = find(name).unwrap();
        let scaled = entry.scaled(0.1);
        for velocity in [-2.0, 0.01, 3.0] {
            let ((torque, deviation), (small, less)) = (entry.torque(velocity), scaled.torque(velocity));
            assert!((0.1 * torque - small).abs() < 1e-12 && (0.1 * deviation - less).abs() < 1e-12, "{name}");
        }
        let [whole, tenth] = [&entry, &scaled].map(|entry| entry.identified.friction);
        let (at, under) = (whole.steady_torque(1.0, 0.0, 2.0), tenth.steady_torque(1.0, 0.0, 0.2));
        assert!((0.1 * at - under).abs() < 1e-12, "{name}");
        let steps = [&entry, &scaled].map(|entry| entry.recommended_step().map(|step| (1e9 * step).round()));
        assert_eq!(steps[0], steps[1], "{name}");
    }
}

/// A mass on bristles that stick swings with ω = √(σ₀/J): at the recommended step the period is right to 0.2 %, and it
/// is stable only below ten times that step.
#[test]
fn the_recommended_step_follows_the_bristles() {
    let mut entry = find("dc-servo").unwrap();
    if let Model::Lugre(model) = &mut entry.identified.friction.model {
        model.bristle_damping = 0.0;
        model.sliding.viscous_friction = 0.0;
    }
    let step = entry.recommended_step().unwrap();
    let omega = libm::sqrt(260.0 / 2.3e-3);
    // A leapfrog swings with sin(ω'·h/2) = ω·h/2.
    let period = |step: f64| 2.0 * libm::asin(0.5 * omega * step) / step;
    assert!((period(step) / omega - 1.0).abs() < 0.002);
    assert!((10.0 * step * omega - 2.0).abs() < 1e-9);
}

#[test]
fn on_a_bench_it_is_the_desired_or_the_own_friction() {
    let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    let entry = find("dc-servo").unwrap();
    let desired = entry.on(&preset, Role::Desired).unwrap();
    assert_eq!(desired.bench.desired, entry.sliding().unwrap());
    assert_eq!(desired.bench.desired_bristles.stiffness, 260.0);
    assert_eq!((desired.plant, desired.model), (preset.plant, preset.model));
    let own = entry.on(&preset, Role::Own).unwrap();
    assert_eq!(own.plant.screw_friction, entry.identified.friction);
    assert_eq!((own.model.own, own.plant.wheel.preload), (entry.sliding().unwrap(), 0.0));
    // Torques beyond all ranges.
    let refused = entry.scaled(1e6).on(&preset, Role::Desired).unwrap_err().to_string();
    assert!(refused.contains("breakaway_torque"), "{refused}");
}

/// A friction file with a Maxwell slip, with further tables.
fn maxwell_slip(more: &str) -> Entry {
    let text = format!(
        "[about]\ntitle = \"A slide\"\nsource = \"a test\"\nlicence = \"none\"\n\n[range]\ninertia = 1e-3\n\n\
         [friction.model]\nkind = \"maxwell-slip\"\nfirst_share = 0.1\nfirst_stiffness = 400.0\n\n{more}"
    );
    read("slide", &text, "slide.toml").unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_maxwell_slip_is_accepted_as_own_but_not_as_desired_friction() {
    let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    let entry = maxwell_slip("");
    let Model::MaxwellSlip(model) = entry.identified.friction.model else { panic!("unexpected model") };
    assert_eq!((model.first_share, model.first_stiffness, model.fourth_stiffness), (0.1, 400.0, 20.0));
    let limits = entry.limits().join(" ");
    assert!(!limits.contains("do not close") && limits.contains("temperature"), "{limits}");
    // ω² = 540 N·m/rad over 1e-3 kg·m², a tenth of 2/ω; viscous friction shortens it by some 1e-4 of itself.
    assert!((entry.recommended_step().unwrap() / (0.2 / f64::sqrt(540e3)) - 1.0).abs() < 1e-3);
    let folder = tempfile::tempdir().unwrap();
    entry.write(folder.path(), "stickslip friction").unwrap();
    assert!(folder.path().join("presliding.svg").exists());
    let own = entry.on(&preset, Role::Own).unwrap();
    assert_eq!(own.plant.screw_friction, entry.identified.friction);
    assert_eq!((own.model.own, own.model.own_bristles.stiffness), (model.sliding, 540.0));
    let refused = entry.on(&preset, Role::Desired).unwrap_err().to_string();
    assert!(refused.starts_with("slide cannot be the desired friction") && refused.contains("--as own"), "{refused}");
}

#[test]
fn a_friction_with_rest_time_or_temperature_is_not_rendered() {
    let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    let tables = ["[friction.rest]\nshape = \"rising\"\n", "[friction.temperature]\nshape = \"exponential\"\n"];
    for (table, effect) in tables.into_iter().zip(["Temperature has no effect.", "The time at rest has no effect."]) {
        let mut entry = maxwell_slip(table);
        entry.identified.friction.model = Model::ElastoPlastic(ElastoPlastic::default());
        assert!(entry.limits().contains(&effect), "{:?}", entry.limits());
        let refused = entry.on(&preset, Role::Desired).unwrap_err().to_string();
        assert!(refused.contains("time at rest") && refused.contains("rest and temperature"), "{refused}");
        assert!(entry.on(&preset, Role::Own).is_ok());
    }
}

#[test]
fn errors_of_a_file_state_its_line() {
    let text = ENTRIES.iter().find(|(name, _)| *name == "dc-servo").unwrap().1;
    let read = |text: &str| read("mine", text, "mine.toml").map(|_| ()).unwrap_err().to_string();
    let line = text.lines().position(|line| line.starts_with("bristle_stiffness")).unwrap() + 1;
    let far = read(&text.replace("bristle_stiffness = 260.0", "bristle_stiffness = -1.0"));
    assert!(far.contains(&format!("mine.toml:{line}")) || far.contains(&format!("line {line}")), "{far}");
    let nameless = read(&text.replace("licence", "license"));
    assert!(nameless.contains("license") && nameless.contains("[about]"), "{nameless}");
    let nowhere = read(&text.replace("[range]", "[about.deviations]\n\"friction.stiffness\" = 1.0\n\n[range]"));
    assert!(nowhere.contains("friction.stiffness"), "{nowhere}");
    let path = "\"friction.model.bristle_stiffness\"";
    let negative = read(&text.replace("[range]", &format!("[about.deviations]\n{path} = -1.0\n\n[range]")));
    assert!(negative.contains("at least 0"), "{negative}");
}

#[test]
fn an_unknown_name_gives_a_list_of_all_names() {
    let unknown = find("ems").unwrap_err().to_string();
    assert!(unknown.contains("ems") && unknown.contains("emps"), "{unknown}");
    assert!(matches!(find("nowhere.toml"), Err(Error::File { .. })));
}
