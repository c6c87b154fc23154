//! A custom controller in Rust, in one file.
//!
//!     cargo run --release -p stickslip --example own_controller -- my_controller
//!
//! writes it as the library `my_controller/sliding_mode.so`, as C with its self-test, as FMU and as A2L. Load the
//! library on the bench with `stickslip load my_controller/sliding_mode.so`; its parameters are those of the table
//! below.

use std::path::PathBuf;

use stickslip::generate::{Variables, Version, module_of};
use stickslip::{Error, output};
use stickslip_core::Fields;
use stickslip_core::block::Block;
use stickslip_core::control::{ControllerInput, ControllerOutput};
use stickslip_core::scalar::Scalar;

/// Sliding mode with a boundary layer: a nearly switched torque keeps the axis on a line of velocity over deviation,
/// against any friction below its amplitude.
///
///   s = (ṙ − ω) + λ·(r − φ)
///   M = J·(r̈ + λ·(ṙ − ω)) + K·s/(|s| + ε) + I,   İ = K_i·s
///
/// J.-J. E. Slotine, W. Li: Applied Nonlinear Control, Prentice Hall 1991, chapter 7.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct SlidingMode<T> {
    /// Slope of the line: rate at which a deviation decays on it.
    #[field(symbol = "λ", unit = "1/s", range = 0.1..=1e3, default = 25.0)]
    pub(crate) slope: T,
    /// Amplitude of the switched torque, above the friction.
    #[field(symbol = "K", unit = "N m", range = 0.0..=100.0, default = 0.8)]
    pub(crate) amplitude: T,
    /// Distance from the line at which half of the amplitude acts: smaller is stiffer and noisier.
    #[field(symbol = "ε", unit = "rad/s", range = 1e-3..=100.0, default = 3.0)]
    pub(crate) layer: T,
    /// Torque per distance from the line and time.
    #[field(symbol = "K_i", unit = "N m/rad", range = 0.0..=1e3, default = 2.0)]
    pub(crate) integral_gain: T,
    /// Inertia whose torque is fed forward.
    #[field(symbol = "J", unit = "kg m^2", range = 0.0..=10.0, default = 1.0e-3)]
    pub(crate) inertia: T,
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m", range = 1e-6..=1e4, default = 1.4)]
    pub(crate) torque_limit: T,
}

/// Its state.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(crate) struct SlidingModeState<T> {
    /// Integral part of the torque.
    #[field(symbol = "I", unit = "N m")]
    pub(crate) integral: T,
}

impl<T: Scalar> Block<T> for SlidingMode<T> {
    type State = SlidingModeState<T>;
    type Input = ControllerInput<T>;
    type Output = ControllerOutput<T>;

    fn step(&self, state: &mut SlidingModeState<T>, input: ControllerInput<T>, dt: T) -> ControllerOutput<T> {
        let deviation = input.reference_position - input.measured_angle;
        let rate = input.reference_velocity - input.measured_velocity;
        let distance = rate + self.slope * deviation;
        let switched = self.amplitude * distance / (distance.abs() + self.layer);
        let ahead = self.inertia * (input.reference_acceleration + self.slope * rate);
        let limit = self.torque_limit;
        let torque = (ahead + switched + state.integral).clamp(T::of(0.0) - limit, limit);
        // The integral stays within the torque limit of the drive.
        state.integral = (state.integral + self.integral_gain * distance * dt).clamp(T::of(0.0) - limit, limit);
        ControllerOutput { torque }
    }
}

#[allow(dead_code, reason = "the test uses the controller alone")]
fn main() -> Result<(), Error> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "own-controller".into()));
    // A thousand samples a second in the self-test and the FMU; in the loop it runs at the rate of the bench.
    let module = module_of(&SlidingMode::<f64>::default(), "sliding_mode", 1e-3)?;
    module.generated(true).write(&folder)?;
    let library = folder.join(format!("sliding_mode{}", std::env::consts::DLL_SUFFIX));
    output::write(&library, module.library()?)?;
    let fmu = module.fmu(Version::Three)?;
    output::write(&folder.join(&fmu.file), &fmu.bytes)?;
    output::write(&folder.join("sliding_mode.a2l"), module.description(&Variables::default())?.text)?;
    println!("{}: load it with stickslip load {}", folder.display(), library.display());
    Ok(())
}
