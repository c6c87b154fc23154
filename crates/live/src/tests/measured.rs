//! Measurements on a running bench, and advice from them.

use super::*;
use crate::LiveError;
use stickslip_design::DesignError;
use stickslip_experiment::workflow::judged::Verdict;

#[test]
fn a_measurement_writes_its_results_and_blocks_changes_of_parameters() {
    let (live, project) = live();
    let plan = [("slowest", "20"), ("fastest", "40"), ("speeds", "2")];
    let plan = plan.map(|(name, value)| (name.to_owned(), value.to_owned()));
    let measure = Call::Measure { what: Quantity::Friction, plan: plan.into(), render: false };
    live.call(ANN, measure.clone()).unwrap();
    let busy = live.call(ANN, set(GAIN, "11")).unwrap_err();
    assert!(matches!(busy.of(), Some(LiveError::Busy { .. })), "{busy}");
    let ended = ended(&live);
    assert_eq!(ended.error, None);
    let folder = ended.folder.unwrap();
    assert!(folder.ends_with("runs/0001-measure-friction"), "{folder}");
    assert!(Path::new(&folder).starts_with(project.path()));
    assert!(Path::new(&folder).join("summary.json").exists());
    live.call(ANN, set(GAIN, "11")).unwrap();
    let unknown =
        Call::Measure { what: Quantity::Friction, plan: BTreeMap::from([("sped".into(), "2".into())]), render: false };
    let refused = live.call(ANN, unknown).unwrap_err().to_string();
    assert!(refused.contains("speeds"), "{refused}");
}

#[test]
fn a_sketch_and_a_margin_leave_the_bench_unchanged() {
    let (live, _folder) = live();
    let sketch = serde_json::json!(
        {"call": "sketch", "speeds": [0, 1, 10], "desired": [0.3, 0.12, 0.01, 1e-4], "thorough": true}
    );
    let sketch = Call::from_json(sketch).unwrap();
    let Answer::Drawn(drawn) = live.call("looks", sketch).unwrap() else { panic!("it is drawn") };
    assert_eq!((drawn.curve.len(), drawn.renderable), (3, false));
    let margin = |law: &str, stiffness: &str| {
        let values = [("bench.law.kind", law), ("bench.desired_bristles.stiffness", stiffness)];
        let values = values.map(|(path, value)| (path.to_owned(), value.to_owned())).into();
        live.call("looks", Call::Margin { values })
    };
    let Answer::Margin(soft) = margin("bristle", "300").unwrap() else { panic!("it is a margin") };
    assert!(soft.stable && soft.stiffness == Some(300.0) && soft.chatter < soft.chatter_limit, "{soft:?}");
    assert!(matches!(margin("bristly", "300"), Err(Error::Parameters(_))));
    let Answer::Status(status) = live.call("looks", Call::Status {}).unwrap() else { panic!("a status") };
    assert_eq!((status.changed, status.operator), (0, None));
    live.stop().unwrap();
}

#[test]
fn a_friction_curve_is_shown_during_its_measurement_and_its_fit_afterwards() {
    let (live, project) = live();
    let plan: BTreeMap<String, String> = [("slowest", "5"), ("fastest", "40"), ("speeds", "3")]
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .into();
    let curve = |run| match live.call("looks", Call::Curve { run }).unwrap() {
        Answer::Curve(curve) => *curve,
        other => panic!("{other:?}"),
    };
    assert_eq!(curve(None), protocol::MeasuredCurve::default());
    let call = Call::Plan { what: Quantity::Friction, thorough: false, plan: plan.clone() };
    let Answer::Plan(form) = live.call("looks", call).unwrap() else { panic!("no plan") };
    assert!(form.duration > 0.0 && form.items.iter().any(|item| item.path == "speeds" && item.value == Some(3.0)));
    live.call(ANN, Call::Measure { what: Quantity::Friction, plan, render: false }).unwrap();
    let growing = loop {
        let growing = curve(None);
        if growing.points.len() >= 2 {
            break growing;
        }
        thread::sleep(Duration::from_millis(5));
    };
    assert!(growing.measuring && growing.run.is_none() && !growing.course.is_empty(), "{growing:?}");
    assert_eq!(ended(&live).error, None);
    let measured = curve(None);
    assert_eq!((measured.run, measured.measuring, measured.points.len()), (Some(1), false, 6));
    let fit = measured.fit.as_ref().unwrap();
    // The numbers are those of `stickslip fit` on the same folder.
    let folder = project.path().join("runs/0001-measure-friction");
    let fits = stickslip_experiment::workflow::fit::fit_file(&folder, &Default::default(), false).unwrap();
    assert_eq!(fit.rms, fits.fits[0].fit.rms);
    for (shown, (_, estimate)) in fit.parameters.iter().zip(fits.fits[0].fit.lines()) {
        assert_eq!(shown.value, estimate.written().value);
    }
    assert_eq!(fit.velocity.len(), fit.band.len());
    assert_eq!(curve(Some(1)), measured);
    assert!(live.call("looks", Call::Curve { run: Some(7) }).unwrap_err().to_string().contains("curves"));
    // A preview shows the differences and changes nothing.
    let values = BTreeMap::from([("model.own.kinetic_torque".to_owned(), "0.17".to_owned())]);
    let Answer::Differences { differences } = live.call("looks", Call::Preview { values }).unwrap() else { panic!() };
    assert_eq!((differences.len(), status(&live).changed), (1, 0));
    let Answer::Machine(machine) = live.call("looks", Call::Machine {}).unwrap() else { panic!("no machine") };
    assert_eq!(machine.speeds[1].factor, 60.0 / std::f64::consts::TAU);
}

