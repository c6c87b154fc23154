//! The correction that the bench makes of itself before its curve is judged: it measures the friction that it renders,
//! by its own converters and its own model, and adds what is missing.

use stickslip_core::plant::Plant;
use stickslip_core::render::Correction;

use super::Cell;
use stickslip_base::preset::Settings;
use stickslip_base::{Error, Preset, Watch};
use stickslip_bench::{Bench as _, VirtualBench};
use stickslip_experiment::workflow::correct::{correct, missing, table};
use stickslip_experiment::workflow::render::faded_below;
use stickslip_experiment::{FrictionCurve, FrictionPlan, home, measure_friction};

/// How often it corrects at most.
const CORRECTIONS: usize = 2;
/// The noise of these measurements is another one than that of the comparison.
const OTHER_NOISE: u64 = 1 << 32;

/// The speeds of the staircase that judges, over shorter arcs than a plan that shall tell the own friction.
fn plan() -> FrictionPlan<f64> {
    FrictionPlan { slowest: 0.05, speeds: 12.0, arc: 0.1, ..FrictionPlan::quick() }
}

/// The correction that is kept on this machine; none where supervision ends the first measurement.
///
/// # Errors
/// What the design of the software and the integrator refuse.
pub(super) fn correction(
    cell: &Cell,
    plant: &Plant<f64>,
    settings: &Settings<f64>,
    seed: u64,
) -> Result<Option<Correction<f64>>, Error> {
    let (plan, watch) = (plan(), Watch::silent());
    let (begin, desired) = (faded_below(settings), &settings.desired);
    let preset = Preset { plant: *plant, model: cell.preset.model, bench: *settings };
    let mut bench = VirtualBench::new(&preset, OTHER_NOISE | seed)?;
    let mut measured = || {
        home(&mut bench, &watch)?;
        bench.set_law(cell.law)?;
        correct(
            table(&plan, begin),
            CORRECTIONS,
            |curve: &FrictionCurve| missing(curve, desired, begin),
            |correction| {
                bench.set_correction(correction)?;
                measure_friction(&plan, &mut bench, true, &watch)
            },
        )
    };
    match measured() {
        Ok(corrected) => Ok(Some(corrected.best().correction)),
        Err(Error::BenchFault { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}
