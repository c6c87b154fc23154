//! Simulated axes with known truth: each force and fault is found where it is, and only there.

use std::path::Path;

use super::*;
use axis::{Axis as Truth, Plan, Record};
use stickslip_recording::Column;

#[path = "../../stickslip/examples/intervals/axis.rs"]
#[allow(dead_code, reason = "the study draws random numbers from it, the tests do not")]
mod axis;

const TRUTH: Truth = Truth {
    inertia: 90.0,
    viscous: 190.0,
    coulomb: 22.0,
    gain: 36.0,
    offset: 0.0,
    load: 0.0,
    ripple: None,
    lag: 0.0,
    delay: 0,
    grid: 1e-7,
    noise: 0.0,
    disturbance: [0.3, 0.02],
    warm_up: 0.0,
    elastic: None,
};

const PLAN: Plan = Plan {
    rate: 1000.0,
    seconds: 16.0,
    stroke: 0.2,
    speed: 0.3,
    acceleration: 2.5,
    forward_only: false,
    pulses: 0.0,
    seed: 1,
};

fn machine(injected: bool) -> Machine {
    let injected = if injected { "injected = { name = \"w\", unit = \"V\" }" } else { "" };
    let text = format!(
        "name = \"axis\"\naxis = \"linear\"\nsampling_period = {{ value = 1, unit = \"ms\" }}\n[columns]\nposition = \
         {{ name = \"q\", unit = \"m\" }}\nreference = {{ name = \"r\", unit = \"m\" }}\ncommand = {{ name = \"u\", unit \
         = \"V\" }}\n{injected}\n[drive]\ngain = {{ value = 36, unit = \"N/V\" }}\n"
    );
    Machine::parse(Path::new("axis.toml"), &text).unwrap()
}

fn recording(record: Record) -> Recording {
    let Record { position, reference, command, injected } = record;
    let columns = [("q", position), ("r", reference), ("u", command), ("w", injected)];
    Recording::from_columns("axis.csv", columns.map(|(name, values)| Column::new(name, values)).into())
}

/// A rotary axis: the same numbers in rad and N m.
fn rotary(record: Record) -> Identification {
    let text = "name = \"arm\"\naxis = \"rotary\"\nsampling_period = { value = 1, unit = \"ms\" }\n[columns]\nposition = { name = \
                \"q\", unit = \"rad\" }\nreference = { name = \"r\", unit = \"rad\" }\ncommand = { name = \"u\", unit = \"A\" }\n\
                [drive]\ngain = { value = 36, unit = \"N m/A\" }\n";
    identify(&recording(record), &Machine::parse(Path::new("arm.toml"), text).unwrap(), &Watch::silent()).unwrap()
}

fn found(truth: &Truth, plan: &Plan) -> Identification {
    identify(&recording(truth.record(plan)), &machine(false), &Watch::silent()).unwrap()
}

/// Each number of mass and friction is within twice its interval of the truth, and the interval is narrow.
fn assert_true(found: &Identification, truth: &Truth) {
    let [viscous, coulomb] = [truth.viscous, truth.coulomb];
    let expected = [truth.inertia, viscous, coulomb, viscous, coulomb];
    let fit = &found.asymmetric.fit;
    for (index, truth) in expected.into_iter().enumerate() {
        let ([low, high], value) = (fit.ci95[index], fit.coefficients[index]);
        assert!((value - truth).abs() <= high - low, "{}: {value} {low} {high}", ASYMMETRIC[index]);
        assert!(high - low < 0.2 * truth, "{}: {low} {high}", ASYMMETRIC[index]);
    }
}

fn says(found: &Identification, words: &str) -> bool {
    found.findings.sentences(found.axis).iter().any(|sentence| sentence.contains(words))
}

#[test]
fn a_plain_axis_has_its_mass_and_friction_and_nothing_else_is_found() {
    let found = found(&TRUTH, &PLAN);
    assert_true(&found, &TRUTH);
    let Findings { delay, load, weight, periodic, drift, only, resonance, .. } = &found.findings;
    assert!(!delay.is_significant && delay.value.abs() < 1e-4, "{delay:?}");
    assert!(
        load.is_none() && weight.is_none() && periodic.is_none() && drift.is_empty() && only.is_none(),
        "{:?}",
        found.findings
    );
    assert!(resonance.is_none() && found.findings.sentences(found.axis).is_empty());
}

