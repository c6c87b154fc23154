//! The identified axis, and its closed loop with the known controller.
//!
//! ```text
//! M·q̈ = K·s − F(q̇) − F_0,   τ·ṡ = u − s,   u = limited(k_v·(k_p·(r − q) − v)) + injected
//! ```
//!
//! Without bristles the axis sticks exactly: within a sub-step friction is the force that would stop the axis, limited
//! to the sliding curve of the direction of motion or push (Moreau's time stepping). There is no regularised sign,
//! hence no creep. With bristles friction is LuGre on the sliding curve of the present direction.

use std::ops::Range;

use multiversion::multiversion;
use stickslip_core::friction::{Bend, DampingVelocity, Decay, Fading, LuGre, Stribeck, advance};
use stickslip_core::scalar::{Mask, Scalar};

use super::motion::Motion;
use crate::machine::{Cascade, Controller, Machine, Signals};
use stickslip_base::{Error, Watch};

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
    /// Presliding; without bristles the axis sticks.
    pub bristles: Option<Bristles<T>>,
}

/// Bristles of LuGre on the sliding curves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristles<T> {
    /// σ₀ [N/m or N m/rad].
    pub stiffness: T,
    /// σ₁ at rest [N s/m or N m s/rad].
    pub damping: T,
    /// v_c at which the damping has faded to half [m/s or rad/s].
    pub damping_velocity: T,
}

/// Position, velocity and bristle deflection.
#[derive(Clone, Copy, Debug)]
struct AxisState<T> {
    position: T,
    velocity: T,
    deflection: T,
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
    /// Force at a constant velocity [N or N m]; the offset alone at rest.
    pub fn steady_force(&self, velocity: T) -> T {
        let zero = T::of(0.0);
        let negative = self.negative.torque(velocity);
        velocity.gt(zero).select(self.positive.torque(velocity), negative) + self.offset
    }

    /// Deflection of the bristles after long motion at a velocity.
    fn steady_deflection(&self, velocity: T) -> T {
        let level = self.side(velocity).level(velocity.abs());
        self.bristles.map_or(T::of(0.0), |b| velocity.sign() * level / b.stiffness)
    }

    /// The curve for motion or push of this sign.
    #[inline(always)]
    fn side(&self, sign: T) -> Stribeck<T> {
        let forward = sign.gt(T::of(0.0));
        let (p, n) = (self.positive, self.negative);
        Stribeck {
            breakaway_torque: forward.select(p.breakaway_torque, n.breakaway_torque),
            kinetic_torque: forward.select(p.kinetic_torque, n.kinetic_torque),
            stribeck_velocity: forward.select(p.stribeck_velocity, n.stribeck_velocity),
            viscous_friction: forward.select(p.viscous_friction, n.viscous_friction),
            decay: Decay::Exponential,
        }
    }

    /// One sub-step under a drive force.
    #[inline(always)]
    fn advance(&self, axis: AxisState<T>, force: T, step: &Step<T>) -> AxisState<T> {
        let Step { dt, kick, hold, .. } = *step;
        let AxisState { position, velocity, deflection } = axis;
        let moving = self.side(velocity);
        let free = force - self.offset - moving.viscous_friction * velocity;
        let (deflection, friction) = match self.bristles {
            None => {
                let arrest = hold * velocity + free;
                let level = self.side(arrest).level(velocity.abs());
                (deflection, arrest.clamp(-level, level))
            }
            Some(bristles) => {
                let bend = Bend { deflection, probe: deflection, velocity, dt };
                advance(&bristles.lugre(moving), bend)
            }
        };
        let next = velocity + kick * (free - friction);
        AxisState { position: position + T::of(0.5) * dt * (velocity + next), velocity: next, deflection }
    }
}

/// Numbers of a sub-step.
#[derive(Clone, Copy)]
struct Step<T> {
    /// Duration [s].
    dt: T,
    /// dt/M.
    kick: T,
    /// M/dt.
    hold: T,
    /// Share by which the drive approaches its command.
    approach: T,
}

/// Steps of axis and drive under a force. The width of the vectors, for the derivatives of dual numbers, is chosen at run
/// time for the processor; the bits are the same.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn take<T: Scalar>(
    model: &AxisModel<T>,
    axis: &mut AxisState<T>,
    drive: &mut T,
    force: T,
    steps: usize,
    step: &Step<T>,
) {
    for _ in 0..steps {
        *drive = *drive + step.approach * (force - *drive);
        *axis = model.advance(*axis, *drive, step);
    }
}

