//! Refusal of a controller whose loop is unstable with the delays of the drives.
//!
//! An axis without delays in its model is not checked: an unstable loop is an object of study on this bench. The load
//! slides. A stuck load is bounded by its bristles: an unstable loop there hunts instead of running away.

use std::fmt::Write as _;

use stickslip_core::control::AxisControl;

use super::PositionLoop;
use crate::linear::{Operating, StateSpace, axis_under_control};
use crate::{DesignError, axis_control, position_controller, torque_filter};
use stickslip_base::Error;
use stickslip_base::parameters::number::rounded;
use stickslip_base::preset::{ControllerChoice, FilterChoice, Model, NotchChoice, Settings};

/// Velocity of the sliding load [rad/s], as in the analysis of a loop.
const SLIDING: f64 = 10.0;
/// Smallest factor of the gains that is proposed, and number of halvings of its interval.
const SMALLEST: f64 = 1e-3;
const HALVINGS: usize = 12;

/// Refuses a controller whose loop over the modelled axis is unstable with the delays in the model. A model without
/// delays is not checked.
///
/// # Errors
/// [`DesignError::LateLoop`]; errors of the design and of the linearisation.
pub fn check_delays(model: &Model<f64>, settings: &Settings<f64>) -> Result<(), Error> {
    let delays = [
        ("servo amplifier", "model.servo_delay", model.servo_delay),
        ("load amplifier", "model.load_amplifier.delay", model.load_amplifier.delay),
    ];
    if delays.iter().all(|(_, _, delay)| *delay <= 0.0) {
        return Ok(());
    }
    let axis = axis_under_control(model, settings, Operating::Sliding(SLIDING))?;
    let Some(frequency) = oscillation(&axis, axis_control(model, settings)?)? else { return Ok(()) };
    let mut late = String::new();
    for (drive, path, delay) in delays.into_iter().filter(|(_, _, delay)| *delay > 0.0) {
        let and = if late.is_empty() { "" } else { " and " };
        let _ = write!(late, "{and}the delay of {} ms of the {drive} ({path})", rounded(1e3 * delay, 3));
    }
    let remedy = remedy(&axis, model, settings)?;
    let controller = match settings.controller {
        ControllerChoice::Cascade(_) => "cascade",
        ControllerChoice::Pid(_) => "pid",
        ControllerChoice::StateFeedback(_) => "state-feedback",
        ControllerChoice::Predictive(_) => "predictive",
        ControllerChoice::Linear(_) => "linear",
    };
    Err(DesignError::LateLoop { controller, late, frequency, remedy }.into())
}

/// Frequency of the fastest growing oscillation of the closed loop [rad/s]; `None` if it is stable.
fn oscillation(axis: &StateSpace, control: AxisControl<f64>) -> Result<Option<f64>, Error> {
    let closed = PositionLoop::over(axis.clone(), control, SLIDING)?.closed()?;
    if closed.is_stable()? {
        return Ok(None);
    }
    let rates = closed.rates(&closed.poles()?);
    Ok(rates.into_iter().max_by(|one, other| one.re.total_cmp(&other.re)).map(|rate| rate.im.abs()))
}

/// The remedy: for a cascade and a PID controller the largest stable gains, rounded down, and a notch if it suffices.
fn remedy(axis: &StateSpace, model: &Model<f64>, settings: &Settings<f64>) -> Result<String, Error> {
    let choice = &settings.controller;
    let mut now = *choice;
    let gains = gains(&mut now);
    if gains.is_empty() {
        let is_linear = matches!(choice, ControllerChoice::Linear(_));
        let computed = "Compute its matrices for an axis with this delay.";
        let tuned = "`stickslip loop --tune` tunes the controller for this delay.";
        return Ok(if is_linear { computed } else { tuned }.into());
    }
    let control = axis_control(model, settings)?;
    let is_stable = |factor: f64| {
        let controller = position_controller(&scaled(choice, factor), model, settings)?;
        Ok(oscillation(axis, AxisControl { controller, ..control })?.is_none())
    };
    let Some(factor) = largest(is_stable)? else { return Ok("Reduce its gains.".into()) };
    let changes: Vec<String> = gains
        .into_iter()
        .filter(|(_, gain)| **gain > 0.0)
        .map(|(name, gain)| format!("bench.controller.{name} to at most {}", two_digits(factor * *gain)))
        .collect();
    let notched = Settings { filter: FilterChoice::Notch(NotchChoice::default()), ..*settings };
    let filter = torque_filter(model, &notched);
    let suffices = oscillation(axis, AxisControl { filter, ..control })?.is_none();
    let notch = if suffices { ", or set bench.filter.kind to notch" } else { "" };
    Ok(format!("Reduce {}{notch}.", changes.join(", ")))
}

/// The gains that are factors of the loop gain, with their names; none of a controller that is computed from a model.
fn gains(choice: &mut ControllerChoice<f64>) -> Vec<(&'static str, &mut f64)> {
    match choice {
        ControllerChoice::Cascade(it) => {
            vec![("velocity_gain", &mut it.velocity_gain), ("integral_gain", &mut it.integral_gain)]
        }
        ControllerChoice::Pid(it) => vec![
            ("proportional_gain", &mut it.proportional_gain),
            ("integral_gain", &mut it.integral_gain),
            ("derivative_gain", &mut it.derivative_gain),
        ],
        ControllerChoice::StateFeedback(_) | ControllerChoice::Predictive(_) | ControllerChoice::Linear(_) => vec![],
    }
}

