//! How far a rendering law is from chatter.
//!
//! The loop of law, observer, current control, believed machine and all delays is linearised about a load that is stuck,
//! tick by tick and with exact slopes, and driven by the noise of the instruments. Chatter is what the load torque then
//! does within half a second, about as long as a load sticks in a limit cycle: an unstable loop has grown far beyond the
//! limit by then, a stable one shows its noise. `docs/studies/margins.md` holds the stiffness from which on there is
//! chatter against the whole virtual bench.
//!
//! Left out: a load that slides; the position controller, which is far slower; the torque steps of the paper's law at its
//! fade-out limits. That law asks for nothing at rest, so that nothing limits it here.

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
/// Stiffnesses of the desired bristles between which a limit is looked for [N m/rad].
pub const STIFFNESSES: [f64; 2] = [100.0, 1e5];
/// Largest gain that is tried.
pub const LARGEST_GAIN: f64 = 10.0;
/// Largest additional delay that is tried, in ticks.
pub const LARGEST_DELAY: f64 = 3.0;
/// Inertias that move with the carriage, in those of the load, between which a limit is looked for.
const LIGHTEST: f64 = 0.01;
const HEAVIEST: f64 = 20.0;
/// Time in which chatter builds up [s].
const HORIZON: f64 = 0.5;
/// Time over which the load torque's change is taken [s].
const PERIOD: f64 = 1e-3;
/// Ratio of a search's steps, and the accuracy to which its end is found.
const STRIDE: f64 = 1.15;
const ACCURACY: f64 = 1.005;

/// How far a law is from chatter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin {
    /// Stiffness of the desired bristles up to which it stays below [`CHATTER_LIMIT`], see [`stiffness_limit`] [N m/rad].
    pub stiffness_limit: Option<f64>,
    /// Factor of the law's torque up to which the loop is stable; `None`: at least [`LARGEST_GAIN`].
    pub gain_margin: Option<f64>,
    /// Additional delay up to which it is [s]; `None`: at least [`LARGEST_DELAY`].
    pub delay_margin: Option<f64>,
    /// Change of the load torque from millisecond to millisecond [N m RMS].
    pub predicted_chatter: f64,
    /// Where most of it comes from.
    pub cause: &'static str,
}

impl fmt::Display for Margin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.stiffness_limit {
            Some(limit) => write!(f, "bristles up to {limit:.0} N m/rad")?,
            None => write!(f, "no limit of the bristles")?,
        }
        if let Some(gain) = self.gain_margin {
            write!(f, ", gain {gain:.2}")?;
        }
        if let Some(delay) = self.delay_margin {
            write!(f, ", delay {:.2} ms", 1e3 * delay)?;
        }
        write!(f, ", chatter {:.1} mN m, most by {}", 1e3 * self.predicted_chatter, self.cause)
    }
}

/// How far a law of this machine and these settings is from chatter.
///
/// # Errors
/// [`DesignError::Chatters`] where the loop is not stable; what the design of observer and current control refuses.
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

/// Stiffness of the desired bristles up to which a law does not chatter, their damping as it is [N m/rad]; `None` where
/// there is no limit up to the last of [`STIFFNESSES`], 0 where it chatters already at the first.
///
/// # Errors
/// What the design of observer and current control refuses.
pub fn stiffness_limit(law: &Law<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Result<Option<f64>, Error> {
    let mut sampled = with_arm(law, model, settings)?;
    let [softest, stiffest] = STIFFNESSES;
    Ok(climb(softest, stiffest, |stiffness| {
        sampled.law = with_stiffness(law, stiffness);
        chatter(&sampled, model, settings).rms() <= CHATTER_LIMIT
    }))
}

/// The loop of a law and of the arm that is rendered besides.
fn with_arm(law: &Law<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Result<SampledLoop<f64>, Error> {
    let mut sampled = SampledLoop::new(*law, model, settings)?;
    sampled.arm = arm_rendering(model, settings)?;
    Ok(sampled)
}

/// The largest inertia that moves with the carriage, of this arm, whose rendering alone is stable [kg m²]; infinite where
/// that is more than [`HEAVIEST`].
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

/// The largest stiffness below this one that does not chatter.
fn feasible(
    law: &Law<f64>,
    stiffness: f64,
    model: &Model<f64>,
    settings: &Settings<f64>,
) -> Result<Option<f64>, Error> {
    let mut sampled = with_arm(law, model, settings)?;
    let found = climb(1.0 / stiffness, 1.0 / STIFFNESSES[0], |inverse| {
        sampled.law = with_stiffness(law, 1.0 / inverse);
        chatter(&sampled, model, settings).rms() > CHATTER_LIMIT
    });
    // A hair softer than where chatter ends.
    Ok(found.map(|inverse| 1.0 / (ACCURACY * inverse)))
}

fn chatter(sampled: &SampledLoop<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Chatter {
    let ticks = |time: f64| (time * settings.tick_rate).round().max(1.0);
    sampled.linearised(model).chatter(libm::log2(ticks(HORIZON)).round() as usize, ticks(PERIOD) as usize)
}

/// The largest value from `first` on up to which all is well, by steps and then bisection; `None` if that is to `last`, 0
/// if not even `first` is.
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

/// Stiffness of the bristles that a law renders [N m/rad]; `None` where it has none.
pub fn desired_stiffness(law: &Law<f64>) -> Option<f64> {
    let desired = match law {
        Law::Bristle(law) => &law.desired,
        Law::Admittance(law) => &law.desired,
        Law::Off | Law::Paper(_) | Law::Smooth(_) | Law::Karnopp(_) => return None,
    };
    Some(desired.stiffest().0)
}

/// The law with other desired bristles, their damping as it is; a law without any stays.
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
