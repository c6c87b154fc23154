//! Tests of the comparison: values that must be 0 are 0, values that must be 1 are 1, and each verdict is provoked.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use stickslip_core::drive::{Arm, ElasticArm};
use stickslip_core::render::{Law, RenderedArm};
use stickslip_core::tick::{Order, Tick, TickOutput};

use super::*;
use stickslip_base::parallel::map;
use stickslip_base::preset::{
    ArmDamping, CompensationChoice, ControllerChoice, DampedArm, FeedforwardChoice, LawChoice, StateFeedback,
};
use stickslip_base::statistics::{bootstrap, mean};
use stickslip_base::{Error, Watch};
use stickslip_design as design;
use stickslip_simulate::fast_bench::FastBench;
use stickslip_simulate::fidelity::machine;

fn cell(wheel: bool, mismatch: Mismatch) -> Cell {
    TestBed::find("prototype").unwrap().cell(wheel, 4000.0, mismatch)
}

fn runs(cell: &Cell, role: Role, scenarios: &[Scenario], seeds: &[u64]) -> Runs {
    Runs::simulate(cell, role, scenarios, seeds, 2, &Watch::silent()).unwrap()
}

#[test]
fn a_machine_differs_from_itself_by_0_and_from_one_without_rendering_by_1() {
    let cell = cell(true, Mismatch::PERFECT);
    let scenarios = [Scenario::SINE_2HZ, Scenario::PRESLIDING];
    let [a, a0, b] = [Role::Desired, Role::Own, Role::Rendered].map(|role| runs(&cell, role, &scenarios, &[1, 2]));
    for score in scores(&a, &a, &a0) {
        assert_eq!((score.difference, score.excess, score.ci95), (0.0, 0.0, [0.0; 2]), "{score:?}");
        assert!(score.stable && score.floor < 0.05, "{score:?}");
    }
    assert!(scores(&a, &a, &a0)[0].floor > 0.0, "other noise, another path");
    // The law is off: the load motor's current is controlled to zero within the noise of its sensor.
    let sine = scores(&b, &a, &a0)[0];
    assert!((sine.difference - 1.0).abs() < 0.02, "{sine:?}");
    assert_eq!(scores(&a0, &a, &a0)[0].difference, 1.0);
}

#[test]
fn with_the_desired_friction_the_controller_hunts_with_the_own_one_it_does_not() {
    let cell = cell(false, Mismatch::PERFECT);
    let [a, a0] = [Role::Desired, Role::Own].map(|role| runs(&cell, role, &[Scenario::HUNTING], &[1]));
    let [of_a, of_a0] = [a, a0].map(|runs| LimitCycle::find(&runs.traces[0][0], Scenario::HUNTING.evaluated_from()));
    // An independent prototype of this bench: 80 mrad, 0.573 s, 21 breakaways in 12 s.
    assert!((of_a.amplitude - 0.080).abs() < 0.004 && (of_a.interval - 0.573).abs() < 0.03, "{of_a:?}");
    assert!((20..=22).contains(&of_a.breakaways), "{of_a:?}");
    assert!(of_a0.breakaways < 2 && of_a0.amplitude.is_nan(), "{of_a0:?}");
}

#[test]
fn a_law_that_runs_away_is_not_stable_and_has_no_difference() {
    let mut cell = cell(false, Mismatch::PERFECT);
    cell.preset.bench.safety.speed = 100.0;
    // It assumes twenty times the friction, and pushes the load along as soon as it breaks away.
    cell.preset.model.own.kinetic_torque *= 20.0;
    cell.preset.model.own.breakaway_torque *= 20.0;
    let bench = &cell.preset;
    cell.law = Law::Paper(design::difference_torque(&bench.bench.desired, &bench.model, &bench.bench));
    let scenarios = [Scenario::PRESLIDING];
    let [a, a0, b] = [Role::Desired, Role::Own, Role::Rendered].map(|role| runs(&cell, role, &scenarios, &[1, 2]));
    let score = scores(&b, &a, &a0)[0];
    assert!(!score.stable && score.difference.is_nan() && score.excess.is_nan(), "{score:?}");
    assert!(b.traces[0][0].angle.len() < a.traces[0][0].angle.len(), "it is stopped");
}