/// Compares a key number with that of the summary, rounded to its uncertainty.
fn is_as_in_summary(key: &protocol::KeyEstimate, folder: &Path) {
    let summary = std::fs::read_to_string(folder.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let error = stickslip_base::quantity::Estimate::new(
        summary["results"]["render.rms_error"]["value"].as_f64().unwrap(),
        "N m",
    );
    let (error, number) = (error.written(), |text: &str| text.parse::<f64>().unwrap());
    assert!(!key.half_width.is_empty() && key.unit == error.unit, "{error} {key:?}");
    assert!((number(&error.value) - number(&key.value)).abs() <= number(&key.half_width), "{error} {key:?}");
}

#[test]
fn the_rendered_friction_is_measured_shown_and_reported() {
    let (live, project) = live();
    let plan: BTreeMap<String, String> = [("slowest", "10"), ("fastest", "40"), ("speeds", "2")]
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .into();
    let measure = |render| Call::Measure { what: Quantity::Friction, plan: plan.clone(), render };
    let rendered = |run| match live.call("looks", Call::Rendered { run }).unwrap() {
        Answer::Rendered(rendered) => *rendered,
        other => panic!("{other:?}"),
    };
    // There is no result yet, a refused measurement moves nothing, and only friction can be measured with rendering.
    assert_eq!(rendered(None), protocol::RenderedFriction::default());
    assert!(matches!(live.call(ANN, Call::SaveReport {}).unwrap_err(), Error::TooFew { found: 0, .. }));
    let refused = live.call(ANN, measure(true)).unwrap_err();
    assert!(matches!(refused.of(), Some(DesignError::NotRenderable { .. })), "{refused}");
    let bristles = Call::Measure { what: Quantity::Presliding, plan: BTreeMap::new(), render: true };
    assert!(live.call(ANN, bristles).unwrap_err().to_string().contains("Only the friction curve"));
    assert_eq!((status(&live).state.as_str(), status(&live).doing), ("off", None));

    live.call(ANN, measure(false)).unwrap();
    assert_eq!(ended(&live).error, None);
    let sketch =
        stickslip_experiment::workflow::sketch::Sketch { nearest: true, speeds: vec![0.0], ..Default::default() };
    let Answer::Drawn(nearest) = live.call("looks", Call::Sketch(sketch)).unwrap() else { panic!("not drawn") };
    let values = stickslip_fit::PARAMETERS.iter().zip(nearest.desired);
    let values = values.map(|((key, ..), value)| (format!("bench.desired.{key}"), format!("{value:?}"))).collect();
    live.call(ANN, Call::Set { values }).unwrap();
    live.call(ANN, measure(true)).unwrap();
    let growing = loop {
        let growing = rendered(None);
        if growing.measuring && !growing.keys.is_empty() {
            break growing;
        }
        thread::sleep(Duration::from_millis(5));
    };
    assert_eq!((growing.run, growing.figures.len()), (None, 4));
    assert_eq!(ended(&live).error, None);

    let complete = rendered(None);
    assert_eq!((complete.run, complete.measuring, complete.figures.len()), (Some(2), false, 4));
    assert!(complete.verdict.contains("% of M_S"), "{}", complete.verdict);
    assert_eq!(complete.outcome, Some(Verdict::Met), "{}", complete.verdict);
    is_as_in_summary(&complete.keys[0], &project.path().join("runs/0002-render"));
    // It is listed as a curve, but not as the own friction.
    let curves = |live: &Live| match live.call("looks", Call::Curves {}).unwrap() {
        Answer::Curves { curves } => curves.into_iter().map(|name| (name.run, name.rendered)).collect::<Vec<_>>(),
        other => panic!("{other:?}"),
    };
    assert_eq!(curves(&live), [(2, true), (1, false)]);
    let Answer::Curve(own) = live.call("looks", Call::Curve { run: None }).unwrap() else { panic!("no curve") };
    assert_eq!((own.run, own.rendered, own.course.is_empty()), (Some(1), false, false));
    let Answer::Curve(curve) = live.call("looks", Call::Curve { run: Some(2) }).unwrap() else { panic!("no curve") };
    assert_eq!((curve.rendered, curve.points.len(), curve.course.is_empty()), (true, 4, false));

    let Answer::Report { run, folder } = live.call(ANN, Call::SaveReport {}).unwrap() else { panic!("no report") };
    assert_eq!(run, 3);
    let page = live.report_page(run).unwrap();
    assert_eq!(page, std::fs::read_to_string(Path::new(&folder).join("report.html")).unwrap());
    for part in
        ["Own friction", "Desired friction", "Rendered friction", "figure 12", "figure 13", "figure 14", "cascade"]
    {
        assert!(page.contains(part), "{part}");
    }
    // The number of its folder is that of the catalogue.
    let listed = || match live.call("looks", Call::Runs { query: "report".into(), limit: 5 }).unwrap() {
        Answer::Runs { runs, .. } => runs.iter().map(|run| run.number).collect::<Vec<_>>(),
        other => panic!("{other:?}"),
    };
    while listed().is_empty() {
        thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(listed(), [3]);
    assert!(live.report_page(77).unwrap_err().to_string().contains("no run with a report 77"));
    // Links are not followed.
    #[cfg(unix)]
    {
        let link = project.path().join("runs/0009-link");
        std::fs::create_dir(&link).unwrap();
        std::os::unix::fs::symlink(project.path().join("serve-token"), link.join("report.html")).unwrap();
        assert!(live.report_page(9).is_err());
    }
    live.stop();
}

#[test]
fn breakaway_and_presliding_are_shown_during_their_measurement_and_do_not_change_the_friction_curve() {
    let (live, _project) = live();
    let at_rest = |what, run| match live.call("looks", Call::AtRest { what, run }).unwrap() {
        Answer::AtRest(measurement) => *measurement,
        other => panic!("{other:?}"),
    };
    let plan = |values: &[(&str, &str)]| -> BTreeMap<String, String> {
        values.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
    };
    let growing = |what, is_ready: &dyn Fn(&protocol::BreakawayMeasurement) -> bool| loop {
        let growing = at_rest(what, None);
        if growing.measuring && is_ready(&growing) {
            break growing;
        }
        assert_eq!(status(&live).last.and_then(|last| last.error), None);
        thread::sleep(Duration::from_millis(2));
    };
    assert_eq!(at_rest(Quantity::Breakaway, None), protocol::BreakawayMeasurement::default());
    let refused = live.call("looks", Call::AtRest { what: Quantity::Friction, run: None }).unwrap_err();
    assert!(refused.to_string().contains("`curve`"), "{refused}");

    let ramps = |rate| {
        let plan = plan(&[("repetitions", "1"), ("angles", "1"), ("rest_time", "0.05"), ("rate", rate)]);
        Call::Measure { what: Quantity::Breakaway, plan, render: false }
    };
    // Slow ramps: in real time the control stops the load only some time after its breakaway.
    live.call(ANN, ramps("0.1")).unwrap();
    let first = growing(Quantity::Breakaway, &|measurement| !measurement.keys.is_empty());
    assert_eq!((first.run, first.figures.len()), (None, 1));
    assert_eq!(ended(&live).error, None);
    let result = at_rest(Quantity::Breakaway, None);
    assert_eq!((result.run, result.measuring, result.keys.len(), result.figures.len()), (Some(1), false, 3, 1));
    let own: f64 = result.own["model.own.breakaway_torque"].parse().unwrap();
    assert!((own - result.keys[0].value.parse::<f64>().unwrap()).abs() < 0.01, "{result:?}");
    // At another rate, a figure shows the results of earlier runs as well.
    live.call(ANN, ramps("0.15")).unwrap();
    assert_eq!(ended(&live).error, None);
    let result = at_rest(Quantity::Breakaway, None);
    assert_eq!((result.run, result.runs.as_slice(), result.figures.len()), (Some(2), &[2, 1][..], 2));
    assert!(result.figures[1].figure.title().contains("rate of the ramp"));
    assert_eq!(at_rest(Quantity::Breakaway, Some(1)).run, Some(1));
    assert!(live.call("looks", Call::AtRest { what: Quantity::Breakaway, run: Some(9) }).is_err());

    let plan = plan(&[("slow_frequency", "4"), ("slow_cycles", "3")]);
    live.call(ANN, Call::Measure { what: Quantity::Presliding, plan, render: false }).unwrap();
    let before = growing(Quantity::Presliding, &|measurement| !measurement.figures.is_empty());
    assert!(before.figures[0].figure.title().contains("friction"), "{before:?}");
    // The friction that is measured first is not a friction curve of the run.
    assert!(live.shared.measurements.current_curve().plateaus.is_empty());
    live.call(ANN, Call::Halt {}).unwrap();
    ended(&live);
    live.stop().unwrap();
}

#[test]
fn a_preload_is_advised_for_parameters_that_are_not_active_yet() {
    let (live, _project) = live();
    let advice = |law: &str| {
        let values = [("bench.law.kind", law), ("bench.desired.breakaway_torque", "0.2")];
        let values = values.map(|(path, value)| (path.to_owned(), value.to_owned())).into();
        match live.call("looks", Call::AdvisePreload { values }).unwrap() {
            Answer::AdvisedPreload(advice) => advice,
            other => panic!("{other:?}"),
        }
    };
    let faded = advice("paper");
    assert!(faded.needed && !faded.by_hand && faded.sentence.contains("two preloads"), "{faded:?}");
    assert!(!advice("bristle").needed);
    live.stop().unwrap();
}
