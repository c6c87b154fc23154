//! Elasto-plastic contacts side by side.
//!
//! A step of a contact is a long chain of dependent operations. Computed in one loop over arrays, which the compiler
//! turns into vector instructions, several contacts take little longer than one. Each has the bits that it has alone.

use super::bristle::{Bend, relax};
use super::dependence::{Condition, Direction, Rest, Temperature};
use super::{DampingVelocity, Decay, ElastoPlastic, Fading, Friction, LuGre, Model, Stribeck};
use crate::scalar::Scalar;

/// Number of contacts: one vector of usual processors.
pub(crate) const CONTACTS: usize = 4;

/// One number for each contact.
pub(crate) type Each<T> = [T; CONTACTS];

/// Parameters of the contacts.
#[derive(Clone, Copy)]
pub(crate) struct ContactVector<T> {
    breakaway: Each<T>,
    kinetic: Each<T>,
    stribeck_velocity: Each<T>,
    viscous: Each<T>,
    stiffness: Each<T>,
    damping: Each<T>,
    damping_velocity: Each<T>,
    elastic_fraction: Each<T>,
    asymmetry: Each<T>,
    viscous_asymmetry: Each<T>,
    offset: Each<T>,
    /// Form in which the damping fades: Gaussian or rational.
    gaussian: bool,
}

/// Inputs of the contacts in a step.
#[derive(Clone, Copy)]
pub(crate) struct Inputs<T> {
    /// Deflection at the start [rad].
    pub(crate) deflection: Each<T>,
    /// Velocity of the sliding surface, held over the step [rad/s].
    pub(crate) velocity: Each<T>,
    /// Factor by angle and load.
    pub(crate) factor: Each<T>,
}

impl<T: Scalar> ContactVector<T> {
    /// The contacts, if all of them are elasto-plastic, decay exponentially, fade in one form, and depend neither on the
    /// time at rest nor on the temperature.
    #[inline(always)]
    pub(crate) fn of(contacts: [&Friction<T>; CONTACTS]) -> Option<Self> {
        let models = [plastic(contacts[0])?, plastic(contacts[1])?, plastic(contacts[2])?, plastic(contacts[3])?];
        let gaussian = models.map(|model| matches!(model.lugre.fading, Fading::Gaussian(_)));
        if gaussian != [gaussian[0]; CONTACTS] {
            return None;
        }
        Some(ContactVector {
            breakaway: models.map(|model| model.lugre.sliding.breakaway_torque),
            kinetic: models.map(|model| model.lugre.sliding.kinetic_torque),
            stribeck_velocity: models.map(|model| model.lugre.sliding.stribeck_velocity),
            viscous: models.map(|model| model.lugre.sliding.viscous_friction),
            stiffness: models.map(|model| model.lugre.bristle_stiffness),
            damping: models.map(|model| model.lugre.bristle_damping),
            damping_velocity: models.map(|model| {
                let (Fading::Gaussian(fading) | Fading::Rational(fading)) = model.lugre.fading;
                fading.velocity
            }),
            elastic_fraction: models.map(|model| model.elastic_fraction),
            asymmetry: contacts.map(|contact| contact.direction.asymmetry),
            viscous_asymmetry: contacts.map(|contact| contact.direction.viscous_asymmetry),
            offset: contacts.map(|contact| contact.direction.offset),
            gaussian: gaussian[0],
        })
    }

    /// Deflections at the end [rad] and torques [N m] of a predictor; see [`Friction::predict`].
    #[inline(always)]
    pub(crate) fn predict(&self, inputs: &Inputs<T>, dt: T) -> (Each<T>, Each<T>) {
        if self.gaussian {
            self.step::<true, true>(inputs, &inputs.deflection, dt)
        } else {
            self.step::<true, false>(inputs, &inputs.deflection, dt)
        }
    }

    /// The same of a whole step, with the release linearised about `probe` [rad]; see [`Friction::correct`].
    #[inline(always)]
    pub(crate) fn correct(&self, inputs: &Inputs<T>, probe: &Each<T>, dt: T) -> (Each<T>, Each<T>) {
        if self.gaussian {
            self.step::<false, true>(inputs, probe, dt)
        } else {
            self.step::<false, false>(inputs, probe, dt)
        }
    }

    #[inline(always)]
    fn step<const PREDICTS: bool, const GAUSSIAN: bool>(
        &self,
        inputs: &Inputs<T>,
        probe: &Each<T>,
        dt: T,
    ) -> (Each<T>, Each<T>) {
        let (mut ends, mut torques) = (inputs.deflection, inputs.deflection);
        for i in 0..CONTACTS {
            let (start, velocity) = (inputs.deflection[i], inputs.velocity[i]);
            let bend = Bend { deflection: start, probe: probe[i], velocity, dt };
            let (end, torque) = relax::<T, PREDICTS>(&self.model::<GAUSSIAN>(i), bend, &Condition::reference());
            let direction = Direction {
                asymmetry: self.asymmetry[i],
                viscous_asymmetry: self.viscous_asymmetry[i],
                offset: self.offset[i],
            };
            let viscous = direction.viscous_factor(velocity) * self.viscous[i] * velocity;
            let torque = torque * direction.factor(T::of(0.5) * (start + end));
            ends[i] = end;
            torques[i] = inputs.factor[i] * (torque + viscous) + direction.offset;
        }
        (ends, torques)
    }

    #[inline(always)]
    fn model<const GAUSSIAN: bool>(&self, i: usize) -> ElastoPlastic<T> {
        let fading = DampingVelocity { velocity: self.damping_velocity[i] };
        let sliding = Stribeck {
            breakaway_torque: self.breakaway[i],
            kinetic_torque: self.kinetic[i],
            stribeck_velocity: self.stribeck_velocity[i],
            viscous_friction: self.viscous[i],
            decay: Decay::Exponential,
        };
        let lugre = LuGre {
            sliding,
            bristle_stiffness: self.stiffness[i],
            bristle_damping: self.damping[i],
            fading: if GAUSSIAN { Fading::Gaussian(fading) } else { Fading::Rational(fading) },
        };
        ElastoPlastic { lugre, elastic_fraction: self.elastic_fraction[i] }
    }
}

/// The elasto-plastic model of a contact that decays exponentially, without ageing and at the reference temperature.
#[inline(always)]
fn plastic<T: Scalar>(contact: &Friction<T>) -> Option<&ElastoPlastic<T>> {
    let (Rest::Constant, Temperature::Constant) = (&contact.rest, &contact.temperature) else { return None };
    match &contact.model {
        Model::ElastoPlastic(model) if matches!(model.lugre.sliding.decay, Decay::Exponential) => Some(model),
        _ => None,
    }
}
