//! A study as it is run: the machine, who drives it, what is done, what is changed.

use std::path::Path;

use super::{Axis, Design, Work, axis};
use crate::benchmark::{Entrant, Manoeuvre, Measure};
use stickslip_base::parameters::within;
use stickslip_base::preset::Preset;
use stickslip_base::{Error, Watch};

/// What is run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What the study is called.
    pub title: String,
    /// What the machine is called.
    pub machine: String,
    /// The machine without any change.
    pub preset: Preset<f64>,
    /// Who drives it; as the preset has it where nobody is named.
    pub entrant: Option<Entrant>,
    /// What is done.
    pub manoeuvres: Vec<Manoeuvre>,
    /// Seeds of noise of each case, the same in all of them.
    pub seeds: u64,
    /// Places to rest at, or ways to go, of each case.
    pub places: u64,
    /// Share by which measures may move when the step of the virtual machine is halved. `None` takes the step that is
    /// stated, of which nothing is then known.
    pub tolerance: Option<f64>,
    /// What is changed, in this order.
    pub axes: Vec<Axis>,
    /// Which cases there are.
    pub design: Design,
    /// Threads.
    pub threads: usize,
}

/// Years of work, whose parts can still be listed in memory.
const MOST_CASES: u64 = 1_000_000_000;

/// Parts of a preset that an entrant brings along.
const OF_ENTRANT: [&str; 5] = ["bench.controller", "bench.filter", "bench.shaper", "bench.compensation", "bench.hold"];

/// Whether an entrant brings a parameter along.
pub(super) fn of_entrant(path: &str) -> bool {
    OF_ENTRANT.iter().any(|group| within(path, group))
}

impl Plan {
    /// How many cases there are.
    ///
    /// # Errors
    /// [`Error::TooFew`] for a study without a case; [`Error::OutOfRange`] for more than a billion.
    pub fn cases(&self) -> Result<u64, Error> {
        // None where it is more than any integer.
        let count = self.design.cases(&self.axes);
        match count.filter(|count| *count <= MOST_CASES) {
            None => Err(Error::OutOfRange {
                name: "the number of cases",
                value: count.map_or(f64::INFINITY, |count| count as f64),
                unit: "1",
                minimum: 1.0,
                maximum: MOST_CASES as f64,
                remedy: "Give the axes fewer values, or draw a sample of them.",
            }),
            Some(0) => {
                let remedy = "Give each axis a value, and a sample a size.";
                Err(Error::TooFew { what: "cases", found: 0, needed: 1, remedy })
            }
            Some(cases) => Ok(cases),
        }
    }

    /// The measures of all manoeuvres.
    pub fn measures(&self) -> impl Iterator<Item = &'static Measure> + '_ {
        self.manoeuvres.iter().flat_map(|manoeuvre| manoeuvre.measures())
    }

    /// The values of each axis where each is met with each of the others, the last axis changing first.
    pub fn grid(&self) -> Option<Vec<&[f64]>> {
        let is_grid = self.design == Design::Grid;
        self.axes.iter().map(|axis| axis.spread.listed().filter(|_| is_grid)).collect()
    }

    /// Values of the axes in a case, counted from 0.
    pub fn values(&self, case: u64) -> Vec<f64> {
        axis::values(&self.axes, &self.design.place(case, &self.axes))
    }

    /// Runs of a case: manoeuvre, seed, and where between two counts it rests or which way it goes.
    pub(super) fn runs(&self) -> impl Iterator<Item = (Manoeuvre, u64, f64)> + '_ {
        self.manoeuvres.iter().flat_map(|&manoeuvre| {
            let count = if manoeuvre.has_places() { self.places } else { self.seeds };
            (0..count).map(move |k| (manoeuvre, k + 1, (k as f64 + 0.5) / count as f64))
        })
    }

    /// The plan with its controller, which is tuned once, on the machine as believed without any change; what was tuned
    /// from the same is taken from the folder.
    ///
    /// # Errors
    /// What tuning refuses; [`Error::Cancelled`]; [`Error::File`]; as [`cases`](Self::cases).
    pub(super) fn ready(&self, folder: &Path, watch: &Watch) -> Result<Work, Error> {
        // Before anything takes long.
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

    /// The preset whose parameters the axes name: with a controller of the entrant's kind.
    pub(super) fn stated(&self) -> Preset<f64> {
        let of = |entrant: &Entrant| entrant.on(&self.preset, entrant.start(&self.preset));
        self.entrant.as_ref().map_or(self.preset, of)
    }
}
