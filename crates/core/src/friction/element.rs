//! Friction as a separate block.

use super::{Contact, Friction, FrictionInput, Memory};
use crate::Fields;
use crate::block::Block;
use crate::scalar::Scalar;

/// Friction of one contact as a separate block for an external simulation: motion in, torque out.
///
/// A step is that of the virtual machine, with the velocity held: a predictor over half the step gives the deflection
/// about which the release of the bristles is linearised (midpoint of the exponential bristle step). The step is of
/// second order if the velocity is that in its middle, of first order if it is that at its start.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionElement<T> {
    /// Model and dependences.
    pub friction: Friction<T>,
}

/// State of a friction element.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionElementState<T> {
    /// The contact.
    pub memory: Memory<T>,
}

/// Outputs of a friction element.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionElementOutput<T> {
    /// Mean friction torque of the step, against positive motion.
    #[field(symbol = "M_R", unit = "N m")]
    pub torque: T,
}

impl<T: Scalar> Block<T> for FrictionElement<T> {
    type State = FrictionElementState<T>;
    type Input = Contact<T>;
    type Output = FrictionElementOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Contact<T>, dt: T) -> Self::Output {
        let (probe, _) = self.friction.predict(&state.memory, input, T::of(0.5) * dt);
        let end = self.friction.run(&mut state.memory, FrictionInput { probe, contact: input }, dt);
        FrictionElementOutput { torque: end.torque }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::{ElastoPlastic, Model, Static};

    const DT: f64 = 25e-6;

    #[test]
    fn at_constant_speed_the_torque_becomes_the_static_one() {
        let mut element = FrictionElement::<f64>::default();
        element.friction.model = Model::ElastoPlastic(ElastoPlastic::default());
        let mut state = FrictionElementState::default();
        let contact = Contact { velocity: 2.0, ..Contact::default() };
        let mut torque = 0.0;
        for _ in 0..4000 {
            torque = element.step(&mut state, contact, DT).torque;
        }
        let expected = element.friction.steady_torque(2.0, 0.0, 0.0);
        // 100 ms are 200 times the rise time of the bristles.
        assert!((torque - expected).abs() < 1e-9, "{torque} instead of {expected}");
    }

    #[test]
    fn static_friction_takes_up_what_would_move_a_load_at_rest() {
        let mut element = FrictionElement::<f64>::default();
        element.friction.model = Model::Static(Static::default());
        let mut state = FrictionElementState::default();
        for (arrest, expected) in [(0.1, 0.1), (-0.2, -0.2), (0.5, 0.3)] {
            let contact = Contact { arrest, ..Contact::default() };
            assert_eq!(element.step(&mut state, contact, DT).torque, expected);
        }
    }
}
