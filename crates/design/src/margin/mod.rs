//! Stability margin of a rendering law against chatter.
//!
//! The loop of law, observer, current control, modelled machine and all delays is linearised about a stuck load, tick
//! by tick with exact slopes, and driven by the noise of the instruments. Chatter is the change of the load torque
//! within half a second, about the time for which a load sticks in a limit cycle: an unstable loop has grown far beyond
//! the limit by then, a stable one shows its noise. `docs/studies/margins.md` compares the stiffness at which chatter
//! starts with the whole virtual bench.
//!
//! Left out: a sliding load; the position controller, which is far slower; the torque steps of the paper's law at its
//! fade-out limits. That law renders no torque at rest, so that it has no limit here.

mod sampled_loop;
#[cfg(test)]
mod tests;

use crate::DesignError;
use std::fmt;

use stickslip_core::drive::ElasticArm;
use stickslip_core::friction::Model as FrictionModel;
use stickslip_core::render::{ArmRendering, Law, RenderedArm};

use super::arm_rendering;
use sampled_loop::{Chatter, SampledLoop};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};

/// Change of the load torque from millisecond to millisecond that counts as chatter [N m RMS].
pub const CHATTER_LIMIT: f64 = 20e-3;
/// Stiffnesses of the desired bristles between which the limit is searched [N m/rad].
pub const STIFFNESSES: [f64; 2] = [100.0, 1e5];
/// Largest tested gain.
pub const LARGEST_GAIN: f64 = 10.0;
/// Largest tested additional delay, in ticks.
pub const LARGEST_DELAY: f64 = 3.0;
/// Inertias on the carriage, as shares of the load inertia, between which the limit is searched.
const LIGHTEST: f64 = 0.01;
const HEAVIEST: f64 = 20.0;
/// Time in which chatter builds up [s].
const HORIZON: f64 = 0.5;
/// Period of the load torque's change [s].
const PERIOD: f64 = 1e-3;
/// Ratio of a search's steps, and its accuracy.
const STRIDE: f64 = 1.15;
const ACCURACY: f64 = 1.005;

/// Stability margin of a law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin {
    /// Stiffness of the desired bristles up to which it stays below [`CHATTER_LIMIT`], see [`stiffness_limit`] [N m/rad].
    pub stiffness_limit: Option<f64>,
    /// Factor of the law's torque up to which the loop is stable; `None`: at least [`LARGEST_GAIN`].
    pub gain_margin: Option<f64>,
    /// Additional delay up to which the loop is stable [s]; `None`: at least [`LARGEST_DELAY`].
    pub delay_margin: Option<f64>,
    /// Change of the load torque from millisecond to millisecond [N m RMS].
    pub predicted_chatter: f64,
    /// Its main cause.
    pub cause: &'static str,
}

impl fmt::Display for Margin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let limits = [
            self.stiffness_limit.map(|limit| format!("bristle stiffness up to {limit:.0} N·m/rad")),
            self.gain_margin.map(|gain| format!("gain margin {gain:.2}")),
            self.delay_margin.map(|delay| format!("delay margin {:.2} ms", 1e3 * delay)),
        ];
        let limits: Vec<String> = limits.into_iter().flatten().collect();
        write!(f, "Stable")?;
        if !limits.is_empty() {
            write!(f, ": {}", limits.join(", "))?;
        }
        write!(f, ". Predicted torque ripple {:.1} mN·m, mainly {}", 1e3 * self.predicted_chatter, self.cause)
    }
}