#[test]
fn a_late_position_and_a_lag_of_the_drive_are_found_with_their_total() {
    for (truth, total) in [
        (Truth { delay: 8, ..TRUTH }, 8e-3),
        (Truth { lag: 2e-3, ..TRUTH }, 2e-3),
        (Truth { delay: 3, lag: 1e-3, ..TRUTH }, 4e-3),
    ] {
        let found = found(&truth, &PLAN);
        let delay = found.findings.delay;
        assert!(delay.is_significant && (delay.value - total).abs() < 1.5e-4, "{delay:?}");
        assert_true(&found, &truth);
        assert!(says(&found, "position is recorded"), "{:?}", found.findings);
    }
    // The command late instead: as a held channel.
    let mut record = TRUTH.record(&PLAN);
    record.command = (0..record.command.len()).map(|i| record.command[i.saturating_sub(4)]).collect();
    let found = identify(&recording(record), &machine(false), &Watch::silent()).unwrap();
    assert!((found.findings.delay.value + 4e-3).abs() < 1e-4 && says(&found, "command is recorded"));
    assert_true(&found, &TRUTH);
}

#[test]
fn a_lag_of_the_drive_is_distinguished_from_a_delay_where_the_motion_shows_it() {
    let quick = Plan { acceleration: 6.0, ..PLAN };
    let lagging = found(&Truth { lag: 6e-3, delay: 2, disturbance: [0.1, 0.02], ..TRUTH }, &quick);
    let (lag, [low, high]) = lagging.findings.delay.lag.expect("the lag is distinguished");
    assert!((lag - 6e-3).abs() < 3e-4 && low < 6e-3 && 6e-3 < high && high - low < 1e-3, "{lag} {low} {high}");
    assert!((lagging.findings.delay.value - 8e-3).abs() < 1e-4, "{:?}", lagging.findings.delay);
    assert!(says(&lagging, "lag of first order") && (lagging.asymmetric.fit.coefficients[0] - 90.0).abs() < 0.2);
    let late = found(&Truth { delay: 8, ..TRUTH }, &PLAN);
    assert!(late.findings.delay.lag.is_none() && says(&late, "act alike here"), "{:?}", late.findings.delay);
}

#[test]
fn weight_beside_the_axis_is_found_apart_from_the_offset_on_a_rotary_axis_only() {
    let truth = Truth { ripple: Some([12.0, std::f64::consts::TAU]), offset: 5.0, ..TRUTH };
    let plan = Plan { stroke: 4.0, speed: 6.0, acceleration: 25.0, ..PLAN };
    let record = truth.record(&plan);
    let found = rotary(record.clone());
    let weight = found.findings.weight.expect("the weight is found");
    assert!((weight.amplitude - 12.0).abs() < 0.4 && weight.ci95[0] < 12.0 && 12.0 < weight.ci95[1], "{weight:?}");
    assert!(says(&found, "one period per turn"), "{:?}", found.findings);
    let offset = 0.5 * (found.asymmetric.fit.coefficients[2] - found.asymmetric.fit.coefficients[4]);
    assert!((offset - 5.0).abs() < 0.5 && (found.asymmetric.fit.coefficients[0] - 90.0).abs() < 0.5, "{offset}");
    let linear = identify(&recording(record), &machine(false), &Watch::silent()).unwrap();
    assert!(linear.findings.weight.is_none(), "{:?}", linear.findings);
    let balanced = rotary(TRUTH.record(&plan));
    assert!(balanced.findings.weight.is_none(), "{:?}", balanced.findings);
}

#[test]
fn friction_that_grows_with_the_force_is_found_with_its_share() {
    let truth = Truth { load: 0.12, ..TRUTH };
    let found = found(&truth, &PLAN);
    let load = found.findings.load.expect("the share is found");
    assert!((load.share - 0.12).abs() < 0.01 && load.ci95[0] < load.share, "{load:?}");
    assert_eq!(found.best().kind, Kind::Load);
    assert_true(&found, &truth);
    assert!(says(&found, "Friction grows with the transmitted force"));
}

