//! Friction of several contacts on one mass, updated in the middle of a well-balanced step.
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
    /// Sum of all torques but friction, against positive motion.
    pub(crate) others: T,
}

/// A contact: its friction, a factor of its torque, and its state.
pub(crate) type Touching<'a, T> = (&'a Friction<T>, T, &'a mut Memory<T>);

/// Predictor for several contacts on one mass: half a step at the velocity of the start. Returns the velocity [rad/s]
/// and the deflections [rad] in the middle of the step.
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

/// Corrector: the whole step at the velocity of the middle, with α linearised about the deflections of the middle.
/// Updates the contacts; returns the new velocity [rad/s] and the new torque to hold [N m].
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
    /// After `dt` [s] under contacts with these factors and torques [N m]: the velocity [rad/s], and the torque to hold
    /// [N m].
    #[inline(always)]
    pub(crate) fn kicked<const N: usize>(&self, contacts: [(T, T); N], dt: T) -> (T, T) {
        let mut total = self.others;
        for (factor, torque) in contacts {
            total += factor * torque;
        }
        (self.velocity - (total - self.held) * dt / self.inertia, total)
    }

    /// Friction torque [N m] that would bring the mass to rest within `dt` [s]; each contact takes up its part and
    /// leaves the rest to the next one.
    #[inline(always)]
    fn arrest(&self, dt: T) -> T {
        self.held + self.velocity * self.inertia / dt - self.others
    }

    /// Inputs of a contact at a velocity of the mass; `factor` multiplies its torque.
    #[inline(always)]
    fn contact(&self, velocity: T, arrest: T, factor: T) -> Contact<T> {
        // With the factor 0 the contact has no torque; the lower limit only avoids a division by 0.
        Contact { velocity, angle: self.angle, load: self.load, arrest: arrest / factor.max(T::of(1e-12)) }
    }
}