#[test]
fn a_load_that_breaks_away_has_no_presliding_loop() {
    // Without the wheel the machine breaks away at 0.2 N m, the cycles have 0.405.
    let cell = cell(false, Mismatch::PERFECT);
    let scenarios = [Scenario::PRESLIDING, Scenario::BREAKAWAY];
    let [a, a0] = [Role::Desired, Role::Own].map(|role| runs(&cell, role, &scenarios, &[1]));
    let scores = scores(&a0, &a, &a0);
    let [area, stiffness, breakaway] = scores[..] else { panic!("three measures") };
    assert_eq!((area.difference, stiffness.difference), (1.0, 1.0));
    // Half of the torque over the twist at 0.9 M_S of bristles of 3000 N m/rad, 5 % of it slid back and forth.
    assert!((stiffness.reference / 3000.0 - 0.95).abs() < 0.01, "{stiffness:?}");
    // 0.20 instead of 0.45 N m; until it has moved by 5 mrad the ramp has gone on by about 10 mN m.
    assert!((breakaway.difference - (1.0 - 0.20 / 0.45)).abs() < 0.03, "{breakaway:?}");
    assert!((breakaway.reference - 0.45).abs() < 0.01, "{breakaway:?}");
}

/// A trace of 10 s with this angle over time.
fn trace(angle: impl Fn(f64) -> f64, reference: impl Fn(f64) -> f64) -> Trace {
    let over_time = |f: &dyn Fn(f64) -> f64| (0..10_000).map(|k| f(f64::from(k) * 1e-3)).collect();
    Trace { period: 1e-3, angle: over_time(&angle), reference: over_time(&reference), ..Trace::default() }
}

#[test]
fn a_limit_cycle_has_the_amplitude_and_interval_of_its_trace() {
    // Every 0.5 s it moves 50 mrad within 50 ms.
    let stairs = |time: f64| 0.05 * ((time / 0.5).floor() + (((time / 0.5).fract() - 0.9) / 0.1).max(0.0));
    let cycle = LimitCycle::find(&trace(stairs, |time| 0.1 * time), 1.0);
    assert!((cycle.interval - 0.5).abs() < 1e-9 && cycle.breakaways == 18, "{cycle:?}");
    // From the end of a slip, 0, back behind by 0.45 s of the ramp.
    assert!((cycle.amplitude - 0.0225).abs() < 0.0005, "{cycle:?}");
    let even = trace(|time| 0.1 * time + 0.001 * (40.0 * time).sin(), |time| 0.1 * time);
    assert_eq!(LimitCycle::find(&even, 1.0).breakaways, 0, "sliding evenly is not a cycle");
    let creeps = trace(|time| 0.03 * (0.5 * time).sin(), |_| 0.0);
    assert!(LimitCycle::find(&creeps, 1.0).interval.is_nan(), "nor is creeping");
}

#[test]
fn every_mismatch_changes_the_machine_and_only_perfect_changes_nothing() {
    for wheel in [true, false] {
        let nominal = cell(wheel, Mismatch::PERFECT);
        for &mismatch in MISMATCHES {
            let cell = cell(wheel, mismatch);
            let changed = [Role::Desired, Role::Own].map(|role| machine(&cell, role) != machine(&nominal, role));
            let of_own_friction =
                ["own", "ripple10%", "gaussian", "stiffness"].iter().any(|n| mismatch.name.starts_with(n));
            assert_eq!(
                changed,
                [mismatch.name != "perfect" && !of_own_friction, mismatch.name != "perfect"],
                "{mismatch:?}"
            );
            assert_eq!(cell.preset, nominal.preset, "the model stays");
            assert_eq!(
                Mismatch::find(mismatch.name).map(|mismatch| mismatch.name),
                Some(mismatch.name),
                "names are unique"
            );
        }
    }
}

