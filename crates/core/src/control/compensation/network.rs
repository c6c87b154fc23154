//! Feedforward of friction by a small network that was trained on recordings of the drive.
//!
//! `stickslip measure tracking` records features and torque, so that `examples/network/train.py` contains no equation.
//! `crates/stickslip/tests/laboratory/linear/network.rs` compares the trained `data/network/prototype.toml` with the
//! virtual bench and with scikit-learn.

use super::{CompensationInput, CompensationOutput, FrictionFeedforward, FrictionFeedforwardState, bounded};
use crate::Fields;
use crate::block::Block;
use crate::control::{finite_or, measurable};
use crate::fields::{Relation, at_most};
use crate::scalar::{Mask, Scalar};

/// Features of the set-point as inputs of the network, see [`SetpointFeatures`].
pub const FEATURES: usize = 6;
/// Neurons of each hidden layer.
pub const NEURONS: usize = 16;

/// Features of a set-point that determine the friction:
///
///   f = (ṙ⁺, r̈, ṙ⁺/(Ω₁ + |ṙ⁺|), ṙ⁺/(Ω₂ + |ṙ⁺|), m₁, m₂),   dmᵢ = (sgn ṙ⁺ − mᵢ)·|dr⁺|/ϑᵢ
///
/// Two smooth signs resolve the speeds near 0, where friction changes most. Two memories store the direction before a
/// reversal: the first changes over the distance of the bristles, the second over that of bristles and coupling. The
/// distance is that of the set-point's mean velocity in the sample, and the memories relax exponentially along it, so
/// that they do not depend on the step. P. R. Dahl, AIAA Journal 14 (1976) 1675.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct SetpointFeatures<T> {
    /// Velocity at which the first smooth sign is one half.
    #[field(symbol = "Ω₁", unit = "rad/s", range = 1e-4..=1e3, default = 0.3)]
    pub slow_velocity: T,
    /// Velocity at which the second smooth sign is one half.
    #[field(symbol = "Ω₂", unit = "rad/s", range = 1e-4..=1e3, default = 3.0)]
    pub fast_velocity: T,
    /// Distance over which the first memory changes.
    #[field(symbol = "ϑ₁", unit = "rad", range = 1e-7..=1e3, default = 1.5e-4)]
    pub short_twist: T,
    /// Distance over which the second memory changes.
    #[field(symbol = "ϑ₂", unit = "rad", range = 1e-7..=1e3, default = 4e-3)]
    pub long_twist: T,
}

/// State of the features.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FeatureState<T> {
    /// Direction of the set-point, over the short twist.
    #[field(symbol = "m₁", unit = "1")]
    pub short_memory: T,
    /// Direction of the set-point, over the long twist.
    #[field(symbol = "m₂", unit = "1")]
    pub long_memory: T,
}

impl<T: Scalar> SetpointFeatures<T> {
    /// The features of a sample: previewed velocity [rad/s], acceleration [rad/s²], and its length [s].
    #[inline(always)]
    pub fn advance(&self, state: &mut FeatureState<T>, velocity: T, acceleration: T, dt: T) -> [T; FEATURES] {
        let mean = velocity - T::of(0.5) * dt * acceleration;
        let (side, way) = (mean.sign(), mean.abs() * dt);
        let turned = |memory: T, twist: T| {
            let relaxed = side + (memory - side) * (-way / twist).exp();
            measurable(mean).select(relaxed, memory)
        };
        state.short_memory = turned(state.short_memory, self.short_twist);
        state.long_memory = turned(state.long_memory, self.long_twist);
        self.features(state, velocity, acceleration)
    }

    /// Features of a motion that has been steady for long.
    #[inline(always)]
    fn settled(&self, state: &mut FeatureState<T>, velocity: T, acceleration: T) -> [T; FEATURES] {
        let side = velocity.sign();
        *state = FeatureState { short_memory: side, long_memory: side };
        self.features(state, velocity, acceleration)
    }

