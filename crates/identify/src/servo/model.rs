//! A geared servo that moves a pendulum, and its closed loop with the servo's own position controller.
//!
//! ```text
//! J·q̈ = M_M + M_W − M_R,     M_W = −m·g·l·sin(q + q_0),     J = J_A + m·l²
//! M_M = k·i,                 i = (U·duty − k·q̇)/(R + R_S·duty²),     duty = limited(gain·(r(t − T) − q))
//! M_R ∈ [−g, g] + b·q̇,       g = M_K + drop(q̇)·(M_S − M_K)
//! M_K = c + |l_W·M_W − l_M·M_M|
//! M_S − M_K = s + |s_W·M_W − s_M·M_M| + quadratic
//! ```
//!
//! The motor is driven by a share of the supply, whose source has a resistance R_S: it carries duty·i. Friction of the
//! gear rises with the transmitted torque: Duclusaud, Passault, Padois, Ly (2025), models M1 … M6, each a special case
//! of this one. `quadratic` acts where weight and motor act against each other: the square of the smaller of both
//! torques times its own coefficient. `drop` and true stick are those of the sliding curve ([`Stribeck`]) within
//! [`Static`].

use stickslip_core::Fields;
use stickslip_core::friction::{Decay, Exponent, Static, Stribeck};
use stickslip_core::scalar::{Mask, Scalar};

use super::super::axis::coulomb;
use super::fit::fields;
use crate::machine::Run;
use stickslip_base::{Error, Watch};

/// How rich the friction is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Coulomb and viscous friction.
    Coulomb,
    /// The same with more friction at rest.
    Stribeck,
    /// Coulomb friction that rises with the torque through the gear.
    Load,
    /// Both, and friction at rest rises with that torque, too.
    StribeckLoad,
    /// The same with separate coefficients for motor and weight.
    Directional,
    /// The same with friction at rest that rises with the square of the smaller torque.
    Quadratic,
}

impl Kind {
    /// All, each richer than some before it.
    pub const ALL: [Kind; 6] =
        [Kind::Coulomb, Kind::Stribeck, Kind::Load, Kind::StribeckLoad, Kind::Directional, Kind::Quadratic];

    /// Name in files.
    pub fn name(self) -> &'static str {
        ["coulomb", "stribeck", "load", "stribeck_load", "directional", "quadratic"][self as usize]
    }

    /// Title.
    pub fn title(self) -> &'static str {
        [
            "Coulomb and viscous",
            "Stribeck",
            "Load-dependent",
            "Stribeck, load-dependent",
            "Directional load",
            "Quadratic directional load",
        ][self as usize]
    }

    /// Whether another model has all parameters of this one.
    pub fn is_within(self, other: Kind) -> bool {
        self != other && fields().iter().all(|field| other.has(field.name) || !self.has(field.name))
    }

    fn has_drop(self) -> bool {
        !matches!(self, Kind::Coulomb | Kind::Load)
    }

    fn has_load(self) -> bool {
        !matches!(self, Kind::Coulomb | Kind::Stribeck)
    }

    fn is_directional(self) -> bool {
        matches!(self, Kind::Directional | Kind::Quadratic)
    }

    /// Whether a parameter, by its name, is part of the model.
    pub fn has(self, parameter: &str) -> bool {
        match parameter {
            "stribeck" | "stribeck_velocity" | "exponent" => self.has_drop(),
            "motor_load" => self.has_load(),
            "motor_load_stribeck" => self.has_load() && self.has_drop(),
            "weight_load" | "weight_load_stribeck" => self.is_directional(),
            "motor_load_quadratic" | "weight_load_quadratic" => self == Kind::Quadratic,
            _ => true,
        }
    }
}

/// The parameters of servo and gear, on the output shaft. Parameters outside a kind are 0.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Servo<T> {
    /// Torque constant of the motor behind its gear.
    #[field(symbol = "k", unit = "N m/A", range = 1e-3..=100.0, default = 0.5)]
    pub torque_constant: T,
    /// Resistance of the winding.
    #[field(symbol = "R", unit = "Ω", range = 1e-3..=1e3, default = 5.0)]
    pub resistance: T,
    /// Resistance of supply and cable.
    #[field(symbol = "R_S", unit = "Ω", range = 0.0..=1e3, default = 0.3)]
    pub source_resistance: T,
    /// Moment of inertia of motor and gear.
    #[field(symbol = "J_A", unit = "kg m^2", range = 0.0..=100.0, default = 1e-3)]
    pub armature: T,
    /// Angle of the pendulum at encoder position 0.
    #[field(symbol = "q_0", unit = "rad", range = -0.5..=0.5)]
    pub offset: T,
    /// Delay between recorded and effective reference.
    #[field(symbol = "T", unit = "s", range = -0.05..=0.05)]
    pub delay: T,
    /// Viscous friction.
    #[field(symbol = "b", unit = "N m s/rad", range = 0.0..=50.0, default = 5e-3)]
    pub viscous: T,
    /// Coulomb friction without load.
    #[field(symbol = "c", unit = "N m", range = 0.0..=200.0, default = 0.02)]
    pub coulomb: T,
    /// Additional friction at rest.
    #[field(symbol = "s", unit = "N m", range = 0.0..=200.0, default = 0.01)]
    pub stribeck: T,
    /// Stribeck velocity.
    #[field(symbol = "Ω_Strib", unit = "rad/s", range = 0.05..=10.0, default = 1.0)]
    pub stribeck_velocity: T,
    /// Exponent of the drop.
    #[field(symbol = "δ", unit = "1", range = 0.3..=10.0, default = 1.0)]
    pub exponent: T,
    /// Friction per torque of the motor; without direction, per torque through the gear.
    #[field(symbol = "l_M", unit = "1", range = 0.0..=1.0, default = 0.2)]
    pub motor_load: T,
    /// Friction per torque of the weight.
    #[field(symbol = "l_W", unit = "1", range = 0.0..=1.0, default = 0.05)]
    pub weight_load: T,
    /// Additional `motor_load` at rest.
    #[field(symbol = "s_M", unit = "1", range = 0.0..=1.0, default = 0.05)]
    pub motor_load_stribeck: T,
    /// Additional `weight_load` at rest.
    #[field(symbol = "s_W", unit = "1", range = 0.0..=1.0, default = 0.05)]
    pub weight_load_stribeck: T,
    /// Friction at rest per square of the motor's torque where the weight moves it.
    #[field(symbol = "q_M", unit = "1/(N m)", range = 0.0..=10.0, default = 0.02)]
    pub motor_load_quadratic: T,
    /// Friction at rest per square of the weight's torque where the motor lifts it.
    #[field(symbol = "q_W", unit = "1/(N m)", range = 0.0..=10.0, default = 0.02)]
    pub weight_load_quadratic: T,
}

