//! One cell of the comparison, and its runs.

use stickslip_base::preset::Settings;
use stickslip_core::friction::{Friction, Stribeck};
use stickslip_core::plant::Plant;
use stickslip_core::render::{Correction, Law};

use super::run::{Job, Run, Trace, follow, start};
use super::{Mismatch, Role, Scenario};
use crate::fast_bench::{FastBench, vectors};
use stickslip_base::parallel::map;
use stickslip_base::{Error, Preset, Watch};

/// Measures and corrects the rendered curve of a machine before it is compared: cell, machine, settings and noise seed.
/// `None` where the supervision ends the first measurement.
pub type Correct = fn(&Cell, &Plant<f64>, &Settings<f64>, u64) -> Result<Option<Correction<f64>>, Error>;

/// A bench, its difference from the model, and a law.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The bench without the mismatch.
    pub preset: Preset<f64>,
    /// The friction of A.
    pub desired: Friction<f64>,
    /// How the machine differs from `preset`.
    pub mismatch: Mismatch,
    /// The rendering law of B.
    pub law: Law<f64>,
    /// How B corrects its curve before a corrected scenario; default: such a scenario runs uncorrected.
    pub correct: Option<Correct>,
}

/// All runs of one machine: scenarios by seeds.
#[derive(Clone, Debug)]
pub struct Runs {
    /// The scenarios, in the order of `traces`.
    pub scenarios: Vec<Scenario>,
    /// For each scenario the traces of all seeds.
    pub traces: Vec<Vec<Trace>>,
    /// The desired characteristic.
    pub desired: Stribeck<f64>,
}

impl Runs {
    /// The traces of a scenario, one for each seed, or those of its uncorrected form; empty if neither was run.
    pub fn of(&self, scenario: Scenario) -> &[Trace] {
        let index = |scenario| self.scenarios.iter().position(|other| *other == scenario);
        index(scenario).or(index(scenario.uncorrected())).map_or(&[], |index| &self.traces[index])
    }

    /// Simulates a machine of the cell in these scenarios with these noise seeds. The result does not depend on the
    /// number of threads.
    ///
    /// # Errors
    /// Errors of the software's design and of the integrator; [`Error::Cancelled`].
    pub fn simulate(
        cell: &Cell,
        role: Role,
        scenarios: &[Scenario],
        seeds: &[u64],
        threads: usize,
        watch: &Watch,
    ) -> Result<Self, Error> {
        Runs::counted(cell, role, scenarios, seeds, threads, &|| watch.check())
    }

    /// The same; `done` is called after each run, and its error ends the work.
    pub fn counted(
        cell: &Cell,
        role: Role,
        scenarios: &[Scenario],
        seeds: &[u64],
        threads: usize,
        done: &(dyn Fn() -> Result<(), Error> + Sync),
    ) -> Result<Self, Error> {
        Ok(Runs::of_all(&[Machine { cell, role, seeds }], scenarios, threads, done)?.remove(0))
    }

    /// The same for several machines, side by side where they differ in numbers only.
    pub(super) fn of_all(
        machines: &[Machine<'_>],
        scenarios: &[Scenario],
        threads: usize,
        done: &(dyn Fn() -> Result<(), Error> + Sync),
    ) -> Result<Vec<Self>, Error> {
        let mut jobs = Vec::new();
        for &Machine { cell, role, seeds } in machines {
            for scenario in scenarios {
                jobs.extend(seeds.iter().map(|&seed| Job { cell, role, scenario, seed }));
            }
        }
        let started = map(&jobs, threads, start)?;
        let runs: Vec<(usize, &(FastBench, Run))> =
            started.iter().enumerate().filter_map(|(job, run)| Some((job, run.as_ref()?))).collect();
        let benches: Vec<&FastBench> = runs.iter().map(|(_, run)| &run.0).collect();
        // No idle threads with few runs.
        let vectors = vectors(&benches, runs.len().div_ceil(threads.max(1)));
        let simulate = |vector: &Vec<usize>| {
            let benches: Vec<&FastBench> = vector.iter().map(|&run| benches[run]).collect();
            let beside: Vec<&Run> = vector.iter().map(|&run| &runs[run].1.1).collect();
            let traces = match &benches[..] {
                [alone] => follow((*alone).clone(), &beside),
                _ => FastBench::in_lanes(&benches).map_or(Vec::new(), |wide| follow(wide, &beside)),
            };
            vector.iter().try_for_each(|_| done())?;
            Ok(vector.iter().map(|&run| runs[run].0).zip(traces).collect::<Vec<_>>())
        };
        let refused = |job: &Job<'_>| Trace { period: job.cell.preset.bench.control_period(), ..Trace::default() };
        let mut traces: Vec<Trace> = jobs.iter().map(refused).collect();
        for (job, trace) in map(&vectors, threads, simulate)?.into_iter().flatten() {
            traces[job] = trace;
        }
        (runs.len()..jobs.len()).try_for_each(|_| done())?;
        let mut traces = traces.into_iter();
        let gather = |&Machine { cell, seeds, .. }: &Machine<'_>| Runs {
            scenarios: scenarios.to_vec(),
            traces: scenarios.iter().map(|_| traces.by_ref().take(seeds.len()).collect()).collect(),
            desired: cell.preset.bench.desired,
        };
        Ok(machines.iter().map(gather).collect())
    }
}

/// A machine of a cell, with its seeds.
#[derive(Clone, Copy)]
pub(super) struct Machine<'a> {
    pub(super) cell: &'a Cell,
    pub(super) role: Role,
    pub(super) seeds: &'a [u64],
}
