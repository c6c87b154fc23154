//! The step of the virtual machine, chosen for each case by what its measures say.
//!
//! A case is run with ever finer steps, each half of the one before, until none of its measures moves by more than the
//! tolerance. By how much they still moved is its error: of a scheme of second order three times what is left, of one of
//! first order just that.

use super::Work;
use super::cases::Measured;
use stickslip_base::preset::Preset;
use stickslip_base::{Error, Watch};

/// No finer step is tried [s].
const FINEST: f64 = 1e-6;
/// What halving the step has to make of an error for another one to be tried. What moves more does not hang on the step,
/// but on the smallest causes: a count of the encoder, a sample of the noise.
const FALLS: f64 = 0.5;

/// A case on its way to steps that are fine enough.
struct Climb {
    preset: Preset<f64>,
    /// In a tick.
    steps: u64,
    found: Option<Measured>,
    /// The least that the measures have moved by so far.
    least: f64,
    settled: bool,
}

impl Climb {
    fn new(preset: &Preset<f64>) -> Self {
        Climb { preset: *preset, steps: coarsest(preset), found: None, least: f64::INFINITY, settled: false }
    }

    fn step(&self) -> f64 {
        self.preset.bench.tick_time() / self.steps as f64
    }

    fn machine(&self) -> Preset<f64> {
        let mut preset = self.preset;
        preset.bench.plant_step = self.step();
        preset
    }

    /// Takes what the measures are with its steps, and chooses what comes next.
    fn take(&mut self, found: Measured, tolerance: f64) {
        let moved = self.found.as_ref().and_then(|coarser| moved(&coarser.measures, &found.measures));
        let first = self.found.is_none();
        self.found = Some(Measured { step: Some(self.step()), error: moved, ..found });
        if let Some(moved) = moved {
            // Where the preset would not go, only as long as it helps.
            let stands = self.step() <= self.preset.bench.plant_step && moved > FALLS * self.least;
            self.settled = moved <= tolerance || stands;
            self.least = self.least.min(moved);
        } else {
            self.settled = !first;
        }
        self.settled |= 0.5 * self.step() < FINEST;
        self.steps *= 2;
    }
}

impl Work {
    /// The measures of machines, each with the steps that the tolerance takes.
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
                return Ok(climbs.into_iter().filter_map(|climb| climb.found).collect());
            }
            let machines: Vec<Preset<f64>> = open.iter().map(|climb| climb.machine()).collect();
            let found = self.measured(&machines, watch)?;
            open.iter_mut().zip(found).for_each(|(climb, found)| climb.take(found, tolerance));
        }
    }
}

/// Fewest steps of a tick, a power of two, that the machine bears and that show the jitter of its ticks.
pub(super) fn coarsest(preset: &Preset<f64>) -> u64 {
    let (tick, jitter) = (preset.bench.tick_time(), preset.plant.tick_jitter);
    let longest = preset.plant.largest_step().min(if jitter > 0.0 { jitter } else { tick });
    // A hair off a whole number is rounding, not another step.
    let steps = (tick / longest - 1e-9).ceil().clamp(1.0, (tick / FINEST).max(1.0));
    (steps as u64).max(1).next_power_of_two()
}

/// Largest share by which measures differ; a measure that is there in one of them alone differs by all of it. `None`
/// where none is there.
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

    fn found(measures: &[Option<f64>]) -> Measured {
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
    fn a_case_climbs_until_its_measures_stand_still() {
        let mut climb = climb();
        let steps = climb.steps;
        for (value, settled) in [(1.0, false), (1.1, false), (1.12, false), (1.121, true)] {
            assert!(!climb.settled);
            climb.take(found(&[Some(value)]), 1e-3);
            assert_eq!(climb.settled, settled, "{value}");
        }
        let found = climb.found.unwrap();
        assert_eq!(found.step, Some(250e-6 / (8 * steps) as f64));
        assert_eq!(found.error, Some((1.121 - 1.12) / 1.121));
    }

    #[test]
    fn what_does_not_hang_on_the_step_ends_the_climb_and_says_so() {
        let mut climb = climb();
        let mut runs = 0;
        while !climb.settled {
            runs += 1;
            climb.take(found(&[Some(if runs % 2 == 0 { 1.0 } else { 1.1 })]), 1e-3);
        }
        let found = climb.found.unwrap();
        // Not before the step that the preset states, and no finer.
        assert!(found.step.unwrap() <= 25e-6 && found.step.unwrap() > 12.4e-6, "{found:?}");
        assert!((found.error.unwrap() - 0.1 / 1.1).abs() <= 1e-12);
    }

    #[test]
    fn where_nothing_is_measured_nothing_is_said_of_the_error() {
        let mut climb = climb();
        climb.take(found(&[None]), 1e-3);
        assert!(!climb.settled);
        climb.take(found(&[None]), 1e-3);
        assert!(climb.settled);
        assert_eq!(climb.found.unwrap().error, None);
        // Stopped with the coarser step alone: another one tells.
        let mut climb = super::tests::climb();
        climb.take(found(&[None]), 1e-3);
        climb.take(found(&[Some(1.0)]), 1e-3);
        assert!(!climb.settled);
    }

    #[test]
    fn the_coarsest_step_is_one_that_the_machine_bears_and_that_shows_its_jitter() {
        let mut preset = climb().preset;
        assert_eq!(coarsest(&preset), 1);
        preset.plant.tick_jitter = 30e-6;
        assert_eq!(coarsest(&preset), 16, "15.6 us; 31.25 would hide some of it");
        preset.plant.tick_jitter = 0.0;
        preset.plant.drive.coupling_stiffness = 1e9;
        assert_eq!(coarsest(&preset), 256, "no finer than a microsecond");
        preset.plant.drive.coupling_stiffness = f64::NAN;
        assert_eq!(coarsest(&preset), 1);
    }
}
