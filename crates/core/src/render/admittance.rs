//! Admittance: the load follows a virtual load with the desired friction.

use super::bristle::slide;
use super::{LawInput, LawOutput, LawState};
use crate::Fields;
use crate::block::Block;
use crate::drive::nan_to_zero;
use crate::estimate::DriveObserver;
use crate::friction::{Friction, Memory};
use crate::scalar::{Mask, Scalar};

/// Load-side admittance: the estimated torque of the coupling drives a virtual load with the desired friction, and the
/// load motor makes the load follow it.
///
/// ```text
/// J_L·Ω̇_v = M_C − M_desired(z_d, Ω_v)
/// M_diff  = M_desired(z_d, Ω_v) − M_own(z, Ω) − r − J_L·[ω_t²·(φ_v − φ) + 2·ω_t·(Ω_v − Ω)]
/// ```
///
/// Stiff desired bristles are in the virtual load alone, so that they do not limit the loop. Errors of K_t and J_L are
/// compensated as if they were friction: calibrate first.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Admittance<T> {
    /// Observer of the drive with its own friction.
    pub observer: DriveObserver<T>,
    /// Desired friction.
    pub desired: Friction<T>,
    /// Bandwidth with which the load follows the virtual load, critically damped.
    #[field(symbol = "ω_t", unit = "rad/s", range = 1.0..=1000.0, default = 150.0)]
    pub bandwidth: T,
    /// Steps of the model from the tick in which the torque acts to the start and to the end of the averaged interval.
    #[field(fixed)]
    pub ahead: (usize, usize),
    /// Largest torque of the load motor.
    #[field(symbol = "M_max", unit = "N m", range = 0.0..=200.0, default = 1.4)]
    pub torque_limit: T,
}

/// The virtual load.
#[derive(Clone, Copy)]
struct Virtual<T> {
    velocity: T,
    lead: T,
    memory: Memory<T>,
    resistance: T,
}

impl<T: Scalar> Admittance<T> {
    /// One step of the virtual load under the coupling's torque [N m], while the load has this velocity [rad/s]; well
    /// balanced, as the step of the drive.
    #[inline(always)]
    fn advance(&self, load: &mut Virtual<T>, coupling: T, velocity: T, dt: T) {
        let per_inertia = T::of(1.0) / self.observer.model.drive.load_inertia;
        let half = T::of(0.5) * dt;
        let push = (coupling - load.resistance) * per_inertia;
        let start = load.velocity;
        let flown = start + push * half;
        let torque = slide(&self.desired, &mut { load.memory }, flown, half);
        let middle = flown - (torque - load.resistance) * half * per_inertia;
        let torque = slide(&self.desired, &mut load.memory, middle, dt);
        load.velocity = flown - (torque - load.resistance) * dt * per_inertia + push * half;
        load.resistance = torque;
        load.lead += dt * (T::of(0.5) * (start + load.velocity) - velocity);
    }

    #[inline(always)]
    fn torque(&self, load: &Virtual<T>, own: T, velocity: T) -> T {
        let stiffness = self.bandwidth * self.bandwidth;
        let behind = stiffness * load.lead + T::of(2.0) * self.bandwidth * (load.velocity - velocity);
        load.resistance - own - self.observer.model.drive.load_inertia * behind
    }
}

impl<T: Scalar> Block<T> for Admittance<T> {
    type State = LawState<T>;
    type Input = LawInput<T>;
    type Output = LawOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut LawState<T>, input: LawInput<T>, dt: T) -> LawOutput<T> {
        let observed = input.observed(state);
        // The virtual load starts with the load when the observer starts.
        let known = state.observer.started.gt(T::of(0.5));
        let before = known.select(state.observer.drive.angle, input.angle);
        let mut load = Virtual {
            velocity: known.select(state.virtual_velocity, input.estimated_velocity),
            lead: known.select(state.virtual_lead, T::of(0.0)),
            memory: state.desired_memory,
            resistance: state.virtual_resistance,
        };
        let estimate = self.observer.follow(&mut state.observer, &observed, dt, |middle, h| {
            self.advance(&mut load, middle.coupling_torque, middle.velocity, h);
        });
        // A correction of the angle moves the load, not the virtual load.
        load.lead += before - estimate.angle;
        state.virtual_velocity = nan_to_zero(load.velocity);
        state.virtual_lead = nan_to_zero(load.lead);
        state.desired_memory = load.memory.without_nan();
        state.virtual_resistance = nan_to_zero(load.resistance);
        let (limit, observer) = (self.torque_limit, &state.observer);
        let drive = self.observer.after_pending_commands(observer, input.motor_torque, dt, |middle, h| {
            self.advance(&mut load, middle.coupling_torque, middle.velocity, h);
        });
        let from = (observer, drive);
        let mean = self.observer.look_ahead(from, input.motor_torque, self.ahead, dt, |middle, own, h| {
            self.advance(&mut load, middle.coupling_torque, middle.velocity, h);
            self.torque(&load, own, middle.velocity).clamp(-limit, limit)
        });
        LawOutput { torque: nan_to_zero(mean), velocity: drive.velocity, current: drive.load_current }
    }
}
