//! Prediction of hunting, the limit cycle of an integral and stiction about a constant set-point.
//!
//! While the load sticks the integral winds up; it breaks away, slips past the set-point, and sticks again. From
//! standstill to standstill this is a map e → e⁺ of the deviation, and the drive hunts unless the map converges to 0.
//! The map is computed from the modelled drive, coupling, friction with bristles, lags and the controller's sample of
//! delay, under the controller itself, without noise and counts. It is valid for any controller, compensation and hold.
//! For one rigid mass under PID it is the algebra of B. Armstrong, B. Amin, Automatica 32 (1996) 679.
//!
//! The describing function replaces friction by the equivalent damping of a sine. It does not predict hunting and is
//! computed for comparison only: a loop that is stable with any viscous damping, as usual loops are, has no predicted
//! limit cycle for any friction.

use std::f64::consts::{PI, TAU};

use stickslip_core::block::Block as _;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::control::{AxisControl, AxisControlInput, AxisControlState};
use stickslip_core::estimate::{DriveObserver, DriveObserverInput, DriveObserverState};
use stickslip_core::friction::Stribeck;

use super::drive_observer::simulated_drive;
use super::{PositionLoop, axis_control};
use crate::linear::{Operating, size};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};
use stickslip_base::watch::Watch;

/// Speed over [`WINDOW`] below which a load is at a standstill [rad/s].
const STANDS: f64 = 2e-3;
/// Averaging time of a standstill [s].
const WINDOW: f64 = 0.02;
/// Least way of a slip between two standstills [rad]; bristles deflect less before breakaway.
const SLIPPED: f64 = 2e-4;
/// Longest step of the modelled drive [s].
const STEP: f64 = 62.5e-6;

/// A standstill of the load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standstill {
    /// Time of the stop [s].
    pub time: f64,
    /// Set-point minus angle [rad].
    pub deviation: f64,
}

/// A limit cycle about a constant set-point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hunting {
    /// Half the distance between the extremes of the deviation, mean over the cycles [rad].
    pub amplitude: f64,
    /// Mean time from one slip to the next [s].
    pub interval: f64,
    /// Number of slips.
    pub slips: usize,
}

impl Hunting {
    /// The limit cycle in deviations [rad] sampled every `period` [s]; `None` if their extremes are closer than
    /// `resolution` [rad], or the load does not move forth and back twice.
    pub fn find(deviations: &[f64], period: f64, resolution: f64) -> Option<Self> {
        let (low, high) = extremes(deviations);
        let apart = high - low > resolution;
        if !apart {
            return None;
        }
        // From one side to the other, with a dead band against small vibrations.
        let (middle, band) = (0.5 * (low + high), 0.2 * (high - low));
        let mut side = 0i8;
        let mut crossings = Vec::new();
        for (k, deviation) in deviations.iter().enumerate() {
            let now = if deviation - middle > band {
                1
            } else if middle - deviation > band {
                -1
            } else {
                side
            };
            if now != side && side != 0 {
                crossings.push(k);
            }
            side = now;
        }
        let (&first, &last) = (crossings.first()?, crossings.last()?);
        let slips = crossings.len();
        // A single motion forth and back may be its end.
        if slips < 3 {
            return None;
        }
        let amplitudes: Vec<f64> = crossings
            .windows(3)
            .map(|cycle| extremes(&deviations[cycle[0]..cycle[2]]))
            .map(|(low, high)| 0.5 * (high - low))
            .collect();
        Some(Hunting {
            amplitude: amplitudes.iter().sum::<f64>() / amplitudes.len() as f64,
            interval: (last - first) as f64 * period / (slips - 1) as f64,
            slips,
        })
    }
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)))
}

/// The modelled drive under control, at a constant set-point of 0.
#[derive(Clone, Debug)]
pub struct ModelledAxis {
    drive: DriveObserver<f64>,
    control: AxisControl<f64>,
    /// Sampling time of the controller [s].
    period: f64,
}

/// State of the modelled drive.
#[derive(Clone, Copy, Debug)]
struct Running {
    drive: DriveObserverState<f64>,
    control: AxisControlState<f64>,
}

