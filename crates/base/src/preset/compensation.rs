//! What is stated of the compensation of friction; `design::axis_control` prepares it.

use stickslip_core::Fields;
use stickslip_core::control::compensation::Network;

/// How friction is compensated beside the position controller.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum CompensationChoice<T> {
    /// Not at all.
    Nothing,
    /// The believed curve at the set-point's velocity: no presliding, and nothing at rest.
    Curve(CurveChoice<T>),
    /// The believed friction with its bristles along the set-point.
    Feedforward(FeedforwardChoice<T>),
    /// The same with levels that are estimated while the drive runs.
    Adaptive(AdaptiveChoice<T>),
    /// Coulomb friction estimated by the observer of Friedland and Park.
    FriedlandPark(FriedlandParkChoice<T>),
    /// The believed friction of the drive that an observer follows: presliding by what the drive does.
    FrictionObserver(FrictionObserverChoice<T>),
    /// All that the drive's inertia does not explain; the controller's integral fades meanwhile.
    DisturbanceObserver(DisturbanceObserverChoice<T>),
    /// What a network that was trained on recordings finds along the set-point; the believed friction where it was not.
    Network(NetworkChoice<T>),
}

/// Which friction is believed to act.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AssumedFriction<T> {
    /// Whether it is the desired one, which the load motor renders, instead of the machine's own.
    #[field(unit = "1", flag)]
    pub desired: T,
    /// Share of it that is compensated: above 1 it pushes, and the drive may hunt.
    #[field(unit = "1", range = 0.0..=2.0, default = 1.0)]
    pub share: T,
}

/// The believed friction along the set-point.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FeedforwardChoice<T> {
    /// Which friction.
    pub belief: AssumedFriction<T>,
}

/// The believed curve with a smooth sign.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CurveChoice<T> {
    /// Which friction.
    pub belief: AssumedFriction<T>,
    /// Velocity at which 71 % of it is fed forward.
    #[field(symbol = "Ω_s", unit = "rad/s", range = 1e-4..=10.0, default = 0.05)]
    pub smoothing_velocity: T,
}

/// The levels of a Stribeck curve by recursive least squares.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AdaptiveChoice<T> {
    /// Which friction to start from.
    pub belief: AssumedFriction<T>,
    /// How long a sample counts: what is older weighs less than 1/e.
    #[field(symbol = "T_λ", unit = "s", range = 0.05..=1e4, default = 2.0)]
    pub memory: T,
    /// Time constant of the low-pass before the estimate.
    #[field(symbol = "τ", unit = "s", range = 1e-4..=1.0, default = 5e-3)]
    pub filter_time: T,
}

/// How fast Coulomb friction is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FriedlandParkChoice<T> {
    /// How fast the estimate follows; above 100 1/s noise rules.
    #[field(symbol = "λ", unit = "1/s", range = 0.1..=1000.0, default = 100.0)]
    pub rate: T,
}

/// The drive with its friction as an observer sees it.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionObserverChoice<T> {
    /// Whether the friction is the desired one, which the load motor renders, instead of the machine's own.
    #[field(unit = "1", flag)]
    pub desired: T,
    /// Share that is compensated of the least that the friction may be, as `model.doubt.friction` says. Above 0.9 the
    /// drive may hunt.
    #[field(symbol = "g", unit = "1", range = 0.0..=2.0, default = 0.9)]
    pub share: T,
    /// How fast the friction that the model lacks wanders: more follows measurements, less follows the model.
    #[field(symbol = "q_r", unit = "N m √Hz", range = 1e-5..=10.0, default = 0.1)]
    pub missing_torque: T,
}

/// How fast a disturbance is observed.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DisturbanceObserverChoice<T> {
    /// Bandwidth of the observer, a double pole; the loop loses phase to it.
    #[field(symbol = "p", unit = "1/s", range = 1.0..=2000.0, default = 60.0)]
    pub bandwidth: T,
}

/// A trained network, and what is in force where it knows nothing.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct NetworkChoice<T> {
    /// Which friction is believed outside the region that it was trained in.
    pub belief: AssumedFriction<T>,
    /// What was trained, as `examples/network/train.py` writes it. As it stands here it was not, and is nowhere in force.
    pub network: Network<T>,
}
