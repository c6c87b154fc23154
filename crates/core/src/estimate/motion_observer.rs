//! Motion of the drive: by encoder and accelerometer, or by encoder and a model of the drive.

use super::{DriveObserver, DriveObserverInput, DriveObserverState, DriveState, Estimate};
use crate::Fields;
use crate::block::Block;
use crate::control::{VelocityObserver, VelocityObserverInput, VelocityObserverOutput, VelocityObserverState};
use crate::fields::Fields as _;
use crate::scalar::{Mask, Scalar};

/// The observer of the bench.
///
/// With an accelerometer and a tacho no model of the drive is needed. Without them the drive's model, its friction and
/// the torques of both motors take their place: an error of this model is an error of the estimated velocity until the
/// encoder has corrected it.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum MotionObserver<T> {
    /// Encoder and accelerometer; the velocity of the motor is that of the tacho.
    Accelerometer(VelocityObserver<T>),
    /// Encoder and the model of the drive, without accelerometer and tacho.
    Model(DriveObserver<T>),
}

/// Estimates of the observer for the present tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct MotionEstimate<T> {
    /// The screw.
    pub screw: VelocityObserverOutput<T>,
    /// Velocity of the motor.
    #[field(symbol = "Ω_M", unit = "rad/s")]
    pub motor_velocity: T,
}

impl<T> MotionObserver<T> {
    /// Whether accelerometer and tacho are used.
    pub fn has_accelerometer(&self) -> bool {
        matches!(self, MotionObserver::Accelerometer(_))
    }
}

impl<T: Scalar> MotionObserver<T> {
    /// One tick. With the model, the state is that of the rendering law if the law follows the drive itself
    /// (`followed`): its prediction for this tick is the estimate.
    #[inline(always)]
    pub fn observe(
        &self,
        (velocity, drive): (&mut VelocityObserverState<T>, &mut DriveObserverState<T>),
        followed: bool,
        input: DriveObserverInput<T>,
        dt: T,
    ) -> MotionEstimate<T> {
        match self {
            MotionObserver::Accelerometer(observer) => {
                let seen = VelocityObserverInput { angle: input.angle, acceleration: input.acceleration };
                let screw = observer.run(velocity, seen, dt);
                MotionEstimate { screw, motor_velocity: input.motor_velocity }
            }
            MotionObserver::Model(observer) => by_model(observer, drive, followed, &input, dt),
        }
    }
}

impl<T: Scalar> MotionEstimate<T> {
    fn of(estimate: Estimate<T>, acceleration: T) -> Self {
        let Estimate { angle, velocity, motor_velocity } = estimate;
        let screw = VelocityObserverOutput { angle, velocity, acceleration_offset: T::of(0.0), acceleration };
        MotionEstimate { screw, motor_velocity }
    }
}

// Not inlined: it contains the code of all friction models, and many functions contain a tick.
#[inline(never)]
fn by_model<T: Scalar>(
    observer: &DriveObserver<T>,
    state: &mut DriveObserverState<T>,
    followed: bool,
    input: &DriveObserverInput<T>,
    dt: T,
) -> MotionEstimate<T> {
    if followed {
        let known = state.started.gt(T::of(0.5));
        let start = observer.begin(input);
        let DriveState { angle, velocity, motor_velocity, .. } =
            state.merge(&start, &mut |running, fresh| known.select(running, fresh)).drive;
        let acceleration = observer.model.acceleration(&state.drive);
        return MotionEstimate::of(Estimate { angle, velocity, motor_velocity }, acceleration);
    }
    let mut acceleration = T::of(0.0);
    let estimate = observer.follow(state, input, dt, |middle, _| acceleration = middle.acceleration);
    MotionEstimate::of(estimate, acceleration)
}