/// The controller with its gains times a factor.
fn scaled(choice: &ControllerChoice<f64>, factor: f64) -> ControllerChoice<f64> {
    let mut scaled = *choice;
    gains(&mut scaled).into_iter().for_each(|(_, gain)| *gain *= factor);
    scaled
}

/// The largest factor below 1 with a stable loop; `None` if there is none.
fn largest(is_stable: impl Fn(f64) -> Result<bool, Error>) -> Result<Option<f64>, Error> {
    let mut unstable = 1.0;
    let mut stable = 0.5;
    while !is_stable(stable)? {
        unstable = stable;
        stable *= 0.5;
        if stable < SMALLEST {
            return Ok(None);
        }
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (stable + unstable);
        if is_stable(middle)? { stable = middle } else { unstable = middle }
    }
    Ok(Some(stable))
}

/// A gain with two significant digits, rounded down.
fn two_digits(value: f64) -> String {
    let unit = libm::pow(10.0, libm::floor(libm::log10(value)) - 1.0);
    rounded(libm::floor(value / unit) * unit, 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cascade_as_pid, tune};
    use stickslip_base::Preset;
    use stickslip_base::Watch;
    use stickslip_base::parameters::presets;
    use stickslip_base::preset::{ControllerMatrices, StateFeedback};
    use stickslip_core::control::Cascade;

    /// The bench at 1 kHz with a late servo amplifier.
    fn late(delay: f64, controller: ControllerChoice<f64>) -> Preset<f64> {
        let mut preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
        preset.bench.tick_rate = 1000.0;
        preset.model.servo_delay = delay;
        preset.bench.controller = controller;
        preset
    }

    fn refusal(preset: &Preset<f64>) -> Option<String> {
        check_delays(&preset.model, &preset.bench).err().map(|error| error.to_string())
    }

    #[test]
    fn a_loop_that_is_unstable_with_a_delay_is_refused_and_the_proposed_gains_are_stable() {
        let cascade = Cascade::default();
        for controller in [ControllerChoice::Cascade(cascade), ControllerChoice::Pid(cascade_as_pid(&cascade))] {
            let mut preset = late(5e-3, controller);
            let refused = refusal(&preset).expect("it is unstable");
            assert!(refused.contains("the delay of 5 ms of the servo amplifier (model.servo_delay)"), "{refused}");
            assert!(refused.ends_with(", or set bench.filter.kind to notch."), "{refused}");
            let mut notched = preset;
            notched.bench.filter = FilterChoice::Notch(NotchChoice::default());
            assert_eq!(refusal(&notched), None);
            let digits = |text: &str| text.split([',', ' ']).next().unwrap().trim_end_matches('.').parse().unwrap();
            let proposed: Vec<f64> = refused.split("to at most ").skip(1).map(digits).collect();
            let gains = gains(&mut preset.bench.controller);
            assert_eq!(gains.len(), proposed.len(), "{refused}");
            for ((name, gain), proposed) in gains.into_iter().zip(proposed) {
                assert!(refused.contains(name) && (0.05 * *gain..*gain).contains(&proposed), "{refused}");
                *gain = proposed;
            }
            assert_eq!(refusal(&preset), None);
        }
    }

    #[test]
    fn a_state_feedback_is_refused_and_accepted_after_its_tuning() {
        let mut preset = late(5e-3, ControllerChoice::StateFeedback(StateFeedback::default()));
        let refused = refusal(&preset).expect("it is unstable");
        assert!(refused.ends_with("growing amplitude. `stickslip loop --tune` tunes the controller for this delay."));
        let tuned = tune(&preset.bench.controller, &preset.model, &preset.bench, SLIDING, &Watch::silent());
        preset.bench.controller = tuned.unwrap().controller;
        assert_eq!(refusal(&preset), None);
    }

    #[test]
    fn matrices_are_refused_without_a_proposal() {
        let mut matrices = ControllerMatrices::default();
        // The torque per deviation of the angle, without damping.
        matrices.direct[0] = -5.0;
        let refused = refusal(&late(5e-3, ControllerChoice::Linear(matrices))).expect("it is unstable");
        assert!(refused.contains("Compute its matrices for an axis with this delay."), "{refused}");
    }

    #[test]
    fn a_model_without_delays_is_not_checked_and_the_gains_of_the_guide_are_accepted() {
        let cascade = Cascade { velocity_gain: 50.0, ..Cascade::default() };
        assert_eq!(refusal(&late(0.0, ControllerChoice::Cascade(cascade))), None);
        let guide = Cascade { position_gain: 5.0, velocity_gain: 0.03, integral_gain: 1.0, ..cascade };
        let mut preset = late(5e-3, ControllerChoice::Cascade(guide));
        (preset.bench.torque_amplifier, preset.model.load_amplifier.delay) = (1.0, 5e-3);
        preset.bench.filter = FilterChoice::Notch(NotchChoice::default());
        assert_eq!(refusal(&preset), None);
    }
}
