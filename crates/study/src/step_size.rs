//! The step of the virtual machine, selected for each case by its measures.
//!
//! A case is run with ever finer steps, each half of the one before, until none of its measures moves by more than the
//! tolerance. The last change is its error: three times the remaining error of a scheme of second order, the remaining
//! error itself of one of first order.

use super::Work;
use super::cases::Measured;
use stickslip_base::preset::Preset;
use stickslip_base::stability::largest_step;
use stickslip_base::{Error, Watch};

/// Finest step [s].
const FINEST: f64 = 1e-6;
/// Factor by which halving the step must reduce an error for another one to be tried. A larger change does not depend
/// on the step, but on single events: a count of the encoder, a sample of the noise.
const FALLS: f64 = 0.5;

/// Search for the step of a case.
struct Climb {
    preset: Preset<f64>,
    /// Steps in a tick.
    steps: u64,
    result: Option<Measured>,
    /// Smallest change of the measures so far.
    least: f64,
    settled: bool,
}

impl Climb {
    fn new(preset: &Preset<f64>) -> Self {
        Climb { preset: *preset, steps: coarsest(preset), result: None, least: f64::INFINITY, settled: false }
    }

    fn step(&self) -> f64 {
        self.preset.bench.tick_time() / self.steps as f64
    }

    fn machine(&self) -> Preset<f64> {
        let mut preset = self.preset;
        preset.bench.plant_step = self.step();
        preset
    }

    /// Takes the measures with the present steps, and selects the next ones.
    fn take(&mut self, result: Measured, tolerance: f64) {
        let moved = self.result.as_ref().and_then(|coarser| moved(&coarser.measures, &result.measures));
        let first = self.result.is_none();
        self.result = Some(Measured { step: Some(self.step()), error: moved, ..result });
        if let Some(moved) = moved {
            // Finer than the preset only as long as it helps.
            let is_constant = self.step() <= self.preset.bench.plant_step && moved > FALLS * self.least;
            self.settled = moved <= tolerance || is_constant;
            self.least = self.least.min(moved);
        } else {
            self.settled = !first;
        }
        self.settled |= 0.5 * self.step() < FINEST;
        self.steps *= 2;
    }
}

impl Work {
    /// The measures of machines, each with the steps that the tolerance requires.
    ///
    /// # Errors
    /// [`Error::Cancelled`] alone.
    pub(super) fn settled(
        &self,
        presets: &[Preset<f64>],
        tolerance: f64,
        watch: &Watch,
    ) -> Result<Vec<Measured>, Error> {
        let mut climbs: Vec<Climb> = presets.iter().map(Climb::new).collect();
        loop {
            let mut open: Vec<&mut Climb> = climbs.iter_mut().filter(|climb| !climb.settled).collect();
            if open.is_empty() {
                return Ok(climbs.into_iter().filter_map(|climb| climb.result).collect());
            }
            let machines: Vec<Preset<f64>> = open.iter().map(|climb| climb.machine()).collect();
            let results = self.measured(&machines, watch)?;
            open.iter_mut().zip(results).for_each(|(climb, result)| climb.take(result, tolerance));
        }
    }
}

/// Fewest steps of a tick, a power of two, that the machine admits and that resolve the jitter of its ticks.
pub(super) fn coarsest(preset: &Preset<f64>) -> u64 {
    let (tick, jitter) = (preset.bench.tick_time(), preset.plant.tick_jitter);
    let longest = largest_step(&preset.plant).min(if jitter > 0.0 { jitter } else { tick });
    // A deviation from a whole number within rounding is not another step.
    let steps = (tick / longest - 1e-9).ceil().clamp(1.0, (tick / FINEST).max(1.0));
    (steps as u64).max(1).next_power_of_two()
}

/// Largest share by which measures differ; a measure that exists in only one of them differs by 1. `None` where there
/// is none.
fn moved(coarser: &[Option<f64>], finer: &[Option<f64>]) -> Option<f64> {
    let shares = coarser.iter().zip(finer).filter_map(|pair| match pair {
        (Some(a), Some(b)) if a == b => Some(0.0),
        (Some(a), Some(b)) => Some((a - b).abs() / a.abs().max(b.abs())),
        (None, None) => None,
        _ => Some(1.0),
    });
    shares.reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::parameters::presets::find;

    fn climb() -> Climb {
        let mut preset: Preset<f64> = find("prototype").unwrap().read().unwrap();
        preset.bench.tick_rate = 4000.0;
        Climb::new(&preset)
    }

    fn measured(measures: &[Option<f64>]) -> Measured {
        Measured { measures: measures.to_vec(), ..Measured::default() }
    }

    #[test]
    fn a_measure_moves_by_a_share_of_itself() {
        assert_eq!(moved(&[Some(2.0), Some(-1.0)], &[Some(1.5), Some(-1.0)]), Some(0.25));
        assert_eq!(moved(&[Some(0.0), None], &[Some(0.0), None]), Some(0.0));
        assert_eq!(moved(&[None], &[Some(1e-9)]), Some(1.0));
        assert_eq!(moved(&[None], &[None]), None);
    }

    #[test]
    fn steps_are_halved_until_the_measures_are_constant() {
        let mut climb = climb();
        let steps = climb.steps;
        for (value, settled) in [(1.0, false), (1.1, false), (1.12, false), (1.121, true)] {
            assert!(!climb.settled);
            climb.take(measured(&[Some(value)]), 1e-3);
            assert_eq!(climb.settled, settled, "{value}");
        }
        let result = climb.result.unwrap();
        assert_eq!(result.step, Some(250e-6 / (8 * steps) as f64));
        assert_eq!(result.error, Some((1.121 - 1.12) / 1.121));
    }

    #[test]
    fn a_change_independent_of_the_step_ends_the_search_and_is_reported() {
        let mut climb = climb();
        let mut runs = 0;
        while !climb.settled {
            runs += 1;
            climb.take(measured(&[Some(if runs % 2 == 0 { 1.0 } else { 1.1 })]), 1e-3);
        }
        let result = climb.result.unwrap();
        // Not before the step that the preset states, and no finer.
        assert!(result.step.unwrap() <= 25e-6 && result.step.unwrap() > 12.4e-6, "{result:?}");
        assert!((result.error.unwrap() - 0.1 / 1.1).abs() <= 1e-12);
    }

    #[test]
    fn without_measures_there_is_no_error() {
        let mut climb = climb();
        climb.take(measured(&[None]), 1e-3);
        assert!(!climb.settled);
        climb.take(measured(&[None]), 1e-3);
        assert!(climb.settled);
        assert_eq!(climb.result.unwrap().error, None);
        // Stopped with the coarser step only: a finer one shows it.
        let mut climb = super::tests::climb();
        climb.take(measured(&[None]), 1e-3);
        climb.take(measured(&[Some(1.0)]), 1e-3);
        assert!(!climb.settled);
    }

    #[test]
    fn the_coarsest_step_is_admitted_by_the_machine_and_resolves_its_jitter() {
        let mut preset = climb().preset;
        assert_eq!(coarsest(&preset), 1);
        preset.plant.tick_jitter = 30e-6;
        assert_eq!(coarsest(&preset), 16, "15.6 us; 31.25 would not resolve it");
        preset.plant.tick_jitter = 0.0;
        preset.plant.drive.coupling_stiffness = 1e9;
        assert_eq!(coarsest(&preset), 256, "no finer than a microsecond");
        preset.plant.drive.coupling_stiffness = f64::NAN;
        assert_eq!(coarsest(&preset), 1);
    }
}