#[test]
fn jitter_and_backlash_change_every_machine_and_a_seed_repeats_them() {
    let trace = |mismatch: &str, role, seed| {
        let cell = cell(true, Mismatch::find(mismatch).unwrap());
        runs(&cell, role, &[Scenario::PRESLIDING], &[seed]).traces[0][0].clone()
    };
    for role in [Role::Desired, Role::Own] {
        let [without, jitter, backlash] = ["perfect", "jitter", "backlash"].map(|mismatch| trace(mismatch, role, 1));
        assert!(jitter != without && backlash != without);
        assert!(jitter == trace("jitter", role, 1) && jitter != trace("jitter", role, 2));
    }
    // Friction balances the drive torque; the torque that keeps the gap open is not friction.
    let [tight, slack] = ["perfect", "backlash"].map(|mismatch| trace(mismatch, Role::Own, 1).resisting_torque);
    let peak = |torque: &[f64]| torque.iter().fold(0.0, |most: f64, torque| most.max(torque.abs()));
    assert!(
        (peak(&tight) - 0.405).abs() < 0.005 && (peak(&slack) - 0.405).abs() < 0.02,
        "{} {}",
        peak(&tight),
        peak(&slack)
    );
}

#[test]
fn a_machine_with_the_desired_friction_is_on_its_curve() {
    let cell = cell(true, Mismatch::PERFECT);
    let a = runs(&cell, Role::Desired, &[Scenario::CURVE], &[1]);
    let curve = scores(&a, &a, &a)[0];
    // Noise of tacho and encoder sways the slowest speeds. Measured: 3e-5.
    assert!(curve.difference < 1e-4 && curve.floor == curve.difference, "{curve:?}");
}

#[test]
fn measuring_the_rendered_friction_corrects_an_error_of_the_model() {
    let mut cell = cell(true, Mismatch::find("gaussian").unwrap());
    cell.preset.bench.law = LawChoice::Bristle;
    cell.law = stickslip_simulate::rendering_law(&cell.preset.model, &cell.preset.bench).unwrap();
    let a = runs(&cell, Role::Desired, &[Scenario::CURVE], &[1]);
    let b = runs(&cell, Role::Rendered, &[Scenario::CURVE, Scenario::CURVE_CORRECTED], &[1]);
    // A0 is not used. Measured: 1.6 and 0.06 % of M_S.
    let none = Runs { scenarios: Vec::new(), traces: Vec::new(), ..a.clone() };
    let [curve, corrected] = scores(&b, &a, &none)[..] else { panic!("two measures") };
    assert_eq!((curve.measure, corrected.measure), ("curve", "curve_corrected"));
    assert!(curve.difference > 0.01 && corrected.difference < 0.1 * curve.difference, "{curve:?} {corrected:?}");
    assert_eq!(corrected.floor, curve.floor, "a machine without rendering has nothing to correct");
}

#[test]
fn a_law_that_cannot_be_measured_has_no_corrected_curve() {
    let mut cell = cell(false, Mismatch::PERFECT);
    // As above, and with more torque than the drive has against it.
    cell.preset.model.own.kinetic_torque *= 40.0;
    cell.preset.model.own.breakaway_torque *= 40.0;
    cell.preset.plant.load_motor.amplifier.current_limit = 50.0;
    cell.preset.model.load_amplifier.current_limit = 50.0;
    let bench = &cell.preset;
    cell.law = Law::Paper(design::difference_torque(&bench.bench.desired, &bench.model, &bench.bench));
    let [a, b] = [Role::Desired, Role::Rendered].map(|role| runs(&cell, role, &[Scenario::CURVE_CORRECTED], &[1]));
    let score = scores(&b, &a, &a)[0];
    assert!(!score.stable && score.difference.is_nan() && score.floor < 1e-4, "{score:?}");
}

