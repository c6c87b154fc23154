//! Plan of the compared cells.

use super::{MISMATCHES, Mismatch, SCENARIOS, Scenario, TestBed};
use stickslip_base::Error;
use stickslip_base::preset::{DriveModelTrust, ObserverChoice};
use stickslip_simulate::fidelity::law::{AUTO, LAWS, PAPER};

/// The cells of one machine and rate: the same A and A0.
#[derive(Clone, Debug)]
pub struct Group {
    /// Name of the preset, or the path of its file.
    pub preset: String,
    /// Whether the friction wheel is pressed on.
    pub wheel: bool,
    /// Tick rate [Hz].
    pub rate: f64,
    /// Difference between machine and model.
    pub mismatch: Mismatch,
    /// The observer of the bench.
    pub observer: ObserverChoice<f64>,
    /// Names of the laws.
    pub laws: Vec<String>,
    /// Names of the laws whose curve is corrected too: it takes as long as all other scenarios together.
    pub corrected: Vec<String>,
}

/// All cells, with their scenarios, seeds and threads.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The cells.
    pub groups: Vec<Group>,
    /// Scenarios of each; the corrected curve under some laws only.
    pub scenarios: Vec<Scenario>,
    /// Noise seeds of each.
    pub seeds: Vec<u64>,
    /// Number of threads.
    pub threads: usize,
}

/// Selection by a user. Empty lists select everything in the benchmark.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// The short benchmark: closed loop with 3 seeds, the paper's law and the selected one on `prototype` with the
    /// mismatch `real` at 4 and 10 kHz. Otherwise the full one with 10 seeds.
    pub quick: bool,
    /// Another number of seeds.
    pub seeds: Option<u64>,
    /// Names of presets or paths of their files.
    pub presets: Vec<String>,
    /// Names of laws.
    pub laws: Vec<String>,
    /// Tick rates [Hz].
    pub rates: Vec<f64>,
    /// Only with the wheel pressed on, or only without.
    pub wheel: Option<bool>,
    /// Names of mismatches.
    pub mismatches: Vec<String>,
    /// Names of observers; by default those of the benchmark, or that of the preset.
    pub observers: Vec<String>,
    /// Names of scenarios.
    pub scenarios: Vec<String>,
    /// Threads; 0 uses all processors.
    pub threads: usize,
}

/// A product of machines, rates and mismatches.
struct Block {
    presets: Vec<String>,
    rates: Vec<f64>,
    mismatches: Vec<Mismatch>,
    /// None: that of the preset.
    observer: Option<ObserverChoice<f64>>,
    laws: Vec<String>,
}

/// The observer of a bench without accelerometer and tacho.
fn by_model() -> ObserverChoice<f64> {
    ObserverChoice::Model(DriveModelTrust::default())
}

/// Name of an observer.
pub(super) fn observer_name(observer: &ObserverChoice<f64>) -> &'static str {
    match observer {
        ObserverChoice::Accelerometer => "accelerometer",
        ObserverChoice::Model(_) => "model",
    }
}

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(|name| (*name).into()).collect()
}

/// The full benchmark: all laws over rates, with an exact model and with the errors that identification leaves; the
/// paper's law and the selected one over all mismatches and on the other beds, one of which has a mismatch of its own;
/// without accelerometer and tacho, all laws over rates and these two over the mismatches.
fn full() -> Vec<Block> {
    let all: Vec<String> = LAWS.iter().map(|(name, _)| (*name).into()).chain([AUTO.into()]).collect();
    let (perfect, real) = (Mismatch::PERFECT, Mismatch::REAL);
    let others: Vec<Mismatch> =
        MISMATCHES.iter().copied().filter(|other| ![perfect.name, real.name].contains(&other.name)).collect();
    let block = |presets: &[&str], rates: &[f64], mismatches: &[Mismatch], laws: &[String]| Block {
        presets: names(presets),
        rates: rates.into(),
        mismatches: mismatches.into(),
        observer: None,
        laws: laws.into(),
    };
    let without = |block: Block| Block { observer: Some(by_model()), ..block };
    let (rates, two) = ([1000.0, 4000.0, 10_000.0], names(&[PAPER, AUTO]));
    vec![
        block(&["prototype"], &rates, &[perfect, real], &all),
        block(&["prototype"], &[4000.0], &others, &two),
        block(&["clm-bench"], &[4000.0], &[perfect, real], &two),
        block(&["clm-real"], &[4000.0], &[perfect], &two),
        without(block(&["prototype"], &rates, &[real], &all)),
        without(block(&["prototype"], &[4000.0], &others, &two)),
        without(block(&["clm-bench"], &[4000.0], &[real], &two)),
    ]
}

fn quick() -> Vec<Block> {
    vec![Block {
        presets: names(&["prototype"]),
        rates: vec![4000.0, 10_000.0],
        mismatches: vec![Mismatch::REAL],
        observer: None,
        laws: names(&[PAPER, AUTO]),
    }]
}

