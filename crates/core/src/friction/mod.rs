//! Friction: a model, multiplied by factors for its dependences.
//!
//! | model | presliding | Stribeck | small loops close | holds a constant load | holds a vibrating load |
//! |---|---|---|---|---|---|
//! | [`Static`] | no | yes | | exactly | exactly |
//! | [`Dahl`] | yes | no | no | exactly | drifts |
//! | [`LuGre`] | yes | yes | no | exactly | drifts |
//! | [`ElastoPlastic`] | yes | yes | no | exactly | within the elastic zone exactly |
//! | [`MaxwellSlip`] | yes | yes, with a lag | yes | exactly | exactly, after the first swings |
//!
//! "Exactly" holds within the well-balanced step of [`plant`](crate::plant), the only integrator used here. Direction,
//! position, load and temperature multiply the torque of any model, both its damping and its stiffness: the breakaway
//! deflection is unchanged, there is no division by zero, and a passive model stays passive. Exception: a load that
//! changes while the bristles are bent does work on them, in proportion to their stored energy. The time at rest
//! multiplies the holding torque of any model but not its stiffness, because it changes while the bristles are bent.

mod bristle;
mod bristles;
pub(crate) mod contact_vector;
pub(crate) mod contacts;
mod dependence;
mod element;
mod maxwell_slip;
mod memory;
mod stribeck;
#[cfg(test)]
mod tests;

use bristle::relax;
pub use bristle::{
    Bend, Bristle, Dahl, DampingVelocity, ElastoPlastic, Fading, LuGre, Release, advance, predict, rate,
};
pub use bristles::Bristles;
use dependence::{Condition, factor};
pub use dependence::{Direction, Load, Position, Rest, Ripple, Rising, Temperature, Warming};
pub use element::{FrictionElement, FrictionElementOutput, FrictionElementState};
pub use maxwell_slip::MaxwellSlip;
use maxwell_slip::Slip;
pub use memory::{ELEMENTS, Memory};
pub use stribeck::{Decay, Exponent, FrictionTorque, Speed, Static, Stribeck};

use crate::Fields;
use crate::block::Block;
use crate::scalar::Scalar;

/// Friction of one contact: screw, friction wheel or motor brushes. A step is the exponential step of its bristles,
/// with the velocity held.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Friction<T> {
    /// The model.
    pub model: Model<T>,
    /// Difference between the two directions.
    pub direction: Direction<T>,
    /// Dependence on the angle of the screw.
    pub position: Position<T>,
    /// Dependence on the torque that the contact carries.
    pub load: Load<T>,
    /// Dependence on the time at rest.
    pub rest: Rest<T>,
    /// Dependence on the temperature.
    pub temperature: Temperature<T>,
}

/// The friction model.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Model<T> {
    /// No friction.
    Nothing,
    /// Coulomb, viscous and Stribeck friction with true stick.
    Static(Static<T>),
    /// Dahl's model.
    Dahl(Dahl<T>),
    /// The LuGre model.
    Lugre(LuGre<T>),
    /// The elasto-plastic model.
    ElastoPlastic(ElastoPlastic<T>),
    /// Generalised Maxwell slip.
    MaxwellSlip(MaxwellSlip<T>),
}

/// Inputs of the contact in a step.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Contact<T> {
    /// Velocity of the sliding surface, held over the step.
    #[field(symbol = "Ω", unit = "rad/s")]
    pub velocity: T,
    /// Angle of the screw.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Torque that the contact carries, for load-dependent friction.
    #[field(symbol = "M_C", unit = "N m")]
    pub load: T,
    /// Torque that would bring the load to rest within the step.
    #[field(symbol = "M_a", unit = "N m")]
    pub arrest: T,
}

/// Inputs of a step of friction, besides the state of the contact.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionInput<T> {
    /// Deflection about which the release is linearised: that in the middle of the step.
    #[field(symbol = "z_m", unit = "rad")]
    pub probe: T,
    /// Inputs of the contact.
    pub contact: Contact<T>,
}

/// Result of a step of friction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionOutput<T> {
    /// Mean torque of the step, against positive motion.
    #[field(symbol = "M_R", unit = "N m")]
    pub torque: T,
}