    #[inline(always)]
    fn features(&self, state: &FeatureState<T>, velocity: T, acceleration: T) -> [T; FEATURES] {
        let smooth_sign = |half: T| velocity / (half + velocity.abs());
        let signs = [smooth_sign(self.slow_velocity), smooth_sign(self.fast_velocity)];
        [velocity, acceleration, signs[0], signs[1], state.short_memory, state.long_memory]
    }
}

/// Two layers of neurons between the features and the torque, and their region of validity:
///
///   x = (f − f₀)/s,   h₁ = tanh(W₁ᵀ·x + b₁),   h₂ = tanh(W₂ᵀ·h₁ + b₂),   M = wᵀ·h₂ + b
///
/// The region is that of the training features. Outside, the output is not valid: its share falls from 1 to 0 within a
/// margin, by the feature that is farthest outside.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = Network::law)]
pub struct Network<T> {
    /// Features at the input.
    pub features: SetpointFeatures<T>,
    /// Offset of each feature, in the feature's unit.
    #[field(symbol = "f₀", unit = "1", range = -1e9..=1e9)]
    pub offset: [T; FEATURES],
    /// Scale of each feature.
    #[field(symbol = "s", unit = "1", range = 1e-9..=1e9, default = 1.0)]
    pub scale: [T; FEATURES],
    /// Smallest value of each feature in the training.
    #[field(symbol = "f_min", unit = "1", range = -1e9..=1e9)]
    pub smallest: [T; FEATURES],
    /// Largest value of each feature in the training.
    #[field(symbol = "f_max", unit = "1", range = -1e9..=1e9)]
    pub largest: [T; FEATURES],
    /// Distance outside the region at which the output is 0, in scales of the feature.
    #[field(symbol = "μ", unit = "1", range = 1e-3..=10.0, default = 0.1)]
    pub margin: T,
    /// Weights from each feature to all neurons of the first layer.
    #[field(symbol = "W₁", unit = "1", range = -1e4..=1e4)]
    pub first: [[T; NEURONS]; FEATURES],
    /// Bias of the first layer.
    #[field(symbol = "b₁", unit = "1", range = -1e4..=1e4)]
    pub first_bias: [T; NEURONS],
    /// Weights from each neuron of the first layer to all of the second.
    #[field(symbol = "W₂", unit = "1", range = -1e4..=1e4)]
    pub second: [[T; NEURONS]; NEURONS],
    /// Bias of the second layer.
    #[field(symbol = "b₂", unit = "1", range = -1e4..=1e4)]
    pub second_bias: [T; NEURONS],
    /// Torque per neuron of the second layer.
    #[field(symbol = "w", unit = "N m", range = -1e4..=1e4)]
    pub output: [T; NEURONS],
    /// Bias of the output.
    #[field(symbol = "b", unit = "N m", range = -1e4..=1e4)]
    pub output_bias: T,
}

impl<T: Scalar> Network<T> {
    fn law(&self) -> [Relation<T>; FEATURES] {
        let remedy = "The region goes from the smallest to the largest of each feature.";
        core::array::from_fn(|k| at_most("smallest", self.smallest[k], self.largest[k], remedy))
    }

    /// The torque [N m] and its share: 1 inside the region, 0 beyond the margin and for non-finite features.
    #[inline(always)]
    pub fn evaluate(&self, features: &[T; FEATURES]) -> (T, T) {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let mut scaled = *features;
        let mut outside = zero;
        for k in 0..FEATURES {
            let beyond = (features[k] - self.largest[k]).max(self.smallest[k] - features[k]);
            outside = (beyond / self.scale[k]).max(outside);
            scaled[k] = (features[k] - self.offset[k]) / self.scale[k];
        }
        let first = layer(&self.first, &self.first_bias, &scaled);
        let second = layer(&self.second, &self.second_bias, &first);
        let mut torque = self.output_bias;
        for (weight, neuron) in self.output.iter().zip(&second) {
            torque += *weight * *neuron;
        }
        let share = (one - outside / self.margin).clamp(zero, one);
        (torque, measurable(torque).select(share, zero))
    }
}

