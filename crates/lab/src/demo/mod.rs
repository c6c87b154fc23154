//! The paper's chapter 5 on the virtual bench: measure, fit, design, render, measure again.
//!
//! Nothing is given to the software but what `[model]` and `[bench]` say; what the machine truly is stands beside the
//! results, computed by [`truth`], and is used for nothing else.

mod figures;
mod files;

use std::time::Instant;

use stickslip_core::friction::Stribeck;
use stickslip_core::render::{DifferenceTorque, Law};

use crate::bench::{Bench, Frame, VirtualBench};
use crate::experiment::{
    FrictionCurve, FrictionPlan, PreloadAdvice, advise_preload, expected_inside_fade, home, measure_friction,
    predicted_velocity_noise, sweep_through_standstill,
};
use crate::fit::StribeckFit;
use crate::{Error, Preset, Watch, truth};

/// Speed up to which the sweep through standstill goes [rad/s].
const SWEEP_SPEED: f64 = 1.5;
/// How fast it does [rad/s²].
const SWEEP_ACCELERATION: f64 = 1.5;

/// Everything that came out of the demonstration.
#[derive(Clone, Debug)]
pub struct Demo {
    /// What it was run with.
    pub preset: Preset<f64>,
    /// Seed of the noise.
    pub seed: u64,
    /// The plan of every measurement.
    pub plan: FrictionPlan<f64>,
    /// Curve 1: linings released.
    pub released: Measured,
    /// Curve 2: linings pressed on fully.
    pub pressed: Measured,
    /// The preload for the desired breakaway torque.
    pub preload: PreloadAdvice,
    /// Own friction at that preload: what the law subtracts.
    pub own: Measured,
    /// The law that rendered.
    pub law: DifferenceTorque<f64>,
    /// Curve 3 as measured under the law.
    pub rendered: FrictionCurve,
    /// Sweep through standstill under the law.
    pub sweep: Vec<Frame>,
    /// What the own friction truly is.
    pub truth: StribeckFit,
    /// RMS distance of the true own friction from its best Stribeck curve at the plan's speeds [N m].
    pub truth_residual: f64,
    /// Standard deviation of the estimated velocity that the data sheet predicts [rad/s].
    pub velocity_noise: f64,
    /// Bench time [s].
    pub bench_time: f64,
    /// Time that it took [s].
    pub wall_time: f64,
}

/// A measured characteristic and its fit.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The plateaus.
    pub curve: FrictionCurve,
    /// The Stribeck curve through them.
    pub fit: StribeckFit,
}

impl Demo {
    /// Runs it.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; [`Error::BenchFault`]; whatever a fit refuses.
    pub fn run(preset: &Preset<f64>, seed: u64, watch: &Watch) -> Result<Self, Error> {
        let begin = Instant::now();
        let plan = FrictionPlan::quick();
        let mut bench = VirtualBench::new(preset, seed)?;
        home(&mut bench, watch)?;
        let released = measure(&plan, &mut bench, 0.0, watch)?;
        let pressed = measure(&plan, &mut bench, 1.0, watch)?;

        let desired = preset.bench.desired;
        let preload = advise_preload(desired.breakaway_torque, &released.fit.curve(), &pressed.fit.curve());
        let own = measure(&plan, &mut bench, preload.preload, watch)?;
        bench.learn_own(own.fit.curve());

        let law = difference(&desired, &bench);
        bench.set_law(Law::Paper(law));
        let rendered = measure_friction(&plan, &mut bench, true, watch)?;
        let sweep = sweep_through_standstill(&mut bench, SWEEP_SPEED, SWEEP_ACCELERATION, watch)?;

        let truth = truth::own_curve(bench.truth(), &plan)?;
        Ok(Demo {
            preset: *preset,
            seed,
            plan,
            released,
            pressed,
            preload,
            own,
            law,
            rendered,
            truth_residual: truth::distance(bench.truth(), &truth.curve(), &plan),
            truth,
            velocity_noise: predicted_velocity_noise(bench.model(), bench.settings())?,
            bench_time: sweep.last().map_or(0.0, |frame| frame.cycle as f64 * preset.bench.tick_time()),
            sweep,
            wall_time: begin.elapsed().as_secs_f64(),
        })
    }

    /// RMS of measured minus desired outside the fade-out [N m].
    pub fn error_outside_fade(&self) -> f64 {
        self.rendered.rms_from(&self.law.desired, |speed| speed > self.law.fade_velocity)
    }

    /// The same inside [N m].
    pub fn error_inside_fade(&self) -> f64 {
        self.rendered.rms_from(&self.law.desired, |speed| speed <= self.law.fade_velocity)
    }

    /// What the law can be expected to leave inside [N m], for the spread of the estimated velocity on each plateau:
    /// noise of the observer and motion of the load, which the steps at the fade limits shake.
    pub fn expected_inside_fade(&self) -> f64 {
        let plateaus = self.rendered.kept().map(|plateau| (plateau.set_velocity, plateau.velocity_spread));
        expected_inside_fade(&self.law, plateaus)
    }

    /// The same for a load that moves steadily [N m]: by the observer's noise alone, as the data sheet predicts it.
    pub fn expected_inside_fade_if_steady(&self) -> f64 {
        expected_inside_fade(&self.law, self.plan.speeds().map(|speed| (speed, self.velocity_noise)))
    }
}

/// Measures at a preload and fits.
fn measure(plan: &FrictionPlan<f64>, bench: &mut VirtualBench, preload: f64, watch: &Watch) -> Result<Measured, Error> {
    bench.set_preload(preload)?;
    let curve = measure_friction(plan, bench, false, watch)?;
    watch.check()?;
    let fit = curve.fit()?;
    Ok(Measured { curve, fit })
}

/// The paper's law for what is believed of the machine.
fn difference(desired: &Stribeck<f64>, bench: &dyn Bench) -> DifferenceTorque<f64> {
    let model = bench.model();
    DifferenceTorque {
        desired: *desired,
        own: model.own,
        fade_velocity: bench.settings().fade_velocity,
        torque_limit: model.load_amplifier.current_limit * model.load_motor.torque_constant,
    }
}
