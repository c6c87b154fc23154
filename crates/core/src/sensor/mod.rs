//! Instruments of the virtual machine: resolution, range, bandwidth, noise, and faults to inject.
//!
//! The software of the bench has only their data-sheet scaling.

mod analogue;
mod encoder;

pub use analogue::{
    Accelerometer, Converter, CurrentSensor, Fault, Pickups, PickupsInput, PickupsState, Stuck, Tacho, Voltages,
};
pub use encoder::{Encoder, EncoderFault, EncoderState, LostLines};