/// A layer of neurons behind these inputs; the weights of an input to all neurons are adjacent.
#[inline(always)]
fn layer<T: Scalar, const N: usize>(weights: &[[T; NEURONS]; N], bias: &[T; NEURONS], inputs: &[T; N]) -> [T; NEURONS] {
    let mut sums = *bias;
    for (column, input) in weights.iter().zip(inputs) {
        for k in 0..NEURONS {
            sums[k] += column[k] * *input;
        }
    }
    for sum in &mut sums {
        *sum = tanh(*sum);
    }
    sums
}

/// Hyperbolic tangent, within 1e-16 of 1; ±1 for the largest numbers.
#[inline(always)]
fn tanh<T: Scalar>(x: T) -> T {
    // From 20 on it is 1 to the last bit; the exponential stays finite, and so does its slope.
    let double = T::of(2.0) * x.clamp(T::of(-20.0), T::of(20.0));
    T::of(1.0) - T::of(2.0) / (T::of(1.0) + double.exp())
}

/// The output of a trained network along the set-point; the friction model outside its region:
///
///   M_c = α·M_N(f) + (1 − α)·M_F
///
/// M_N and its share α are those of the [`Network`], M_F is that of the [`FrictionFeedforward`]. Its input is the
/// set-point when the torque acts. It repeats its training data, errors included: where a friction is described by a
/// curve and its bristles, [`FrictionFeedforward`] does the same with six readable numbers. Use this for effects that
/// no such model has: different directions, a guide that is tight at some speeds, the friction of a gear. It does not
/// adapt while the drive runs; for varying friction use [`AdaptiveStribeck`](super::AdaptiveStribeck).
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct NetworkFeedforward<T> {
    /// The trained network.
    pub network: Network<T>,
    /// Fallback outside the trained region; preview and limit are those of both.
    pub fallback: FrictionFeedforward<T>,
}

/// State of the network and its fallback.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct NetworkFeedforwardState<T> {
    /// Of the features.
    pub features: FeatureState<T>,
    /// State of the fallback.
    pub fallback: FrictionFeedforwardState<T>,
}

impl<T: Scalar> NetworkFeedforward<T> {
    /// Starts as if the set-point had moved steadily for long; returns its torque [N m].
    #[inline(always)]
    pub(super) fn begin(&self, state: &mut NetworkFeedforwardState<T>, input: CompensationInput<T>) -> T {
        let fallback = self.fallback.begin(&mut state.fallback, input);
        let (velocity, _) = input.preview(self.fallback.preview);
        let features = self.network.features.settled(&mut state.features, velocity, input.reference.acceleration);
        self.joined(&features, fallback).torque
    }

    /// The torque of both, each with its share.
    #[inline(always)]
    fn joined(&self, features: &[T; FEATURES], fallback: T) -> CompensationOutput<T> {
        let (torque, share) = self.network.evaluate(features);
        let network = finite_or(torque, T::of(0.0));
        bounded(share * network + (T::of(1.0) - share) * fallback, self.fallback.torque_limit)
    }
}

impl<T: Scalar> Block<T> for NetworkFeedforward<T> {
    type State = NetworkFeedforwardState<T>;
    type Input = CompensationInput<T>;
    type Output = CompensationOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let fallback = self.fallback.run(&mut state.fallback, input, dt).torque;
        let (velocity, _) = input.preview(self.fallback.preview);
        let acceleration = input.reference.acceleration;
        let features = self.network.features.advance(&mut state.features, velocity, acceleration, dt);
        self.joined(&features, fallback)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::reference::Setpoint;
    use crate::friction::{Bristles, Stribeck};