impl<T: Scalar> Bend<T> {
    /// See [`Scalar::barrier`].
    #[inline(always)]
    fn barrier(self) -> Self {
        Bend { velocity: self.velocity.barrier(), ..self }
    }
}

/// A step of elasto-plastic bristles, as a function call where calls are cheap: the code is short, and the processor
/// overlaps the steps of several contacts.
#[inline(always)]
fn relax_apart<T: Scalar, const PREDICTS: bool, const AGES: bool>(
    model: &ElastoPlastic<T>,
    bend: Bend<T>,
    condition: &Condition<T>,
) -> (T, T) {
    #[inline(never)]
    fn called<T: Scalar, const PREDICTS: bool, const AGES: bool>(
        model: &ElastoPlastic<T>,
        bend: Bend<T>,
        condition: &Condition<T>,
    ) -> (T, T) {
        // Repeated here, so that the compiler knows that the factors are 1.
        let reference = Condition::reference();
        relax::<T, PREDICTS>(model, bend, if AGES { condition } else { &reference })
    }
    if T::CALLS_ARE_CHEAP {
        called::<T, PREDICTS, AGES>(model, bend, condition)
    } else {
        relax::<T, PREDICTS>(model, bend, condition)
    }
}

impl<T: Scalar> Friction<T> {
    /// Viscous constant of the model [N m s/rad].
    #[inline(always)]
    pub(crate) fn viscous(&self) -> T {
        match self.model {
            Model::Nothing => T::of(0.0),
            Model::Static(model) => model.sliding.viscous_friction,
            Model::Dahl(model) => model.viscous_friction,
            Model::Lugre(model) => model.sliding.viscous_friction,
            Model::ElastoPlastic(model) => model.lugre.sliding.viscous_friction,
            Model::MaxwellSlip(model) => model.sliding.viscous_friction,
        }
    }

    /// Sliding level of the model [N m] at a speed [rad/s].
    #[inline(always)]
    fn level(&self, speed: T) -> T {
        match self.model {
            Model::Nothing => T::of(0.0),
            Model::Static(model) => model.sliding.level(speed),
            Model::Dahl(model) => model.kinetic_torque,
            Model::Lugre(model) => model.sliding.level(speed),
            Model::ElastoPlastic(model) => model.lugre.sliding.level(speed),
            Model::MaxwellSlip(model) => model.sliding.level(speed),
        }
    }

    /// Friction torque [N m] in steady sliding at a velocity [rad/s], an angle [rad] and a load [N m], as a measurement
    /// at constant speed shows it; the offset at rest.
    pub fn steady_torque(&self, velocity: T, angle: T, load: T) -> T {
        let speed = velocity.abs();
        let (warmth, thinning) = self.temperature.factors();
        let level = self.level(speed) * self.rest.strength(self.rest.steady_age(speed));
        let contact = Contact { velocity, angle, load, arrest: T::of(0.0) };
        let sliding = velocity.sign() * self.direction.factor(velocity) * level;
        let viscous = self.direction.viscous_factor(velocity) * self.viscous() * velocity * thinning;
        factor(&self.position, &self.load, &contact) * warmth * (sliding + viscous) + self.direction.offset
    }

    /// State of a contact after long sliding at a constant velocity [rad/s].
    #[inline(always)]
    pub fn steady_memory(&self, velocity: T) -> Memory<T> {
        let age = self.rest.steady_age(velocity.abs());
        let strength = self.rest.strength(age);
        let stiffness = match self.model {
            Model::Nothing | Model::Static(_) => return Memory { age, ..Memory::default() },
            Model::Dahl(model) => model.bristle_stiffness,
            Model::Lugre(model) => model.bristle_stiffness,
            Model::ElastoPlastic(model) => model.lugre.bristle_stiffness,
            Model::MaxwellSlip(model) => return Memory { age, ..model.steady(velocity, strength) },
        };
        let deflection = velocity.sign() * self.level(velocity.abs()) / stiffness * strength;
        Memory { deflection, age, ..Memory::default() }
    }

    /// A step of bristles with the factor of their direction: by the sign of the deflection, not of the velocity, so
    /// that the torque has no jump at a reversal.
    #[inline(always)]
    fn sided(&self, start: T, (next, torque): (T, T)) -> (T, T) {
        (next, torque * self.direction.factor(T::of(0.5) * (start + next)))
    }