impl ModelledAxis {
    /// The drive of a model with its load friction, under the configured control.
    ///
    /// # Errors
    /// Errors of the control's design.
    pub fn new(model: &Model<f64>, settings: &Settings<f64>) -> Result<Self, Error> {
        let control = axis_control(model, settings)?;
        Self::under(control, model, settings)
    }

    /// The same under this control.
    ///
    /// # Errors
    /// Errors of the drive's preparation.
    pub fn under(control: AxisControl<f64>, model: &Model<f64>, settings: &Settings<f64>) -> Result<Self, Error> {
        let period = settings.control_period();
        let friction = model.own_bristles.under(model.own);
        Ok(ModelledAxis { drive: simulated_drive(model, friction, period, STEP)?, control, period })
    }

    /// At rest with this deviation [rad], without torque.
    fn at(&self, deviation: f64) -> Running {
        let mut drive = DriveObserverState { started: 1.0, ..DriveObserverState::default() };
        drive.drive.angle = -deviation;
        let input = Self::measured(&drive);
        Running { drive, control: self.control.take_over(0.0, input, &AxisControlState::default(), None) }
    }

    fn measured(drive: &DriveObserverState<f64>) -> AxisControlInput<f64> {
        AxisControlInput {
            reference: Setpoint::default(),
            measured_angle: drive.drive.angle,
            measured_velocity: drive.tacho,
        }
    }

    /// One sample of the controller; returns the deviation at its start [rad].
    fn sample(&self, running: &mut Running) -> f64 {
        let input = Self::measured(&running.drive);
        let active_torque = running.control.torque;
        self.control.step(&mut running.control, input, self.period);
        let held = DriveObserverInput { motor_torque: active_torque, ..DriveObserverInput::default() };
        self.drive.step(&mut running.drive, held, self.period);
        -input.measured_angle
    }

    /// Deviations [rad], one for each sample of the controller, from rest with the first of them, for a time [s].
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn run(&self, deviation: f64, duration: f64, watch: &Watch) -> Result<Vec<f64>, Error> {
        let mut running = self.at(deviation);
        let samples = (duration / self.period).round().max(1.0) as usize;
        let mut deviations = Vec::with_capacity(samples);
        for k in 0..samples {
            if k % 4096 == 0 {
                watch.stage("hunting", k as f64 / samples as f64)?;
            }
            deviations.push(self.sample(&mut running));
        }
        Ok(deviations)
    }

    /// Sampling time of the controller [s].
    pub fn period(&self) -> f64 {
        self.period
    }

    /// The largest limit cycle of a plan, with a resolution of `count` [rad], and its deviations [rad]; without the map
    /// from standstill to standstill, in a tenth of its time.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn follow(&self, plan: &HuntingPlan, count: f64, watch: &Watch) -> Result<(Option<Hunting>, Vec<f64>), Error> {
        let mut followed: Option<(Option<Hunting>, Vec<f64>)> = None;
        for start in plan.starts {
            let deviations = self.run(start, plan.duration, watch)?;
            let from = ((plan.from / self.period) as usize).min(deviations.len());
            let hunting = Hunting::find(&deviations[from..], self.period, plan.counts * count);
            let far = |hunting: &Option<Hunting>| hunting.map_or(0.0, |hunting| hunting.amplitude);
            if followed.as_ref().is_none_or(|(other, _)| far(&hunting) > far(other)) {
                followed = Some((hunting, deviations));
            }
        }
        Ok(followed.unwrap_or_default())
    }

    /// The next standstill after one with this deviation [rad]; `None` if the load does not break away within
    /// `patience` [s].
    pub fn next_standstill(&self, deviation: f64, patience: f64) -> Option<Standstill> {
        let mut running = self.at(deviation);
        let window = (WINDOW / self.period).ceil().max(2.0) as usize;
        let mut last = vec![deviation; window];
        let mut slipped = false;
        for k in 0..(patience / self.period) as usize {
            let now = self.sample(&mut running);
            let (low, high) = extremes(&last);
            let stands = high.max(now) - low.min(now) < STANDS * WINDOW;
            slipped |= (now - deviation).abs() > SLIPPED && !stands;
            if slipped && stands {
                return Some(Standstill { time: k as f64 * self.period, deviation: now });
            }
            last[k % window] = now;
        }
        None
    }
}

