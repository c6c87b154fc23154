//! Holding a position against stiction: prevents hunting without a friction model.

use core::f64::consts::TAU;

use super::finite_or;
use crate::Fields;
use crate::block::Block;
use crate::control::reference::Setpoint;
use crate::scalar::{Mask, Scalar};

/// Hold against stiction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Hold<T> {
    /// The controller alone.
    Nothing,
    /// Dead zone, knocker and dither.
    Stiction(StictionHold<T>),
}

/// Dead zone, knocker and dither, each of which may be 0: off.
///
/// - Within the dead zone the controller's integral is frozen, so that it does not wind up against stiction.
/// - Once the set-point has been constant, short pulses towards the set-point release the drive where the deviation is
///   above the knock zone. T. Hägglund, J. Process Control 12 (2002) 897.
/// - A sinusoidal torque keeps the contact moving; its frequency must be away from the resonance of the coupling.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct StictionHold<T> {
    /// Deviation within which the controller's integral is frozen.
    #[field(symbol = "e_d", unit = "rad", range = 0.0..=1.0)]
    pub dead_zone: T,
    /// Torque of a knock; slightly more than the drop of friction after breakaway, 1.2·(M_S − M_K), is a good start.
    #[field(symbol = "M_k", unit = "N m", range = 0.0..=100.0)]
    pub knock_torque: T,
    /// Duration of a knock.
    #[field(symbol = "T_k", unit = "s", range = 1e-5..=1.0, default = 3e-3)]
    pub knock_duration: T,
    /// Time from the start of a knock to the next.
    #[field(symbol = "T_i", unit = "s", range = 1e-4..=100.0, default = 0.05)]
    pub knock_interval: T,
    /// Deviation above which knocks occur.
    #[field(symbol = "e_k", unit = "rad", range = 0.0..=1.0, default = 1e-3)]
    pub knock_zone: T,
    /// Time for which the set-point must have been constant.
    #[field(symbol = "T_d", unit = "s", range = 0.0..=100.0, default = 0.1)]
    pub dwell: T,
    /// Amplitude of the dither.
    #[field(symbol = "M_d", unit = "N m", range = 0.0..=100.0)]
    pub dither_torque: T,
    /// Frequency of the dither.
    #[field(symbol = "f_d", unit = "Hz", range = 0.1..=1e4, default = 130.0)]
    pub dither_frequency: T,
}

/// State of the hold.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct HoldState<T> {
    /// Time for which the set-point has been constant, up to the dwell.
    #[field(unit = "s")]
    pub rested: T,
    /// Time since the start of the last knock, up to the interval.
    #[field(unit = "s")]
    pub since_knock: T,
    /// Torque of the last knock.
    #[field(unit = "N m")]
    pub knock: T,
    /// Position of the set-point in the sample before.
    #[field(unit = "rad")]
    pub position: T,
    /// Phase of the dither, in turns.
    #[field(unit = "1")]
    pub phase: T,
}

/// Inputs of the hold.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct HoldInput<T> {
    /// Set-point.
    pub reference: Setpoint<T>,
    /// Measured screw angle, unwrapped.
    #[field(symbol = "φ", unit = "rad")]
    pub measured_angle: T,
}

/// Outputs of the hold.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct HoldOutput<T> {
    /// Torque of knock and dither.
    #[field(symbol = "M_h", unit = "N m")]
    pub torque: T,
    /// Whether the controller's integral may move.
    #[field(unit = "1", flag)]
    pub integrates: T,
}

impl<T: Scalar> Block<T> for StictionHold<T> {
    type State = HoldState<T>;
    type Input = HoldInput<T>;
    type Output = HoldOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        // A non-finite deviation gives no knock.
        let deviation = finite_or(input.reference.position - input.measured_angle, zero);
        let moves = input.reference.velocity.abs() + input.reference.acceleration.abs();
        let stays = input.reference.position.le(state.position) & input.reference.position.ge(state.position);
        let rests = moves.le(zero) & stays;
        state.position = finite_or(input.reference.position, state.position);
        // Half a step of tolerance, since rounding would shift durations of whole samples.
        let slack = T::of(0.5) * dt;
        let (rested, since_knock) = (state.rested + slack, state.since_knock + slack);
        let dwelt = rested.ge(self.dwell) & since_knock.ge(self.knock_interval);
        let knocks = rests & dwelt & deviation.abs().gt(self.knock_zone);
        state.since_knock = knocks.select(zero, state.since_knock);
        state.knock = knocks.select(self.knock_torque * deviation.sign(), state.knock);
        let strikes = rests & (state.since_knock + slack).lt(self.knock_duration);
        let knock = strikes.select(state.knock, zero);
        state.since_knock = (state.since_knock + dt).min(self.knock_interval + dt);
        state.rested = rests.select((state.rested + dt).min(self.dwell + dt), zero);

        let dither = self.dither_torque * (T::of(TAU) * state.phase).sin();
        let phase = state.phase + self.dither_frequency * dt;
        state.phase = phase - phase.floor();

        let within = deviation.abs().lt(self.dead_zone);
        HoldOutput { torque: knock + dither, integrates: within.select(zero, one) }
    }
}
