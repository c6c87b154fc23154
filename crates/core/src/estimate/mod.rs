//! Estimation with a model of the drive: motion of the load between two counts of its encoder.
//!
//! [`DriveModel`] is the software's model of the drive, [`DriveObserver`] corrects it by encoder, tacho,
//! accelerometer and current. Presliding is smaller than one count of most encoders, so that only the model shows it.
//! Without a reliable model use [`VelocityObserver`](crate::control::VelocityObserver), which needs none.
//! [`MotionObserver`] is one of the two.

mod drive_model;
mod drive_observer;
mod motion_observer;

pub use drive_model::{DriveModel, DriveModelInput, DriveModelOutput, DriveState};
pub use drive_observer::{
    AccelerationSensor, DriveObserver, DriveObserverInput, DriveObserverState, Estimate, ObserverGains,
};
pub use motion_observer::{MotionEstimate, MotionObserver};