/// Result of the describing function for a loop: equivalent damping of a sine of a velocity amplitude, and stability of
/// the loop with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Described {
    /// Amplitude of the velocity [rad/s].
    pub amplitude: f64,
    /// Viscous friction with the same work [N m s/rad].
    pub damping: f64,
    /// Largest magnitude of the closed loop's poles in z with it.
    pub radius: f64,
}

/// The describing function of a sliding curve for amplitudes of the velocity [rad/s], on the loop of a controller. It
/// predicts a limit cycle where the radius passes 1.
///
/// # Errors
/// Errors of the linearisation.
pub fn describe(
    control: AxisControl<f64>,
    model: &Model<f64>,
    settings: &Settings<f64>,
    amplitudes: &[f64],
) -> Result<Vec<Described>, Error> {
    let at = |&amplitude: &f64| {
        let damping = equivalent_damping(&model.own, amplitude);
        // This damping is the only friction of the load.
        let none = 1e-6;
        let own = Stribeck { breakaway_torque: none, kinetic_torque: none, viscous_friction: damping, ..model.own };
        let damped = Model { own, ..*model };
        let closes = PositionLoop::new(control, &damped, settings, Operating::Sliding(SLIDING))?;
        let radius = closes.closed()?.poles()?.into_iter().map(size).fold(0.0, f64::max);
        Ok(Described { amplitude, damping, radius })
    };
    amplitudes.iter().map(at).collect()
}

/// Strongest examined damping of the load [N m s/rad], and largest amplitude of its velocity [rad/s].
const STRONGEST: f64 = 2.0;
const FASTEST: f64 = 100.0;
/// Speed at which viscous friction is linearised [rad/s]; its value has no effect.
const SLIDING: f64 = 10.0;

/// Viscous friction [N m s/rad] with the work of a sliding curve in a sine of this velocity amplitude [rad/s]:
///
///   b_eq(V) = 2/(π·V)·∫₀^π M_R(V·sin θ)·sin θ dθ
pub fn equivalent_damping(sliding: &Stribeck<f64>, amplitude: f64) -> f64 {
    const PARTS: usize = 512;
    let sum: f64 = (0..PARTS)
        .map(|k| libm::sin(PI * (k as f64 + 0.5) / PARTS as f64))
        .map(|sine| sliding.magnitude(amplitude * sine) * sine)
        .sum();
    2.0 / (PI * amplitude) * sum * PI / PARTS as f64
}

/// Prediction for a controller at a constant set-point.
#[derive(Clone, Debug)]
pub struct HuntingPrediction {
    /// The limit cycle; `None` if it comes to rest within the resolution.
    pub hunting: Option<Hunting>,
    /// Deviations [rad] of the simulated limit cycle, one for each sample.
    pub deviations: Vec<f64>,
    /// Sampling time [s].
    pub period: f64,
    /// Deviation at a standstill [rad], and after the next slip; `None` without a slip.
    pub map: Vec<(f64, Option<Standstill>)>,
    /// Results of the describing function.
    pub described: Vec<Described>,
    /// Resolution of the encoder [rad].
    pub count: f64,
}

/// Plan of a prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HuntingPlan {
    /// Start deviations [rad]: a drive may hunt from one and come to rest from another.
    pub starts: [f64; 3],
    /// Simulated time [s].
    pub duration: f64,
    /// Start of the evaluation [s].
    pub from: f64,
    /// Largest distance of the extremes, in counts, that is not hunting.
    pub counts: f64,
}

impl Default for HuntingPlan {
    fn default() -> Self {
        HuntingPlan { starts: [0.5, 0.1, 0.02], duration: 30.0, from: 10.0, counts: 3.0 }
    }
}

