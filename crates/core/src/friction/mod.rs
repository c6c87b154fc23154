//! Friction: one composable form, a model times what it depends on.
//!
//! | model | presliding | Stribeck | holds a constant load | holds a vibrating load |
//! |---|---|---|---|---|
//! | [`Static`] | no | yes | exactly | exactly |
//! | [`Dahl`] | yes | no | exactly | drifts |
//! | [`LuGre`] | yes | yes | exactly | drifts |
//! | [`ElastoPlastic`] | yes | yes | exactly | within the elastic zone exactly |
//!
//! "Exactly" holds within the well-balanced step of [`plant`](crate::plant), the only integrator used here. Direction,
//! position and load multiply the torque of any model, its damping and its stiffness together, so that the breakaway
//! twist stays, nothing is divided by zero, and a passive model stays passive; only a load that changes while the
//! bristles are bent does work on them, in proportion to the energy that they store.

mod bristle;
mod bristles;
pub(crate) mod contacts;
mod element;
mod stribeck;
#[cfg(test)]
mod tests;

use core::f64::consts::TAU;

use bristle::relax;
pub use bristle::{
    Bend, Bristle, Dahl, DampingVelocity, ElastoPlastic, Fading, LuGre, Release, advance, predict, rate,
};
pub use bristles::Bristles;
pub use element::{FrictionElement, FrictionElementOutput, FrictionElementState};
pub use stribeck::{Decay, Exponent, FrictionTorque, Speed, Static, Stribeck};

use crate::Fields;
use crate::block::Block;
use crate::scalar::Scalar;

/// The friction of one place: screw, friction wheel, motor brushes. A step is the exponential one of its bristles, with
/// the velocity held over it.
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
}

/// Difference between the two directions. All zero: none.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Direction<T> {
    /// Friction is greater by this share when it acts against positive motion, smaller by it when against negative.
    #[field(symbol = "ε_C", unit = "1", range = -0.95..=0.95)]
    pub asymmetry: T,
    /// The same for the viscous part.
    #[field(symbol = "ε_b", unit = "1", range = -0.95..=0.95)]
    pub viscous_asymmetry: T,
    /// A constant torque against positive motion: weight, or the offset of an amplifier.
    #[field(symbol = "M_0", unit = "N m", range = -200.0..=200.0)]
    pub offset: T,
}

/// Dependence on the angle of the screw.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "shape")]
pub enum Position<T> {
    /// None.
    Constant,
    /// A ripple at the pitch of the screw.
    Ripple(Ripple<T>),
}

/// 1 + r·sin(n·φ + φ_0).
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Ripple<T> {
    /// Amplitude, as a share of the friction.
    #[field(symbol = "r", unit = "1", range = 0.0..=0.9, default = 0.05)]
    pub amplitude: T,
    /// Periods in a revolution of the screw.
    #[field(symbol = "n", unit = "1", range = 1.0..=1000.0, default = 1.0, whole)]
    pub periods: T,
    /// Phase at angle 0.
    #[field(symbol = "φ_0", unit = "rad", range = -7.0..=7.0)]
    pub phase: T,
}

/// Dependence on the torque that the contact carries: 1 + k·|M_C|.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Load<T> {
    /// Share by which friction rises per torque carried.
    #[field(symbol = "k", unit = "1/(N m)", range = 0.0..=100.0)]
    pub sensitivity: T,
}

/// What the contact sees in a step.
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

/// What a step of friction begins with. The bristles are no state of its own: an integrator asks for the same step
/// from several places.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionInput<T> {
    /// Deflection of the bristles at the begin.
    #[field(symbol = "z", unit = "rad")]
    pub deflection: T,
    /// Deflection about which the release is linear: that of the step's middle.
    #[field(symbol = "z_m", unit = "rad")]
    pub probe: T,
    /// What the contact sees.
    pub contact: Contact<T>,
}

