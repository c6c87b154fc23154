//! Simulation of a recorded run on the virtual bench with other parameters.
//!
//! Commands, requests and faults are the same in the same cycles, but the software reads the simulated machine instead
//! of the record. Without changes, the result equals the record of a virtual machine exactly.

use std::time::Instant;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_core::fields::Fields;
use stickslip_core::render::Law;
use stickslip_software::cycle::{Change, Parameters};

use super::numbers::{from_numbers, numbers};
use super::read::Stored;
use super::replay::ReplayedBench;
use super::signals::channels;
use crate::tap::{ChangeKind, Changed};
use stickslip_base::parameters::{self, Difference};
use stickslip_base::{Error, Preset, Watch};
use stickslip_design as design;

/// Interval of the checks for cancellation [cycles].
const LOOK: u64 = 4096;

/// Simulation of a recorded run with other parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Simulated {
    /// Time of the first cycle [s].
    pub from: f64,
    /// Time of the last simulated cycle [s].
    pub to: f64,
    /// Number of simulated cycles.
    pub cycles: u64,
    /// Ratio of bench time to computing time.
    pub speed: f64,
    /// Reason of an end before the end of the record.
    pub ended: Option<String>,
    /// Time of each part of a trace [s].
    pub time: Vec<f64>,
    /// The requested signals.
    pub traces: Vec<Trace>,
}

/// A recorded and a simulated signal, with minimum and maximum in each part of the time, so that no spike is lost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Trace {
    /// Its name.
    pub signal: String,
    /// As in an equation; may be empty.
    pub symbol: String,
    /// SI unit.
    pub unit: String,
    /// As recorded: minimum and maximum.
    pub recorded: [Vec<Option<f64>>; 2],
    /// As simulated.
    pub simulated: [Vec<Option<f64>>; 2],
    /// Simulated minus recorded.
    pub difference: [Vec<Option<f64>>; 2],
    /// RMS of the difference over all cycles; `null` if a value is not finite.
    pub rms: Option<f64>,
    /// Its largest magnitude.
    pub peak: Option<f64>,
}

/// Request of a simulation.
#[derive(Clone, Debug)]
pub struct SimulationRequest<'a> {
    /// Changed values, by path.
    pub values: &'a [(String, String)],
    /// Names of the signals.
    pub signals: &'a [String],
    /// Length from the start of the run on [s].
    pub length: f64,
    /// Parts of the time in a trace, at least 1.
    pub parts: usize,
}

impl Stored {
    /// Simulates the run with other parameters; also returns the changed parameters.
    ///
    /// # Errors
    /// Invalid values; [`Error::Unknown`] signal; [`Error::Cancelled`]; a damaged file; an initial state that is
    /// impossible for the changed machine.
    pub fn simulate(
        &self,
        request: &SimulationRequest<'_>,
        watch: &Watch,
    ) -> Result<(Simulated, Vec<Difference>), Error> {
        let channels = channels();
        let index = |name: &String| {
            let unknown = || Error::Unknown {
                what: "signal",
                name: name.clone(),
                remedy: "`stickslip bench signals` lists them.".into(),
            };
            channels.iter().position(|entry| entry.path == *name).ok_or_else(unknown)
        };
        let indices = request.signals.iter().map(index).collect::<Result<Vec<_>, _>>()?;
        let preset = other(&self.record.preset, request.values)?;
        let differences = parameters::diff(&self.record.preset, &preset);
        let overlay = Overlay::new(&self.record.preset, &preset)?;
        let mut record = super::Record { preset, ..self.record.clone() };
        record.initial = overlay.over(&record.initial);
        for Changed { what, .. } in &mut record.changes {
            if let ChangeKind::Software(Change::Parameters(parameters), _) = what {
                *parameters = overlay.over(parameters);
            }
        }
        let tick_time = record.tick_time();
        let most = ((request.length / tick_time).min(self.len() as f64) as u64).max(1);
        let mut parts = Parts::new(indices.len(), most, request.parts as u64);
        // For another machine: the virtual machine of its preset, with noise.
        let mut bench = ReplayedBench::of(&record, record.seed.or(Some(1)))?;
        if record.state.is_some() && !differences.is_empty() {
            // The state has the recorded parameters.
            bench.adopt(|parameters| overlay.over(parameters));
        }
        let (mut first, mut last, mut cycles, mut ended) = (None, 0, 0, None);
        let start = Instant::now();
        for cycle in self.cycles()?.take(most as usize) {
            let (cycle, recorded) = cycle?;
            if cycles % LOOK == 0 {
                watch.stage("simulate", cycles as f64 / most as f64)?;
            }
            if bench.lost(cycle) > 0 {
                ended = Some("the following cycles are missing in the record".to_owned());
                break;
            }
            let simulated = bench.free(cycle, &recorded)?;
            let (old, new) = (recorded.row(), simulated.row());
            parts.take(cycle as f64 * tick_time, &indices, &old, &new);
            first.get_or_insert(cycle);
            last = cycle;
            cycles += 1;
        }
        let wall = start.elapsed().as_secs_f64().max(1e-9);
        let (time, traces) = parts.finish(cycles, |k| &channels[indices[k]]);
        let simulated = Simulated {
            from: first.unwrap_or(0) as f64 * tick_time,
            to: last as f64 * tick_time,
            cycles,
            speed: cycles as f64 * tick_time / wall,
            ended,
            time,
            traces,
        };
        Ok((simulated, differences))
    }
}