#[test]
fn the_curve_is_corrected_where_that_helps_and_where_it_is_requested() {
    let full = Selection::default().plan().unwrap();
    let corrected: Vec<_> = full.groups.iter().filter(|group| !group.corrected.is_empty()).collect();
    assert!(corrected.iter().all(|group| group.rate >= 4000.0 && group.corrected == ["paper", AUTO]));
    for mismatch in ["real", "gaussian", "ripple10%"] {
        assert!(corrected.iter().any(|group| group.mismatch.name == mismatch), "{mismatch}");
    }
    assert!(corrected.iter().all(|group| group.mismatch.name != "perfect"));
    let one = |scenario: &str| Selection {
        quick: true,
        laws: vec!["bristle".into()],
        scenarios: vec![scenario.into()],
        ..Selection::default()
    };
    assert!(one("curve_corrected").plan().unwrap().groups.iter().all(|group| group.corrected == ["bristle"]));
    assert!(one("curve").plan().unwrap().groups.iter().all(|group| group.corrected.is_empty()));
}

#[test]
fn without_its_wheel_a_bed_has_its_modelled_friction() {
    for name in ["prototype", "clm-bench"] {
        let bed = TestBed::find(name).unwrap();
        for wheel in [true, false] {
            let cell = bed.cell(wheel, 4000.0, Mismatch::PERFECT);
            let truth = |speed: f64| stickslip_experiment::true_friction::own_friction(&cell.preset.plant, speed);
            for speed in [0.1, 1.0, 10.0] {
                // The curve with the wheel of clm-bench is a fit of two contacts, within 0.2 % of M_S.
                let modelled = cell.preset.model.own.magnitude(speed);
                assert!((truth(speed) - modelled).abs() < 1e-3, "{name}, {wheel}, {speed}: {modelled}");
            }
        }
        let breakaway = |wheel| bed.cell(wheel, 4000.0, Mismatch::PERFECT).preset.model.own.breakaway_torque;
        assert!(breakaway(false) < 0.5 * breakaway(true));
    }
    assert!(matches!(TestBed::find("emps"), Err(Error::NothingToRender { .. })));
}

#[test]
fn results_do_not_depend_on_the_number_of_threads_nor_on_neighbours_in_a_vector() {
    let cell = cell(true, Mismatch::REAL);
    let run = |threads| {
        let watch = Watch::silent();
        Runs::simulate(&cell, Role::Own, &[Scenario::SINE_2HZ, Scenario::BREAKAWAY], &[1, 2], threads, &watch).unwrap()
    };
    // With one thread all four are in a vector, with three each is alone. Not `assert_eq!`: it would print the traces.
    let [one, three] = [run(1), run(3)];
    assert!(one.traces == three.traces, "the runs differ");
    assert!(one.traces[0][0] != one.traces[0][1], "another seed is another run");
}

#[test]
fn the_first_failure_is_returned_and_ends_the_work() {
    let jobs: Vec<usize> = (0..1000).collect();
    let begun = std::sync::atomic::AtomicUsize::new(0);
    let result = map(&jobs, 3, |&job| {
        begun.fetch_add(1, Ordering::Relaxed);
        if job == 5 { Err(Error::Cancelled) } else { Ok(job) }
    });
    assert!(matches!(result, Err(Error::Cancelled)));
    assert!(begun.into_inner() < 1000);
    assert_eq!(map(&jobs, 3, |&job| Ok(2 * job)).unwrap()[999], 1998);
}

