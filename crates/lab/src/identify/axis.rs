//! The axis as identified, and its closed loop with the known controller.
//!
//! ```text
//! M·q̈ = K·s − F(q̇) − F_0,   τ·ṡ = u − s,   u = limited(k_v·(k_p·(r − q) − v)) + injected
//! ```
//!
//! True stick: within a sub-step friction is the force that would bring the axis to rest, limited to the sliding curve
//! of the direction in which it is pushed (Moreau's time stepping). No regularised sign, hence no creep.

use std::ops::Range;

use stickslip_core::friction::{Decay, Stribeck};
use stickslip_core::scalar::{Mask, Scalar};

use super::motion::Motion;
use crate::machine::{Cascade, Signals};

/// An axis with a sliding curve for each direction; units as the axis has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisModel<T> {
    /// Moving mass or inertia [kg or kg m²].
    pub inertia: T,
    /// Friction against positive velocity.
    pub positive: Stribeck<T>,
    /// Friction against negative velocity, as magnitudes.
    pub negative: Stribeck<T>,
    /// Constant force against positive motion [N or N m].
    pub offset: T,
    /// Time constant of the drive [s]; 0 is none.
    pub lag: T,
}

/// Coulomb and viscous friction as a sliding curve.
pub fn coulomb<T: Scalar>(coulomb: T, viscous: T) -> Stribeck<T> {
    Stribeck {
        breakaway_torque: coulomb,
        kinetic_torque: coulomb,
        stribeck_velocity: T::of(1.0),
        viscous_friction: viscous,
        decay: Decay::Exponential,
    }
}

impl<T: Scalar> AxisModel<T> {
    /// Force that keeps a velocity up [N or N m]; the offset alone at rest.
    pub fn steady_force(&self, velocity: T) -> T {
        let zero = T::of(0.0);
        let negative = self.negative.torque(velocity);
        velocity.gt(zero).select(self.positive.torque(velocity), negative) + self.offset
    }

    /// One sub-step of `dt` [s]: the new position and velocity under a drive force.
    #[inline(always)]
    fn advance(&self, (position, velocity): (T, T), force: T, dt: T) -> (T, T) {
        let zero = T::of(0.0);
        let speed = velocity.abs();
        let viscous = velocity.gt(zero).select(self.positive.viscous_friction, self.negative.viscous_friction);
        let free = force - self.offset - viscous * velocity;
        let arrest = self.inertia * velocity / dt + free;
        let level = arrest.gt(zero).select(self.positive.level(speed), self.negative.level(speed));
        let next = velocity + dt / self.inertia * (free - arrest.clamp(-level, level));
        (position + T::of(0.5) * dt * (velocity + next), next)
    }
}

/// What the closed loop would have done.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedLoop<T> {
    /// The samples that were simulated.
    pub range: Range<usize>,
    /// Position at each.
    pub position: Vec<T>,
    /// Command of the controller at each [V].
    pub command: Vec<T>,
}

/// Sub-steps of the axis in a sampling period.
const SUB_STEPS: usize = 20;

/// What surrounds the axis in a recording.
#[derive(Clone, Copy, Debug)]
pub struct Loop<'a> {
    /// The recording.
    pub signals: &'a Signals,
    /// Its reference position.
    pub reference: &'a [f64],
    /// Its motion, for the state at the start.
    pub motion: &'a Motion,
    /// The controller.
    pub controller: Cascade,
    /// Force per command [N/V or N m/V].
    pub gain: f64,
}

impl Loop<'_> {
    /// Simulates samples from the measured state at the first of them; the recorded command is not used.
    ///
    /// # Panics
    /// If the range does not begin with two samples before it, or ends beyond the recording.
    pub fn simulate<T: Scalar>(&self, model: &AxisModel<T>, range: Range<usize>) -> ClosedLoop<T> {
        assert!(range.start >= 2, "the controller remembers two positions");
        let Cascade { position_gain, velocity_gain, limit } = self.controller;
        let dt = T::of(self.signals.period / SUB_STEPS as f64);
        let approach = T::of(1.0) - (-(dt / model.lag)).exp();
        let first = range.start;
        let mut axis = (T::of(self.motion.position[first]), T::of(self.motion.velocity[first]));
        let mut before = [1, 2].map(|k| T::of(self.signals.position[first - k]));
        let mut drive = T::of(self.motion.force[first - 1]);
        let mut run = ClosedLoop { range: range.clone(), position: Vec::new(), command: Vec::new() };
        for i in range {
            // The difference of two means of neighbours spans two periods.
            let rate = (axis.0 - before[1]) * T::of(0.5 / self.signals.period);
            let wanted = T::of(position_gain) * (T::of(self.reference[i]) - axis.0);
            let command = (T::of(velocity_gain) * (wanted - rate)).clamp(T::of(-limit), T::of(limit));
            run.position.push(axis.0);
            run.command.push(command);
            before = [axis.0, before[0]];
            let injected = self.signals.injected.as_ref().map_or(0.0, |w| w[i]);
            let force = T::of(self.gain) * (command + T::of(injected));
            for _ in 0..SUB_STEPS {
                drive = drive + approach * (force - drive);
                axis = model.advance(axis, drive, dt);
            }
        }
        run
    }

    /// How far a simulation is from the recording, without its first `skip` samples.
    pub fn compare(&self, run: &ClosedLoop<f64>, skip: usize) -> Prediction {
        let (mut error, mut square, mut distance, mut samples) = (0.0, 0.0, 0.0, 0usize);
        for (k, i) in run.range.clone().enumerate().skip(skip) {
            error += (self.signals.command[i] - run.command[k]).powi(2);
            square += self.signals.command[i].powi(2);
            distance += (self.signals.position[i] - run.position[k]).powi(2);
            samples += 1;
        }
        Prediction {
            voltage_error: (error / square).sqrt(),
            voltage_rms: (error / samples as f64).sqrt(),
            position_rms: (distance / samples as f64).sqrt(),
        }
    }
}

/// Distance between a simulation and a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// ‖u − û‖/‖u‖.
    pub voltage_error: f64,
    /// rms(u − û) [V].
    pub voltage_rms: f64,
    /// rms(q − q̂) [m or rad].
    pub position_rms: f64,
}
