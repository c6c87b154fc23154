//! The elastic arm that is rendered, prepared for the bench; how heavy it may be.

use crate::DesignError;
use std::f64::consts::TAU;

use stickslip_core::drive::{Arm, ElasticArm};
use stickslip_core::friction::Bristles;
use stickslip_core::render::{ArmRendering, RenderedArm};

use super::margin::rigid_limit;
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};

/// Share of the slowest observer pole up to which the observed motion drives the mode: beyond it the observer lags too
/// much, and the measured acceleration does better.
const OBSERVED: f64 = 0.3;
/// Share of the stability limit up to which an inertia is rendered: the whole bench began to oscillate at three quarters
/// of the limit at worst, since the loop leaves its observer and its quantisation out.
const ADMITTED: f64 = 0.7;
/// Low-pass of the acceleration that a heavy arm's rigid part needs [Hz].
const LOW_PASS: f64 = 300.0;

/// How much inertia that moves with the carriage can be rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmLimit {
    /// Where the loop over accelerometer and load motor becomes unstable, the load stuck or sliding [kg m²].
    pub stability: f64,
    /// Up to which it is rendered [kg m²].
    pub admitted: f64,
}

/// The arm of `settings.arm`, for what is believed of the machine. The observed motion drives its mode, or, where that is
/// too fast for the observer, the measured acceleration. The acceleration of its rigid part passes a low-pass only where
/// it is too heavy without.
///
/// # Errors
/// [`DesignError::ArmTooHeavy`]; what the design of observer and current control refuses.
pub fn arm_rendering(model: &Model<f64>, settings: &Settings<f64>) -> Result<RenderedArm<f64>, Error> {
    let Arm::Elastic(arm) = settings.arm else { return Ok(RenderedArm::Nothing) };
    let mut feasible = 0.0;
    for filtered in [false, true] {
        let rendering = prepared(&arm, filtered, model, settings);
        let limit = limit_of(&rendering, model, settings)?.admitted;
        if arm.rigid_inertia <= limit {
            return Ok(RenderedArm::Elastic(rendering));
        }
        feasible = limit.max(feasible);
    }
    Err(DesignError::ArmTooHeavy { rigid_inertia: arm.rigid_inertia, feasible }.into())
}

/// How much inertia can be rendered with the mode of this arm; `filtered`: with the low-pass that makes more of it
/// possible.
///
/// # Errors
/// What the design of observer and current control refuses.
pub fn arm_limit(
    arm: &ElasticArm<f64>,
    filtered: bool,
    model: &Model<f64>,
    settings: &Settings<f64>,
) -> Result<ArmLimit, Error> {
    limit_of(&prepared(arm, filtered, model, settings), model, settings)
}

fn limit_of(rendering: &ArmRendering<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Result<ArmLimit, Error> {
    // Sliding bristles have no stiffness, and a viscous friction would only help.
    let mut sliding = *model;
    sliding.own_bristles = Bristles { stiffness: 1e-3, damping: 0.0, ..model.own_bristles };
    sliding.own.viscous_friction = 0.0;
    let stability = rigid_limit(rendering, model, settings)?.min(rigid_limit(rendering, &sliding, settings)?);
    Ok(ArmLimit { stability, admitted: ADMITTED * stability })
}

fn prepared(arm: &ElasticArm<f64>, filtered: bool, model: &Model<f64>, settings: &Settings<f64>) -> ArmRendering<f64> {
    let dt = settings.tick_time();
    let slowest = settings.observer_poles.into_iter().fold(f64::INFINITY, f64::min);
    let followed = arm.angular_frequency() <= OBSERVED * slowest;
    ArmRendering {
        arm: *arm,
        by_acceleration: f64::from(u8::from(!followed)),
        low_pass: if filtered { 1.0 - libm::exp(-TAU * LOW_PASS * dt) } else { 1.0 },
        flow: arm.flow(dt),
        torque_limit: model.load_amplifier.current_limit * model.load_motor.torque_constant,
    }
}

#[cfg(test)]
mod tests;