#[test]
fn the_bootstrap_spreads_as_the_standard_error_does() {
    let values: Vec<f64> = (0..100).map(f64::from).collect();
    let [low, high] = bootstrap(100, |drawn| mean(drawn.iter().map(|&k| values[k])));
    // Uniform: σ = 100/√12, standard error 2.9; the percentiles of 2000 draws within a tenth of it.
    let half_width = 1.96 * 100.0 / 12.0_f64.sqrt() / 10.0;
    assert!((low - (49.5 - half_width)).abs() < 0.6 && (high - (49.5 + half_width)).abs() < 0.6, "{low} {high}");
    assert_eq!(bootstrap(3, |_| 7.0), [7.0, 7.0]);
}

/// One machine with two laws in one short scenario, which needs no A0: three runs.
fn small() -> Plan {
    let list = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let selection = Selection {
        seeds: Some(1),
        presets: list(&["prototype"]),
        laws: list(&["bristle", "residual"]),
        rates: vec![4000.0],
        wheel: Some(true),
        mismatches: list(&["perfect"]),
        scenarios: list(&["presliding"]),
        threads: 1,
        ..Selection::default()
    };
    selection.plan().unwrap()
}

/// Cancelled once this share of the work is done.
fn cancelled_after(share: f64) -> Watch {
    let flag = Arc::new(AtomicBool::new(false));
    let cancel = flag.clone();
    Watch::new(flag, move |_, fraction| cancel.store(fraction >= share, Ordering::Relaxed))
}

#[test]
fn cancelled_it_keeps_the_laws_that_were_finished() {
    let outcome = run_plan(&small(), &cancelled_after(0.6)).unwrap();
    assert!(!outcome.complete);
    assert!(!outcome.rows.is_empty() && outcome.rows.iter().all(|row| row.law == "bristle"));
    assert_eq!(outcome.summary().value("fidelity.complete"), Some(0.0));
    assert!(matches!(run_plan(&small(), &cancelled_after(0.3)), Err(Error::Cancelled)), "nothing was finished");
}

#[test]
fn a_complete_run_is_marked_and_has_all_rows() {
    let outcome = run_plan(&small(), &Watch::silent()).unwrap();
    assert!(outcome.complete);
    let [(title, table)] = &outcome.tables()[..] else { panic!("one machine") };
    assert!(title.starts_with("prototype with wheel, 4"), "{title}");
    let lines = table.lines();
    assert!(lines[1].starts_with("floor") && lines[2].starts_with("bristle") && lines[3].starts_with("residual"));
    let json = outcome.summary().to_json();
    for key in
        ["preset", "law", "wheel", "rate_hz", "mismatch", "scenario", "auto", "difference", "excess", "floor", "ci95"]
    {
        assert!(json.contains(&format!("\"{key}\":")), "{key}");
    }
    assert!(json.contains("\"fade_velocity\": null"), "these laws have none");
}

#[test]
fn the_paper_s_law_gets_the_fade_out_that_suits_the_bench_best() {
    let list = |name: &str| vec![name.to_owned()];
    let selection =
        Selection { laws: list("paper"), scenarios: list("presliding"), seeds: Some(1), ..Selection::default() };
    let selection =
        Selection { presets: list("prototype"), mismatches: list("perfect"), rates: vec![4000.0], ..selection };
    let plan = Selection { wheel: Some(true), ..selection }.plan().unwrap();
    let rows = run_plan(&plan, &Watch::silent()).unwrap().rows;
    // 0.1 rad/s was the smallest usable one of the prototype, and the best.
    assert!((0.05..=0.2).contains(&rows[0].fade_velocity), "{rows:?}");
}

