//! Parameters of the compensation of friction; `design::axis_control` prepares it.

use stickslip_core::Fields;
use stickslip_core::control::compensation::Network;

/// Compensation of friction in addition to the position controller.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum CompensationChoice<T> {
    /// No compensation.
    Nothing,
    /// Friction curve of the model at the velocity of the set-point: without presliding, and zero at rest.
    Curve(CurveChoice<T>),
    /// Friction of the model with its bristles along the set-point.
    Feedforward(FeedforwardChoice<T>),
    /// The same with levels that are estimated while the drive runs.
    Adaptive(AdaptiveChoice<T>),
    /// Coulomb friction estimated by the observer of Friedland and Park.
    FriedlandPark(FriedlandParkChoice<T>),
    /// Friction of the model along the motion that an observer estimates: presliding of the actual motion.
    FrictionObserver(FrictionObserverChoice<T>),
    /// Total torque that the inertia of the drive does not explain; the integral of the controller decays meanwhile.
    DisturbanceObserver(DisturbanceObserverChoice<T>),
    /// Output of a network, trained on recordings, along the set-point; outside the trained region the friction of the
    /// model.
    Network(NetworkChoice<T>),
}

/// Friction that is assumed to act.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AssumedFriction<T> {
    /// Whether the desired friction, which the load motor renders, is assumed instead of the machine's own.
    #[field(unit = "1", flag)]
    pub desired: T,
    /// Share of the friction that is compensated. Above 1 it is overcompensated, and the drive may hunt.
    #[field(unit = "1", range = 0.0..=2.0, default = 1.0)]
    pub share: T,
}

/// Friction of the model along the set-point.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FeedforwardChoice<T> {
    /// Assumed friction.
    pub belief: AssumedFriction<T>,
}

/// Friction curve of the model with a smooth sign.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CurveChoice<T> {
    /// Assumed friction.
    pub belief: AssumedFriction<T>,
    /// Velocity at which 71 % of the friction is fed forward.
    #[field(symbol = "Ω_s", unit = "rad/s", range = 1e-4..=10.0, default = 0.05)]
    pub smoothing_velocity: T,
}

/// Levels of a Stribeck curve by recursive least squares.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AdaptiveChoice<T> {
    /// Assumed friction at the start.
    pub belief: AssumedFriction<T>,
    /// Memory of the estimate: older samples have weights below 1/e.
    #[field(symbol = "T_λ", unit = "s", range = 0.05..=1e4, default = 2.0)]
    pub memory: T,
    /// Time constant of the low-pass before the estimate.
    #[field(symbol = "τ", unit = "s", range = 1e-4..=1.0, default = 5e-3)]
    pub filter_time: T,
}

/// Observer of Coulomb friction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FriedlandParkChoice<T> {
    /// Rate at which the estimate follows. Above 100 1/s noise dominates.
    #[field(symbol = "λ", unit = "1/s", range = 0.1..=1000.0, default = 100.0)]
    pub rate: T,
}

/// Observer of the drive with its friction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionObserverChoice<T> {
    /// Whether the friction is the desired one, which the load motor renders, instead of the machine's own.
    #[field(unit = "1", flag)]
    pub desired: T,
    /// Share that is compensated of the smallest friction within the uncertainty `model.doubt.friction`. Above 0.9 the
    /// drive may hunt.
    #[field(symbol = "g", unit = "1", range = 0.0..=2.0, default = 0.9)]
    pub share: T,
    /// Rate at which the friction that is missing in the model may change. A larger value follows measurements, a
    /// smaller one the model.
    #[field(symbol = "q_r", unit = "N m √Hz", range = 1e-5..=10.0, default = 0.1)]
    pub missing_torque: T,
}

/// Observer of the disturbance.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DisturbanceObserverChoice<T> {
    /// Bandwidth of the observer, a double pole. It reduces the phase margin of the loop.
    #[field(symbol = "p", unit = "1/s", range = 1.0..=2000.0, default = 60.0)]
    pub bandwidth: T,
}

/// A trained network, and the friction outside its trained region.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct NetworkChoice<T> {
    /// Assumed friction outside the trained region.
    pub belief: AssumedFriction<T>,
    /// The network, as `examples/network/train.py` writes it. The default is untrained and active nowhere.
    pub network: Network<T>,
}
