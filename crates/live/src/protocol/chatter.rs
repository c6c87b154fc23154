//! How far a rendering law is from chatter, for people.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_core::render::Law;
use stickslip_design::DesignError;

use stickslip_base::Error;
use stickslip_design::{self as design, CHATTER_LIMIT, Margin};

/// How far a rendering law is from chatter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChatterMargin {
    /// Whether the bench would take it.
    pub stable: bool,
    /// In a sentence: how far, or why not and what would do.
    pub sentence: String,
    /// Stiffness of the desired bristles up to which it does not chatter [N m/rad]; `null`: no limit was found, or it is
    /// not stable.
    pub stiffness_limit: Option<f64>,
    /// Stiffness of the desired bristles [N m/rad]; `null` where the law renders none.
    pub stiffness: Option<f64>,
    /// Factor of the law's torque up to which the loop is stable; `null`: any that was tried.
    pub gain_margin: Option<f64>,
    /// Additional delay up to which it is [s]; `null`: any that was tried.
    pub delay_margin: Option<f64>,
    /// Change of the load torque from millisecond to millisecond that is to be expected [N m RMS].
    pub chatter: f64,
    /// From which on it is chatter [N m RMS].
    pub chatter_limit: f64,
    /// What of the way to the nearest limit is left, 0 … 1; `null` where it is not known.
    pub left: Option<f64>,
    /// Below this share caution is due.
    pub caution: f64,
    /// The nearest limit: `chatter`, `stiffness`.
    pub nearest: String,
}

/// A fifth of the way: by choice, as room for what the model of the bench is off.
const CAUTION: f64 = 0.2;

impl ChatterMargin {
    pub(crate) fn of(law: &Law<f64>, margin: Result<Margin, Error>) -> Result<Self, Error> {
        let stable = margin.is_ok();
        let sentence = margin.as_ref().map_or_else(ToString::to_string, ToString::to_string);
        let known = match margin {
            Ok(margin) => margin,
            // No limit is known where the loop grows by itself.
            Err(error) => {
                let Some(&DesignError::Chatters { predicted_chatter, cause, .. }) = error.of() else {
                    return Err(error);
                };
                Margin { stiffness_limit: None, gain_margin: None, delay_margin: None, predicted_chatter, cause }
            }
        };
        let stiffness = design::desired_stiffness(law);
        let uses = [
            ("chatter", Some(known.predicted_chatter / CHATTER_LIMIT)),
            ("stiffness", stiffness.zip(known.stiffness_limit).map(|(stiffness, limit)| stiffness / limit)),
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
            stiffness_limit: known.stiffness_limit,
            stiffness,
            gain_margin: known.gain_margin,
            delay_margin: known.delay_margin,
            chatter: known.predicted_chatter,
            chatter_limit: CHATTER_LIMIT,
        })
    }
}