#[test]
fn a_selection_is_a_part_of_the_benchmark() {
    let full = Selection::default().plan().unwrap();
    assert_eq!((full.seeds.len(), full.scenarios.len()), (10, SCENARIOS.len()));
    assert!(full.groups.iter().any(|group| group.rate == 1000.0 && group.laws.len() > 7));
    assert!(MISMATCHES.iter().all(|mismatch| full.groups.iter().any(|group| group.mismatch.name == mismatch.name)));
    let quick = Selection { quick: true, ..Selection::default() }.plan().unwrap();
    assert_eq!((quick.groups.len(), quick.seeds.len(), quick.scenarios.len()), (4, 3, CLOSED_LOOP.len()));
    let fast =
        Selection { quick: true, rates: vec![10_000.0], wheel: Some(false), ..Selection::default() }.plan().unwrap();
    assert!(fast.groups.len() == 1 && !fast.groups[0].wheel);
    // Not part of the quick benchmark, but requested by name.
    let other =
        Selection { quick: true, mismatches: vec!["kt+2%".into()], rates: vec![2000.0], ..Selection::default() };
    let other = other.plan().unwrap();
    assert!(other.groups.len() == 2 && other.groups[0].mismatch.name == "kt+2%" && other.groups[0].rate == 2000.0);
}

#[test]
fn an_unknown_name_is_reported_with_the_known_ones() {
    let message = |selection: Selection| selection.plan().unwrap_err().to_string();
    let law = message(Selection { laws: vec!["newton".into()], ..Selection::default() });
    assert_eq!(
        law,
        "unknown law newton. Available: paper, smooth, karnopp, bristle, residual, residual_slow, admittance, admittance_slow, auto."
    );
    assert!(
        message(Selection { mismatches: vec!["x".into()], ..Selection::default() }).starts_with("unknown mismatch x.")
    );
    assert!(
        message(Selection { scenarios: vec!["x".into()], ..Selection::default() }).starts_with("unknown scenario x.")
    );
}

/// An arm of a fifth of the load inertia on a spring of 10 Hz and a tenth that moves with the carriage.
fn with_arm(bed: &str, rate: f64) -> Cell {
    let mut cell = TestBed::find(bed).unwrap().cell(true, rate, Mismatch::PERFECT);
    let (load, omega) = (cell.preset.model.drive.load_inertia, 2.0 * std::f64::consts::PI * 10.0);
    let inertia = 0.2 * load;
    cell.preset.bench.arm = Arm::Elastic(ElasticArm {
        inertia,
        stiffness: inertia * omega * omega,
        damping: 0.02 * inertia * omega,
        rigid_inertia: 0.1 * load,
    });
    // Its own friction is what is desired.
    cell.preset.bench.desired = cell.preset.model.own;
    cell.desired = cell.preset.plant.screw_friction;
    cell
}

#[test]
fn a_rendered_arm_differs_little_from_a_mounted_one() {
    let cell = with_arm("prototype", 4000.0);
    let (scenarios, seeds) = ([Scenario::SINE_2HZ, Scenario::POINT_TO_POINT], [1, 2]);
    let [carried, without] = [Role::Desired, Role::Own].map(|role| runs(&cell, role, &scenarios, &seeds));
    let judged = |cell: &Cell, measure: &str| {
        let scores = scores(&runs(cell, Role::Rendered, &scenarios, &seeds), &carried, &without);
        scores.iter().find(|score| score.measure == measure).map_or(f64::NAN, |score| score.difference)
    };
    for (measure, bound) in
        [("sine_2hz", 0.05), ("sine_2hz_arm", 0.04), ("point_to_point", 0.10), ("point_to_point_arm", 0.04)]
    {
        let difference = judged(&cell, measure);
        assert!(difference <= bound, "{measure}: {difference}");
    }
    // Another arm differs from it, by the carriage and by its own twist.
    let mut lighter = cell.clone();
    let mut softer = cell;
    if let (Arm::Elastic(a), Arm::Elastic(b)) = (&mut lighter.preset.bench.arm, &mut softer.preset.bench.arm) {
        a.rigid_inertia = 0.0;
        b.stiffness *= 0.9;
    }
    assert!(judged(&lighter, "sine_2hz") > 0.2);
    assert!(judged(&softer, "sine_2hz_arm") > 0.04);
}

