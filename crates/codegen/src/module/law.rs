//! A controller in Rust with the signature of a library: from a sample to a torque.

use stickslip_core::block::Block;
use stickslip_core::control::{ControllerInput, ControllerOutput};
use stickslip_core::fields::{Fields, Laws, ParameterError, Shape, Walk};
use stickslip_core::scalar::Scalar;

use crate::record::{Program, Recorded, record};

/// Inputs of a controller in a sample.
#[derive(Clone, Copy, Debug, PartialEq, stickslip_core::Fields)]
pub struct LawSample<T> {
    /// Time since the start of the controller.
    #[field(symbol = "t", unit = "s")]
    pub time: T,
    /// Desired angle of the screw.
    #[field(symbol = "r", unit = "rad")]
    pub reference_position: T,
    /// Its first derivative.
    #[field(symbol = "ṙ", unit = "rad/s")]
    pub reference_velocity: T,
    /// Its second derivative.
    #[field(symbol = "r̈", unit = "rad/s^2")]
    pub reference_acceleration: T,
    /// Angle of the screw by the encoder, unwrapped.
    #[field(symbol = "φ", unit = "rad")]
    pub measured_angle: T,
    /// Velocity of the motor by the tacho.
    #[field(symbol = "ω", unit = "rad/s")]
    pub measured_velocity: T,
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m")]
    pub torque_limit: T,
}

/// A controller of the bench with the signature of a library. It has the controller's name, parameters and laws.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Loaded<C>(C);

impl<T: Scalar, C: Fields<T>> Fields<T> for Loaded<C> {
    const NAME: &'static str = C::NAME;
    const HELP: &'static str = C::HELP;
    const SHAPE: Shape = C::SHAPE;
    type With<U: Scalar> = Loaded<C::With<U>>;

    fn contents(&mut self, walk: &mut dyn Walk<T>) {
        self.0.contents(walk);
    }

    fn map<U: Scalar>(&self, convert: &mut dyn FnMut(T) -> U) -> Self::With<U> {
        Loaded(self.0.map(convert))
    }

    fn merge(&self, other: &Self, join: &mut impl FnMut(T, T) -> T) -> Self {
        Loaded(self.0.merge(&other.0, join))
    }

    fn laws(&self, laws: &mut dyn Laws<T>) {
        self.0.laws(laws);
    }

    fn check(values: &Self::With<f64>) -> Result<(), ParameterError> {
        C::check(&values.0)
    }
}

impl<T: Scalar, C: Block<T, Input = ControllerInput<T>, Output = ControllerOutput<T>>> Block<T> for Loaded<C> {
    type State = C::State;
    type Input = LawSample<T>;
    type Output = ControllerOutput<T>;

    fn step(&self, state: &mut C::State, sample: LawSample<T>, dt: T) -> ControllerOutput<T> {
        let input = ControllerInput {
            reference_position: sample.reference_position,
            reference_velocity: sample.reference_velocity,
            reference_acceleration: sample.reference_acceleration,
            measured_angle: sample.measured_angle,
            measured_velocity: sample.measured_velocity,
            ..ControllerInput::default()
        };
        self.0.step(state, input, dt)
    }
}

/// Records a controller with the values of its parameters, in the form for [`source`](super::source).
pub fn record_law<C>(controller: &C) -> Program
where
    C: Fields<f64>,
    C::With<Recorded>: Block<Recorded, Input = ControllerInput<Recorded>, Output = ControllerOutput<Recorded>>,
{
    record::<Loaded<C>, f64>(&Loaded(*controller))
}
