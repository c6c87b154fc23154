//! A custom friction model in Rust, in one file.
//!
//!     cargo run --release -p stickslip --example own_friction -- my_friction
//!
//! writes it as C with its self-test, as FMU and as A2L, for other simulations and boards.

use std::path::PathBuf;

use stickslip::generate::{Variables, Version, own_friction};
use stickslip::{Error, output};
use stickslip_core::Fields;
use stickslip_core::friction::{Bristle, Release};
use stickslip_core::scalar::Scalar;

/// Bristles as those of LuGre with the sliding curve of Hess and Soom, a quotient without exponential.
///
///   g(Ω) = M_K + (M_S − M_K)/(1 + (Ω/Ω_HS)²)
///
/// D. P. Hess, A. Soom: Friction at a Lubricated Line Contact Operating at Oscillating Sliding Velocities, ASME Journal of
/// Tribology 112 (1990) 147–152.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct HessSoom<T> {
    /// Torque at which the contact breaks away.
    #[field(symbol = "M_S", unit = "N m", range = 1e-6..=200.0, default = 0.30)]
    pub(crate) breakaway_torque: T,
    /// Kinetic torque at high speed.
    #[field(symbol = "M_K", unit = "N m", range = 1e-6..=200.0, default = 0.18)]
    pub(crate) kinetic_torque: T,
    /// Speed at half of the drop.
    #[field(symbol = "Ω_HS", unit = "rad/s", range = 1e-6..=1e3, default = 1.5)]
    pub(crate) drop_velocity: T,
    /// Stiffness of the bristles.
    #[field(symbol = "σ₀", unit = "N m/rad", range = 1e-3..=1e7, default = 300.0)]
    pub(crate) bristle_stiffness: T,
    /// Damping of the bristles.
    #[field(symbol = "σ₁", unit = "N m s/rad", range = 0.0..=100.0, default = 0.01)]
    pub(crate) bristle_damping: T,
}

impl<T: Scalar> Bristle<T> for HessSoom<T> {
    #[inline(always)]
    fn sliding(&self, speed: T) -> T {
        let ratio = speed / self.drop_velocity;
        self.kinetic_torque + (self.breakaway_torque - self.kinetic_torque) / (T::of(1.0) + ratio * ratio)
    }

    #[inline(always)]
    fn release(&self, _deflection: T, _velocity: T, _level: T) -> Release<T> {
        Release::sliding()
    }

    #[inline(always)]
    fn damping(&self, _velocity: T) -> T {
        self.bristle_damping
    }

    #[inline(always)]
    fn stiffness(&self) -> T {
        self.bristle_stiffness
    }
}

#[allow(dead_code, reason = "the test uses the model alone")]
fn main() -> Result<(), Error> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "own-friction".into()));
    let code = own_friction(&HessSoom::<f64>::default(), "hess_soom", 50e-6)?;
    code.generated(true).write(&folder)?;
    let fmu = code.fmu(Version::Three)?;
    output::write(&folder.join(&fmu.file), &fmu.bytes)?;
    output::write(&folder.join("hess_soom.a2l"), code.description(&Variables::default())?.text)?;
    println!("{}: see its README.md for usage.", folder.display());
    Ok(())
}
