//! A friction and a controller drawn at random, predicted and run.

use core::f64::consts::TAU;

use stickslip::design::{Hunting, HuntingPlan, pid_by_bandwidth, predict_hunting, software};
use stickslip::fast_bench::FastBench;
use stickslip::parameters::presets;
use stickslip::{ControllerChoice, Error, Preset, StateFeedback, Watch};
use stickslip_core::control::Pid;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::friction::{Friction, Stribeck};
use stickslip_core::tick::Order;

/// Duration of a case, and start of its evaluation [s].
const DURATION: f64 = 18.0;
const FROM: f64 = 6.0;
/// Largest distance of the extremes, in counts, that is not hunting.
const COUNTS: f64 = 3.0;

/// The machines on which cases are drawn.
pub(crate) const MACHINES: [&str; 2] = ["prototype", "clm-bench"];

/// A case.
pub(crate) struct Case {
    pub(crate) machine: &'static str,
    pub(crate) preset: Preset<f64>,
    /// Offset of the set-point from a count [rad].
    off: f64,
    seed: u64,
}

/// Result of a case.
pub(crate) struct Outcome {
    pub(crate) predicted: Option<Hunting>,
    pub(crate) truth: Option<Hunting>,
    /// Largest pole by the describing function.
    pub(crate) radius: f64,
}

impl Outcome {
    /// Whether the prediction of hunting is right.
    pub(crate) fn is_right(&self) -> bool {
        self.predicted.is_some() == self.truth.is_some()
    }

    /// Relative errors of amplitude and interval.
    pub(crate) fn errors(&self) -> Option<[f64; 2]> {
        let (predicted, truth) = (self.predicted?, self.truth?);
        Some([(predicted.amplitude / truth.amplitude - 1.0).abs(), (predicted.interval / truth.interval - 1.0).abs()])
    }
}

/// Pseudo-random numbers between 0 and 1.
pub(crate) struct Chance(pub(crate) u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Even on a logarithmic scale.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low * libm::pow(high / low, self.next())
    }
}

impl Case {
    /// The next case of a machine: three of four under a PID controller of any bandwidth, else a state feedback.
    pub(crate) fn draw(machine: &'static str, number: u64, chance: &mut Chance) -> Result<Self, Error> {
        let mut preset: Preset<f64> = presets::find(machine)?.read()?;
        let kinetic_torque = chance.between(0.1, 0.4);
        let sliding = Stribeck {
            kinetic_torque,
            breakaway_torque: kinetic_torque * chance.between(1.1, 2.5),
            stribeck_velocity: chance.between(0.1, 5.0),
            viscous_friction: 2e-3,
            ..preset.model.own
        };
        preset.model.own = sliding;
        preset.plant.screw_friction = preset.model.own_bristles.under(sliding);
        preset.plant.wheel.friction = Friction::default();
        let (bandwidth, more) = (chance.between(8.0, 40.0), 1.0 + 2.0 * chance.next());
        let torque_limit = preset.bench.controller.torque_limit();
        preset.bench.controller = if number % 4 == 3 {
            ControllerChoice::StateFeedback(StateFeedback { torque_limit, ..StateFeedback::default() })
        } else {
            let pid = Pid { torque_limit, ..Pid::default() };
            let pid = pid_by_bandwidth(pid, preset.model.drive.inertia(), bandwidth)?;
            ControllerChoice::Pid(Pid { integral_gain: more * pid.integral_gain, ..pid })
        };
        let off = chance.next() * TAU / preset.model.encoder.counts_per_revolution;
        Ok(Case { machine, preset, off, seed: number })
    }

    /// Predicts and runs it.
    pub(crate) fn outcome(&self) -> Result<Outcome, Error> {
        let Preset { model, bench: settings, plant } = &self.preset;
        let plan = HuntingPlan { duration: DURATION, from: FROM, counts: COUNTS, ..HuntingPlan::default() };
        let prediction = predict_hunting(model, settings, &plan, &Watch::silent())?;
        // From the same deviations; the largest cycle is the result in both.
        let mut truth: Option<Hunting> = None;
        for start in plan.starts {
            let mut bench = FastBench::new(plant, software(model, settings)?, settings, settings.divider(), self.seed)?;
            let mut deviations = Vec::new();
            let reference = Setpoint { position: start + self.off, ..Setpoint::default() };
            for cycle in 0..(DURATION * settings.tick_rate) as u64 {
                bench.tick(Order { control: 1.0, reference, ..Order::default() });
                if cycle % settings.divider() == 0 {
                    deviations.push(reference.position - bench.true_state().plant.machine.angle);
                }
            }
            let from = (FROM / prediction.period) as usize;
            let hunting = Hunting::find(&deviations[from..], prediction.period, COUNTS * prediction.count);
            let far = |hunting: Option<Hunting>| hunting.map_or(0.0, |hunting| hunting.amplitude);
            if far(hunting) > far(truth) {
                truth = hunting;
            }
        }
        Ok(Outcome {
            predicted: prediction.hunting,
            truth,
            radius: prediction.described.iter().map(|it| it.radius).fold(0.0, f64::max),
        })
    }
}