/// Three seconds at a constant set-point, with a short torque pulse [N m] after the first: machine and software of a
/// role, the software changed; `observe` gets each tick after the pulse.
fn pulse_response(
    cell: &Cell,
    role: Role,
    torque: f64,
    change: impl FnOnce(&mut Tick<f64>),
    mut observe: impl FnMut(&FastBench, &TickOutput<f64>),
) {
    let settings = &cell.preset.bench;
    let mut tick = design::software(&cell.preset.model, settings).unwrap();
    change(&mut tick);
    let mut bench = FastBench::new(&machine(cell, role), tick, settings, settings.divider(), 1).unwrap();
    let second = settings.tick_rate as u64;
    for cycle in 0..3 * second {
        let knock = f64::from(u8::from((second..second + second / 100).contains(&cycle)));
        let order = Order { control: 1.0, render: 1.0, added_torque: torque * knock, ..Order::default() };
        let output = bench.tick(order);
        if cycle >= second + second / 100 {
            observe(&bench, &output);
        }
    }
}

/// Root mean square of the load motor's torque [N m] over a second at rest, after a short torque pulse, with a rendered
/// arm of this rigid inertia, whether the bench admits it or not.
fn torque_after_a_knock(cell: &Cell, rigid_inertia: f64) -> f64 {
    let mut squares = Vec::new();
    let heavy = |tick: &mut Tick<f64>| {
        if let RenderedArm::Elastic(arm) = &mut tick.arm {
            arm.arm.rigid_inertia = rigid_inertia;
        }
    };
    pulse_response(cell, Role::Rendered, 0.3, heavy, |_, output| squares.push(output.difference_torque.powi(2)));
    let last_second = squares.len() - cell.preset.bench.tick_rate as usize;
    libm::sqrt(mean(squares[last_second..].iter().copied()))
}

/// Frequency [Hz] and damping ratio of a decaying oscillation, sampled with a period [s]: from its zero crossings, and
/// from the decay of the extremes between them.
fn mode(course: &[f64], period: f64) -> (f64, f64) {
    let crossings: Vec<f64> = (1..course.len())
        .filter(|&k| (course[k - 1] < 0.0) != (course[k] < 0.0))
        .map(|k| k as f64 - course[k] / (course[k] - course[k - 1]))
        .collect();
    let halves = crossings.len() - 1;
    let half = (crossings[halves] - crossings[0]) / halves as f64;
    let size = |pair: &[f64]| course[pair[0] as usize..pair[1] as usize].iter().fold(0.0f64, |m, q| m.max(q.abs()));
    let sizes: Vec<(f64, f64)> =
        crossings.windows(2).enumerate().map(|(k, pair)| (k as f64, libm::log(size(pair)))).collect();
    let (x, y) = (mean(sizes.iter().map(|it| it.0)), mean(sizes.iter().map(|it| it.1)));
    let fall = sizes.iter().map(|it| (it.0 - x) * (it.1 - y)).sum::<f64>()
        / sizes.iter().map(|it| (it.0 - x).powi(2)).sum::<f64>();
    (0.5 / (half * period), -fall / std::f64::consts::PI)
}

#[test]
fn the_mode_of_a_rendered_arm_has_the_frequency_and_damping_of_a_mounted_one() {
    let dying: Vec<f64> =
        (0..4000).map(|k| f64::from(k) * 1e-3).map(|t| libm::exp(-0.01 * 62.8 * t) * libm::sin(62.8 * t)).collect();
    let (hertz, damping) = mode(&dying, 1e-3);
    assert!((hertz - 62.8 / std::f64::consts::TAU).abs() < 1e-3 && (damping - 0.01).abs() < 1e-5, "{hertz} {damping}");

    for (bed, rate) in [("prototype", 4000.0), ("prototype", 10_000.0), ("clm-bench", 4000.0), ("clm-bench", 10_000.0)]
    {
        let cell = with_arm(bed, rate);
        let [carried, rendered] = [Role::Desired, Role::Rendered].map(|role| {
            let mut course = Vec::new();
            let change = |tick: &mut Tick<f64>| {
                if role != Role::Rendered {
                    tick.arm = RenderedArm::Nothing;
                }
            };
            pulse_response(&cell, role, 2.0, change, |bench, _| {
                let truth = bench.true_state();
                let (model, mounted) = (truth.tick.arm.twist, truth.plant.machine.arm_twist);
                course.push(if role == Role::Rendered { model } else { mounted });
            });
            // Once the carriage rests again.
            mode(&course[(0.5 * rate) as usize..], 1.0 / rate)
        });
        assert!((rendered.0 / carried.0 - 1.0).abs() < 0.003, "{bed}, {rate} Hz: {carried:?}, {rendered:?}");
        assert!((rendered.1 - carried.1).abs() < 0.0005, "{bed}, {rate} Hz: {carried:?}, {rendered:?}");
    }
}

