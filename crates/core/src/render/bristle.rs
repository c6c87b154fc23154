//! Difference of two frictions with bristles at a predicted velocity.

use super::{LawInput, LawOutput, LawState};
use crate::Fields;
use crate::block::Block;
use crate::drive::nan_to_zero;
use crate::estimate::{DriveObserver, DriveObserverInput};
use crate::friction::{Contact, Friction, Memory};
use crate::scalar::Scalar;

/// Desired minus own friction, both with bristles and at the same velocity: that of an observer of the drive and its
/// friction, predicted to the time at which the torque acts.
///
/// ```text
/// M_diff = mean over the look-ahead of  M_desired(z_d, Ω) − M_own(z, Ω) − r
/// ```
///
/// Renders presliding and breakaway, without a fade-out and without a friction wheel. The rendered friction is as
/// accurate as the observer's model of the own friction; the error of this model can be estimated as a torque r
/// ([`DriveObserver`]).
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct BristleDifference<T> {
    /// Observer of the drive with its own friction.
    pub observer: DriveObserver<T>,
    /// Desired friction.
    pub desired: Friction<T>,
    /// Steps of the model from the tick in which the torque acts to the start and to the end of the averaged interval.
    #[field(fixed)]
    pub ahead: (usize, usize),
    /// Largest torque of the load motor.
    #[field(symbol = "M_max", unit = "N m", range = 0.0..=200.0, default = 1.4)]
    pub torque_limit: T,
}

/// One step of friction alone, with predictor and corrector: the mean torque [N m].
// Not inlined: it contains the code of all friction models.
#[inline(never)]
pub(super) fn slide<T: Scalar>(friction: &Friction<T>, memory: &mut Memory<T>, velocity: T, dt: T) -> T {
    let contact = Contact { velocity, ..Contact::default() };
    let (middle, _) = friction.predict(memory, contact, T::of(0.5) * dt);
    friction.correct(memory, middle, contact, dt)
}

impl<T: Scalar> LawInput<T> {
    /// Inputs of the observer.
    #[inline(always)]
    pub(super) fn observed(&self, state: &LawState<T>) -> DriveObserverInput<T> {
        DriveObserverInput {
            angle: self.angle,
            motor_velocity: self.motor_velocity,
            acceleration: self.acceleration,
            current: self.current,
            motor_torque: state.motor_torque,
            voltage: state.voltage,
            estimated_velocity: self.estimated_velocity,
        }
    }
}

impl<T: Scalar> Block<T> for BristleDifference<T> {
    type State = LawState<T>;
    type Input = LawInput<T>;
    type Output = LawOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut LawState<T>, input: LawInput<T>, dt: T) -> LawOutput<T> {
        let observed = input.observed(state);
        let mut memory = state.desired_memory;
        let desired = &self.desired;
        self.observer.follow(&mut state.observer, &observed, dt, |middle, h| {
            slide(desired, &mut memory, middle.velocity, h);
        });
        state.desired_memory = memory.without_nan();
        let (limit, observer) = (self.torque_limit, &state.observer);
        let drive = self.observer.after_pending_commands(observer, input.motor_torque, dt, |middle, h| {
            slide(desired, &mut memory, middle.velocity, h);
        });
        let from = (observer, drive);
        let mean = self.observer.look_ahead(from, input.motor_torque, self.ahead, dt, |middle, own, h| {
            (slide(desired, &mut memory, middle.velocity, h) - own).clamp(-limit, limit)
        });
        LawOutput { torque: nan_to_zero(mean), velocity: drive.velocity, current: drive.load_current }
    }
}