/// The preset with some values changed.
fn other(preset: &Preset<f64>, values: &[(String, String)]) -> Result<Preset<f64>, Error> {
    if let Some((path, _)) = values.iter().find(|(path, _)| FIXED.iter().any(|fixed| parameters::within(path, fixed))) {
        return Err(Error::Answer {
            question: "changed parameter of the simulation".into(),
            answer: path.clone(),
            remedy: "The cycles of the record depend on it: record a new run with this value.".into(),
        });
    }
    let text = parameters::set_all::<Preset<f64>>(&parameters::write_commented(preset), "the run", values)?;
    Ok(parameters::read(&text, "the run")?)
}

/// Parameters that change the meaning of cycles and counts of a record.
const FIXED: [&str; 2] = ["bench.tick_rate", "model.encoder"];

/// Changes of the parameters of the software; other changes during the run are preserved.
struct Overlay {
    before: Parameters<f64>,
    after: Parameters<f64>,
    laws: [Law<f64>; 2],
}

impl Overlay {
    fn new(before: &Preset<f64>, after: &Preset<f64>) -> Result<Self, Error> {
        let law = |preset: &Preset<f64>| stickslip_simulate::rendering_law(&preset.model, &preset.bench);
        // An automatic law is chosen by simulations, so it is chosen only once if possible.
        let first = law(before)?;
        let same = before.model == after.model && before.bench == after.bench;
        let laws = [first, if same { first } else { law(after)? }];
        let design = |preset: &Preset<f64>| design::parameters(&preset.model, &preset.bench);
        Ok(Overlay { before: design(before)?, after: design(after)?, laws })
    }

    fn over(&self, parameters: &Parameters<f64>) -> Parameters<f64> {
        let law = match parameters.tick.law {
            Law::Off => Law::Off,
            law => over(&law, &self.laws[0], &self.laws[1]),
        };
        let without = |parameters: &Parameters<f64>| {
            let mut parameters = *parameters;
            parameters.tick.law = Law::Off;
            parameters
        };
        let mut new = over(&without(parameters), &without(&self.before), &without(&self.after));
        new.tick.law = law;
        new
    }
}

/// Applies the differences between two sets to a third; returns the second if their structures differ.
fn over<P: Fields<f64> + Default + PartialEq>(set: &P, before: &P, after: &P) -> P {
    if before == after {
        return *set;
    }
    let (mut row, old, new) = (numbers(set), numbers(before), numbers(after));
    if row.len() != old.len() || old.len() != new.len() {
        return *after;
    }
    for ((value, old), new) in row.iter_mut().zip(&old).zip(&new) {
        if old.to_bits() != new.to_bits() {
            *value = *new;
        }
    }
    from_numbers(&row).unwrap_or(*after)
}

/// Traces under construction.
struct Parts {
    each: u64,
    taken: u64,
    time: Vec<f64>,
    /// For each signal: recorded, simulated, difference; each with minimum and maximum.
    extremes: Vec<[[Vec<f64>; 2]; 3]>,
    squares: Vec<f64>,
    peaks: Vec<f64>,
}

