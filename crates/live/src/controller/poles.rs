//! Poles as points of the s-plane, and a hand on those that are wanted.

use std::f64::consts::PI;

use nalgebra::Complex;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_core::fields::{Field, Fields};

use super::view::short;
use stickslip_base::preset::{Poles, Regulation, StateFeedback};
use stickslip_base::{ControllerChoice, Error};
use stickslip_design::linear::{StateSpace, size};

/// Damping ratios whose rays are drawn.
const RAYS: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// A pole in continuous time, ln z/T.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopPole {
    /// [1/s]; below 0 it dies out.
    pub real: f64,
    /// [rad/s].
    pub imaginary: f64,
    /// Natural frequency [rad/s].
    pub frequency: f64,
    /// Damping ratio; 1 on the real axis, negative where it grows.
    pub damping: f64,
}

/// The direction in which poles of a damping ratio lie.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DampingRay {
    /// The damping ratio.
    pub damping: f64,
    /// Of a unit vector.
    pub real: f64,
    /// Of a unit vector; the other ray has the opposite sign.
    pub imaginary: f64,
}

/// A hand on the pair of poles that is wanted of a state feedback.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoleDrag {
    /// Where it is [1/s].
    pub real: f64,
    /// Where it is [rad/s].
    pub imaginary: f64,
}

/// The pair of poles that is wanted, to be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PoleGrip {
    /// Where the upper one lies [1/s].
    pub real: f64,
    /// Where it lies [rad/s], from 0 on.
    pub imaginary: f64,
    /// Natural frequency [rad/s].
    pub bandwidth: f64,
    /// Damping ratio.
    pub damping: f64,
}

impl LoopPole {
    fn of(rate: Complex<f64>) -> Self {
        let frequency = size(rate);
        let damping = if frequency > 0.0 { -rate.re / frequency } else { 1.0 };
        let [real, imaginary, frequency, damping] = [rate.re, rate.im, frequency, damping].map(short);
        LoopPole { real, imaginary, frequency, damping }
    }

    /// Of these poles in z of a system, but for those that are gone after a sample; the slowest first.
    pub(super) fn all(system: &StateSpace, poles: &[Complex<f64>]) -> Vec<LoopPole> {
        let mut all: Vec<_> = system.rates(poles).into_iter().map(LoopPole::of).collect();
        all.sort_by(|one, other| one.frequency.total_cmp(&other.frequency));
        all
    }
}

impl DampingRay {
    /// All that are drawn.
    pub(super) fn all() -> Vec<DampingRay> {
        let ray = |damping: f64| DampingRay { damping, real: -damping, imaginary: libm::sqrt(1.0 - damping * damping) };
        RAYS.map(ray).to_vec()
    }
}

impl PoleGrip {
    /// Of a controller whose poles are stated.
    pub(super) fn of(controller: &ControllerChoice<f64>) -> Option<Self> {
        let ControllerChoice::StateFeedback(StateFeedback { regulator: Regulation::Poles(wanted), .. }) = controller
        else {
            return None;
        };
        let Poles { bandwidth, damping, .. } = *wanted;
        // Two real poles are held between both.
        let real = -bandwidth * damping.min(1.0);
        let imaginary = bandwidth * libm::sqrt((1.0 - damping * damping).max(0.0));
        Some(PoleGrip { real, imaginary, bandwidth, damping })
    }
}

/// What a hand means: the natural frequency is its distance from 0, the damping ratio the sine of its angle from the
/// imaginary axis, both within what a file admits.
pub(super) fn dragged(controller: &mut ControllerChoice<f64>, drag: &PoleDrag) -> Result<(), Error> {
    let ControllerChoice::StateFeedback(StateFeedback { regulator: Regulation::Poles(wanted), .. }) = controller else {
        return Err(Error::NotSolvable {
            what: "a controller by the place of its poles",
            remedy: "Choose state feedback with its regulator by poles: the poles of others follow from their gains.",
        });
    };
    let hand = Complex::new(drag.real, drag.imaginary.abs());
    let frequency = size(hand);
    if !frequency.is_finite() {
        return Err(Error::NotFinite { what: "the place of a pole", value: frequency });
    }
    // In the right half plane a hand is on the imaginary axis, which the least damping keeps it from.
    let damping = if hand.re < 0.0 { libm::sin(libm::atan2(-hand.re, hand.im).min(0.5 * PI)) } else { 0.0 };
    wanted.bandwidth = clamped("bandwidth", frequency);
    wanted.damping = clamped("damping", damping);
    Ok(())
}

/// In the digits that a hand can mean, and in the range that is stated.
fn clamped(name: &str, value: f64) -> f64 {
    let fields = <Poles<f64> as Fields<f64>>::SHAPE.fields();
    let field: &Field = fields.iter().find(|field| field.name == name).expect("poles have their parameters");
    let digits: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    digits.clamp(field.minimum, field.maximum)
}