/// Longest step of a simulation [s]. Half of it changes the error on unseen runs by less than 2 % of itself.
pub(super) const STEP: f64 = 1e-3;

impl<T: Scalar> Servo<T> {
    /// Torque of the motor [N m] at a duty and a velocity [rad/s].
    #[inline(always)]
    fn motor(&self, supply: T, duty: T, velocity: T) -> T {
        let resistance = self.resistance + self.source_resistance * duty * duty;
        self.torque_constant * (supply * duty - self.torque_constant * velocity) / resistance
    }

    /// The sliding curve of the gear under these torques of motor and weight.
    #[inline(always)]
    pub fn gear(&self, kind: Kind, motor: T, weight: T) -> Stribeck<T> {
        let rising = |by_motor: T, by_weight: T| {
            let by_weight = if kind.is_directional() { by_weight } else { by_motor };
            (by_weight * weight - by_motor * motor).abs()
        };
        let mut sliding = self.coulomb;
        if kind.has_load() {
            sliding += rising(self.motor_load, self.weight_load);
        }
        if !kind.has_drop() {
            return coulomb(sliding, self.viscous);
        }
        let mut rest = self.stribeck;
        if kind.has_load() {
            rest += rising(self.motor_load_stribeck, self.weight_load_stribeck);
        }
        if kind == Kind::Quadratic {
            let zero = T::of(0.0);
            let lifts = weight.abs().lt(motor.abs());
            let smaller =
                lifts.select(self.weight_load_quadratic * weight * weight, self.motor_load_quadratic * motor * motor);
            rest += (weight * motor).lt(zero).select(smaller, zero);
        }
        Stribeck {
            breakaway_torque: sliding + rest,
            kinetic_torque: sliding,
            stribeck_velocity: self.stribeck_velocity,
            viscous_friction: self.viscous,
            decay: Decay::Power(Exponent { exponent: self.exponent }),
        }
    }

    /// The angle at each sample of a run [rad], from rest at the first measured one; no other measurement is used.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn simulate(&self, kind: Kind, run: &Run, watch: &Watch) -> Result<Vec<T>, Error> {
        self.simulate_in_steps(kind, run, STEP, None, watch)
    }

    /// The same in steps of at most `step` [s]. With a `memory` [s] the simulation is drawn to the measured angle as by
    /// an observer with a double pole at 1/`memory`, and returns predictions.
    pub(super) fn simulate_in_steps(
        &self,
        kind: Kind,
        run: &Run,
        step: f64,
        memory: Option<f64>,
        watch: &Watch,
    ) -> Result<Vec<T>, Error> {
        let [gain, supply, weight] = [run.gain, run.supply, run.weight].map(T::of);
        let inertia = self.armature + T::of(run.inertia);
        let one = T::of(1.0);
        let (mut position, mut velocity) = (T::of(run.position[0]), T::of(0.0));
        let mut positions = vec![position];
        for i in 1..run.time.len() {
            if i % 256 == 0 {
                watch.check()?;
            }
            let span = run.time[i] - run.time[i - 1];
            let steps = (span / step).ceil().max(1.0);
            let slope = (run.reference[i] - run.reference[i - 1]) / span;
            let dt = span / steps;
            let (kick, hold) = (T::of(dt) / inertia, inertia / T::of(dt));
            for k in 0..steps as usize {
                let reference = T::of(run.reference[i - 1] + slope * (k as f64 * dt)) - T::of(slope) * self.delay;
                let duty = (gain * (reference - position)).clamp(-one, one);
                let motor = T::of(run.enabled[i - 1]) * self.motor(supply, duty, velocity);
                let weight = -(weight * (position + self.offset).sin());
                let gear = self.gear(kind, motor, weight);
                let free = motor + weight - gear.viscous_friction * velocity;
                let friction = Static { sliding: gear }.torque(velocity, hold * velocity + free);
                let next = velocity + kick * (free - friction);
                position += T::of(0.5 * dt) * (velocity + next);
                velocity = next;
            }
            positions.push(position);
            if let Some(memory) = memory {
                let error = T::of(run.position[i]) - position;
                position += T::of(2.0 * span / memory) * error;
                velocity += T::of(span / (memory * memory)) * error;
            }
        }
        Ok(positions)
    }
}
