//! The friction library for the page: curves identified on physical machines, as desired friction.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use stickslip_base::Error;
use stickslip_design::within;
use stickslip_experiment::library;

/// A friction of the library.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LibraryFriction {
    /// Its name.
    pub name: String,
    /// Title, one line.
    pub title: String,
    /// Authors and method of identification.
    pub source: String,
    /// Missing information.
    pub lacks: Vec<String>,
    /// Factor of all torques.
    pub scale: f64,
    /// Breakaway torque [N m], kinetic torque [N m], Stribeck velocity [rad/s] and viscous friction [N m s/rad].
    pub desired: [f64; 4],
}

/// All frictions with a sliding curve; with `breakaway`, their torques are scaled to this breakaway torque [N m].
pub(super) fn all(breakaway: Option<f64>) -> Result<Vec<LibraryFriction>, Error> {
    if let Some(torque) = breakaway {
        let remedy = "Use the breakaway torque of the desired friction.";
        within("the breakaway torque of the library", torque, "N m", (1e-6, 200.0), remedy)?;
    }
    let mut frictions = Vec::new();
    for name in library::names() {
        let entry = library::find(name)?;
        let Some(curve) = entry.sliding() else { continue };
        let scale = breakaway.map_or(1.0, |torque| torque / curve.breakaway_torque);
        let about = entry.about;
        frictions.push(LibraryFriction {
            name: name.into(),
            title: about.title,
            source: about.source,
            lacks: about.lacks,
            scale,
            desired: [
                scale * curve.breakaway_torque,
                scale * curve.kinetic_torque,
                curve.stribeck_velocity,
                scale * curve.viscous_friction,
            ],
        });
    }
    Ok(frictions)
}
