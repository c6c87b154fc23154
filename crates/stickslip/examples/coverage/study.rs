//! One whole experiment of the coverage study, and the count of its hits.

use stickslip::bench::{Bench, VirtualBench};
use stickslip::experiment::{FrictionCurve, FrictionPlan, home, measure_friction};
use stickslip::fit::{StribeckFit, fit_stribeck};
use stickslip::noise::Normals;
use stickslip::{Error, Preset, Watch, parameters, true_friction};
use stickslip_core::friction::Stribeck;

/// True parameters of the virtual machine, and the fit to the measurement.
pub(crate) struct Experiment {
    /// The true parameters.
    pub(crate) truth: [f64; 4],
    /// The fit.
    pub(crate) fit: StribeckFit,
}

/// Homes `clm-bench` and runs the quick plan at a preload of the friction wheel: the true parameters and the curve.
pub(crate) fn measure(preload: f64, seed: u64) -> Result<([f64; 4], FrictionCurve), Error> {
    let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    let plan = FrictionPlan::quick();
    let mut bench = VirtualBench::in_short_steps(&preset, seed)?;
    home(&mut bench, &Watch::silent())?;
    bench.set_preload(preload)?;
    let curve = measure_friction(&plan, &mut bench, false, &Watch::silent())?;
    Ok((true_friction::own_curve(bench.true_plant(), &plan)?.parameters, curve))
}

/// Measures and fits.
pub(crate) fn experiment(preload: f64, seed: u64) -> Result<Experiment, Error> {
    let (truth, curve) = measure(preload, seed)?;
    Ok(Experiment { truth, fit: curve.fit()? })
}

/// Redraws the points of a measured curve about the true one with the stated errors, and fits.
pub(crate) fn redraw(truth: [f64; 4], measured: &FrictionCurve, seed: u64) -> Result<Experiment, Error> {
    let [breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction] = truth;
    let law = Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, ..Stribeck::default() };
    let normals = Normals::new(seed);
    let mut points = measured.points();
    for (k, point) in points.iter_mut().enumerate() {
        point.torque = law.torque(point.velocity) + point.standard_error * normals.pair(0, k as u64)[0];
    }
    Ok(Experiment { truth, fit: fit_stribeck(&points, &FrictionCurve::FIT)? })
}

/// Whether the intervals of a fit contain the true values.
pub(crate) fn hits(truth: &[f64; 4], fit: &StribeckFit) -> [bool; 4] {
    std::array::from_fn(|i| (fit.ci95[i][0]..=fit.ci95[i][1]).contains(&truth[i]))
}
