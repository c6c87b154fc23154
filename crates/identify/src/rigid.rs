//! Rigid body with Coulomb and viscous friction: linear in its parameters, hence without start values.
//!
//! ```text
//! F = M·q̈ + F_v·q̇ + F_c·sign q̇ + F_0                      symmetric
//! F = M·q̈ + F_v⁺·q̇ + F_c⁺            q̇ > 0
//!     M·q̈ + F_v⁻·q̇ − F_c⁻            q̇ < 0                asymmetric
//! ```
//!
//! Inverse dynamic identification by least squares, Janot, Gautier, Brunot (2019). A common offset and two Coulomb
//! levels are not separately identifiable: motion only determines F_c⁺ + F_0 and F_c⁻ − F_0. The asymmetric model
//! therefore has no offset; where Coulomb friction is symmetric, half the difference of the two levels is the offset.
//! On a vertical axis the offset is a weight, subtracted before (`Motion::unload`).

use std::ops::Range;

use super::motion::{Motion, Regression};
use stickslip_base::Error;
use stickslip_fit::LinearFit;

/// One friction for both directions and an offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Symmetric {
    /// M [kg or kg m²], F_v [N s/m or N m s/rad], F_c, F_0 [N or N m].
    pub fit: LinearFit,
}

/// A friction for each direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Asymmetric {
    /// M, F_v⁺, F_c⁺, F_v⁻, F_c⁻.
    pub fit: LinearFit,
}

/// Names of the symmetric parameters in the order of the fit.
pub const SYMMETRIC: [&str; 4] = ["mass", "viscous", "coulomb", "offset"];
/// Names of the asymmetric parameters in the order of the fit.
pub const ASYMMETRIC: [&str; 5] =
    ["mass", "positive_viscous", "positive_coulomb", "negative_viscous", "negative_coulomb"];

fn symmetric(velocity: f64, acceleration: f64) -> [f64; 4] {
    [acceleration, velocity, sign(velocity), 1.0]
}

fn asymmetric(velocity: f64, acceleration: f64) -> [f64; 5] {
    let (forward, backward) = (f64::from(velocity > 0.0), f64::from(velocity < 0.0));
    [acceleration, forward * velocity, forward, backward * velocity, -backward]
}

/// −1, 0, 1; `f64::signum` has no 0.
fn sign(x: f64) -> f64 {
    f64::from(x > 0.0) - f64::from(x < 0.0)
}

impl Symmetric {
    /// Fits the samples of a range.
    ///
    /// # Errors
    /// A range too short, or a motion that does not determine the parameters.
    pub fn identify(motion: &Motion, range: Range<usize>, decimation: usize) -> Result<Self, Error> {
        let rows = Regression::of(motion, range, decimation, symmetric)?;
        Ok(Symmetric { fit: rows.fit(motion.inertia)? })
    }
}

impl Asymmetric {
    /// Fits the samples of a range.
    ///
    /// # Errors
    /// A range too short, or a motion that does not determine the parameters.
    pub fn identify(motion: &Motion, range: Range<usize>, decimation: usize) -> Result<Self, Error> {
        let rows = Regression::of(motion, range, decimation, asymmetric)?;
        Ok(Asymmetric { fit: rows.fit(motion.inertia)? })
    }
}
