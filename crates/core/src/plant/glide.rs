//! Long steps while the machine slides steadily.
//!
//! A short step is needed where friction changes within it: at standstill, in presliding, at reversals and at fast
//! changes of speed. In steady sliding a step of several times the length has the same accuracy. Whether a tick is
//! taken in long steps is decided once, at its start.

use core::f64::consts::TAU;

use super::{Arm, Backlash, Machine, MachineInput, MachineState, Plant, PlantInput, PlantState, Seen, VirtualMachine};
use crate::Fields;
use crate::drive::{INPUTS, STATES, half_flow};
use crate::fields::Fields as _;
use crate::friction::{Friction, Memory};
use crate::scalar::{Mask, Scalar};
use crate::sensor::Pickups;
use crate::tick::Measurement;

/// Most steps in a long step.
const MOST: usize = 5;

/// Largest change of the velocities in a tick, and largest rate of the bristles, both as a share of the velocity.
const STEADY: f64 = 0.01;

/// Largest phase of the coupling's free vibration in a long step [rad], as in the bound of a step, and largest share of a
/// velocity that viscous friction takes away in it.
const SMALL: f64 = 0.5;

/// A virtual machine that takes long steps in steady sliding.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct GlidingMachine<T> {
    /// The machine in short steps.
    pub short: VirtualMachine<T>,
    /// Its long steps.
    pub glide: Glide<T>,
}

/// Long steps of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Glide<T> {
    /// Short steps in a long step. 1: no long steps.
    #[field(fixed)]
    steps: usize,
    /// Largest relative change of a velocity in a tick that is taken in long steps; −1: none is.
    #[field(unit = "1")]
    steady: T,
    /// Moving parts, prepared for a long step.
    parts: Machine<T>,
    /// Changes of the velocities of motor and load in a tick: one column for each state and each input.
    #[field(unit = "1")]
    change: [[T; 2]; STATES + INPUTS],
    /// Share of a change of the motor's velocity in a long step by which the tacho's low-pass sees more than the mean, so
    /// that it follows a ramp exactly.
    #[field(unit = "1")]
    ramp: T,
}

impl<T: Scalar> GlidingMachine<T> {
    /// The machine of these parts, which are prepared for steps of `dt` [s].
    pub fn new(parts: Machine<T>, dt: T) -> Self {
        GlidingMachine { short: VirtualMachine { parts }, glide: Glide::new(&parts, dt) }
    }

    /// As [`new`](Self::new), without long steps.
    pub fn in_short_steps(parts: Machine<T>, dt: T) -> Self {
        let mut machine = Self::new(parts, dt);
        machine.glide.steps = 1;
        machine
    }

    /// Presses the linings of the wheel: factor of its friction, 0 to 1.
    pub fn set_preload(&mut self, preload: T) {
        self.short.parts.plant.wheel.preload = preload;
        self.glide.parts.plant.wheel.preload = preload;
    }

    /// As [`VirtualMachine::take`], in long steps if the machine slides steadily.
    #[inline(always)]
    pub fn take(&self, steps: usize, state: &mut PlantState<T>, input: PlantInput<T>, dt: T) -> Measurement<T> {
        self.glide.take(&self.short, steps, state, input, dt)
    }
}

impl<T: Scalar> Glide<T> {
    /// A tick of this machine: see [`GlidingMachine::take`].
    #[inline(always)]
    pub(crate) fn take(
        &self,
        short: &VirtualMachine<T>,
        steps: usize,
        state: &mut PlantState<T>,
        input: PlantInput<T>,
        dt: T,
    ) -> Measurement<T> {
        let held = short.held(input);
        let (long, rest) = if self.steps > 1 { (steps / self.steps, steps % self.steps) } else { (0, steps) };
        let steady = self.is_steady(&short.parts, &state.machine, held.0);
        let glides = long > 0 && steady.anywhere();
        let creeps = !glides || (!steady).anywhere();
        // Where lanes differ, both are computed, from the same state.
        let before = (glides && creeps).then_some(*state);
        let (mut seen, mut glided) = (Seen::default(), None);
        let pieces = [
            (&self.parts, if glides { long } else { 0 }, Some(self.ramp)),
            (&short.parts, if glides { rest } else { 0 }, None),
            (&short.parts, if creeps { steps } else { 0 }, None),
        ];
        // One loop over all pieces, and one place of the state: the code of a step is long.
        for (number, (parts, count, ramp)) in pieces.into_iter().enumerate() {
            if let (Some(before), 2) = (before, number) {
                glided = Some((*state, seen));
                *state = before;
            }
            if count > 0 {
                let dt = if ramp.is_some() { dt * T::of(self.steps as f64) } else { dt };
                seen = parts.go(count, ramp, state, held, dt);
            }
        }
        if let Some((moved, seen_gliding)) = glided {
            let mut select = |short, long| steady.select(long, short);
            seen = (seen.0.merge(&seen_gliding.0, &mut select), seen.1.merge(&seen_gliding.1, &mut select));
            *state = state.merge(&moved, &mut select);
        }
        short.readings(state, seen, input, dt)
    }

