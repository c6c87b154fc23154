//! Automatic tuning: the same criterion and the same robustness limits for every controller.
//!
//!   min ln IAE + 0.3·ln ê   of the angle after a step of the load torque, the load sliding,
//!
//! under M_s ≤ 1.8 sliding and stuck, M_s ≤ 2.5 in the corners of load inertia and coupling stiffness, and a noise of the
//! commanded torque of at most 4 % of its limit. By Nelder and Mead's simplex on the logarithms of the gains, from several
//! starts; exceeding a limit has a penalty above any gain of the criterion.

use stickslip_core::control::AxisControl;
use stickslip_core::fields::{Field, Fields as _, Walk};

use super::super::{position_controller, torque_filter};
use super::price::{Outcome, TestBeds, WORST, price};
use stickslip_base::Error;
use stickslip_base::preset::{ControllerChoice, DampedArm, Model, Regulation, Settings, StateFeedback};
use stickslip_base::watch::Watch;

/// Largest noise of the commanded torque, as a share of its limit.
pub const NOISE_LIMIT: f64 = 0.04;
/// Start factors of all gains.
const STARTS: [f64; 3] = [1.0, 0.5, 1.7];
/// Least improvement by a repeated search for another one.
const WORTH_IT: f64 = 2e-3;
/// Largest number of evaluations for a start.
const EVALUATIONS: usize = 220;

/// A tuned controller and its results.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuned {
    /// The controller.
    pub controller: ControllerChoice<f64>,
    /// Integral of |angle| after a load torque of 1 N m [rad s].
    pub absolute_error: f64,
    /// Largest |angle| after it [rad].
    pub peak: f64,
    /// Noise of the commanded torque [N m RMS].
    pub noise_torque: f64,
}

/// Tunes the gains of a controller; its kind, limits and switches are unchanged.
///
/// # Errors
/// Errors of the linearisation; [`Error::NotSolvable`] if no start led to a loop within the limits;
/// [`Error::Cancelled`].
pub fn tune(
    controller: &ControllerChoice<f64>,
    model: &Model<f64>,
    settings: &Settings<f64>,
    velocity: f64,
    watch: &Watch,
) -> Result<Tuned, Error> {
    if let ControllerChoice::Linear(_) = controller {
        let what = "the tuning of a controller given by its matrices";
        return Err(Error::NotSolvable { what, remedy: "Tune it with the tool that computed its matrices." });
    }
    // The axis has the arm modelled by this controller.
    let beds = TestBeds::new(model, &Settings { controller: *controller, ..*settings }, velocity)?;
    let designed = |gains: &[f64]| {
        let stated = with_gains(controller, gains);
        let filter = torque_filter(model, settings);
        Ok::<_, Error>((stated, AxisControl { filter, ..position_controller(&stated, model, settings)?.into() }))
    };
    let torque_limit = controller.torque_limit();
    let judge = |gains: &[f64]| match designed(gains) {
        Ok((_, controller)) => price(&beds, &controller, torque_limit, model).map(|(price, _)| price),
        // Gains without a design are skipped.
        Err(_) => Ok(WORST),
    };
    let mut evaluated = 0;
    let mut search = |start: &[f64]| {
        simplex(start, EVALUATIONS, |gains| {
            evaluated += 1;
            watch.stage("tune", (evaluated as f64 / (EVALUATIONS * (STARTS.len() + 1)) as f64).min(0.99))?;
            judge(gains)
        })
    };
    let mut best: Option<(f64, Vec<f64>)> = None;
    for factor in STARTS {
        let start: Vec<f64> = gains(controller).iter().map(|gain| gain + libm::log(factor)).collect();
        let result = search(&start)?;
        if best.as_ref().is_none_or(|(least, _)| result.0 < *least) {
            best = Some(result);
        }
    }
    // Along a limit a simplex collapses too early: the search is repeated from there.
    while let Some((least, gains)) = &best {
        let repeated = search(gains)?;
        if repeated.0 > least - WORTH_IT {
            break;
        }
        best = Some(repeated);
    }
    let nothing = Error::NotSolvable {
        what: "a tuning within the limits of sensitivity and noise",
        remedy: "Start from softer gains, or model a stiffer machine or quieter sensors.",
    };
    let Some((_, gains)) = best else { return Err(nothing) };
    let (controller, parameters) = designed(&gains)?;
    let (_, outcome) = price(&beds, &parameters, torque_limit, model)?;
    outcome.filter(|outcome| outcome.beyond <= 0.01).map_or(Err(nothing), |outcome| {
        let Outcome { absolute_error, peak, noise_torque, .. } = outcome;
        Ok(Tuned { controller, absolute_error, peak, noise_torque })
    })
}