    const DT: f64 = 1e-3;

    /// 0.5 N m in the direction of the set-point, trained up to 10 rad/s and 100 rad/s².
    fn constant() -> NetworkFeedforward<f64> {
        let mut network = Network::<f64> {
            scale: [10.0, 100.0, 1.0, 1.0, 1.0, 1.0],
            smallest: [-10.0, -100.0, -1.0, -1.0, -1.0, -1.0],
            largest: [10.0, 100.0, 1.0, 1.0, 1.0, 1.0],
            ..Network::default()
        };
        network.first[4][3] = 30.0;
        network.second[3][7] = 30.0;
        network.output[7] = 0.5;
        let friction = Bristles { stiffness: 3000.0, ..Bristles::default() }.under(Stribeck::default());
        NetworkFeedforward { network, fallback: FrictionFeedforward { friction, ..FrictionFeedforward::default() } }
    }

    fn input(velocity: f64, acceleration: f64) -> CompensationInput<f64> {
        let reference = Setpoint { position: 0.0, velocity, acceleration };
        CompensationInput { reference, ..CompensationInput::default() }
    }

    /// Torque after a while at this velocity.
    fn steady(block: &NetworkFeedforward<f64>, velocity: f64) -> f64 {
        let mut state = NetworkFeedforwardState::default();
        (0..300).map(|_| block.step(&mut state, input(velocity, 0.0), DT).torque).last().unwrap()
    }