impl HuntingPlan {
    /// The usual plan over another time [s]: slow controllers hunt slowly.
    pub fn lasting(duration: f64) -> Self {
        let usual = HuntingPlan::default();
        HuntingPlan { duration, from: duration * usual.from / usual.duration, ..usual }
    }
}

/// Predicts whether the modelled drive hunts under the configured control, with amplitude and interval.
///
/// # Errors
/// Errors of the design; [`Error::Cancelled`].
pub fn predict_hunting(
    model: &Model<f64>,
    settings: &Settings<f64>,
    plan: &HuntingPlan,
    watch: &Watch,
) -> Result<HuntingPrediction, Error> {
    let axis = ModelledAxis::new(model, settings)?;
    let count = TAU / model.encoder.counts_per_revolution;
    let (hunting, deviations) = axis.follow(plan, count, watch)?;
    // From a fifth of a count to ten times the way of a slip at breakaway.
    let far = 10.0 * (model.own.breakaway_torque / model.drive.coupling_stiffness).max(10.0 * count);
    const POINTS: usize = 25;
    let near = 0.2 * count;
    let grid = (0..POINTS).map(|k| near * libm::pow(far / near, k as f64 / (POINTS - 1) as f64));
    let map = grid.map(|deviation| (deviation, axis.next_standstill(deviation, plan.duration))).collect();
    // Slower loads are nearly stuck.
    let slow = 4.0 * model.own.breakaway_torque / (PI * STRONGEST);
    let amplitudes: Vec<f64> = (0..13).map(|k| slow * libm::pow(FASTEST / slow, f64::from(k) / 12.0)).collect();
    let described = describe(axis.control, model, settings, &amplitudes)?;
    Ok(HuntingPrediction { hunting, deviations, period: axis.period, map, described, count })
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::Preset;
    use stickslip_base::parameters::presets;
    use stickslip_base::preset::{ControllerChoice, StateFeedback};
    use stickslip_core::control::Pid;
    use stickslip_core::control::compensation::{Hold, StictionHold};

    /// The drive of the comparisons with a friction, under a PID controller with a triple pole at 15 rad/s and half more
    /// of its integral.
    fn prototype(sliding: Stribeck<f64>) -> Preset<f64> {
        let mut preset: Preset<f64> = presets::find("prototype").unwrap().read().unwrap();
        preset.model.own = sliding;
        let pid = super::super::pid_by_bandwidth(Pid::default(), preset.model.drive.inertia(), 15.0).unwrap();
        preset.bench.controller = ControllerChoice::Pid(Pid { integral_gain: 1.5 * pid.integral_gain, ..pid });
        preset
    }

    fn stribeck(breakaway_torque: f64, kinetic_torque: f64) -> Stribeck<f64> {
        Stribeck {
            breakaway_torque,
            kinetic_torque,
            stribeck_velocity: 0.5,
            viscous_friction: 2e-3,
            ..Stribeck::default()
        }
    }

    fn predicted(preset: &Preset<f64>) -> HuntingPrediction {
        predict_hunting(&preset.model, &preset.bench, &HuntingPlan::default(), &Watch::silent()).unwrap()
    }

    #[test]
    fn a_friction_with_a_stribeck_drop_hunts_under_an_integral_and_one_without_comes_to_rest() {
        let drops = predicted(&prototype(stribeck(0.45, 0.2)));
        assert!(drops.hunting.is_some_and(|hunting| hunting.slips > 5), "{:?}", drops.hunting);
        assert_eq!(predicted(&prototype(stribeck(0.2, 0.2))).hunting, None);
        // No integral, no hunting.
        let mut alone = prototype(stribeck(0.45, 0.2));
        if let ControllerChoice::Pid(pid) = &mut alone.bench.controller {
            pid.integral_gain = 0.0;
        }
        assert_eq!(predicted(&alone).hunting, None);
        // The hold against stiction is included: a dead zone as wide as the cycle ends it.
        let mut with_hold = prototype(stribeck(0.45, 0.2));
        with_hold.bench.hold = Hold::Stiction(StictionHold { dead_zone: 0.5, ..StictionHold::default() });
        assert_eq!(predicted(&with_hold).hunting, None);
    }

    #[test]
    fn the_map_of_one_rigid_mass_is_that_of_armstrongs_algebra() {
        let mut preset = prototype(stribeck(0.45, 0.2));
        // Nearly rigid, without delay, with stiff bristles.
        preset.model.drive.coupling_stiffness *= 100.0;
        preset.model.servo_lag = 2e-5;
        preset.model.drive_lag = 4e-5;
        preset.model.own_bristles.stiffness *= 10.0;
        preset.bench.tick_rate = 10_000.0;
        preset.bench.control_divider = 1.0;
        let ControllerChoice::Pid(pid) = preset.bench.controller else { panic!("a PID controller") };
        let axis = ModelledAxis::new(&preset.model, &preset.bench).unwrap();
        let inertia = preset.model.drive.inertia();
        for deviation in [0.01, 0.03, 0.1] {
            let next = axis.next_standstill(deviation, 30.0).unwrap();
            // At the breakaway P and I together hold M_S; then J·Ω̇ = K_p·e + I − K_d·Ω − M_R(Ω) until it rests.
            let own = preset.model.own;
            let (mut e, mut velocity) = (deviation, 1e-9);
            let mut integral = own.breakaway_torque - pid.proportional_gain * deviation;
            let dt = 1e-6;
            while velocity > 0.0 {
                let torque = pid.proportional_gain * e + integral - pid.derivative_gain * velocity;
                velocity += dt / inertia * (torque - own.magnitude(velocity));
                e -= dt * velocity;
                integral += dt * pid.integral_gain * e;
                if velocity <= 0.0 && e == deviation {
                    velocity = 1e-6;
                }
            }
            // The tolerance of a tenth covers the sample of delay and the bristles.
            assert!((next.deviation - e).abs() < 0.1 * deviation.max(e.abs()), "{deviation}: {next:?} instead of {e}");
        }
    }

    #[test]
    fn the_describing_function_predicts_no_hunting_where_there_is() {
        for controller in [None, Some(ControllerChoice::StateFeedback(StateFeedback::default()))] {
            let mut preset = prototype(stribeck(0.45, 0.2));
            preset.bench.controller = controller.unwrap_or(preset.bench.controller);
            let prediction = predicted(&preset);
            assert!(prediction.described.iter().all(|it| it.radius < 1.0), "{:?}", prediction.described);
        }
        // The guard fires: a loop that is unstable without friction.
        let mut wild = prototype(stribeck(0.45, 0.2));
        if let ControllerChoice::Pid(pid) = &mut wild.bench.controller {
            pid.integral_gain *= 50.0;
        }
        assert!(predicted(&wild).described.iter().any(|it| it.radius > 1.0));
    }

    #[test]
    fn the_equivalent_damping_of_coulomb_friction_is_four_over_pi_of_it_per_velocity() {
        let coulomb = Stribeck { viscous_friction: 3e-3, ..stribeck(0.2, 0.2) };
        let damping = equivalent_damping(&coulomb, 2.0);
        assert!((damping - (4.0 * 0.2 / (PI * 2.0) + 3e-3)).abs() < 1e-5, "{damping}");
    }

    #[test]
    fn a_limit_cycle_has_the_amplitude_and_interval_of_its_swings() {
        let square = |k: usize| if (k / 300).is_multiple_of(2) { 0.01 } else { -0.02 };
        let swings: Vec<f64> = (0..3000).map(square).collect();
        let hunting = Hunting::find(&swings, 1e-3, 2e-3).unwrap();
        assert!(
            (hunting.amplitude - 0.015).abs() < 1e-12 && (hunting.interval - 0.3).abs() < 1e-12 && hunting.slips == 9
        );
        assert_eq!(Hunting::find(&swings, 1e-3, 0.04), None, "within the resolution");
        assert_eq!(Hunting::find(&swings[..700], 1e-3, 2e-3), None, "forth and back once");
        assert_eq!(Hunting::find(&[], 1e-3, 2e-3), None);
    }
}
