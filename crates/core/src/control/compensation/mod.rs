//! Compensation of friction, added to any position controller.
//!
//! One kind at a time: a disturbance observer and a feedforward would both supply the friction torque, and the drive
//! would get it twice. Each kind is bounded, and ignores non-finite inputs.

mod adaptive;
mod disturbance_observer;
mod feedforward;
mod friction_observer;
mod friedland_park;
mod hold;
mod network;
#[cfg(test)]
mod tests;

pub use adaptive::{AdaptiveStribeck, AdaptiveStribeckState};
pub use disturbance_observer::{DisturbanceObserver, DisturbanceObserverState};
pub use feedforward::{CurveFeedforward, FrictionFeedforward, FrictionFeedforwardState};
pub use friction_observer::{FrictionObserver, FrictionObserverState};
pub use friedland_park::{FriedlandPark, FriedlandParkState};
pub use hold::{Hold, HoldInput, HoldOutput, HoldState, StictionHold};
pub use network::{
    FEATURES, FeatureState, NEURONS, Network, NetworkFeedforward, NetworkFeedforwardState, SetpointFeatures,
};

use super::finite_or;
use super::reference::Setpoint;
use crate::Fields;
use crate::block::Block;
use crate::scalar::Scalar;

/// Inputs of compensation of friction: the set-point, and the motion of the drive in the sample before.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CompensationInput<T> {
    /// Set-point.
    pub reference: Setpoint<T>,
    /// Measured velocity, of the tacho.
    #[field(symbol = "ω", unit = "rad/s")]
    pub measured_velocity: T,
    /// Measured screw angle, unwrapped.
    #[field(symbol = "φ", unit = "rad")]
    pub measured_angle: T,
    /// Torque of the drive motor in the sample that ends.
    #[field(symbol = "M_M", unit = "N m")]
    pub applied_torque: T,
    /// Torque that was computed in it: active until the next one.
    #[field(symbol = "M_M", unit = "N m")]
    pub pending_torque: T,
}

impl<T: Scalar> CompensationInput<T> {
    /// Velocity [rad/s] and angle [rad] of the set-point this much [s] later.
    #[inline(always)]
    fn preview(&self, ahead: T) -> (T, T) {
        let Setpoint { position, velocity, acceleration } = self.reference;
        let half = T::of(0.5) * ahead;
        (velocity + ahead * acceleration, position + ahead * (velocity + half * acceleration))
    }
}

/// Outputs of compensation of friction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CompensationOutput<T> {
    /// Torque to be added to the controller's.
    #[field(symbol = "M_c", unit = "N m")]
    pub torque: T,
    /// Torque that it supplies from the next sample on in place of the controller's integral.
    #[field(unit = "N m")]
    pub taken: T,
}

/// Kind of compensation of friction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Compensation<T> {
    /// None.
    Nothing,
    /// The modelled curve at the set-point's velocity.
    Curve(CurveFeedforward<T>),
    /// The modelled friction, presliding included, along the set-point.
    Feedforward(FrictionFeedforward<T>),
    /// The same with a curve that is estimated while the drive runs.
    Adaptive(AdaptiveStribeck<T>),
    /// Coulomb friction estimated by the observer of Friedland and Park.
    FriedlandPark(FriedlandPark<T>),
    /// The friction of an observed drive.
    FrictionObserver(FrictionObserver<T>),
    /// All torque that the drive's inertia does not explain, in place of the controller's integral.
    DisturbanceObserver(DisturbanceObserver<T>),
    /// Output of a trained network along the set-point.
    Network(NetworkFeedforward<T>),
}

/// The states of all kinds; only that of the chosen one moves.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CompensationState<T> {
    /// Of the feedforward of friction.
    pub feedforward: FrictionFeedforwardState<T>,
    /// Of the adaptive feedforward.
    pub adaptive: AdaptiveStribeckState<T>,
    /// Of the observer of Friedland and Park.
    pub friedland_park: FriedlandParkState<T>,
    /// Of the friction observer.
    pub friction_observer: FrictionObserverState<T>,
    /// Of the disturbance observer.
    pub disturbance_observer: DisturbanceObserverState<T>,
    /// Of the network.
    pub network: NetworkFeedforwardState<T>,
}

impl<T: Scalar> Compensation<T> {
    /// Whether it follows the set-point, and leaves all other torques to the controller.
    pub(super) fn feeds_forward(&self) -> bool {
        matches!(
            self,
            Compensation::Curve(_)
                | Compensation::Feedforward(_)
                | Compensation::Adaptive(_)
                | Compensation::Network(_)
        )
    }

    /// Share of the controller's integral that is forgotten in a sample: a disturbance observer replaces it.
    #[inline(always)]
    pub(super) fn takes_the_integral(&self) -> T {
        match self {
            Compensation::DisturbanceObserver(observer) => observer.velocity_gain * T::of(0.5),
            _ => T::of(0.0),
        }
    }

    /// Starts while the drive follows this set-point steadily; returns its torque [N m]. States of other kinds stay.
    #[inline(never)]
    pub(super) fn begin(&self, state: &mut CompensationState<T>, input: CompensationInput<T>) -> T {
        let torque = match self {
            Compensation::Nothing => T::of(0.0),
            Compensation::Curve(curve) => curve.run(&mut (), input, T::of(0.0)).torque,
            Compensation::Feedforward(feedforward) => feedforward.begin(&mut state.feedforward, input),
            Compensation::Adaptive(adaptive) => adaptive.begin(&mut state.adaptive, input),
            Compensation::FriedlandPark(observer) => observer.begin(&mut state.friedland_park, input),
            Compensation::FrictionObserver(observer) => observer.begin(&mut state.friction_observer, input),
            Compensation::DisturbanceObserver(observer) => observer.begin(&mut state.disturbance_observer, input),
            Compensation::Network(network) => network.begin(&mut state.network, input),
        };
        finite_or(torque, T::of(0.0))
    }
}

impl<T: Scalar> Block<T> for Compensation<T> {
    type State = CompensationState<T>;
    type Input = CompensationInput<T>;
    type Output = CompensationOutput<T>;

    // Out of line like the laws: long, and not active in every tick.
    #[inline(never)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        match self {
            Compensation::Nothing => CompensationOutput { torque: T::of(0.0), taken: T::of(0.0) },
            Compensation::Curve(curve) => curve.run(&mut (), input, dt),
            Compensation::Feedforward(feedforward) => feedforward.run(&mut state.feedforward, input, dt),
            Compensation::Adaptive(adaptive) => adaptive.run(&mut state.adaptive, input, dt),
            Compensation::FriedlandPark(observer) => observer.run(&mut state.friedland_park, input, dt),
            Compensation::FrictionObserver(observer) => observer.run(&mut state.friction_observer, input, dt),
            Compensation::DisturbanceObserver(observer) => observer.run(&mut state.disturbance_observer, input, dt),
            Compensation::Network(network) => network.run(&mut state.network, input, dt),
        }
    }
}

/// A torque within ±`limit`; 0 for a non-finite one.
#[inline(always)]
fn bounded<T: Scalar>(torque: T, limit: T) -> CompensationOutput<T> {
    CompensationOutput { torque: finite_or(torque, T::of(0.0)).clamp(-limit, limit), taken: T::of(0.0) }
}
