//! True friction of the virtual machine, for comparison with measurements. Experiments must not use it.

use stickslip_core::friction::Stribeck;
use stickslip_core::plant::Plant;

use crate::FrictionPlan;
use stickslip_base::Error;
use stickslip_fit::{CurvePoint, Side, StribeckFit, StribeckPlan, fit_stribeck};

/// Static friction of the load side [N m] at a velocity [rad/s], screw and wheel, mean over a turn.
pub fn own_friction(plant: &Plant<f64>, velocity: f64) -> f64 {
    const ANGLES: usize = 64;
    let mean = |friction: &stickslip_core::friction::Friction<f64>| {
        (0..ANGLES)
            .map(|k| friction.steady_torque(velocity, std::f64::consts::TAU * k as f64 / ANGLES as f64, 0.0))
            .sum::<f64>()
            / ANGLES as f64
    };
    mean(&plant.screw_friction) + plant.wheel.preload * mean(&plant.wheel.friction)
}

/// Its best-fitting Stribeck curve at the plan's speeds, both directions, unweighted.
///
/// # Errors
/// As [`fit_stribeck`].
pub fn own_curve(plant: &Plant<f64>, plan: &FrictionPlan<f64>) -> Result<StribeckFit, Error> {
    let points: Vec<CurvePoint> = plan
        .speeds()
        .flat_map(|speed| [speed, -speed])
        .map(|velocity| CurvePoint { velocity, torque: own_friction(plant, velocity), standard_error: 1.0 })
        .collect();
    fit_stribeck(&points, &StribeckPlan { side: Side::Both, ..StribeckPlan::default() })
}

/// RMS distance of the true friction from a curve at the plan's speeds [N m].
pub fn distance(plant: &Plant<f64>, curve: &Stribeck<f64>, plan: &FrictionPlan<f64>) -> f64 {
    let squares: Vec<f64> =
        plan.speeds().map(|speed| (own_friction(plant, speed) - curve.magnitude(speed)).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}