impl Selection {
    /// The selected cells of the benchmark. Named items that are not part of it run as well, by default at 4 kHz with
    /// the mismatch `real`.
    ///
    /// # Errors
    /// [`Error::NothingToCompare`] for an unknown name; as [`TestBed::find`].
    pub fn plan(&self) -> Result<Plan, Error> {
        let mismatches: Vec<Mismatch> = by_name("mismatch", &self.mismatches, MISMATCHES, |mismatch| mismatch.name)?;
        let scenarios: Vec<Scenario> = by_name("scenario", &self.scenarios, SCENARIOS, |scenario| scenario.name)?;
        let laws: Vec<(&str, ())> = LAWS.iter().map(|(name, _)| (*name, ())).chain([(AUTO, ())]).collect();
        by_name("law", &self.laws, &laws, |law| law.0)?;
        let all_observers = [ObserverChoice::Accelerometer, by_model()];
        let observers = by_name("observer", &self.observers, &all_observers, observer_name)?;
        // The presets of the benchmark have an accelerometer.
        let shown = |block: &Block| {
            let name = observer_name(&block.observer.unwrap_or(ObserverChoice::Accelerometer));
            observers.is_empty() || observers.iter().any(|observer| observer_name(observer) == name)
        };
        let mut groups: Vec<Group> = Vec::new();
        for block in if self.quick { quick() } else { full() }.into_iter().filter(shown) {
            groups.extend(self.groups(&Block {
                presets: chosen(block.presets, &self.presets, |a, b| a == b),
                rates: chosen(block.rates, &self.rates, |a, b| a == b),
                mismatches: chosen(block.mismatches, &mismatches, |a, b| a.name == b.name),
                ..block
            })?);
        }
        if groups.is_empty() {
            let or = |selected: &[String], otherwise: &[&str]| {
                if selected.is_empty() { names(otherwise) } else { selected.to_vec() }
            };
            let observers = observers.iter().copied().map(Some);
            let observers: Vec<_> = if observers.len() > 0 { observers.collect() } else { vec![None] };
            for observer in observers {
                groups.extend(self.groups(&Block {
                    presets: or(&self.presets, &["prototype"]),
                    rates: if self.rates.is_empty() { vec![4000.0] } else { self.rates.clone() },
                    mismatches: if mismatches.is_empty() { vec![Mismatch::REAL] } else { mismatches.clone() },
                    observer,
                    laws: names(&[PAPER, AUTO]),
                })?);
            }
        }
        let all = if self.quick { super::CLOSED_LOOP } else { SCENARIOS };
        let count = self.seeds.unwrap_or(if self.quick { 3 } else { 10 });
        Ok(Plan {
            groups,
            scenarios: if scenarios.is_empty() { all.to_vec() } else { scenarios },
            seeds: (1..=count.max(1)).collect(),
            threads: if self.threads > 0 { self.threads } else { stickslip_base::parallel::processors() },
        })
    }

    /// The groups of a block. Groups with and without wheel are adjacent: they share A.
    fn groups(&self, block: &Block) -> Result<Vec<Group>, Error> {
        let mut groups = Vec::new();
        for preset in &block.presets {
            let bed = TestBed::find(preset)?;
            let observer = block.observer.unwrap_or(bed.observer());
            let set_up = |wheel: &bool| (bed.has_wheel() || !wheel) && self.wheel.is_none_or(|only| only == *wheel);
            for &rate in &block.rates {
                for &mismatch in &block.mismatches {
                    for wheel in [true, false].into_iter().filter(set_up) {
                        let laws = if self.laws.is_empty() { &block.laws } else { &self.laws }.clone();
                        let corrected = self.corrected(rate, mismatch);
                        let preset = preset.clone();
                        groups.push(Group { preset, wheel, rate, mismatch, observer, laws, corrected });
                    }
                }
            }
        }
        Ok(groups)
    }
}

impl Selection {
    /// The laws whose curve is corrected at a rate [Hz] under a mismatch: where a correction can help, or where the
    /// corrected curve is requested by name.
    fn corrected(&self, rate: f64, mismatch: Mismatch) -> Vec<String> {
        let requested = self.scenarios.iter().any(|name| name == Scenario::CURVE_CORRECTED.name);
        let helps = rate >= 4000.0 && [Mismatch::REAL.name, "gaussian", "ripple10%"].contains(&mismatch.name);
        match (requested || helps && !self.quick, self.laws.is_empty()) {
            (false, _) => Vec::new(),
            (true, true) => names(&[PAPER, AUTO]),
            (true, false) => self.laws.clone(),
        }
    }
}

/// The selected items of a block; all of them for an empty selection.
fn chosen<T>(all: Vec<T>, selection: &[T], same: impl Fn(&T, &T) -> bool) -> Vec<T> {
    all.into_iter().filter(|one| selection.is_empty() || selection.iter().any(|other| same(one, other))).collect()
}

/// The items of these names.
///
/// # Errors
/// [`Error::NothingToCompare`] with the first unknown name.
pub fn by_name<T: Copy>(
    what: &'static str,
    names: &[String],
    all: &[T],
    name: impl Fn(&T) -> &'static str,
) -> Result<Vec<T>, Error> {
    let find = |requested: &String| {
        all.iter().copied().find(|one| name(one) == requested).ok_or_else(|| Error::NothingToCompare {
            what,
            name: requested.clone(),
            known: all.iter().map(&name).collect(),
        })
    };
    names.iter().map(find).collect()
}
