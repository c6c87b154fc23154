use super::*;
use crate::BenchError;
use stickslip_base::parameters::presets;
use stickslip_design::DesignError;

fn tuning() -> Tuning {
    Tuning::new(presets::find("clm-bench").unwrap()).unwrap()
}

fn change(path: &str, value: &str) -> Vec<(String, String)> {
    vec![(path.into(), value.into())]
}

fn gain(tuning: &Tuning) -> f64 {
    match tuning.preset().bench.controller {
        ControllerChoice::Cascade(cascade) => cascade.position_gain,
        other => panic!("the preset's controller is a cascade: {other:?}"),
    }
}

const GAIN: &str = "bench.controller.position_gain";

#[test]
fn a_change_is_proposed_entered_undone_and_redone() {
    let mut tuning = tuning();
    let before = gain(&tuning);
    let proposal = tuning.set(&change(GAIN, "11.5")).unwrap();
    assert_eq!(gain(&tuning), before, "a proposal changes nothing");
    assert_eq!((proposal.differences.len(), proposal.margin), (1, None), "the rendering law stays");
    let parameters = proposal.parameters(Correction::Nothing).unwrap();
    let Preset { model, bench, .. } = proposal.preset();
    assert_eq!(parameters.tick.control, design::axis_control(model, bench).unwrap());
    tuning.entered(proposal);
    assert_eq!((gain(&tuning), tuning.can_undo()), (11.5, (true, false)));
    assert_eq!(tuning.differences()[0].path, GAIN);

    tuning.entered(tuning.undo().unwrap());
    assert_eq!((gain(&tuning), tuning.can_undo()), (before, (false, true)));
    assert!(matches!(
        tuning.undo().as_ref().err().and_then(|error| error.of()),
        Some(BenchError::NothingToUndo { .. })
    ));
    tuning.entered(tuning.redo().unwrap());
    assert_eq!(gain(&tuning), 11.5);
    assert!(matches!(
        tuning.redo().as_ref().err().and_then(|error| error.of()),
        Some(BenchError::NothingToUndo { .. })
    ));

    // A change after an undo replaces the undone one; a reset is one more step.
    tuning.entered(tuning.undo().unwrap());
    tuning.entered(tuning.set(&change(GAIN, "12")).unwrap());
    assert_eq!(tuning.can_undo(), (true, false));
    tuning.entered(tuning.reset().unwrap());
    assert_eq!((gain(&tuning), tuning.differences().len(), tuning.can_undo()), (before, 0, (true, false)));
    // A reset without a difference is not a step.
    tuning.entered(tuning.reset().unwrap());
    tuning.entered(tuning.undo().unwrap());
    assert_eq!(gain(&tuning), 12.0);
}

#[test]
fn values_that_belong_together_enter_together_or_not_at_all() {
    let tuning = tuning();
    let ends = |lower: &str, upper: &str| {
        let safety = |name: &str, value: &str| (format!("bench.safety.{name}"), value.to_owned());
        tuning.set(&[safety("lower_end", lower), safety("upper_end", upper)])
    };
    // Either alone would leave no stroke: the ends are -157 and 157.
    let proposal = ends("200", "300").unwrap();
    assert_eq!(proposal.preset().bench.safety.lower_end, 200.0);
    let refused = ends("300", "200").unwrap_err().to_string();
    assert!(refused.contains("upper_end") && refused.contains("stroke"), "{refused}");
    let refused = tuning.set(&[(GAIN.into(), "5".into()), ("bench.no".into(), "1".into())]).unwrap_err();
    assert!(matches!(refused, Error::UnknownParameter { .. }));
}

#[test]
fn a_fixed_parameter_of_a_running_bench_is_refused_with_a_remedy() {
    let tuning = tuning();
    for (path, value) in [
        ("plant.drive.load_inertia", "1e-3"),
        ("bench.tick_rate", "2000"),
        ("bench.plant_step", "2e-5"),
        ("bench.torque_amplifier", "true"),
    ] {
        let refused = tuning.set(&change(path, value)).unwrap_err();
        assert!(
            matches!(&refused.of(), Some(BenchError::NotWhileRunning { path: named, .. }) if named == path),
            "{refused}"
        );
        assert!(refused.to_string().contains("Restart the bench"), "{refused}");
    }
}

#[test]
fn another_desired_friction_has_its_margin_and_an_impossible_one_is_refused() {
    let tuning = tuning();
    let proposal = tuning.set(&change("bench.law.kind", "bristle")).unwrap();
    assert!(proposal.margin.is_some());
    assert!(matches!(proposal.parameters(Correction::Nothing).unwrap().tick.law, Law::Bristle(_)));
    let refused = tuning.set(&change("bench.desired.breakaway_torque", "90")).unwrap_err();
    assert!(matches!(refused.of(), Some(DesignError::NotRenderable(_))), "{refused}");
    // If the active set cannot be rendered, as at 1 kHz, a change is permitted.
    let mut source = presets::find("clm-bench").unwrap();
    source.text = parameters::set::<Preset<f64>>(&source.text, "t", "bench.tick_rate", "1000").unwrap();
    let slow = Tuning::new(source).unwrap();
    assert!(matches!(
        slow.renderable().as_ref().err().and_then(|error| error.of()),
        Some(DesignError::NotRenderable(_))
    ));
    assert_eq!(slow.set(&change("bench.law.kind", "bristle")).unwrap().margin, None);
}

#[test]
fn sets_are_saved_under_names_that_stay_in_their_folder() {
    let folder = tempfile::tempdir().unwrap();
    let sets = Sets::new(&folder.path().join("sets"));
    let mut tuning = tuning();
    assert!(sets.names().is_empty());
    let missing = sets.find("stiff").unwrap_err().to_string();
    assert!(missing.contains("No set is saved"), "{missing}");
    tuning.entered(tuning.set(&change(GAIN, "11.5")).unwrap());
    sets.save("stiff", tuning.text()).unwrap();
    tuning.entered(tuning.reset().unwrap());
    tuning.entered(tuning.load(sets.find("stiff").unwrap()).unwrap());
    assert_eq!((gain(&tuning), sets.names()), (11.5, vec!["stiff".to_owned()]));
    assert!(tuning.text().contains('#'), "comments stay");
    let missing = sets.find("stif").unwrap_err().to_string();
    assert!(missing.contains("stiff"), "{missing}");
    for name in ["", "../stiff", "a/b", "a.b", &"x".repeat(65)] {
        assert!(sets.save(name, "").is_err() && sets.find(name).is_err(), "{name}");
    }
}