impl Parts {
    fn new(signals: usize, cycles: u64, parts: u64) -> Self {
        Parts {
            each: cycles.div_ceil(parts.max(1)).max(1),
            taken: 0,
            time: Vec::new(),
            extremes: vec![Default::default(); signals],
            squares: vec![0.0; signals],
            peaks: vec![0.0; signals],
        }
    }

    fn take(&mut self, time: f64, indices: &[usize], old: &[f64], new: &[f64]) {
        let begins = self.taken.is_multiple_of(self.each);
        self.taken += 1;
        if begins {
            self.time.push(time);
        }
        for (k, &index) in indices.iter().enumerate() {
            let difference = new[index] - old[index];
            self.squares[k] += difference * difference;
            // Non-finite values remain visible.
            let peak = self.peaks[k];
            self.peaks[k] = if difference.is_nan() || peak.is_nan() { f64::NAN } else { peak.max(difference.abs()) };
            for (part, value) in self.extremes[k].iter_mut().zip([old[index], new[index], difference]) {
                let [least, largest] = part;
                match (begins, least.last_mut(), largest.last_mut()) {
                    (false, Some(low), Some(high)) => {
                        *low = low.min(value);
                        *high = high.max(value);
                    }
                    _ => {
                        least.push(value);
                        largest.push(value);
                    }
                }
            }
        }
    }

    fn finish<'a>(self, cycles: u64, channel: impl Fn(usize) -> &'a parameters::Entry) -> (Vec<f64>, Vec<Trace>) {
        let finite = |value: f64| value.is_finite().then_some(value);
        let column = |values: Vec<f64>| values.into_iter().map(|value| finite(rounded(value))).collect::<Vec<_>>();
        let Parts { time, extremes, squares, peaks, .. } = self;
        let traces = extremes.into_iter().zip(squares).zip(peaks).enumerate().map(|(k, ((parts, squares), peak))| {
            let entry = channel(k);
            let [recorded, simulated, difference] = parts.map(|part| part.map(column));
            Trace {
                signal: entry.path.clone(),
                symbol: entry.field.symbol.into(),
                unit: entry.field.unit.into(),
                recorded,
                simulated,
                difference,
                rms: finite((squares / cycles.max(1) as f64).sqrt()),
                peak: finite(peak),
            }
        });
        (time, traces.collect())
    }
}

/// Rounded to the resolution of a plot.
fn rounded(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changed_values_enter_a_set_with_other_changes() {
        let preset: Preset<f64> = parameters::presets::find("clm-bench").unwrap().read().unwrap();
        let gain = |preset: &Preset<f64>, gain: &str| {
            other(preset, &[("bench.controller.position_gain".into(), gain.into())]).unwrap()
        };
        let overlay = Overlay::new(&preset, &gain(&preset, "20")).unwrap();
        // Meanwhile the permitted following error was increased.
        let mut meanwhile = overlay.before;
        meanwhile.safety.following_error *= 2.0;
        let new = overlay.over(&meanwhile);
        assert_eq!(new.tick.control, overlay.after.tick.control);
        assert_ne!(new.tick.control, meanwhile.tick.control);
        assert_eq!(new.safety, meanwhile.safety);
        assert_eq!(new.tick.law, Law::Off, "no law where there was none");
        let mut rendering = overlay.before;
        rendering.tick.law = overlay.laws[0];
        assert_ne!(overlay.over(&rendering).tick.law, Law::Off);
    }

    #[test]
    fn a_part_has_minimum_and_maximum_and_keeps_non_finite_values() {
        let mut parts = Parts::new(1, 4, 2);
        for (k, new) in [1.0, -3.0, 2.0, 5.0].into_iter().enumerate() {
            parts.take(k as f64, &[0], &[1.0], &[new]);
        }
        assert_eq!(parts.time, [0.0, 2.0]);
        assert_eq!(parts.extremes[0][1], [vec![-3.0, 2.0], vec![1.0, 5.0]]);
        assert_eq!(parts.extremes[0][2], [vec![-4.0, 1.0], vec![0.0, 4.0]]);
        assert_eq!((parts.peaks[0], parts.squares[0]), (4.0, 33.0));
        parts.take(4.0, &[0], &[1.0], &[f64::NAN]);
        parts.take(5.0, &[0], &[1.0], &[1.0]);
        assert!(parts.peaks[0].is_nan() && parts.squares[0].is_nan());
    }
}