impl<T: Scalar> Bristles<T> {
    /// Bristles whose damping fades as late as passivity allows: v_c = 8·min g/σ₁, see [`LuGre`].
    pub fn passive(stiffness: T, damping: T, sides: [&Stribeck<T>; 2]) -> Self {
        let [a, b] = sides.map(|s| s.breakaway_torque.min(s.kinetic_torque));
        Bristles { stiffness, damping, damping_velocity: T::of(8.0) * a.min(b) / damping }
    }

    #[inline(always)]
    fn lugre(&self, sliding: Stribeck<T>) -> LuGre<T> {
        let fading = Fading::Rational(DampingVelocity { velocity: self.damping_velocity });
        LuGre { sliding, bristle_stiffness: self.stiffness, bristle_damping: self.damping, fading }
    }
}

/// Simulated closed loop.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedLoop<T> {
    /// Range of the simulated samples.
    pub range: Range<usize>,
    /// Position at each.
    pub position: Vec<T>,
    /// Command of the controller at each, in its SI unit.
    pub command: Vec<T>,
}

/// Surroundings of the axis in a recording.
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
    /// Force or torque per command in its SI unit.
    pub gain: f64,
    /// Steps of the axis in a sampling period; [`SUB_STEPS`](Self::SUB_STEPS) by default.
    pub sub_steps: usize,
}

impl<'a> Loop<'a> {
    /// The loop of a machine file; none where the controller is unknown or its reference was not recorded.
    pub fn of(signals: &'a Signals, motion: &'a Motion, machine: &Machine) -> Option<Self> {
        let (Controller::Cascade(controller), Some(reference)) = (machine.controller, &signals.reference) else {
            return None;
        };
        Some(Loop { signals, reference, motion, controller, gain: machine.gain, sub_steps: Self::SUB_STEPS })
    }

    /// 50 µs at a sampling rate of 1 kHz: twice as many change the prediction errors of the EMPS by a share of 5e-4.
    pub const SUB_STEPS: usize = 20;

    /// Simulates samples from the measured state at the first of them; the recorded command is not used.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    ///
    /// # Panics
    /// If the range starts before the third sample, or ends beyond the recording.
    pub fn simulate<T: Scalar>(
        &self,
        model: &AxisModel<T>,
        range: Range<usize>,
        watch: &Watch,
    ) -> Result<ClosedLoop<T>, Error> {
        assert!(range.start >= 2, "the controller remembers two positions");
        let Cascade { position_gain, velocity_gain, limit } = self.controller;
        let dt = T::of(self.signals.period / self.sub_steps as f64);
        let approach = T::of(1.0) - (-(dt / model.lag)).exp();
        let step = Step { dt, kick: dt / model.inertia, hold: model.inertia / dt, approach };
        let first = range.start;
        let (position, velocity) = (T::of(self.motion.position[first]), T::of(self.motion.velocity[first]));
        let mut axis = AxisState { position, velocity, deflection: model.steady_deflection(velocity) };
        let mut before = [1, 2].map(|k| T::of(self.signals.position[first - k]));
        let mut drive = T::of(self.motion.force[first - 1] + self.motion.offset);
        let mut run = ClosedLoop { range: range.clone(), position: Vec::new(), command: Vec::new() };
        for i in range {
            // A thousand samples take some milliseconds.
            if i % 1000 == 0 {
                watch.check()?;
            }
            // The difference of two means of neighbours spans two periods.
            let rate = (axis.position - before[1]) * T::of(0.5 / self.signals.period);
            let velocity = T::of(position_gain) * (T::of(self.reference[i]) - axis.position);
            let command = (T::of(velocity_gain) * (velocity - rate)).clamp(T::of(-limit), T::of(limit));
            run.position.push(axis.position);
            run.command.push(command);
            before = [axis.position, before[0]];
            let injected = self.signals.injected.as_ref().map_or(0.0, |w| w[i]);
            let force = T::of(self.gain) * (command + T::of(injected));
            take(model, &mut axis, &mut drive, force, self.sub_steps, &step);
        }
        Ok(run)
    }

