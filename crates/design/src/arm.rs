//! The rendered elastic arm, prepared for the bench, and its largest inertia.

use crate::DesignError;
use std::f64::consts::TAU;

use stickslip_core::drive::{Arm, ElasticArm};
use stickslip_core::friction::Bristles;
use stickslip_core::render::{ArmRendering, RenderedArm};

use super::margin::rigid_limit;
use stickslip_base::Error;
use stickslip_base::preset::{Model, ObserverChoice, Settings};

/// Share of the slowest observer pole up to which the observed motion drives the mode: above it the observer lags too
/// much, and the measured acceleration is better.
const OBSERVED: f64 = 0.3;
/// Share of the stability limit up to which an inertia is rendered: the whole bench oscillated from three quarters of
/// the limit at worst, since the loop omits its observer and its quantisation.
const ADMITTED: f64 = 0.7;
/// Low-pass of the acceleration for the rigid part of a heavy arm [Hz].
const LOW_PASS: f64 = 300.0;

/// Largest rendered inertia that moves with the carriage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmLimit {
    /// Inertia at which the loop over accelerometer and load motor becomes unstable, with the load stuck or sliding [kg
    /// m²].
    pub stability: f64,
    /// Largest rendered inertia [kg m²].
    pub admitted: f64,
}

/// The arm of `settings.arm`, for the model of the machine. The observed motion drives its mode, or, if that is too
/// fast for the observer, the measured acceleration. The acceleration of its rigid part passes a low-pass only if the
/// part is too heavy without it.
///
/// # Errors
/// [`DesignError::ArmTooHeavy`]; errors of the design of observer and current control.
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

/// Largest inertia rendered with the mode of this arm; `filtered`: with the low-pass, which permits more.
///
/// # Errors
/// Errors of the design of observer and current control.
pub fn arm_limit(
    arm: &ElasticArm<f64>,
    filtered: bool,
    model: &Model<f64>,
    settings: &Settings<f64>,
) -> Result<ArmLimit, Error> {
    limit_of(&prepared(arm, filtered, model, settings), model, settings)
}

fn limit_of(rendering: &ArmRendering<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Result<ArmLimit, Error> {
    // Sliding bristles have no stiffness; viscous friction, which is left out, would add damping.
    let mut sliding = *model;
    sliding.own_bristles = Bristles { stiffness: 1e-3, damping: 0.0, ..model.own_bristles };
    sliding.own.viscous_friction = 0.0;
    let stability = rigid_limit(rendering, model, settings)?.min(rigid_limit(rendering, &sliding, settings)?);
    Ok(ArmLimit { stability, admitted: ADMITTED * stability })
}

fn prepared(arm: &ElasticArm<f64>, filtered: bool, model: &Model<f64>, settings: &Settings<f64>) -> ArmRendering<f64> {
    let dt = settings.tick_time();
    let slowest = match settings.observer {
        ObserverChoice::Accelerometer => settings.observer_poles.into_iter().fold(f64::INFINITY, f64::min),
        // The model has the torque of the load motor as its input, so that it does not lag.
        ObserverChoice::Model(_) => f64::INFINITY,
    };
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