#[test]
fn the_limit_of_a_rendered_inertia_is_the_onset_of_oscillation() {
    for bed in ["prototype", "clm-bench"] {
        let mut cell = with_arm(bed, 4000.0);
        // Its noise would hide the onset.
        cell.preset.plant.accelerometer.noise_density = 0.0;
        let Arm::Elastic(arm) = cell.preset.bench.arm else { panic!("there is an arm") };
        let limit = design::arm_limit(&arm, false, &cell.preset.model, &cell.preset.bench).unwrap();
        let [within, beyond] =
            [limit.admitted, 1.3 * limit.stability].map(|inertia| torque_after_a_knock(&cell, inertia));
        assert!(within < 0.1 && beyond > 0.4, "{bed}: {within}, {beyond} N m");
    }
}

/// Root mean square of the arm's twist in the rests between moves [rad], and the largest deviation of the screw from its
/// set-point at their ends [rad].
fn after_moves(trace: &Trace) -> (f64, f64) {
    let still: Vec<usize> = (1..trace.reference.len())
        .filter(|&k| trace.reference[k] == trace.reference[k - 1] && k as f64 * trace.period > 0.6)
        .collect();
    let squares: Vec<f64> = still.iter().map(|&k| trace.arm_twist[k].powi(2)).collect();
    let ends = still.iter().filter(|&&k| trace.reference.get(k + 1).is_none_or(|next| *next != trace.reference[k]));
    let off = ends.map(|&k| (trace.reference[k] - trace.angle[k]).abs()).fold(0.0, f64::max);
    (libm::sqrt(mean(squares.iter().copied())), off)
}

#[test]
fn decentralised_observers_damp_a_mounted_or_rendered_arm_with_and_without_friction_compensation() {
    let rest = |has_model: bool, compensates: bool, role: Role| {
        let mut cell = with_arm("prototype", 4000.0);
        let Arm::Elastic(model) = cell.preset.bench.arm else { panic!("there is an arm") };
        let arm = if has_model {
            DampedArm::Elastic(ArmDamping { believed: model, ..ArmDamping::default() })
        } else {
            DampedArm::Nothing
        };
        let feedback = StateFeedback { arm, torque_limit: 2.0, ..StateFeedback::default() };
        cell.preset.bench.controller = ControllerChoice::StateFeedback(feedback);
        if compensates {
            cell.preset.bench.compensation = CompensationChoice::Feedforward(FeedforwardChoice::default());
        }
        let [trace] = &runs(&cell, role, &[Scenario::POINT_TO_POINT], &[1]).traces[0][..] else { panic!("one run") };
        assert!(trace.stable);
        after_moves(trace)
    };
    for compensates in [false, true] {
        let [carried, rendered] = [Role::Desired, Role::Rendered].map(|role| rest(true, compensates, role));
        let undamped = rest(false, compensates, Role::Desired);
        assert!(carried.0 < 0.5 * undamped.0, "{compensates}: {carried:?} {undamped:?}");
        assert!((rendered.0 / carried.0 - 1.0).abs() < 0.1, "{compensates}: {carried:?} {rendered:?}");
    }
}