/// The stability margin of a law for this machine and these settings.
///
/// # Errors
/// [`DesignError::Chatters`] if the loop is unstable; errors of the design of observer and current control.
pub fn margin(law: &Law<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Result<Margin, Error> {
    let mut sampled = with_arm(law, model, settings)?;
    let chatter = |sampled: &SampledLoop<f64>| chatter(sampled, model, settings);
    let now = chatter(&sampled);
    let (predicted_chatter, cause) = (now.rms(), now.cause());
    if now.grows {
        let stiffness = desired_stiffness(law);
        let feasible = match stiffness {
            Some(stiffness) => feasible(law, stiffness, model, settings)?,
            None => None,
        };
        return Err(
            DesignError::Chatters { predicted_chatter, limit: CHATTER_LIMIT, cause, stiffness, feasible }.into()
        );
    }
    let gain_margin = climb(1.0, LARGEST_GAIN, |gain| {
        sampled.gain = gain;
        !chatter(&sampled).grows
    });
    sampled.gain = 1.0;
    let latest = (LARGEST_DELAY * sampled.steps as f64) as usize;
    let too_late = (1..=latest).find(|&late| {
        sampled.late = late;
        chatter(&sampled).grows
    });
    let delay_margin = too_late.map(|late| (late - 1) as f64 * sampled.step());
    let stiffness_limit = stiffness_limit(law, model, settings)?;
    Ok(Margin { stiffness_limit, gain_margin, delay_margin, predicted_chatter, cause })
}

/// Stiffness of the desired bristles up to which a law does not chatter, at their present damping [N m/rad]; `None`
/// without a limit up to the last of [`STIFFNESSES`], 0 if it chatters already at the first.
///
/// # Errors
/// Errors of the design of observer and current control.
pub fn stiffness_limit(law: &Law<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Result<Option<f64>, Error> {
    let mut sampled = with_arm(law, model, settings)?;
    let [softest, stiffest] = STIFFNESSES;
    if desired_stiffness(law).is_none() {
        // The same loop for every stiffness.
        return Ok((chatter(&sampled, model, settings).rms() > CHATTER_LIMIT).then_some(0.0));
    }
    Ok(climb(softest, stiffest, |stiffness| {
        sampled.law = with_stiffness(law, stiffness);
        chatter(&sampled, model, settings).rms() <= CHATTER_LIMIT
    }))
}

/// The loop of a law and of the rendered arm.
fn with_arm(law: &Law<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Result<SampledLoop<f64>, Error> {
    let mut sampled = SampledLoop::new(*law, model, settings)?;
    sampled.arm = arm_rendering(model, settings)?;
    Ok(sampled)
}

/// The largest inertia on the carriage with this arm whose rendering alone is stable [kg m²]; infinite if it is more
/// than [`HEAVIEST`].
pub(super) fn rigid_limit(arm: &ArmRendering<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Result<f64, Error> {
    let mut sampled = SampledLoop::new(Law::Off, model, settings)?;
    let load = model.drive.load_inertia;
    let limit = climb(LIGHTEST * load, HEAVIEST * load, |rigid_inertia| {
        let heavier = ElasticArm { rigid_inertia, ..arm.arm };
        sampled.arm = RenderedArm::Elastic(ArmRendering { arm: heavier, ..*arm });
        !chatter(&sampled, model, settings).grows
    });
    Ok(limit.unwrap_or(f64::INFINITY))
}

/// The largest stiffness below this one without chatter.
fn feasible(
    law: &Law<f64>,
    stiffness: f64,
    model: &Model<f64>,
    settings: &Settings<f64>,
) -> Result<Option<f64>, Error> {
    let mut sampled = with_arm(law, model, settings)?;
    let limit = climb(1.0 / stiffness, 1.0 / STIFFNESSES[0], |inverse| {
        sampled.law = with_stiffness(law, 1.0 / inverse);
        chatter(&sampled, model, settings).rms() > CHATTER_LIMIT
    });
    // Slightly softer than the limit of chatter.
    Ok(limit.map(|inverse| 1.0 / (ACCURACY * inverse)))
}

fn chatter(sampled: &SampledLoop<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Chatter {
    let ticks = |time: f64| (time * settings.tick_rate).round().max(1.0);
    sampled.linearised(model).chatter(libm::log2(ticks(HORIZON)).round() as usize, ticks(PERIOD) as usize)
}

/// The largest value from `first` on up to which `well` is true, by steps and then bisection; `None` if it is true up
/// to `last`, 0 if it is false at `first`.
fn climb(first: f64, last: f64, mut well: impl FnMut(f64) -> bool) -> Option<f64> {
    let (mut good, mut next) = (0.0, first);
    while well(next) {
        if next >= last {
            return None;
        }
        (good, next) = (next, (next * STRIDE).min(last));
    }
    while good > 0.0 && next > ACCURACY * good {
        let middle = libm::sqrt(good * next);
        if well(middle) { good = middle } else { next = middle }
    }
    Some(good)
}

/// Stiffness of the bristles that a law renders [N m/rad]; `None` if it has none.
pub fn desired_stiffness(law: &Law<f64>) -> Option<f64> {
    let desired = match law {
        Law::Bristle(law) => &law.desired,
        Law::Admittance(law) => &law.desired,
        Law::Off | Law::Paper(_) | Law::Smooth(_) | Law::Karnopp(_) => return None,
    };
    Some(desired.stiffest().0)
}

/// The law with another stiffness of the desired bristles, at their present damping; a law without bristles is
/// unchanged.
fn with_stiffness(law: &Law<f64>, stiffness: f64) -> Law<f64> {
    let mut law = *law;
    let desired = match &mut law {
        Law::Bristle(law) => &mut law.desired,
        Law::Admittance(law) => &mut law.desired,
        Law::Off | Law::Paper(_) | Law::Smooth(_) | Law::Karnopp(_) => return law,
    };
    match &mut desired.model {
        FrictionModel::Dahl(model) => model.bristle_stiffness = stiffness,
        FrictionModel::Lugre(model) => model.bristle_stiffness = stiffness,
        FrictionModel::ElastoPlastic(model) => model.lugre.bristle_stiffness = stiffness,
        FrictionModel::MaxwellSlip(model) => *model = model.with_stiffness(stiffness),
        FrictionModel::Nothing | FrictionModel::Static(_) => {}
    }
    law
}
