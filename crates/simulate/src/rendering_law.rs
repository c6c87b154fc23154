//! The rendering law of a bench, with the choice of `auto` by simulation.

use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};
use stickslip_core::render::Law;
use stickslip_design::named_law;

use crate::fidelity::pick_law;

/// The rendering law of `settings.law` for the model of the machine.
///
/// # Errors
/// As the design of the observer; with `auto` as [`pick_law`].
pub fn rendering_law(model: &Model<f64>, settings: &Settings<f64>) -> Result<Law<f64>, Error> {
    match named_law(model, settings)? {
        Some(law) => Ok(law),
        None => rendering_law(model, &Settings { law: pick_law(model, settings)?.law, ..*settings }),
    }
}
