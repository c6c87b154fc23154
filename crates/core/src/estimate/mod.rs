//! Estimation with the drive's model: what a load does between two counts of its encoder.
//!
//! [`DriveModel`] is the software's model of the drive, [`DriveObserver`] corrects it by encoder, tacho,
//! accelerometer and current. Presliding lies below a count of most encoders: what shows it is the model. Where no model
//! is trusted, [`VelocityObserver`](crate::control::VelocityObserver) needs none.

mod drive_model;
mod drive_observer;

pub use drive_model::{DriveModel, DriveModelInput, DriveModelOutput, DriveState};
pub use drive_observer::{
    AccelerationSensor, DriveObserver, DriveObserverInput, DriveObserverState, Estimate, ObserverGains,
};
