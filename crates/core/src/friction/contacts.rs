//! Friction of several contacts on one mass, renewed in the middle of a well-balanced step.
//!
//! What was held of it in the flow before is taken off, so that only its change kicks the velocity.

use super::{Contact, Friction, FrictionInput};
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
    /// Torque against positive motion from all that is no friction.
    pub(crate) others: T,
}

/// Predictor of several contacts on one mass: half a step at the velocity of the start. Leaves the deflections of the
/// middle in `contacts`, returns the velocity of the middle [rad/s]. A contact is its friction, a factor of its torque,
/// and its deflection.
#[inline(always)]
pub(crate) fn predict<T: Scalar, const N: usize>(
    mass: &Sliding<T>,
    contacts: &mut [(&Friction<T>, T, T); N],
    dt: T,
) -> T {
    let start = deflections(contacts);
    let half = T::of(0.5) * dt;
    let (middle, torque) = pass::<T, true, N>(mass, mass.velocity, contacts, start, start, half);
    for i in 0..N {
        contacts[i].2 = middle[i];
    }
    mass.velocity - (torque - mass.held) * half / mass.inertia
}

/// Corrector: the whole step at the velocity of the middle, α linear about the deflections of the middle. Leaves the deflections
/// of the end in `contacts`, returns the new velocity [rad/s] and the new torque to hold [N m].
#[inline(always)]
pub(crate) fn correct<T: Scalar, const N: usize>(
    mass: &Sliding<T>,
    middle: T,
    start: [T; N],
    contacts: &mut [(&Friction<T>, T, T); N],
    dt: T,
) -> (T, T) {
    let probe = deflections(contacts);
    let (ends, torque) = pass::<T, false, N>(mass, middle, contacts, start, probe, dt);
    for i in 0..N {
        contacts[i].2 = ends[i];
    }
    (mass.velocity - (torque - mass.held) * dt / mass.inertia, torque)
}

/// Not `array::map`, which stays a call where a number is wide.
#[inline(always)]
pub(crate) fn deflections<T: Scalar, const N: usize>(contacts: &[(&Friction<T>, T, T); N]) -> [T; N] {
    let mut out = [T::of(0.0); N];
    for i in 0..N {
        out[i] = contacts[i].2;
    }
    out
}

/// One evaluation of all contacts over `dt`: the new deflections and the torque.
#[inline(always)]
fn pass<T: Scalar, const PREDICTS: bool, const N: usize>(
    mass: &Sliding<T>,
    velocity: T,
    contacts: &[(&Friction<T>, T, T); N],
    start: [T; N],
    probe: [T; N],
    dt: T,
) -> ([T; N], T) {
    // Friction that would bring the mass to rest within dt; each contact takes up what it can.
    let mut arrest = mass.held + mass.velocity * mass.inertia / dt - mass.others;
    let mut total = mass.others;
    let mut ends = start;
    for i in 0..N {
        let (friction, factor, _) = contacts[i];
        // A contact without load takes up nothing: its share of the arrest is divided by a factor that is not 0.
        let share = arrest / factor.max(T::of(1e-12));
        let contact = Contact { velocity, angle: mass.angle, load: mass.load, arrest: share };
        let (end, torque) = if PREDICTS {
            friction.predict(start[i], contact, dt)
        } else {
            let end = friction.run(&mut (), FrictionInput { deflection: start[i], probe: probe[i], contact }, dt);
            (end.deflection, end.torque)
        };
        ends[i] = end;
        arrest -= factor * torque;
        total += factor * torque;
    }
    (ends, total)
}
