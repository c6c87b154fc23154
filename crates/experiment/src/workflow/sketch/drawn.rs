//! The computed view of a sketch, as the page shows it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Handle;
use stickslip_design::Verdict;

/// The computed view of a sketch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Drawn {
    /// As [`Sketch::desired`](super::Sketch::desired).
    pub desired: [f64; 4],
    /// Desired friction at each speed [N m].
    pub curve: Vec<f64>,
    /// Own friction at each speed [N m].
    pub own: Vec<f64>,
    /// Smallest friction that can be rendered steadily at each speed [N m].
    pub least: Vec<f64>,
    /// Largest friction that can be rendered steadily at each speed [N m].
    pub largest: Vec<f64>,
    /// The presliding loop of the desired friction.
    pub desired_loop: Loop,
    /// The presliding loop of the own friction, over the same way.
    pub own_loop: Loop,
    /// Handles of the single parameters.
    pub grips: Vec<Grip>,
    /// Whether it can be rendered.
    pub renderable: bool,
    /// Factor of the difference torque at which a limit is reached; `null`: unlimited.
    pub margin: Option<f64>,
    /// The nearest of the limits; `null` if nothing is required.
    pub nearest: Option<NearestLimit>,
    /// Indices of the reference points that contradict the others and are not used.
    pub strays: Vec<usize>,
    /// Limits of the smallest and the largest friction.
    pub edges: Vec<Edge>,
    /// Speed ranges in which it cannot be rendered.
    pub shortages: Vec<SpeedRange>,
    /// Remarks, in sentences.
    pub remarks: Vec<String>,
    /// RMS distance from the reference points [N m]; `null` without any.
    pub distance: Option<f64>,
}

/// Presliding loop of slow motion back and forth from rest: the bristles without damping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Loop {
    /// Way from the start [rad].
    pub angle: Vec<f64>,
    /// Friction torque [N m].
    pub torque: Vec<f64>,
}

/// A handle on the curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Grip {
    /// The handle.
    pub handle: Handle,
    /// Symbol.
    pub symbol: String,
    /// Its value.
    pub value: f64,
    /// SI unit.
    pub unit: String,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Its speed in the figure [rad/s].
    pub speed: f64,
    /// Its torque in the figure [N m].
    pub torque: f64,
}

/// The nearest limit of the region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NearestLimit {
    /// `drive`, `current`, `voltage`, `slope`, `response`, `speed`.
    pub limit: String,
    /// Speed at which it is nearest [rad/s].
    pub speed: f64,
    /// Required value.
    pub needed: f64,
    /// Available value.
    pub available: f64,
    /// SI unit of both.
    pub unit: String,
    /// Remaining share of the way to the limit, 0 … 1; 0: exceeded.
    pub left: f64,
}

impl NearestLimit {
    pub(super) fn of(verdict: &Verdict) -> Option<Self> {
        let (bound, speed) = verdict.nearest;
        verdict.margin.is_finite().then(|| NearestLimit {
            limit: bound.limit.name().into(),
            speed,
            needed: bound.needed,
            available: bound.available,
            unit: bound.limit.unit().into(),
            left: (1.0 - 1.0 / verdict.margin).max(0.0),
        })
    }
}

/// A speed range in which a limit is exceeded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SpeedRange {
    /// Lower end [rad/s].
    pub from: f64,
    /// Upper end [rad/s].
    pub to: f64,
    /// As [`NearestLimit::limit`].
    pub limit: String,
    /// Reason, in a sentence.
    pub reason: String,
}

/// A part of an edge of the renderable region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Edge {
    /// Whether it is the edge of the largest friction, not of the smallest.
    pub largest: bool,
    /// Lower end [rad/s].
    pub from: f64,
    /// Upper end [rad/s].
    pub to: f64,
    /// `drive`, `current`, `voltage`; `wheel` where the law renders no torque and the friction wheel alone acts.
    pub limit: String,
}
