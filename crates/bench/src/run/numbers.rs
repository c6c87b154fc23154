//! All numbers of a struct in a row, exact, for machine-written data.

use stickslip_core::fields::Fields;
use stickslip_core::snapshot::{StateVisitor, fields};

/// Room for the signals of a cycle, so that a row is allocated once.
const USUAL: usize = 40;

/// Selected variants, numbers and fixed counts in the order of declaration.
pub(super) fn numbers<P: Fields<f64>>(values: &P) -> Vec<f64> {
    let mut collect = Collect(Vec::with_capacity(USUAL));
    let mut copy = *values;
    fields(&mut collect, &mut copy);
    collect.0
}

/// The struct with these numbers; `None` for a different count or an unknown variant.
pub(super) fn from_numbers<P: Fields<f64> + Default>(numbers: &[f64]) -> Option<P> {
    let mut restore = Restore::new(numbers);
    let mut values = P::default();
    fields(&mut restore, &mut values);
    restore.fits().then_some(values)
}

struct Collect(Vec<f64>);

impl StateVisitor for Collect {
    fn number(&mut self, value: &mut f64) {
        self.0.push(*value);
    }
}

/// Restores numbers.
pub(super) struct Restore<'a> {
    numbers: std::slice::Iter<'a, f64>,
    fits: bool,
}

impl<'a> Restore<'a> {
    pub(super) fn new(numbers: &'a [f64]) -> Self {
        Restore { numbers: numbers.iter(), fits: true }
    }

    /// Whether numbers and fields correspond one to one.
    pub(super) fn fits(mut self) -> bool {
        self.fits && self.numbers.next().is_none()
    }
}

impl StateVisitor for Restore<'_> {
    fn number(&mut self, value: &mut f64) {
        match self.numbers.next() {
            Some(number) => *value = *number,
            None => self.fits = false,
        }
    }

    fn invalid(&mut self) {
        self.fits = false;
    }
}

#[cfg(test)]
mod tests {
    use stickslip_software::cycle::Parameters;

    use super::*;
    use stickslip_base::preset::LawChoice;
    use stickslip_base::{Preset, parameters};
    use stickslip_design as design;

    #[test]
    fn a_bench_is_restored_exactly_and_other_data_are_refused() {
        let mut preset: Preset<f64> = parameters::presets::find("clm-bench").unwrap().read().unwrap();
        preset.bench.law = LawChoice::Bristle;
        let mut bench = design::parameters(&preset.model, &preset.bench).unwrap();
        bench.tick.law = stickslip_simulate::rendering_law(&preset.model, &preset.bench).unwrap();
        let numbers = numbers(&bench);
        assert_eq!(from_numbers::<Parameters<f64>>(&numbers), Some(bench), "fixed counts included");
        assert_eq!(from_numbers::<Parameters<f64>>(&numbers[1..]), None);
        assert_eq!(from_numbers::<Parameters<f64>>(&[&numbers[..], &[0.0]].concat()), None);
        // The variant of the law is among the first small integers; another variant has other numbers.
        let mut wrong = numbers.clone();
        let place = numbers.iter().position(|number| *number == 4.0).unwrap();
        wrong[place] = 1e9;
        assert_ne!(from_numbers::<Parameters<f64>>(&wrong), Some(bench));
    }
}
