//! Instruments, as the machine has them: resolution, range, bandwidth, noise, and faults to inject.
//!
//! Part of the virtual machine. The software side knows their data-sheet scaling
//! and nothing else.

mod analogue;
mod encoder;

pub use analogue::{
    Accelerometer, Converter, CurrentSensor, Fault, Pickups, PickupsInput, PickupsState, Stuck, Tacho, Voltages,
};
pub use encoder::{Encoder, EncoderFault, EncoderState, LostLines};
