//! One cell of the comparison, and its runs.

use stickslip_base::preset::Settings;
use stickslip_core::friction::{Friction, Stribeck};
use stickslip_core::plant::Plant;
use stickslip_core::render::{Correction, Law};

use super::run::{Trace, run};
use super::{Mismatch, Role, Scenario};
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
        let jobs: Vec<_> =
            scenarios.iter().flat_map(|scenario| seeds.iter().map(move |&seed| (scenario, seed))).collect();
        let simulate = |&(scenario, seed): &(&Scenario, u64)| {
            let trace = run(cell, role, scenario, seed)?;
            done()?;
            Ok(trace)
        };
        let mut traces = map(&jobs, threads, simulate)?.into_iter();
        let by_seed = |_| traces.by_ref().take(seeds.len()).collect();
        Ok(Runs {
            scenarios: scenarios.to_vec(),
            traces: scenarios.iter().map(by_seed).collect(),
            desired: cell.preset.bench.desired,
        })
    }
}
