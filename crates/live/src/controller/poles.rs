//! Poles as points of the s-plane, and dragging of the specified pair of poles.

use std::f64::consts::PI;

use nalgebra::Complex;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_core::fields::{Field, Fields};

use super::view::short;
use stickslip_base::preset::{Poles, Regulation, StateFeedback};
use stickslip_base::{ControllerChoice, Error};
use stickslip_design::linear::{StateSpace, size};
use stickslip_experiment::workflow::position_loop::as_state_feedback;

/// Damping ratios of the drawn rays.
const RAYS: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// A pole in continuous time, ln z/T.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopPole {
    /// Real part [1/s]; negative if stable.
    pub real: f64,
    /// Imaginary part [rad/s].
    pub imaginary: f64,
    /// Natural frequency [rad/s].
    pub frequency: f64,
    /// Damping ratio; 1 on the negative real axis, negative if unstable.
    pub damping: f64,
}

/// Direction of the poles of a damping ratio.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DampingRay {
    /// The damping ratio.
    pub damping: f64,
    /// Real part of the unit vector.
    pub real: f64,
    /// Imaginary part of the unit vector; the other ray has the opposite sign.
    pub imaginary: f64,
}

/// Dragged position of a pair of poles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoleDrag {
    /// Real part [1/s].
    pub real: f64,
    /// Imaginary part [rad/s].
    pub imaginary: f64,
}

/// A pair of poles that can be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PoleGrip {
    /// Real part of the upper pole [1/s].
    pub real: f64,
    /// Imaginary part of the upper pole [rad/s], at least 0.
    pub imaginary: f64,
    /// Natural frequency [rad/s].
    pub bandwidth: f64,
    /// Damping ratio.
    pub damping: f64,
    /// Whether a drag replaces the controller by a state feedback with specified poles.
    pub converts: bool,
}

impl LoopPole {
    fn of(rate: Complex<f64>) -> Self {
        let frequency = size(rate);
        let damping = if frequency > 0.0 { -rate.re / frequency } else { 1.0 };
        let [real, imaginary, frequency, damping] = [rate.re, rate.im, frequency, damping].map(short);
        LoopPole { real, imaginary, frequency, damping }
    }

    /// Converts poles in z of a system, the slowest first; poles at z = 0 are omitted.
    pub(super) fn all(system: &StateSpace, poles: &[Complex<f64>]) -> Vec<LoopPole> {
        let mut all: Vec<_> = system.rates(poles).into_iter().map(LoopPole::of).collect();
        all.sort_by(|one, other| one.frequency.total_cmp(&other.frequency));
        all
    }
}

impl DampingRay {
    /// All drawn rays.
    pub(super) fn all() -> Vec<DampingRay> {
        let ray = |damping: f64| DampingRay { damping, real: -damping, imaginary: libm::sqrt(1.0 - damping * damping) };
        RAYS.map(ray).to_vec()
    }
}

impl PoleGrip {
    /// The pair of a controller with specified poles; else the slowest oscillating pair of the closed loop.
    pub(super) fn of(controller: &ControllerChoice<f64>, closed: &[LoopPole]) -> Option<Self> {
        if let Some(Poles { bandwidth, damping, .. }) = specified(&mut { *controller }).copied() {
            // Two real poles are dragged at their mean.
            let real = -bandwidth * damping.min(1.0);
            let imaginary = bandwidth * libm::sqrt((1.0 - damping * damping).max(0.0));
            return Some(PoleGrip { real, imaginary, bandwidth, damping, converts: false });
        }
        if let ControllerChoice::Linear(_) = controller {
            return None;
        }
        let oscillating = closed.iter().find(|pole| pole.imaginary > 0.0);
        let LoopPole { real, imaginary, frequency, damping } = *oscillating.or(closed.first())?;
        Some(PoleGrip { real, imaginary, bandwidth: frequency, damping, converts: true })
    }
}

/// The specified poles of a state feedback.
fn specified(controller: &mut ControllerChoice<f64>) -> Option<&mut Poles<f64>> {
    match controller {
        ControllerChoice::StateFeedback(StateFeedback { regulator: Regulation::Poles(poles), .. }) => Some(poles),
        _ => None,
    }
}

/// Sets the poles to a dragged position: the natural frequency is its distance from 0, the damping ratio the sine of its
/// angle from the imaginary axis, both limited to the ranges of the parameters. A controller without specified poles
/// becomes a state feedback with them.
pub(super) fn drag_poles(controller: &mut ControllerChoice<f64>, drag: &PoleDrag) -> Result<(), Error> {
    let matrices = matches!(controller, ControllerChoice::Linear(_));
    if !matrices && specified(controller).is_none() {
        *controller = as_state_feedback(controller);
        if let ControllerChoice::StateFeedback(feedback) = controller {
            feedback.regulator = Regulation::Poles(Poles::default());
        }
    }
    let Some(poles) = specified(controller) else {
        return Err(Error::NotSolvable {
            what: "a controller from the position of its poles",
            remedy: "A controller given by matrices has fixed poles: choose another kind.",
        });
    };
    let position = Complex::new(drag.real, drag.imaginary.abs());
    let frequency = size(position);
    if !frequency.is_finite() {
        return Err(Error::NotFinite { what: "the position of a pole", value: frequency });
    }
    // A position in the right half plane gets the smallest damping ratio.
    let damping = if position.re < 0.0 { libm::sin(libm::atan2(-position.re, position.im).min(0.5 * PI)) } else { 0.0 };
    poles.bandwidth = clamped("bandwidth", frequency);
    poles.damping = clamped("damping", damping);
    Ok(())
}

/// Rounded to four digits and limited to the range of the parameter.
fn clamped(name: &str, value: f64) -> f64 {
    let fields = <Poles<f64> as Fields<f64>>::SHAPE.fields();
    let field: &Field = fields.iter().find(|field| field.name == name).expect("poles have their parameters");
    let digits: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    digits.clamp(field.minimum, field.maximum)
}
