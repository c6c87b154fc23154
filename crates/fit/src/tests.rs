use super::*;

const POINTS: &str = include_str!("../../../tests/reference/stribeck/points.csv");
const FITS: &str = include_str!("../../../tests/reference/stribeck/fits.csv");

fn points(set: &str) -> Vec<CurvePoint> {
    let rows = POINTS.lines().map(|line| line.split(',').collect::<Vec<_>>()).filter(|row| row[0] == set);
    let points: Vec<_> = rows
        .map(|row| {
            let number = |i: usize| row[i].parse().unwrap();
            CurvePoint { velocity: number(1), torque: number(2), standard_error: number(3) }
        })
        .collect();
    assert!(!points.is_empty(), "unknown set {set}");
    points
}

fn mirrored(points: &[CurvePoint]) -> Vec<CurvePoint> {
    points.iter().map(|p| CurvePoint { velocity: -p.velocity, torque: -p.torque, ..*p }).collect()
}

/// Standard normal numbers from a counter (splitmix64, Box-Muller).
pub(super) fn normal(seed: u64, index: u64) -> f64 {
    let uniform = |k: u64| {
        let mut z = (seed << 32).wrapping_add(k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    (-2.0 * (1.0 - uniform(2 * index)).ln()).sqrt() * (std::f64::consts::TAU * uniform(2 * index + 1)).cos()
}

pub(super) fn synthetic(parameters: [f64; 4], noise: f64, seed: u64) -> Vec<CurvePoint> {
    let speeds = (0..16).map(|i| 0.1 * 500f64.powf(i as f64 / 15.0));
    speeds
        .enumerate()
        .map(|(i, v)| CurvePoint {
            velocity: v,
            torque: projection::curve(parameters).magnitude(v) + noise * normal(seed, i as u64),
            standard_error: noise.max(1e-6),
        })
        .collect()
}

#[test]
fn fit_and_covariance_are_those_of_scipy() {
    let mut compared = 0;
    for line in FITS.lines().skip(1) {
        let row: Vec<_> = line.split(',').collect();
        let number = |i: usize| row[i].parse::<f64>().unwrap();
        let plan = StribeckPlan {
            side: if row[0].ends_with('-') { Side::Negative } else { Side::Positive },
            uncertainty: if row[2] == "1" { Uncertainty::Absolute } else { Uncertainty::Scaled },
            huber: (row[1] == "huber").then_some(1.345),
        };
        let fit = fit_stribeck(&points(row[0]), &plan).unwrap();
        for i in 0..4 {
            let (ours, theirs) = (fit.parameters[i], number(3 + i));
            assert!((ours - theirs).abs() <= 1e-6 * theirs.abs(), "{line}\nparameter {i}: {ours} {theirs}");
        }
        if row[1] == "square" {
            for i in 0..4 {
                for j in 0..4 {
                    let scale = (number(7 + 5 * i) * number(7 + 5 * j)).sqrt();
                    let (ours, theirs) = (fit.covariance[i][j], number(7 + 4 * i + j));
                    // Relative to the standard errors: a covariance itself may be 0.
                    assert!((ours - theirs).abs() <= 1e-4 * scale, "{line}\ncovariance {i} {j}: {ours} {theirs}");
                }
            }
        }
        compared += 1;
    }
    assert_eq!(compared, 15);
}

#[test]
fn a_curve_without_noise_is_found_exactly() {
    let truth = [0.3, 0.18, 3.0, 2e-4];
    let fit = fit_stribeck(&synthetic(truth, 0.0, 0), &StribeckPlan::default()).unwrap();
    for i in 0..4 {
        assert!((fit.parameters[i] / truth[i] - 1.0).abs() < 1e-8, "{i}: {}", fit.parameters[i]);
    }
    assert_eq!(fit.at_bound, [false; 4]);
}

#[test]
fn the_negative_direction_is_the_mirrored_positive_one() {
    let bench = points("bench");
    let positive = fit_stribeck(&bench, &StribeckPlan { side: Side::Positive, ..Default::default() }).unwrap();
    let negative = StribeckPlan { side: Side::Negative, ..Default::default() };
    assert_eq!(fit_stribeck(&mirrored(&bench), &negative).unwrap(), positive);
    assert!(matches!(fit_stribeck(&bench, &negative), Err(stickslip_base::Error::TooFew { found: 0, needed: 5, .. })));
}

#[test]
fn scaled_torque_scales_the_curve_and_nothing_else() {
    let bench = points("bench");
    let stronger: Vec<_> = bench
        .iter()
        .map(|p| CurvePoint { torque: 1.3 * p.torque, standard_error: 1.3 * p.standard_error, ..*p })
        .collect();
    let [a, b] = [&bench, &stronger].map(|p| fit_stribeck(p, &StribeckPlan::default()).unwrap());
    for (i, factor) in [1.3, 1.3, 1.0, 1.3].into_iter().enumerate() {
        assert!((b.parameters[i] / a.parameters[i] / factor - 1.0).abs() < 1e-9);
        assert!((b.standard_errors[i] / a.standard_errors[i] / factor - 1.0).abs() < 1e-6);
    }
}

#[test]
fn viscous_friction_that_noise_turns_negative_ends_at_zero_and_is_marked() {
    let fit = fit_stribeck(&synthetic([0.3, 0.18, 3.0, -5e-4], 1e-3, 1), &StribeckPlan::default()).unwrap();
    assert_eq!(fit.parameters[3], 0.0);
    assert!(fit.at_bound[3]);
    assert!(fit.ci95[3][0] == 0.0 && fit.ci95[3][1] > 0.0);
}

#[test]
fn intervals_contain_the_truth_in_95_percent() {
    let truth = [0.06, 0.04, 2.0, 2e-4];
    let mut hits = [0; 4];
    for seed in 0..400 {
        let fit = fit_stribeck(&synthetic(truth, 5e-4, seed), &StribeckPlan::default()).unwrap();
        for i in 0..4 {
            hits[i] += usize::from(fit.ci95[i][0] <= truth[i] && truth[i] <= fit.ci95[i][1]);
        }
    }
    // 380 of 400 expected, standard deviation 4.4: four of them, and 2 % for the curvature of the model.
    for hit in hits {
        assert!((355..=398).contains(&hit), "{hits:?}");
    }
}

#[test]
fn noise_is_seldom_taken_for_a_drop_and_a_drop_seldom_for_noise() {
    let drops = |truth, noise| {
        let fits = (0..600).map(|seed| fit_stribeck(&synthetic(truth, noise, seed), &StribeckPlan::default()).unwrap());
        fits.filter(|fit| fit.drop.is_identified()).count()
    };
    let (none, some) = (drops([0.04, 0.04, 2.0, 2e-4], 5e-4), drops([0.06, 0.04, 2.0, 2e-4], 5e-4));
    // Result: 2 and 600.
    assert!(none <= 30, "{none} of 600 false alarms");
    assert!(some >= 594, "{some} of 600 drops found");
}

#[test]
fn the_verdict_states_why_there_is_no_drop() {
    let judge = |set, side| fit_stribeck(&points(set), &StribeckPlan { side, ..Default::default() }).unwrap().drop;
    assert!(judge("bench", Side::Positive).is_identified());
    let rising = judge("rising", Side::Positive);
    assert!(matches!(rising, StribeckDrop::Absent { .. }));
    assert!(rising.to_string().starts_with("F_S < F_K: no Stribeck drop in this data"), "{rising}");
    // Below its slowest speed nothing is measured: the drop of 0.02 N m is at a tenth of it.
    let fast = judge_of(&synthetic([0.06, 0.04, 0.04, 2e-4], 2e-4, 3));
    assert!(matches!(fast, StribeckDrop::OutsideSpeeds { .. }), "{fast}");
    assert!(fast.to_string().ends_with("measure slower"));
    let faint = judge_of(&synthetic([0.0403, 0.04, 2.0, 2e-4], 5e-4, 4));
    assert!(matches!(faint, StribeckDrop::Insignificant { .. }), "{faint}");
}

fn judge_of(points: &[CurvePoint]) -> StribeckDrop {
    fit_stribeck(points, &StribeckPlan::default()).unwrap().drop
}

#[test]
fn invalid_points_are_refused() {
    for (field, change) in [
        ("velocity", (|p: &mut CurvePoint| p.velocity = 0.0) as fn(&mut CurvePoint)),
        ("torque", |p| p.torque = f64::NAN),
        ("standard_error", |p| p.standard_error = 0.0),
    ] {
        let mut bad = points("bench");
        change(&mut bad[3]);
        let error = fit_stribeck(&bad, &StribeckPlan::default()).unwrap_err();
        assert!(error.to_string().starts_with(&format!("point 4 of the friction curve: {field} = ")), "{error}");
    }
}

#[test]
fn data_that_do_not_determine_a_parameter_have_an_infinite_error() {
    let one_speed = vec![CurvePoint { velocity: 1.0, torque: 0.1, standard_error: 1e-3 }; 6];
    let fit = fit_stribeck(&one_speed, &StribeckPlan::default()).unwrap();
    assert_eq!(fit.standard_errors, [f64::INFINITY; 4]);
    assert!(!fit.drop.is_identified());
}

#[test]
fn an_outlier_is_reported_and_a_robust_fit_does_not_follow_it() {
    let truth = [0.3, 0.18, 3.0, 2e-3];
    let mut points = synthetic(truth, 5e-4, 7);
    points[4].torque += 0.02;
    let plan = StribeckPlan { uncertainty: Uncertainty::Absolute, huber: Some(HUBER), ..StribeckPlan::default() };
    let fit = fit_stribeck(&points, &plan).unwrap();
    assert_eq!(fit.outliers, [4]);
    let plain = fit_stribeck(&points, &StribeckPlan::default()).unwrap();
    assert!((fit.parameters[0] - truth[0]).abs() < 0.2 * (plain.parameters[0] - truth[0]).abs());
}

#[test]
fn a_curve_of_another_form_shows_in_the_runs_of_its_residuals() {
    let gaussian = stickslip_core::friction::Stribeck {
        decay: stickslip_core::friction::Decay::Gaussian,
        ..projection::curve([0.3, 0.18, 3.0, 2e-3])
    };
    // 64 points: the test has no power over sixteen.
    let mut points: Vec<_> = (7..11).flat_map(|seed| synthetic([0.3, 0.18, 3.0, 2e-3], 2e-4, seed)).collect();
    assert!(fit_stribeck(&points, &StribeckPlan::default()).unwrap().runs_probability > 0.05);
    for point in &mut points {
        point.torque +=
            gaussian.magnitude(point.velocity) - projection::curve([0.3, 0.18, 3.0, 2e-3]).magnitude(point.velocity);
    }
    assert!(fit_stribeck(&points, &StribeckPlan::default()).unwrap().runs_probability < 0.05);
}

#[test]
fn robust_intervals_with_absolute_errors_contain_the_truth_in_95_percent() {
    let truth = [0.06, 0.04, 2.0, 2e-4];
    let mut hits = [0; 4];
    for uncertainty in [Uncertainty::Absolute, Uncertainty::Extra] {
        let plan = StribeckPlan { uncertainty, huber: Some(HUBER), ..StribeckPlan::default() };
        for seed in 0..200 {
            let fit = fit_stribeck(&synthetic(truth, 5e-4, seed), &plan).unwrap();
            for i in 0..4 {
                hits[i] += usize::from(fit.ci95[i][0] <= truth[i] && truth[i] <= fit.ci95[i][1]);
            }
        }
    }
    // 380 of 400 expected, standard deviation 4.4, of pairs that share their noise 6; three of them, less 2 % for the
    // curvature of the model at 16 points.
    for hit in hits {
        assert!((354..=398).contains(&hit), "{hits:?}");
    }
}

/// The former fit: variable projection on a dense grid with a golden section, then Levenberg-Marquardt.
mod reference {
    use std::convert::Infallible;

    use stickslip_core::scalar::{Dual, Scalar as _};

    use super::super::projection::Sample;
    use super::super::projection::{cost, curve};
    use super::super::{Stop, minimise};

    /// Best of starts all over, each by Levenberg-Marquardt in logarithms.
    pub(super) fn best(samples: &[Sample], bounds: [f64; 2]) -> ([f64; 4], f64) {
        let torque = samples.iter().map(|s| s.torque.abs()).fold(0.0, f64::max);
        let fastest = samples.iter().map(|s| s.speed).fold(0.0, f64::max);
        let (low, high) = (bounds[0].ln(), bounds[1].ln());
        let mut best = ([0.0; 4], f64::INFINITY);
        for k in 0..40 {
            let velocity = (low + (high - low) * (f64::from(k) + 0.5) / 40.0).exp();
            for share in [0.3, 1.0, 3.0] {
                let start = [share * torque, torque, velocity, 0.1 * torque / fastest];
                let residuals = |p: [Dual<4>; 4]| {
                    let curve = curve(p);
                    let residual = |s: &Sample| {
                        (Dual::of(s.torque) - curve.magnitude(Dual::of(s.speed))) * Dual::of(s.weight.sqrt())
                    };
                    Ok::<_, Infallible>(samples.iter().map(residual).collect())
                };
                let stop = Stop { step: 1e-11, fall: f64::NEG_INFINITY, evaluations: 200 };
                let free = [0.0, f64::INFINITY];
                let Ok(minimum) = minimise(start, [free, free, bounds, free], stop, residuals);
                let cost = cost(minimum.parameters, samples);
                if cost < best.1 {
                    best = (minimum.parameters, cost);
                }
            }
        }
        best
    }
}

fn samples_of(points: &[CurvePoint]) -> Vec<projection::Sample> {
    let sample =
        |p: &CurvePoint| projection::Sample { speed: p.velocity, torque: p.torque, weight: p.standard_error.powi(-2) };
    points.iter().map(sample).collect()
}

#[test]
fn no_other_search_finds_a_lower_sum_of_squares() {
    // With and without a drop, with noise up to it, and viscous friction that ends at 0.
    let truths = [[0.3, 0.18, 3.0, 2e-3], [0.18, 0.2, 1.0, 2e-3], [0.2, 0.2, 1.0, 1e-3], [0.3, 0.1, 0.2, -5e-4]];
    for (k, truth) in truths.into_iter().enumerate() {
        for noise in [1e-3, 3e-2] {
            for seed in 0..4 {
                let samples = samples_of(&synthetic(truth, noise, 100 * k as u64 + seed));
                let bounds = optimum::bounds([0.1, 50.0]);
                let (theirs, least) = reference::best(&samples, bounds);
                let ours = optimum::optimum(&samples, bounds);
                let cost = projection::cost(ours, &samples);
                // Theirs stop at shares of 1e-11 of the parameters, and where a direction is flat.
                assert!(cost <= least * (1.0 + 1e-9), "{truth:?} {noise} {seed}: {ours:?} {cost}, {theirs:?} {least}");
            }
        }
    }
}

#[test]
fn many_points_of_a_run_give_the_curve_within_what_their_noise_leaves() {
    let truth = [0.3, 0.18, 3.0, 2e-3];
    let points: Vec<_> = (0..5000)
        .map(|k| {
            let velocity = 0.1 * 500f64.powf((k * 1597 % 5000) as f64 / 4999.0);
            let torque = projection::curve(truth).magnitude(velocity) + 0.01 * normal(1, k);
            CurvePoint { velocity, torque, standard_error: 0.01 }
        })
        .collect();
    let fit = fit_stribeck(&points, &StribeckPlan::default()).unwrap();
    for i in 0..4 {
        let error = (fit.parameters[i] - truth[i]).abs();
        assert!(error < 4.0 * fit.standard_errors[i] && fit.standard_errors[i] < 0.02 * truth[i], "{i}: {fit:?}");
    }
}

#[test]
fn an_undetermined_direction_has_an_infinite_error() {
    let flat = synthetic([0.2, 0.2, 1.0, 1e-3], 0.0, 1);
    let fit = fit_stribeck(&flat, &StribeckPlan::default()).unwrap();
    assert!(fit.rms < 1e-9 && !fit.drop.is_identified(), "{fit:?}");
    let one_speed = CurvePoint { velocity: 1.0, torque: 0.1, standard_error: 1.0 };
    let fit = fit_stribeck(&[one_speed; 6], &StribeckPlan::default()).unwrap();
    assert_eq!(fit.covariance, [[f64::INFINITY; 4]; 4]);
    assert!(fit.rms < 1e-12);
}