/// What a step of friction ends with.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionOutput<T> {
    /// Deflection of the bristles at the end.
    #[field(symbol = "z⁺", unit = "rad")]
    pub deflection: T,
    /// Mean torque of the step, against positive motion.
    #[field(symbol = "M_R", unit = "N m")]
    pub torque: T,
}

impl<T: Scalar> Bend<T> {
    /// See [`Scalar::apart`].
    #[inline(always)]
    fn apart(self) -> Self {
        Bend { velocity: self.velocity.apart(), ..self }
    }
}

/// A step of elasto-plastic bristles, as a call where calls are cheap: short code, of which several contacts overlap in
/// the processor.
#[inline(always)]
fn relax_apart<T: Scalar, const PREDICTS: bool>(model: &ElastoPlastic<T>, bend: Bend<T>) -> (T, T) {
    #[inline(never)]
    fn called<T: Scalar, const PREDICTS: bool>(model: &ElastoPlastic<T>, bend: Bend<T>) -> (T, T) {
        relax::<T, PREDICTS>(model, bend)
    }
    if T::CALLS_ARE_CHEAP { called::<T, PREDICTS>(model, bend) } else { relax::<T, PREDICTS>(model, bend) }
}

impl<T: Scalar> Direction<T> {
    /// Factor of the friction that acts with this sign.
    #[inline(always)]
    fn factor(&self, signed: T) -> T {
        T::of(1.0) + signed.sign() * self.asymmetry
    }

    /// Factor of the viscous friction at a velocity.
    #[inline(always)]
    fn viscous_factor(&self, velocity: T) -> T {
        T::of(1.0) + velocity.sign() * self.viscous_asymmetry
    }
}

impl<T: Scalar> Friction<T> {
    /// Factor from position and load.
    #[inline(always)]
    fn factor(&self, contact: &Contact<T>) -> T {
        let one = T::of(1.0);
        let load = one + self.load.sensitivity * contact.load.abs();
        match self.position {
            Position::Constant => load,
            Position::Ripple(ripple) => {
                // Whole turns are taken off first, so that the sine stays exact far from angle 0.
                let turns = contact.angle * T::of(1.0 / TAU);
                let within = (turns - turns.floor()) * T::of(TAU);
                load * (one + ripple.amplitude * (ripple.periods * within + ripple.phase).sin())
            }
        }
    }

    /// Viscous constant of the model [N m s/rad].
    #[inline(always)]
    fn viscous(&self) -> T {
        match self.model {
            Model::Nothing => T::of(0.0),
            Model::Static(model) => model.sliding.viscous_friction,
            Model::Dahl(model) => model.viscous_friction,
            Model::Lugre(model) => model.sliding.viscous_friction,
            Model::ElastoPlastic(model) => model.lugre.sliding.viscous_friction,
        }
    }

    /// Static friction torque [N m] at a constant velocity [rad/s], an angle [rad] and a load [N m]; the offset at
    /// rest. What a measurement at constant speed sees.
    pub fn steady_torque(&self, velocity: T, angle: T, load: T) -> T {
        let speed = velocity.abs();
        let level = match self.model {
            Model::Nothing => T::of(0.0),
            Model::Static(model) => model.sliding.level(speed),
            Model::Dahl(model) => model.kinetic_torque,
            Model::Lugre(model) => model.sliding.level(speed),
            Model::ElastoPlastic(model) => model.lugre.sliding.level(speed),
        };
        let contact = Contact { velocity, angle, load, arrest: T::of(0.0) };
        let sliding = velocity.sign() * self.direction.factor(velocity) * level;
        let viscous = self.direction.viscous_factor(velocity) * self.viscous() * velocity;
        self.factor(&contact) * (sliding + viscous) + self.direction.offset
    }

    /// Deflection of the bristles [rad] that a constant velocity [rad/s] bends; none without bristles.
    #[inline(always)]
    pub fn steady_deflection(&self, velocity: T) -> T {
        let (level, stiffness) = match self.model {
            Model::Nothing | Model::Static(_) => (T::of(0.0), T::of(1.0)),
            Model::Dahl(model) => (model.kinetic_torque, model.bristle_stiffness),
            Model::Lugre(model) => (model.sliding.level(velocity.abs()), model.bristle_stiffness),
            Model::ElastoPlastic(model) => (model.lugre.sliding.level(velocity.abs()), model.lugre.bristle_stiffness),
        };
        velocity.sign() * level / stiffness
    }

