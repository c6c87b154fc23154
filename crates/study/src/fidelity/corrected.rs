//! Correction of the rendered friction before its curve is judged: the bench measures the rendered friction with its
//! own converters and its own model, and adds the difference.

use stickslip_core::plant::Plant;
use stickslip_core::render::Correction;

use super::Cell;
use stickslip_base::preset::Settings;
use stickslip_base::{Error, Preset, Watch};
use stickslip_bench::{Bench as _, VirtualBench};
use stickslip_experiment::workflow::correct::{correct, missing, table};
use stickslip_experiment::workflow::render::faded_below;
use stickslip_experiment::{FrictionCurve, FrictionPlan, home, measure_friction};

/// Largest number of corrections.
const CORRECTIONS: usize = 2;
/// Seed offset: these measurements have another noise than the comparison.
const OTHER_NOISE: u64 = 1 << 32;

/// The speeds of the judged staircase, over shorter arcs than a plan that identifies the own friction.
fn plan() -> FrictionPlan<f64> {
    FrictionPlan { slowest: 0.05, speeds: 12.0, arc: 0.1, ..FrictionPlan::quick() }
}

/// The best correction on this machine; none where supervision ends the first measurement.
///
/// # Errors
/// Errors of the design of the software and of the integrator.
pub(super) fn correction(
    cell: &Cell,
    plant: &Plant<f64>,
    settings: &Settings<f64>,
    seed: u64,
) -> Result<Option<Correction<f64>>, Error> {
    let (plan, watch) = (plan(), Watch::silent());
    let (begin, desired) = (faded_below(settings), &settings.desired);
    let preset = Preset { plant: *plant, model: cell.preset.model, bench: *settings };
    let mut bench = VirtualBench::in_short_steps(&preset, OTHER_NOISE | seed)?;
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