#[test]
fn a_periodic_force_is_found_with_period_and_amplitude_and_no_stribeck_drop_comes_of_it() {
    let truth = Truth { ripple: Some([8.0, 0.016]), ..TRUTH };
    let found = found(&truth, &PLAN);
    let periodic = found.findings.periodic.clone().expect("the ripple is found");
    assert!((periodic.period.0 - 0.016).abs() < 2e-5, "{periodic:?}");
    assert!((periodic.amplitude.0 - 8.0).abs() < 0.3, "{periodic:?}");
    assert_eq!(found.best().kind, Kind::Periodic);
    assert!(found.stribeck.iter().flatten().all(|fit| !fit.drop.is_identified()), "{:?}", found.stribeck_verdicts());
    assert_true(&found, &truth);
}

#[test]
fn friction_that_falls_over_the_recording_is_reported_and_its_interval_holds_both_halves() {
    let truth = Truth { warm_up: 0.4, ..TRUTH };
    let found = found(&truth, &Plan { seconds: 40.0, ..PLAN });
    let drift = &found.findings.drift;
    assert!(drift.iter().any(|drift| drift.index > 0), "{drift:?}");
    for Drift { index, halves, values } in drift {
        let [low, high] = found.asymmetric.fit.ci95[*index];
        assert!(
            low <= halves[0][0] && halves[1][1] <= high && values[0] > values[1],
            "{index} {low} {high} {halves:?}"
        );
    }
    assert!(says(&found, "halves of the recording differ"));
}

#[test]
fn without_a_set_point_the_intervals_are_doubled_and_it_is_stated() {
    let mut record = recording(TRUTH.record(&PLAN)).columns().to_vec();
    let with = found(&TRUTH, &PLAN);
    record.retain(|column| column.name != "r");
    let text = "name = \"axis\"\naxis = \"linear\"\nsampling_period = { value = 1, unit = \"ms\" }\n[columns]\nposition = { name = \
                \"q\", unit = \"m\" }\ncommand = { name = \"u\", unit = \"V\" }\n[drive]\ngain = { value = 36, unit = \"N/V\" }\n";
    let machine = Machine::parse(Path::new("axis.toml"), text).unwrap();
    let without = identify(&Recording::from_columns("axis.csv", record), &machine, &Watch::silent()).unwrap();
    assert!(says(&without, "No recorded set-point") && !says(&with, "No recorded set-point"));
    assert_true(&without, &TRUTH);
    let width = |found: &Identification| found.asymmetric.fit.ci95[0][1] - found.asymmetric.fit.ci95[0][0];
    assert!(width(&without) > 1.5 * width(&with), "{} {}", width(&without), width(&with));
}

#[test]
fn exchanged_columns_are_named_and_a_disturbed_axis_is_not_suspected() {
    let refused = |truth: &Truth, change: &dyn Fn(&mut Record)| {
        let mut record = truth.record(&PLAN);
        change(&mut record);
        identify(&recording(record), &machine(false), &Watch::silent()).err().map(|error| error.to_string())
    };
    let late = Truth { delay: 8, ..TRUTH };
    let message = refused(&late, &|record| std::mem::swap(&mut record.position, &mut record.command)).unwrap();
    assert!(message.contains("`u` (command) and `q` (position) seem to be exchanged"), "{message}");
    let message = refused(&late, &|record| std::mem::swap(&mut record.reference, &mut record.command)).unwrap();
    assert!(message.contains("`u` (command) and `r` (reference) seem to be exchanged"), "{message}");
    // Against its sign the command moves the axis the other way, and no exchange helps.
    let message = refused(&TRUTH, &|record| record.command.iter_mut().for_each(|u| *u = -*u)).unwrap();
    assert!(message.contains("reverse the sign"), "{message}");
    assert_eq!(refused(&Truth { disturbance: [20.0, 0.05], ..TRUTH }, &|_| {}), None);
}

