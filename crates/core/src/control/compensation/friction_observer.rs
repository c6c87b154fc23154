//! Compensation of the friction that an observer of the drive estimates.

use super::{CompensationInput, CompensationOutput, bounded};
use crate::Fields;
use crate::block::Block;
use crate::control::{finite_or, measurable};
use crate::estimate::{DriveObserver, DriveObserverInput, DriveObserverState};
use crate::friction::{Contact, Friction, Memory};
use crate::scalar::{Mask, Scalar};

/// Time constants with which it takes the torque from the integral when the set-point starts to move, and returns it
/// when the set-point is constant [s].
const RISE: f64 = 0.01;
const RELEASE: f64 = 0.1;

/// The friction of an observed drive, bristles included, when the torque acts:
///
///   M_c = g·(M_R(z⁺, Ω⁺) + M_R,M(z_M⁺, Ω_M⁺)),   Ω⁺ = Ω̂ + T_p·r̈
///
/// The observer contains masses, coupling and friction model, corrected by encoder and tacho. Feedforward uses the
/// motion of the set-point, this the motion of the drive: it is correct at a late reversal. With g above 1, or friction
/// modelled that much too high, it overcompensates and the drive hunts: stay below the lowest plausible friction (D.
/// Putra, N. van de Wouw, H. Nijmeijer, Automatica 43 (2007) 1387). While the set-point is constant the controller's
/// integral holds the friction: the torque passes from one to the other, and the sum stays. C. Canudas de Wit, H.
/// Olsson, K. J. Åström, P. Lischinsky, IEEE TAC 40 (1995) 419.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionObserver<T> {
    /// Model of the drive, without a load motor, and its correction by measurements.
    pub observer: DriveObserver<T>,
    /// Preview from the next sample to the middle of the action of a torque computed now.
    #[field(symbol = "T_p", unit = "s", range = 0.0..=1.0, default = 0.8e-3)]
    pub preview: T,
    /// Compensated share of the friction.
    #[field(symbol = "g", unit = "1", range = 0.0..=2.0, default = 0.9)]
    pub share: T,
    /// Largest torque of the compensation.
    #[field(symbol = "M_c,max", unit = "N m", range = 0.0..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State of the friction observer.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionObserverState<T> {
    /// The drive at the next sample.
    pub observer: DriveObserverState<T>,
    /// Weight of the compensation: 1 while the set-point moves.
    #[field(unit = "1", range = 0.0..=1.0)]
    pub weight: T,
}

impl<T: Scalar> FrictionObserver<T> {
    /// Starts with the next measurement, and with the bristle deflection of a steady motion; returns its torque [N m].
    #[inline(always)]
    pub(super) fn begin(&self, state: &mut FrictionObserverState<T>, input: CompensationInput<T>) -> T {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        *state = FrictionObserverState::default();
        let velocity = input.reference.velocity;
        let moves = measurable(velocity) & velocity.abs().gt(zero);
        state.weight = moves.select(one, zero);
        let model = &self.observer.model;
        let bent =
            |friction: &Friction<T>| Memory::choose(moves, &friction.steady_memory(velocity), &Memory::default());
        state.observer = self.observer.begin(&self.observer_input(&input));
        state.observer.drive.load_memory = bent(&model.friction);
        state.observer.drive.motor_memory = bent(&model.motor_friction);
        state.observer.started = one;
        self.compensated(&state.observer, zero) * state.weight
    }

    /// Inputs of the observer.
    #[inline(always)]
    fn observer_input(&self, input: &CompensationInput<T>) -> DriveObserverInput<T> {
        DriveObserverInput {
            angle: input.measured_angle,
            motor_velocity: input.measured_velocity,
            motor_torque: input.pending_torque,
            estimated_velocity: input.measured_velocity,
            ..DriveObserverInput::default()
        }
    }

    /// The compensated share of both frictions [N m] if the velocity still rises by this [rad/s].
    #[inline(always)]
    fn compensated(&self, observed: &DriveObserverState<T>, gained: T) -> T {
        let (drive, model) = (&observed.drive, &self.observer.model);
        let load = model.drive.coupling_stiffness * drive.twist;
        let on_load = self.torque(&model.friction, &drive.load_memory, drive.velocity + gained, (drive.angle, load));
        let place = (drive.angle + drive.twist, drive.motor_torque);
        let on_motor = self.torque(&model.motor_friction, &drive.motor_memory, drive.motor_velocity + gained, place);
        bounded(self.share * (on_load + on_motor), self.torque_limit).torque
    }

    /// Torque of a friction [N m] with this state at the next sample, moving with this velocity [rad/s] until the
    /// torque acts.
    #[inline(always)]
    fn torque(&self, friction: &Friction<T>, memory: &Memory<T>, velocity: T, (angle, load): (T, T)) -> T {
        let contact = Contact { velocity, angle, load, arrest: T::of(0.0) };
        friction.correct(&mut { *memory }, memory.deflection, contact, self.preview)
    }
}

impl<T: Scalar> Block<T> for FrictionObserver<T> {
    type State = FrictionObserverState<T>;
    type Input = CompensationInput<T>;
    type Output = CompensationOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let moves = (input.reference.velocity.abs() + input.reference.acceleration.abs()).gt(zero);
        let before = state.weight;
        let time = moves.select(T::of(RISE), T::of(RELEASE));
        state.weight += dt / (time + dt) * (moves.select(one, zero) - state.weight);

        self.observer.follow(&mut state.observer, &self.observer_input(&input), dt, |_, _| {});
        let gained = self.preview * finite_or(input.reference.acceleration, zero);
        let whole = self.compensated(&state.observer, gained);
        CompensationOutput { torque: before * whole, taken: (state.weight - before) * whole }
    }
}