/// Logarithms of the tuned gains.
fn gains(controller: &ControllerChoice<f64>) -> Vec<f64> {
    // A gain of 0 has no logarithm: it starts small.
    tuned_values(&mut { *controller }).into_iter().map(|gain| libm::log(gain.max(1e-6))).collect()
}

/// The tuned gains of a controller.
fn tuned_values(controller: &mut ControllerChoice<f64>) -> Vec<&mut f64> {
    match controller {
        ControllerChoice::Cascade(it) => vec![&mut it.position_gain, &mut it.velocity_gain, &mut it.integral_gain],
        ControllerChoice::Pid(it) => {
            let filtered = (it.use_tacho < 0.5).then_some(&mut it.filter_time);
            let gains = [&mut it.proportional_gain, &mut it.integral_gain, &mut it.derivative_gain];
            gains.into_iter().chain(filtered).collect()
        }
        // The meaning of its matrices is unknown.
        ControllerChoice::Linear(_) => Vec::new(),
        ControllerChoice::StateFeedback(it) => tuned_feedback(it),
        // Its limits are settings.
        ControllerChoice::Predictive(it) => tuned_feedback(&mut it.feedback),
    }
}

/// The tuned values of a state feedback.
fn tuned_feedback(it: &mut StateFeedback<f64>) -> Vec<&mut f64> {
    let integrates = it.compensates_load < 0.5;
    let mut values = match &mut it.regulator {
        Regulation::Quadratic(quadratic) => {
            let integral = integrates.then_some(&mut quadratic.integral_time);
            let twist = if let DampedArm::Elastic(arm) = &mut it.arm { Some(&mut arm.twist) } else { None };
            let deviations = [&mut quadratic.angle, &mut quadratic.velocity, &mut quadratic.vibration];
            deviations.into_iter().chain(integral).chain(twist).collect()
        }
        Regulation::Poles(it) => {
            let integral = integrates.then_some(&mut it.integral_rate);
            let pairs = [&mut it.bandwidth, &mut it.damping, &mut it.vibration_damping];
            pairs.into_iter().chain(integral).collect::<Vec<_>>()
        }
    };
    let disturbances = it.observer.disturbances_mut();
    values.extend([&mut disturbances.load_torque, &mut disturbances.motor_torque]);
    values
}

/// The controller with these gains.
fn with_gains(controller: &ControllerChoice<f64>, gains: &[f64]) -> ControllerChoice<f64> {
    let mut controller = *controller;
    for (target, gain) in tuned_values(&mut controller).into_iter().zip(gains) {
        *target = libm::exp(*gain);
    }
    controller.contents(&mut WithinRange);
    controller
}

/// Values outside the range of a parameter file are not tried.
struct WithinRange;

impl Walk<f64> for WithinRange {
    fn number(&mut self, field: &'static Field, value: &mut f64) {
        *value = value.clamp(field.minimum, field.maximum);
    }
}

