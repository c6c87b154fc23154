//! Friction of several contacts on one mass, renewed in the middle of a well-balanced step.
//!
//! The torque held in the previous flow is subtracted, so that only its change kicks the velocity.

use super::{Contact, Friction, FrictionInput, Memory};
use crate::block::Block as _;
use crate::scalar::Scalar;

/// A mass on which friction acts, in the middle of a step.
#[derive(Clone, Copy)]
pub(crate) struct Sliding<T> {
    pub(crate) inertia: T,
    pub(crate) velocity: T,
    pub(crate) angle: T,
    /// Torque that the contacts carry.
    pub(crate) load: T,
    /// Torque against positive motion that was held in the flow.
    pub(crate) held: T,
    /// Torque against positive motion from all torques but friction.
    pub(crate) others: T,
}

/// A contact: its friction, a factor of its torque, and what it remembers.
pub(crate) type Touching<'a, T> = (&'a Friction<T>, T, &'a mut Memory<T>);

/// Predictor of several contacts on one mass: half a step at the velocity of the start. The velocity of the middle [rad/s]
/// and the deflections there [rad].
#[inline(always)]
pub(crate) fn predict<T: Scalar, const N: usize>(
    mass: &Sliding<T>,
    contacts: &[Touching<'_, T>; N],
    dt: T,
) -> (T, [T; N]) {
    let half = T::of(0.5) * dt;
    let mut arrest = mass.arrest(half);
    let mut total = mass.others;
    let mut middle = [T::of(0.0); N];
    for i in 0..N {
        let (friction, factor, memory) = &contacts[i];
        let contact = mass.contact(mass.velocity, arrest, *factor);
        let (deflection, torque) = friction.predict(memory, contact, half);
        middle[i] = deflection;
        arrest -= *factor * torque;
        total += *factor * torque;
    }
    (mass.velocity - (total - mass.held) * half / mass.inertia, middle)
}

/// Corrector: the whole step at the velocity of the middle, α linear about the deflections of the middle. The contacts then
/// remember the end; returns the new velocity [rad/s] and the new torque to hold [N m].
#[inline(always)]
pub(crate) fn correct<T: Scalar, const N: usize>(
    mass: &Sliding<T>,
    (velocity, middle): (T, [T; N]),
    contacts: &mut [Touching<'_, T>; N],
    dt: T,
) -> (T, T) {
    let mut arrest = mass.arrest(dt);
    let mut total = mass.others;
    for i in 0..N {
        let (friction, factor, memory) = &mut contacts[i];
        let contact = mass.contact(velocity, arrest, *factor);
        let torque = friction.run(memory, FrictionInput { probe: middle[i], contact }, dt).torque;
        arrest -= *factor * torque;
        total += *factor * torque;
    }
    (mass.velocity - (total - mass.held) * dt / mass.inertia, total)
}

impl<T: Scalar> Sliding<T> {
    /// Friction that would bring the mass to rest within dt; each contact takes up what it can.
    #[inline(always)]
    fn arrest(&self, dt: T) -> T {
        self.held + self.velocity * self.inertia / dt - self.others
    }

    /// Inputs of a contact at a velocity of the mass; `factor` multiplies its torque.
    #[inline(always)]
    fn contact(&self, velocity: T, arrest: T, factor: T) -> Contact<T> {
        // A contact without load takes up nothing: its share of the arrest is divided by a factor that is not 0.
        Contact { velocity, angle: self.angle, load: self.load, arrest: arrest / factor.max(T::of(1e-12)) }
    }
}
