//! The paper's chapter 5 on the virtual bench: measure, fit, design, render, measure again.
//!
//! The software gets `[model]` and `[bench]` alone. The true values of the machine are shown next to the results,
//! computed by [`crate::true_friction`], and are not used elsewhere.

mod figures;
mod files;

use std::time::Instant;

use crate::true_friction;
use crate::workflow::render::{Rendering, render};
use crate::{FrictionCurve, FrictionPlan, PreloadAdvice, advise_preload, home, measure_friction};
use stickslip_base::{Error, Preset, Watch};
use stickslip_bench::tap::Tap;
use stickslip_bench::{Bench, VirtualBench};
use stickslip_fit::StribeckFit;

/// Results of the demonstration.
#[derive(Clone, Debug)]
pub struct Demo {
    /// Its preset.
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
    /// The law, and curve 3 as measured under it.
    pub rendering: Rendering,
    /// The true own friction.
    pub truth: StribeckFit,
    /// RMS distance of the true own friction from its best Stribeck curve at the plan's speeds [N m].
    pub truth_residual: f64,
    /// Bench time [s].
    pub bench_time: f64,
    /// Computing time [s].
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
    /// Runs it; `tap` gets every cycle.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; [`Error::BenchFault`]; errors of the fits.
    pub fn run(preset: &Preset<f64>, seed: u64, tap: Option<Tap>, watch: &Watch) -> Result<Self, Error> {
        let start = Instant::now();
        let plan = FrictionPlan::quick();
        let mut bench = VirtualBench::new(preset, seed)?;
        tap.into_iter().for_each(|tap| bench.tap(tap));
        home(&mut bench, watch)?;
        let released = measure(&plan, &mut bench, 0.0, watch)?;
        let pressed = measure(&plan, &mut bench, 1.0, watch)?;

        let desired = preset.bench.desired;
        let preload = advise_preload(desired.breakaway_torque, &released.fit.curve(), &pressed.fit.curve());
        let own = measure(&plan, &mut bench, preload.preload, watch)?;
        bench.learn_own(own.fit.curve());

        let rendering = render(&plan, &desired, &mut bench, watch)?;
        watch.check()?;

        let truth = true_friction::own_curve(bench.true_plant(), &plan)?;
        Ok(Demo {
            preset: *preset,
            seed,
            plan,
            released,
            pressed,
            preload,
            own,
            truth_residual: true_friction::distance(bench.true_plant(), &truth.curve(), &plan),
            truth,
            bench_time: rendering.sweep.last().map_or(0.0, |frame| frame.cycle as f64 * preset.bench.tick_time()),
            rendering,
            wall_time: start.elapsed().as_secs_f64(),
        })
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