/// The lowest value and where it is, by Nelder and Mead's simplex (1965) with the usual factors.
fn simplex(
    start: &[f64],
    evaluations: usize,
    mut judge: impl FnMut(&[f64]) -> Result<f64, Error>,
) -> Result<(f64, Vec<f64>), Error> {
    /// First edges, and distance of the corners at the end.
    const EDGE: f64 = 0.3;
    const END: f64 = 1e-3;
    let mut remaining = evaluations;
    let mut at = |point: Vec<f64>| {
        remaining = remaining.saturating_sub(1);
        Ok::<_, Error>((judge(&point)?, point, remaining))
    };
    let mut corners = Vec::new();
    for k in 0..=start.len() {
        let mut point = start.to_vec();
        if k > 0 {
            point[k - 1] += EDGE;
        }
        let (value, point, _) = at(point)?;
        corners.push((value, point));
    }
    loop {
        corners.sort_by(|one, other| one.0.total_cmp(&other.0));
        let count = corners.len();
        let worst = corners[count - 1].clone();
        let spread = (0..start.len()).map(|j| (worst.1[j] - corners[0].1[j]).abs()).fold(0.0, f64::max);
        let middle: Vec<f64> = (0..start.len())
            .map(|j| corners[..count - 1].iter().map(|corner| corner.1[j]).sum::<f64>() / (count - 1) as f64)
            .collect();
        let along = |factor: f64| (0..start.len()).map(|j| middle[j] + factor * (worst.1[j] - middle[j])).collect();
        let (value, point, remaining) = at(along(-1.0))?;
        let better = if value < corners[0].0 {
            let (further, far, _) = at(along(-2.0))?;
            if further < value { Some((further, far)) } else { Some((value, point)) }
        } else if value < corners[count - 2].0 {
            Some((value, point))
        } else {
            let (near, close, _) = at(along(if value < worst.0 { -0.5 } else { 0.5 }))?;
            (near < worst.0.min(value)).then_some((near, close))
        };
        match better {
            Some(better) => corners[count - 1] = better,
            None => {
                let best = corners[0].1.clone();
                for corner in &mut corners[1..] {
                    let point = corner.1.iter().zip(&best).map(|(x, b)| 0.5 * (x + b)).collect();
                    let (value, point, _) = at(point)?;
                    *corner = (value, point);
                }
            }
        }
        if remaining == 0 || spread < END {
            corners.sort_by(|one, other| one.0.total_cmp(&other.0));
            return Ok(corners.swap_remove(0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::Operating;
    use crate::position_loop::{CORNER_LIMIT, PositionLoop, SENSITIVITY_LIMIT};
    use crate::{cascade_as_pid, corners};
    use stickslip_base::parameters::presets;
    use stickslip_base::{Preset, StateFeedback};
    use stickslip_core::control::{Cascade, Pid, PositionController};

    #[test]
    fn the_simplex_walks_down_a_crooked_valley() {
        let rosenbrock = |p: &[f64]| Ok((1.0 - p[0]).powi(2) + 100.0 * (p[1] - p[0] * p[0]).powi(2));
        let (value, point) = simplex(&[-1.2, 1.0], 1000, rosenbrock).unwrap();
        assert!(value < 1e-5 && (point[0] - 1.0).abs() < 1e-2, "{value} at {point:?}");
    }

    #[test]
    fn a_tuning_stays_within_the_ranges_of_a_file() {
        let state_feedback = ControllerChoice::StateFeedback(StateFeedback::default());
        for controller in [ControllerChoice::Cascade(Cascade::default()), state_feedback] {
            for gain in [-80.0, 80.0] {
                let mut preset = Preset::<f64>::default();
                preset.bench.controller = with_gains(&controller, &vec![gain; gains(&controller).len()]);
                let text = stickslip_base::parameters::write_commented(&preset);
                let parsed: Preset<f64> = stickslip_base::parameters::read(&text, "tuned").unwrap();
                assert_eq!(parsed.bench.controller, preset.bench.controller);
            }
        }
    }

    /// By peaks that are searched for, without the grid of the tuning.
    fn meets_the_limits(controller: &ControllerChoice<f64>, preset: &Preset<f64>) {
        let both = [Operating::Sliding(10.0), Operating::Stuck];
        let controller = position_controller(controller, &preset.model, &preset.bench).unwrap();
        for at in both {
            let closes = PositionLoop::new(controller, &preset.model, &preset.bench, at).unwrap();
            let quality = closes.quality(&preset.model).unwrap();
            // A hundredth is the tolerance of the search.
            assert!(quality.stable && quality.margins.sensitivity.value <= 1.01 * SENSITIVITY_LIMIT, "{quality:?}");
        }
        let worst = corners(controller, &preset.model, &preset.bench, &both).unwrap()[0];
        assert!(worst.sensitivity <= 1.01 * CORNER_LIMIT, "{worst:?}");
    }

    #[test]
    fn a_tuning_meets_all_limits_and_pid_and_cascade_have_similar_results() {
        let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
        let cascade = Cascade::default();
        let tuned = |controller| tune(&controller, &preset.model, &preset.bench, 10.0, &Watch::silent()).unwrap();
        let [one, other] =
            [ControllerChoice::Cascade(cascade), ControllerChoice::Pid(cascade_as_pid(&cascade))].map(tuned);
        let state_feedback = tuned(ControllerChoice::StateFeedback(StateFeedback::default()));
        for tuned in [one, other, state_feedback] {
            meets_the_limits(&tuned.controller, &preset);
            assert!(tuned.noise_torque <= 1.01 * NOISE_LIMIT * cascade.torque_limit);
        }
        // The same family, but the cascade's zeros are real, and its integral acts on the motor's side of the coupling.
        assert!((1.0..1.5).contains(&(one.absolute_error / other.absolute_error)), "{one:?} {other:?}");
        // A controller that models the coupling's twist holds the load better.
        assert!(state_feedback.absolute_error < 0.7 * one.absolute_error, "{one:?} {state_feedback:?}");
        let before = TestBeds::new(&preset.model, &preset.bench, 10.0).unwrap();
        let (_, before) =
            price(&before, &PositionController::Cascade(cascade).into(), cascade.torque_limit, &preset.model).unwrap();
        assert!(before.is_none_or(|before| before.beyond > 0.0 || before.absolute_error > one.absolute_error));
    }

    #[test]
    fn a_tuning_is_as_good_as_on_a_grid_for_each_machine() {
        // Found by the same search with one grid of frequencies for each machine.
        let earlier =
            [("clm-bench", [41.825862, 0.0525910, 0.8315862]), ("prototype", [40.639748, 0.1033732, 1.8817421])];
        for (name, [position_gain, velocity_gain, integral_gain]) in earlier {
            let preset: Preset<f64> = presets::find(name).unwrap().read().unwrap();
            let torque_limit = preset.bench.controller.torque_limit();
            let cascade = Cascade { position_gain, velocity_gain, integral_gain, torque_limit, ..Cascade::default() };
            let beds = TestBeds::new(&preset.model, &preset.bench, 10.0).unwrap();
            let priced = |cascade| {
                price(&beds, &PositionController::Cascade(cascade).into(), torque_limit, &preset.model).unwrap()
            };
            let (before, outcome) = priced(cascade);
            assert!(outcome.unwrap().beyond < 0.01, "{name}");
            let start = &preset.bench.controller;
            let tuned = tune(start, &preset.model, &preset.bench, 10.0, &Watch::silent()).unwrap().controller;
            // Not better by a hole in the grid.
            meets_the_limits(&tuned, &preset);
            let ControllerChoice::Cascade(tuned) = tuned else { panic!("{name}: {tuned:?}") };
            let (now, _) = priced(tuned);
            assert!(now < before + 0.01, "{name}: {now} instead of {before}, {tuned:?}");
        }
    }

    #[test]
    fn limits_that_no_gain_meets_are_refused() {
        let mut preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
        // A very noisy tacho, and a drive with nearly no torque.
        preset.model.tacho_noise = 1.0;
        let matrices = ControllerChoice::Linear(stickslip_base::preset::ControllerMatrices::default());
        let error = tune(&matrices, &preset.model, &preset.bench, 10.0, &Watch::silent()).unwrap_err();
        assert!(error.to_string().contains("Tune it with"), "{error}");
        let pid = ControllerChoice::Pid(Pid { torque_limit: 1e-6, ..Pid::default() });
        let refused = tune(&pid, &preset.model, &preset.bench, 10.0, &Watch::silent()).unwrap_err().to_string();
        assert!(refused.contains("within the limits of sensitivity and noise"), "{refused}");
    }
}