    /// Long steps of a machine prepared for steps of `dt` [s].
    fn new(machine: &Machine<T>, dt: T) -> Self {
        let plant = &machine.plant;
        let steps = (1..=MOST).rev().find(|count| machine.steps.is_multiple_of(*count)).unwrap_or(1);
        let steps = if slides(plant) { steps } else { 1 };
        let long = dt * T::of(steps as f64);
        let flow = |dt: T| half_flow(&plant.drive, &plant.load_motor.winding, plant.servo.lag, dt);
        let mut change = flow(T::of(2.0 * machine.steps as f64) * dt).map(|[_, motor, load, ..]| [motor, load]);
        change[1][0] -= T::of(1.0);
        change[2][1] -= T::of(1.0);
        let pickups = Pickups::new(plant.tacho, plant.accelerometer, long);
        // τ·dy/dt = u − y with u = mean + change·(t/h − ½), at the end of the step, for the mean and for the change.
        let lags = T::of(1.0) / (T::of(TAU) * plant.tacho.bandwidth * long);
        let ramp = T::of(1.0) / pickups.tacho_share - lags - T::of(0.5);
        let parts = Machine { half_flow: flow(long), pickups, ..*machine };
        let steady = stable(plant, long).select(T::of(STEADY), T::of(-1.0));
        Glide { steps, steady, parts, change, ramp }
    }

    /// Whether the machine slides steadily during a tick from this state: with the friction held, neither velocity
    /// changes by more than a hundredth, and the bristles take up less than a hundredth of the motion.
    #[inline(always)]
    fn is_steady(&self, machine: &Machine<T>, state: &MachineState<T>, input: MachineInput<T>) -> T::Mask {
        if self.steps <= 1 {
            return T::of(1.0).lt(T::of(0.0));
        }
        let plant = &machine.plant;
        let (_, induced) = plant.load_motor.ripple.of(&plant.load_motor.winding, state);
        let x = machine.held(state, input, induced).with(state);
        // Without a closure, which is a call in vectors.
        let [motor, load] = self.change[0];
        let (mut motor, mut load) = (motor * x[0], load * x[0]);
        for column in 1..STATES + INPUTS {
            motor += self.change[column][0] * x[column];
            load += self.change[column][1] * x[column];
        }
        // Not `≤`: at rest the machine is not sliding.
        let little = |change: T, velocity: T| change.abs().lt(self.steady * velocity.abs());
        let uniform = little(motor, state.motor_velocity) & little(load, state.velocity);
        if !uniform.anywhere() {
            return uniform;
        }
        let slid = |friction: &Friction<T>, memory: &Memory<T>, velocity: T| {
            little(friction.bending_rate(memory, velocity), velocity)
        };
        uniform
            & slid(&plant.motor_friction, &state.motor_memory, state.motor_velocity)
            & slid(&plant.screw_friction, &state.screw_memory, state.velocity)
            & slid(&plant.wheel.friction, &state.wheel_memory, state.velocity)
    }
}

/// Whether a machine of this configuration can slide steadily: an arm or play can change the torques at any time.
fn slides<T: Scalar>(plant: &Plant<T>) -> bool {
    matches!((&plant.arm, &plant.backlash), (Arm::Nothing, Backlash::Nothing))
        && [&plant.motor_friction, &plant.screw_friction, &plant.wheel.friction].into_iter().all(Friction::is_plain)
}

/// Whether a step of `dt` [s] is stable in sliding.
fn stable<T: Scalar>(plant: &Plant<T>, dt: T) -> T::Mask {
    let drive = &plant.drive;
    let phase_squared =
        dt * dt * drive.coupling_stiffness * drive.inertia() / (drive.motor_inertia * drive.load_inertia);
    let load = plant.screw_friction.viscous() + plant.wheel.friction.viscous();
    phase_squared.le(T::of(SMALL * SMALL))
        & (load * dt).le(T::of(SMALL) * drive.load_inertia)
        & (plant.motor_friction.viscous() * dt).le(T::of(SMALL) * drive.motor_inertia)
}

#[cfg(test)]
#[path = "tests/glide.rs"]
mod tests;