    /// One step with the velocity held: the mean torque against positive motion [N m].
    ///
    /// `probe` [rad] is the deflection about which the release is linearised: that in the middle of the step.
    #[inline(always)]
    pub fn correct(&self, memory: &mut Memory<T>, probe: T, contact: Contact<T>, dt: T) -> T {
        if T::CALLS_ARE_CHEAP && self.is_plain() {
            let bend = Bend { deflection: memory.deflection, probe, velocity: contact.velocity, dt };
            let (end, torque) = self.bend::<false, false>(&Condition::reference(), bend, &contact);
            memory.deflection = end;
            return torque;
        }
        let (end, torque) = self.step_apart::<false>(*memory, probe, contact, dt);
        *memory = end;
        torque
    }

    /// As [`correct`](Self::correct), but of first order and from the start alone, for a predictor. Returns the
    /// deflection at the end [rad] and the torque [N m].
    #[inline(always)]
    pub fn predict(&self, memory: &Memory<T>, contact: Contact<T>, dt: T) -> (T, T) {
        let probe = memory.deflection;
        if T::CALLS_ARE_CHEAP && self.is_plain() {
            let bend = Bend { deflection: probe, probe, velocity: contact.velocity, dt };
            return self.bend::<true, false>(&Condition::reference(), bend, &contact);
        }
        let (end, torque) = self.step_apart::<true>(*memory, probe, contact, dt);
        (end.deflection, torque)
    }

    /// Whether the state of the contact is a single deflection.
    #[inline(always)]
    pub(crate) fn is_plain(&self) -> bool {
        matches!((&self.rest, &self.temperature), (Rest::Constant, Temperature::Constant))
            && !matches!(self.model, Model::MaxwellSlip(_))
    }

    /// Rate of the deflection at a velocity [rad/s]; 0 without a deflection. For plain contacts.
    #[inline(always)]
    pub(crate) fn bending_rate(&self, memory: &Memory<T>, velocity: T) -> T {
        match &self.model {
            Model::Nothing | Model::Static(_) | Model::MaxwellSlip(_) => T::of(0.0),
            Model::Dahl(model) => rate(model, memory.deflection, velocity).0,
            Model::Lugre(model) => rate(model, memory.deflection, velocity).0,
            Model::ElastoPlastic(model) => rate(model, memory.deflection, velocity).0,
        }
    }

    /// A step of any contact, as a function call where calls are cheap, so that the code of plain contacts does not
    /// contain that of the others.
    #[inline(always)]
    fn step_apart<const PREDICTS: bool>(
        &self,
        memory: Memory<T>,
        probe: T,
        contact: Contact<T>,
        dt: T,
    ) -> (Memory<T>, T) {
        #[inline(never)]
        fn called<T: Scalar, const PREDICTS: bool>(
            friction: &Friction<T>,
            memory: Memory<T>,
            probe: T,
            contact: Contact<T>,
            dt: T,
        ) -> (Memory<T>, T) {
            friction.any::<PREDICTS>(memory, probe, contact, dt)
        }
        if T::CALLS_ARE_CHEAP {
            called::<T, PREDICTS>(self, memory, probe, contact, dt)
        } else {
            self.any::<PREDICTS>(memory, probe, contact, dt)
        }
    }

    /// A step of any contact.
    #[inline(always)]
    fn any<const PREDICTS: bool>(&self, memory: Memory<T>, probe: T, contact: Contact<T>, dt: T) -> (Memory<T>, T) {
        let condition = Condition::of(&self.rest, &self.temperature, memory.age);
        let velocity = contact.velocity;
        let (mut end, torque) = if let Model::MaxwellSlip(model) = &self.model {
            let slip = Slip { velocity, strength: condition.strength, dt };
            let (end, torque) = model.step::<PREDICTS>(memory, &self.direction, slip);
            let (factor, viscous) = self.around(&condition, &contact);
            (end, factor * (torque + viscous) + self.direction.offset)
        } else {
            let bend = Bend { deflection: memory.deflection, probe, velocity, dt };
            let (deflection, torque) = self.bend::<PREDICTS, true>(&condition, bend, &contact);
            (Memory { deflection, ..memory }, torque)
        };
        if !PREDICTS {
            // The part of the motion that does not bend the bristles is sliding.
            let slid = velocity * dt - (end.deflection - memory.deflection);
            end.age = self.rest.after(memory.age, slid, dt);
        }
        (end, torque)
    }