    /// A step of bristles with the factor of their direction: by the sign of the deflection, not of the velocity, so
    /// that the torque has no jump at a reversal.
    #[inline(always)]
    fn sided(&self, start: T, (next, torque): (T, T)) -> (T, T) {
        (next, torque * self.direction.factor(T::of(0.5) * (start + next)))
    }

    /// One step with the velocity held: the new deflection [rad] and the mean torque against positive motion [N m].
    ///
    /// `probe` is the deflection about which the release is linear: that of the step's middle.
    #[inline(always)]
    pub fn correct(&self, deflection: T, probe: T, contact: Contact<T>, dt: T) -> (T, T) {
        self.bend::<false>(deflection, probe, contact, dt)
    }

    /// The same to first order, from the start alone: what a predictor needs.
    #[inline(always)]
    pub fn predict(&self, deflection: T, contact: Contact<T>, dt: T) -> (T, T) {
        self.bend::<true>(deflection, deflection, contact, dt)
    }

    #[inline(always)]
    fn bend<const PREDICTS: bool>(&self, deflection: T, probe: T, contact: Contact<T>, dt: T) -> (T, T) {
        let factor = self.factor(&contact);
        let viscous = self.direction.viscous_factor(contact.velocity) * self.viscous() * contact.velocity;
        let bend = Bend { deflection, probe, velocity: contact.velocity, dt };
        let (next, torque) = match &self.model {
            Model::Nothing => (deflection, T::of(0.0)),
            Model::Static(model) => {
                // What is left for the sliding law, in its own scale.
                let arrest = (contact.arrest - self.direction.offset) / factor - viscous;
                let side = self.direction.factor(arrest);
                (deflection, side * model.torque(contact.velocity, arrest / side))
            }
            Model::Dahl(model) => self.sided(deflection, relax::<T, PREDICTS>(model, bend.apart())),
            Model::Lugre(model) => self.sided(deflection, relax::<T, PREDICTS>(model, bend.apart())),
            Model::ElastoPlastic(model) => self.sided(deflection, relax_apart::<T, PREDICTS>(model, bend)),
        };
        (next, factor * (torque + viscous) + self.direction.offset)
    }
}

impl<T: Scalar> Block<T> for Friction<T> {
    type State = ();
    type Input = FrictionInput<T>;
    type Output = FrictionOutput<T>;

    /// One step with the velocity held.
    #[inline(always)]
    fn step(&self, _state: &mut (), input: FrictionInput<T>, dt: T) -> FrictionOutput<T> {
        let (deflection, torque) = self.correct(input.deflection, input.probe, input.contact, dt);
        FrictionOutput { deflection, torque }
    }
}

impl Friction<f64> {
    /// Stiffness and damping at rest [N m/rad, N m s/rad]: bristles and viscous friction, with the largest factor of
    /// direction and position; the factor of the load is left to the caller. What bounds the step of an integrator.
    pub fn stiffest(&self) -> (f64, f64) {
        let (stiffness, damping) = match self.model {
            Model::Nothing | Model::Static(_) => (0.0, 0.0),
            Model::Dahl(model) => (model.bristle_stiffness, 0.0),
            Model::Lugre(model) => (model.bristle_stiffness, model.bristle_damping),
            Model::ElastoPlastic(model) => (model.lugre.bristle_stiffness, model.lugre.bristle_damping),
        };
        let ripple = if let Position::Ripple(ripple) = self.position { ripple.amplitude } else { 0.0 };
        let side = 1.0 + self.direction.asymmetry.abs();
        let viscous = (1.0 + self.direction.viscous_asymmetry.abs()) * self.viscous();
        ((1.0 + ripple) * side * stiffness, (1.0 + ripple) * (side * damping + viscous))
    }
}
