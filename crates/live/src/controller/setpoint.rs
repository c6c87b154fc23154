//! Set-point weight of a PID controller from a permitted overshoot. It changes neither the poles nor the margins.

use super::view::LoopAt;
use stickslip_base::{ControllerChoice, Error, Preset};
use stickslip_design::within;
use stickslip_experiment::workflow::position_loop::{LoopRun, as_pid};

/// Steps of the search: the weight is exact to 1/100.
const STEPS: usize = 7;

/// Lowers the set-point weight until a step overshoots by at most this share, with the load sliding; a cascade is
/// converted to the equivalent PID controller.
pub(super) fn limit_overshoot(preset: &mut Preset<f64>, speed: f64, most: f64) -> Result<(), Error> {
    within("the permitted overshoot", most, "1", (0.0, 1.0), "Use a share of the step, for example 0.1.")?;
    if let ControllerChoice::Cascade(_) = preset.bench.controller {
        preset.bench.controller = as_pid(&preset.bench.controller);
    }
    let present = weight(preset)?;
    if overshoot(preset, speed, present)? <= most {
        return Ok(());
    }
    let (mut low, mut high) = (0.0, present);
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        if overshoot(preset, speed, middle)? <= most { low = middle } else { high = middle }
    }
    *weight_mut(preset)? = libm::floor(100.0 * low) / 100.0;
    Ok(())
}

fn weight(preset: &Preset<f64>) -> Result<f64, Error> {
    weight_mut(&mut { *preset }).copied()
}

fn weight_mut(preset: &mut Preset<f64>) -> Result<&mut f64, Error> {
    match &mut preset.bench.controller {
        ControllerChoice::Pid(pid) => Ok(&mut pid.position_weight),
        _ => Err(Error::NotSolvable {
            what: "a set-point weight",
            remedy: "Choose a cascade or a PID controller: other kinds have no set-point weight.",
        }),
    }
}

/// The overshoot of a set-point step with a weight.
fn overshoot(preset: &Preset<f64>, speed: f64, weight: f64) -> Result<f64, Error> {
    let mut preset = *preset;
    *weight_mut(&mut preset)? = weight;
    let run = LoopRun::glance(&preset, speed)?;
    let sliding = run.operating.first().map(LoopAt::of).transpose()?;
    sliding.and_then(|at| at.overshoot).ok_or(Error::NotSolvable {
        what: "the overshoot of an unstable loop",
        remedy: "Stabilize the loop first, for example by automatic tuning.",
    })
}