    #[test]
    fn inside_the_region_it_is_the_network_outside_the_model_and_between_a_mixture() {
        let block = constant();
        let modelled = |velocity: f64| block.fallback.friction.steady_torque(velocity, 0.0, 0.0);
        for velocity in [-9.9, -0.2, 0.2, 9.9] {
            assert!((steady(&block, velocity) - 0.5 * velocity.signum()).abs() < 1e-12, "{velocity}");
        }
        for velocity in [-40.0, -11.01, 11.01, 40.0] {
            assert!((steady(&block, velocity) - modelled(velocity)).abs() < 1e-9, "{velocity}");
        }
        // A tenth of the scale is the margin: no jump on the way.
        let course: [f64; 141] = core::array::from_fn(|k| steady(&block, 9.8 + 0.01 * k as f64));
        assert!((steady(&block, 10.5) - 0.5 * (0.5 + modelled(10.5))).abs() < 1e-9);
        assert!(course.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.01), "{course:?}");
        // An acceleration outside the training.
        let mut state = NetworkFeedforwardState::default();
        let fast = (0..300).map(|_| block.step(&mut state, input(5.0, 120.0), DT).torque).last().unwrap();
        let ahead = 5.0 + block.fallback.preview * 120.0;
        assert!((fast - modelled(ahead)).abs() < 1e-6, "{fast} instead of {}", modelled(ahead));
    }

    #[test]
    fn an_untrained_network_gives_the_friction_model_in_motion() {
        let block = NetworkFeedforward { network: Network::default(), ..constant() };
        for velocity in [-3.0, 0.5, 20.0] {
            let modelled = block.fallback.friction.steady_torque(velocity, 0.0, 0.0);
            assert!((steady(&block, velocity) - modelled).abs() < 1e-9, "{velocity}");
        }
    }

    #[test]
    fn the_torque_keeps_its_limit_and_is_0_for_non_finite_inputs() {
        let mut block = constant();
        block.network.output[7] = 1e4;
        assert_eq!(steady(&block, 5.0), block.fallback.torque_limit);
        let mut state = NetworkFeedforwardState::default();
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for input in [input(bad, 0.0), input(5.0, bad), input(bad, bad)] {
                assert_eq!(block.step(&mut state, input, DT).torque, 0.0, "{input:?}");
            }
        }
        let after = (0..300).map(|_| block.step(&mut state, input(5.0, 0.0), DT).torque).last().unwrap();
        assert_eq!(after, block.fallback.torque_limit, "it sticks in {state:?}");
    }

    #[test]
    fn odd_weights_give_an_odd_torque() {
        let mut block = constant();
        for k in 0..NEURONS {
            for (j, column) in block.network.first.iter_mut().enumerate() {
                column[k] = ((7 * k + 3 * j) % 11) as f64 * 0.1 - 0.5;
            }
            for (j, column) in block.network.second.iter_mut().enumerate() {
                column[k] = ((5 * k + 2 * j) % 13) as f64 * 0.1 - 0.6;
            }
            block.network.output[k] = (k % 3) as f64 * 0.1 - 0.1;
        }
        let (mut there, mut back) = (NetworkFeedforwardState::default(), NetworkFeedforwardState::default());
        for k in 0..500 {
            let phase = 0.02 * f64::from(k);
            let (velocity, acceleration) = (4.0 * phase.sin(), 80.0 * phase.cos());
            let torque = block.step(&mut there, input(velocity, acceleration), DT).torque;
            let mirrored = block.step(&mut back, input(-velocity, -acceleration), DT).torque;
            assert!((torque + mirrored).abs() < 1e-13 && torque.abs() > 0.0, "{torque} and {mirrored}");
        }
    }

    #[test]
    fn the_memories_do_not_depend_on_the_step() {
        let features = SetpointFeatures::<f64>::default();
        // 1 rad/s, turned within 10 ms, over 1 ms and over a tenth of that.
        let course = |steps: u32| {
            let (mut state, dt) = (FeatureState { short_memory: 1.0, long_memory: 1.0 }, DT / f64::from(steps));
            for k in 1..=12 * steps {
                let time = dt * f64::from(k);
                let (velocity, acceleration) = if time < 0.01 { (1.0 - 200.0 * time, -200.0) } else { (-1.0, 0.0) };
                features.advance(&mut state, velocity, acceleration, dt);
            }
            state
        };
        let (coarse, fine) = (course(1), course(10));
        assert!((-0.9..0.0).contains(&fine.long_memory) && fine.short_memory < -0.99, "{fine:?}");
        assert!((coarse.long_memory - fine.long_memory).abs() < 2e-2, "{coarse:?} and {fine:?}");
        // At a constant speed exactly, however coarse.
        let constant = |steps: u32| {
            let mut state = FeatureState { short_memory: 1.0, long_memory: 1.0 };
            for _ in 0..steps {
                features.advance(&mut state, -0.5, 0.0, 4.0 * DT / f64::from(steps));
            }
            state
        };
        let (one, many) = (constant(1), constant(100));
        assert!((one.long_memory - many.long_memory).abs() < 1e-12, "{one:?} and {many:?}");
        assert!((one.short_memory - many.short_memory).abs() < 1e-12, "{one:?} and {many:?}");
    }

    #[test]
    fn it_starts_in_its_steady_state() {
        let block = constant();
        for velocity in [-4.0, 0.7, 30.0] {
            let mut state = NetworkFeedforwardState::default();
            let start = block.begin(&mut state, input(velocity, 0.0));
            assert!((start - steady(&block, velocity)).abs() < 1e-9, "{velocity}: {start}");
        }
        let mut state = NetworkFeedforwardState::default();
        block.begin(&mut state, input(f64::NAN, 0.0));
        assert!(state.features.long_memory == 0.0, "{state:?}");
    }

    #[test]
    fn the_tangent_is_that_of_libm_and_bounded() {
        for k in -400..=400 {
            let x = 0.1 * f64::from(k);
            assert!((tanh(x) - libm::tanh(x)).abs() < 4e-16, "{x}");
        }
        assert_eq!([tanh(f64::MAX), tanh(-f64::MAX), tanh(0.0)], [1.0, -1.0, 0.0]);
        assert!(tanh(f64::NAN).is_nan());
    }
}
