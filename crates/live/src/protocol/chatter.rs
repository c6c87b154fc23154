//! Margin of a rendering law against chatter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_core::render::Law;
use stickslip_design::DesignError;

use stickslip_base::Error;
use stickslip_design::{self as design, CAUTION, CHATTER_LIMIT, Margin};

/// Margin of a rendering law against chatter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChatterMargin {
    /// Whether the loop is stable: the bench accepts the law.
    pub stable: bool,
    /// The result in a sentence; if unstable, with the cause and a remedy.
    pub sentence: String,
    /// Largest stiffness of the desired bristles without chatter [N m/rad]; `null`: no limit found, or not stable.
    pub stiffness_limit: Option<f64>,
    /// Stiffness of the desired bristles [N m/rad]; `null` for a law without bristles.
    pub stiffness: Option<f64>,
    /// Factor of the law's torque up to which the loop is stable; `null`: stable for all tried factors.
    pub gain_margin: Option<f64>,
    /// Additional delay up to which the loop is stable [s]; `null`: stable for all tried delays.
    pub delay_margin: Option<f64>,
    /// Predicted change of the load torque within a millisecond [N m RMS].
    pub chatter: f64,
    /// Limit of this change; above it the law chatters [N m RMS].
    pub chatter_limit: f64,
    /// Remaining share of the distance to the nearest limit, 0 … 1; `null` if unknown.
    pub left: Option<f64>,
    /// Remaining share below which a warning is shown.
    pub caution: f64,
    /// The nearest limit: `chatter`, `stiffness`.
    pub nearest: String,
}

impl ChatterMargin {
    pub(crate) fn of(law: &Law<f64>, margin: Result<Margin, Error>) -> Result<Self, Error> {
        let stable = margin.is_ok();
        let sentence = margin.as_ref().map_or_else(ToString::to_string, ToString::to_string);
        let margin = match margin {
            Ok(margin) => margin,
            // An unstable loop has no limits.
            Err(error) => {
                let Some(&DesignError::Chatters { predicted_chatter, cause, .. }) = error.of() else {
                    return Err(error);
                };
                Margin { stiffness_limit: None, gain_margin: None, delay_margin: None, predicted_chatter, cause }
            }
        };
        let stiffness = design::desired_stiffness(law);
        let uses = [
            ("chatter", Some(margin.predicted_chatter / CHATTER_LIMIT)),
            ("stiffness", stiffness.zip(margin.stiffness_limit).map(|(stiffness, limit)| stiffness / limit)),
        ];
        let uses =
            uses.into_iter().filter_map(|(name, used)| used.filter(|used| used.is_finite()).map(|used| (name, used)));
        let nearest = uses.max_by(|a, b| a.1.total_cmp(&b.1));
        Ok(ChatterMargin {
            left: nearest.map(|(_, used)| (1.0 - used).max(0.0)),
            caution: CAUTION,
            nearest: nearest.map_or("", |(name, _)| name).into(),
            stable,
            sentence,
            stiffness_limit: margin.stiffness_limit,
            stiffness,
            gain_margin: margin.gain_margin,
            delay_margin: margin.delay_margin,
            chatter: margin.predicted_chatter,
            chatter_limit: CHATTER_LIMIT,
        })
    }
}
