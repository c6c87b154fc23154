//! Plan of a study: machine, controller, manoeuvres, axes.

use std::path::Path;

use super::{Axis, Design, Work, axis};
use crate::benchmark::{Entrant, Manoeuvre, Measure, simulated_time};
use stickslip_base::parameters::within;
use stickslip_base::preset::Preset;
use stickslip_base::{Error, Watch};

/// Plan of a study.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Title of the study.
    pub title: String,
    /// Name of the machine.
    pub machine: String,
    /// The machine without any change.
    pub preset: Preset<f64>,
    /// The controller; that of the preset if none is named.
    pub entrant: Option<Entrant>,
    /// Manoeuvres.
    pub manoeuvres: Vec<Manoeuvre>,
    /// Seeds of noise of each case, the same in all of them.
    pub seeds: u64,
    /// Places to rest at, or strokes, of each case.
    pub places: u64,
    /// Share by which measures may move when the step of the virtual machine is halved. `None` uses the stated step,
    /// whose error is then unknown.
    pub tolerance: Option<f64>,
    /// Axes, in this order.
    pub axes: Vec<Axis>,
    /// Design of the cases.
    pub design: Design,
    /// Threads.
    pub threads: usize,
}

/// Largest number of cases: years of work, whose parts still fit in memory as a list.
const MOST_CASES: u64 = 1_000_000_000;

/// Parts of a preset that an entrant replaces.
const OF_ENTRANT: [&str; 5] = ["bench.controller", "bench.filter", "bench.shaper", "bench.compensation", "bench.hold"];

/// Longest case [s of simulated time]: an hour and more of computation.
pub(super) const LONGEST_CASE: f64 = 1e5;

/// Whether an entrant replaces a parameter.
pub(super) fn of_entrant(path: &str) -> bool {
    OF_ENTRANT.iter().any(|group| within(path, group))
}

impl Plan {
    /// Number of cases.
    ///
    /// # Errors
    /// [`Error::TooFew`] for a study without a case; [`Error::OutOfRange`] for more than a billion.
    pub fn cases(&self) -> Result<u64, Error> {
        // None where it overflows.
        let count = self.design.cases(&self.axes);
        match count.filter(|count| *count <= MOST_CASES) {
            None => Err(Error::OutOfRange {
                name: "the number of cases",
                value: count.map_or(f64::INFINITY, |count| count as f64),
                unit: "1",
                minimum: 1.0,
                maximum: MOST_CASES as f64,
                remedy: "Use fewer values for the axes, or draw a sample.",
            }),
            Some(0) => {
                let remedy = "State values for each axis, and a size for a sample.";
                Err(Error::TooFew { what: "cases", found: 0, needed: 1, remedy })
            }
            Some(cases) => Ok(cases),
        }
    }

    /// The measures of all manoeuvres.
    pub fn measures(&self) -> impl Iterator<Item = &'static Measure> + '_ {
        self.manoeuvres.iter().flat_map(|manoeuvre| manoeuvre.measures())
    }

    /// The values of each axis of a grid, the last axis changing first.
    pub fn grid(&self) -> Option<Vec<&[f64]>> {
        let is_grid = self.design == Design::Grid;
        self.axes.iter().map(|axis| axis.spread.listed().filter(|_| is_grid)).collect()
    }

    /// Simulated time of a case on a machine [s].
    pub(super) fn case_time(&self, preset: &Preset<f64>) -> f64 {
        self.runs().map(|(manoeuvre, _, chance)| simulated_time(manoeuvre, preset, chance)).sum()
    }

    /// Simulated time of all cases with the values of the preset [s].
    ///
    /// # Errors
    /// As [`cases`](Self::cases).
    pub fn simulated_time(&self) -> Result<f64, Error> {
        Ok(self.case_time(&self.preset) * self.cases()? as f64)
    }

    /// Values of the axes in a case, counted from 0.
    pub fn values(&self, case: u64) -> Vec<f64> {
        axis::values(&self.axes, &self.design.place(case, &self.axes))
    }

    /// Runs of a case: manoeuvre, seed, and the place between two counts or the stroke.
    pub(super) fn runs(&self) -> impl Iterator<Item = (Manoeuvre, u64, f64)> + '_ {
        self.manoeuvres.iter().flat_map(|&manoeuvre| {
            let count = if manoeuvre.has_places() { self.places } else { self.seeds };
            (0..count).map(move |k| (manoeuvre, k + 1, (k as f64 + 0.5) / count as f64))
        })
    }

    /// The plan with its controller, tuned once on the modelled machine before any change; an earlier result of the
    /// same tuning is read from the folder.
    ///
    /// # Errors
    /// Errors of tuning; [`Error::Cancelled`]; [`Error::File`]; as [`cases`](Self::cases).
    pub(super) fn ready(&self, folder: &Path, watch: &Watch) -> Result<Work, Error> {
        // Before any long computation.
        self.cases()?;
        let tuned = match self.entrant.as_ref().and_then(Entrant::tuned_as) {
            Some(name) => {
                watch.stage("tune the controller", 0.0)?;
                Some(Entrant::tuned(name, &self.preset, folder, watch)?)
            }
            None => None,
        };
        Work::new(self.clone(), tuned)
    }

    /// The preset whose parameters the axes name: with the kind of controller of the entrant.
    pub(super) fn stated(&self) -> Preset<f64> {
        let of = |entrant: &Entrant| entrant.on(&self.preset, entrant.start(&self.preset));
        self.entrant.as_ref().map_or(self.preset, of)
    }
}