    /// Recorded minus simulated command, without the first `skip` samples.
    pub(super) fn misses(&self, run: &ClosedLoop<f64>, skip: usize) -> Vec<f64> {
        let pairs = self.signals.command[run.range.clone()].iter().zip(&run.command).skip(skip);
        pairs.map(|(measured, predicted)| measured - predicted).collect()
    }

    /// Distance of a simulation from the recording, without its first `skip` samples.
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
    /// rms(u − û), in the SI unit of the command.
    pub voltage_rms: f64,
    /// rms(q − q̂) [m or rad].
    pub position_rms: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A loop around an axis at rest, with the reference at this distance.
    fn at_rest<R>(distance: f64, look: impl Fn(&Loop<'_>) -> R) -> R {
        const SAMPLES: usize = 20_000;
        let zeros = vec![0.0; SAMPLES];
        let signals = Signals { period: 1e-3, position: zeros.clone(), command: zeros.clone(), ..Signals::default() };
        let motion = Motion {
            offset: 0.0,
            inertia: None,
            period: 1e-3,
            position: zeros.clone(),
            velocity: zeros.clone(),
            acceleration: zeros.clone(),
            force: zeros.clone(),
            smooth_force: zeros,
        };
        let controller = Cascade { position_gain: 160.0, velocity_gain: 240.0, limit: 10.0 };
        let reference = vec![distance; SAMPLES];
        let gain = 35.0;
        look(&Loop { signals: &signals, reference: &reference, motion: &motion, controller, gain, sub_steps: 20 })
    }

    fn simulated(around: &Loop<'_>, model: &AxisModel<f64>, range: Range<usize>) -> ClosedLoop<f64> {
        around.simulate(model, range, &Watch::silent()).unwrap()
    }

    #[test]
    fn a_simulation_ends_when_it_is_cancelled() {
        let watch = Watch::new(std::sync::Arc::new(true.into()), |_, _| {});
        at_rest(1.0, |around| {
            assert!(matches!(around.simulate(&axis(), 2..20_000, &watch), Err(Error::Cancelled)));
        });
    }

    fn axis() -> AxisModel<f64> {
        let side = coulomb(20.0, 200.0);
        AxisModel { inertia: 95.0, positive: side, negative: side, offset: 3.0, lag: 3e-4, bristles: None }
    }

    #[test]
    fn an_axis_below_breakaway_does_not_move_and_above_it_moves() {
        // Breakaway against the offset: 23 N forward, 17 N backward, at 1.344e6 N per metre of distance.
        for (distance, moves) in [(1.70e-5, false), (1.72e-5, true), (-1.26e-5, false), (-1.27e-5, true)] {
            let last = at_rest(distance, |around| *simulated(around, &axis(), 2..20_000).position.last().unwrap());
            assert_eq!(last != 0.0, moves, "{distance}: {last}");
            assert!(!moves || last * distance > 0.0);
        }
    }

    #[test]
    fn the_command_is_limited_and_the_injected_signal_is_not() {
        at_rest(1.0, |around| {
            let mut signals = around.signals.clone();
            signals.injected = Some(vec![-10.0; signals.position.len()]);
            let balanced = Loop { signals: &signals, ..*around };
            let run = simulated(&balanced, &AxisModel { offset: 0.0, ..axis() }, 2..500);
            assert!(run.command.iter().all(|u| *u == 10.0));
            // 10 V of the controller against 10 V injected: the drive gets nothing.
            assert!(run.position.iter().all(|q| *q == 0.0));
            assert!(simulated(around, &axis(), 2..500).position[400] > 0.1);
        });
    }

    #[test]
    fn bristles_hold_elastically_and_slide_on_the_curve() {
        let mut model = axis();
        model.bristles = Some(Bristles::passive(9e5, 3e3, [&model.positive, &model.negative]));
        let last = at_rest(1.5e-5, |around| *simulated(around, &model, 2..20_000).position.last().unwrap());
        // Spring of the loop against spring of the bristles: 1.344e6·(1.5e-5 − q) = 9e5·q + 3, less what slides.
        let elastic = (1.344e6 * 1.5e-5 - 3.0) / (1.344e6 + 9e5);
        assert!(last > elastic && last < 1.5e-5, "{last} {elastic}");
        assert_eq!(model.steady_force(0.1), 20.0 + 200.0 * 0.1 + 3.0);
        assert_eq!(model.steady_force(-0.1), -(20.0 + 200.0 * 0.1) + 3.0);
    }
}