#[test]
fn motion_in_one_direction_gives_no_number_for_the_other() {
    let found = found(&TRUTH, &Plan { forward_only: true, ..PLAN });
    assert_eq!(found.findings.only, Some(1));
    let fit = &found.asymmetric.fit;
    assert!((fit.coefficients[0] - 90.0).abs() < 1.0 && fit.coefficients[3..].iter().all(|c| c.is_nan()), "{fit:?}");
    let summary = results::summary(&found);
    assert!(summary.value("friction.positive.coulomb").is_some());
    assert!(summary.value("friction.negative.coulomb").is_none() && summary.value("friction.offset").is_none());
    let record = recording(TRUTH.record(&PLAN));
    let page = report(&found, &machine(false), &record, &summary, "").html();
    assert!(page.contains("moves in positive direction only") && !page.contains("NaN"), "{page}");
}

#[test]
fn an_elastic_second_mass_is_named_with_its_frequency() {
    let truth = Truth { elastic: Some([0.3, 30.0]), ..TRUTH };
    let found = found(&truth, &PLAN);
    let resonance = found.findings.resonance.expect("the mode is found");
    // Load against a held motor: 30 Hz; both free against each other: 30/√0.7 = 35.9 Hz.
    assert!((resonance.frequency - 35.9).abs() < 4.0 && resonance.half_width < 10.0, "{resonance:?}");
    assert!(says(&found, "not rigid"));
}

#[test]
fn a_command_that_contains_the_injected_signal_is_recognised_and_the_mass_is_right_both_ways() {
    let truth = Truth { lag: 3e-4, ..TRUTH };
    let record = truth.record(&Plan { pulses: 1.0, ..PLAN });
    for contains in [false, true] {
        let mut record = record.clone();
        if contains {
            record.command.iter_mut().zip(&record.injected).for_each(|(u, w)| *u += w);
        }
        let found = identify(&recording(record), &machine(true), &Watch::silent()).unwrap();
        assert_eq!(found.findings.injected_in_command, contains);
        assert_true(&found, &truth);
        assert_eq!(says(&found, "already contains the injected signal"), contains);
    }
}

#[test]
fn force_pulses_at_a_constant_set_point_give_a_mass_whose_interval_holds_or_state_the_missing_delay() {
    let still = Plan { stroke: 1e-9, speed: 1e-9, pulses: 12.0, ..PLAN };
    for truth in [TRUTH, Truth { lag: 5e-4, ..TRUTH }, Truth { delay: 1, ..TRUTH }, Truth { delay: 4, ..TRUTH }] {
        let mut record = truth.record(&still);
        record.reference.fill(0.0);
        let found = identify(&recording(record), &machine(true), &Watch::silent()).unwrap();
        let ([low, high], is_stated) = (found.asymmetric.fit.ci95[0], says(&found, "motion does not determine it"));
        let is_short = truth.delay <= 1;
        assert!((low..high).contains(&90.0) || is_stated && !is_short, "{low} {high} {:?}", found.findings);
    }
}

#[test]
fn more_gain_is_more_mass_with_the_same_delay_and_a_mirrored_axis_swaps_the_directions() {
    let truth = Truth { delay: 3, ripple: Some([8.0, 0.016]), offset: 4.0, ..TRUTH };
    let record = truth.record(&PLAN);
    let identified = |change: &dyn Fn(&mut Record)| {
        let mut record = record.clone();
        change(&mut record);
        identify(&recording(record), &machine(false), &Watch::silent()).unwrap()
    };
    let one = identified(&|_| {});
    let more = identified(&|record| record.command.iter_mut().for_each(|u| *u *= 1.3));
    let mirrored = identified(&|record| {
        [&mut record.position, &mut record.reference, &mut record.command].into_iter().flatten().for_each(|v| *v = -*v);
    });
    let coefficients = |found: &Identification| found.asymmetric.fit.coefficients.clone();
    let (a, b, c) = (coefficients(&one), coefficients(&more), coefficients(&mirrored));
    for k in 0..5 {
        assert!((b[k] / a[k] / 1.3 - 1.0).abs() < 1e-6, "{k}: {a:?} {b:?}");
        assert!((c[[0, 3, 4, 1, 2][k]] / a[k] - 1.0).abs() < 1e-6, "{k}: {a:?} {c:?}");
    }
    for other in [&more, &mirrored] {
        assert!((other.findings.delay.value - one.findings.delay.value).abs() < 1e-8);
    }
}