    /// Factor of the torque at an angle of the screw [rad] and a load of the contact [N m], without the temperature.
    #[inline(always)]
    pub(crate) fn factor(&self, angle: T, load: T) -> T {
        factor(&self.position, &self.load, &Contact { velocity: T::of(0.0), angle, load, arrest: T::of(0.0) })
    }

    /// Common parts of all models: the factor, and the viscous torque [N m].
    #[inline(always)]
    fn around(&self, condition: &Condition<T>, contact: &Contact<T>) -> (T, T) {
        let velocity = contact.velocity;
        let viscous = self.direction.viscous_factor(velocity) * self.viscous() * velocity * condition.thinning;
        (factor(&self.position, &self.load, contact) * condition.warmth, viscous)
    }

    /// A step of a contact whose state is one deflection: that at the end [rad], and the torque [N m].
    #[inline(always)]
    fn bend<const PREDICTS: bool, const AGES: bool>(
        &self,
        condition: &Condition<T>,
        bend: Bend<T>,
        contact: &Contact<T>,
    ) -> (T, T) {
        let start = bend.deflection;
        let (factor, viscous) = self.around(condition, contact);
        let (end, torque) = match &self.model {
            Model::Nothing | Model::MaxwellSlip(_) => (start, T::of(0.0)),
            Model::Static(model) => {
                // Arresting torque that is left for the sliding law, in the scale of this law.
                let arrest = (contact.arrest - self.direction.offset) / factor - viscous;
                let side = self.direction.factor(arrest) * condition.strength;
                (start, side * model.torque(contact.velocity, arrest / side))
            }
            Model::Dahl(model) => self.sided(start, relax::<T, PREDICTS>(model, bend.barrier(), condition)),
            Model::Lugre(model) => self.sided(start, relax::<T, PREDICTS>(model, bend.barrier(), condition)),
            Model::ElastoPlastic(model) => self.sided(start, relax_apart::<T, PREDICTS, AGES>(model, bend, condition)),
        };
        (end, factor * (torque + viscous) + self.direction.offset)
    }
}

impl<T: Scalar> Block<T> for Friction<T> {
    type State = Memory<T>;
    type Input = FrictionInput<T>;
    type Output = FrictionOutput<T>;

    /// One step with the velocity held.
    #[inline(always)]
    fn step(&self, memory: &mut Memory<T>, input: FrictionInput<T>, dt: T) -> FrictionOutput<T> {
        FrictionOutput { torque: self.correct(memory, input.probe, input.contact, dt) }
    }
}

impl Friction<f64> {
    /// Stiffness and damping at rest [N m/rad, N m s/rad], which bound the step of an integrator: bristles and viscous
    /// friction, with the largest factors of direction and position and with that of the temperature. The caller
    /// applies the factor of the load.
    pub fn stiffest(&self) -> (f64, f64) {
        let (stiffness, damping) = match self.model {
            Model::Nothing | Model::Static(_) => (0.0, 0.0),
            Model::Dahl(model) => (model.bristle_stiffness, 0.0),
            Model::Lugre(model) => (model.bristle_stiffness, model.bristle_damping),
            Model::ElastoPlastic(model) => (model.lugre.bristle_stiffness, model.lugre.bristle_damping),
            Model::MaxwellSlip(model) => (model.stiffness(), 0.0),
        };
        let ripple = if let Position::Ripple(ripple) = self.position { ripple.amplitude } else { 0.0 };
        let (warmth, thinning) = self.temperature.factors();
        let factor = (1.0 + ripple) * warmth;
        let side = 1.0 + self.direction.asymmetry.abs();
        let viscous = (1.0 + self.direction.viscous_asymmetry.abs()) * self.viscous() * thinning;
        (factor * side * stiffness, factor * (side * damping + viscous))
    }
}
