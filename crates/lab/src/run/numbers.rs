//! All numbers of a struct in a row, to the bit: for what no person writes.

use stickslip_core::fields::{Field, Fields, Variant, Walk};

/// The chosen variants, numbers and fixed counts in the order of declaration.
pub(super) fn numbers<P: Fields<f64>>(values: &P) -> Vec<f64> {
    let mut collect = Collect(Vec::new());
    let mut copy = *values;
    copy.contents(&mut collect);
    collect.0
}

/// The struct that has these numbers; none if they are not as many as it takes, or name a variant that there is not.
pub(super) fn from_numbers<P: Fields<f64> + Default>(numbers: &[f64]) -> Option<P> {
    let mut restore = Restore { numbers: numbers.iter(), fits: true };
    let mut values = P::default();
    values.contents(&mut restore);
    (restore.fits && restore.numbers.next().is_none()).then_some(values)
}

struct Collect(Vec<f64>);

impl Walk<f64> for Collect {
    fn number(&mut self, _: &'static Field, value: &mut f64) {
        self.0.push(*value);
    }

    fn choice(&mut self, _: &'static str, _: &'static [Variant], current: usize) -> usize {
        self.0.push(current as f64);
        current
    }

    fn fixed(&mut self, count: &mut usize) {
        self.0.push(*count as f64);
    }
}

struct Restore<'a> {
    numbers: std::slice::Iter<'a, f64>,
    fits: bool,
}

impl Restore<'_> {
    fn next(&mut self) -> f64 {
        self.numbers.next().copied().unwrap_or_else(|| {
            self.fits = false;
            0.0
        })
    }

    /// A whole number below `limit`.
    fn count(&mut self, limit: usize) -> usize {
        let number = self.next();
        let count = number as usize;
        let valid = count as f64 == number && count < limit;
        self.fits &= valid;
        if valid { count } else { 0 }
    }
}

impl Walk<f64> for Restore<'_> {
    fn number(&mut self, _: &'static Field, value: &mut f64) {
        *value = self.next();
    }

    fn choice(&mut self, _: &'static str, variants: &'static [Variant], _: usize) -> usize {
        self.count(variants.len())
    }

    fn fixed(&mut self, count: &mut usize) {
        *count = self.count(1 << 20);
    }
}

#[cfg(test)]
mod tests {
    use stickslip_core::cycle::Parameters;

    use super::*;
    use crate::preset::LawChoice;
    use crate::{Preset, design, parameters};

    #[test]
    fn every_bit_of_a_bench_comes_back_and_nothing_else_does() {
        let mut preset: Preset<f64> = parameters::presets::find("clm-bench").unwrap().read().unwrap();
        preset.bench.law = LawChoice::Bristle;
        let mut bench = design::parameters(&preset.model, &preset.bench).unwrap();
        bench.tick.law = design::rendering_law(&preset.model, &preset.bench).unwrap();
        let numbers = numbers(&bench);
        assert_eq!(from_numbers::<Parameters<f64>>(&numbers), Some(bench), "fixed counts included");
        assert_eq!(from_numbers::<Parameters<f64>>(&numbers[1..]), None);
        assert_eq!(from_numbers::<Parameters<f64>>(&[&numbers[..], &[0.0]].concat()), None);
        // The variant of the law is among the first numbers that are small and whole; another variant has other numbers.
        let mut wrong = numbers.clone();
        let place = numbers.iter().position(|number| *number == 4.0).unwrap();
        wrong[place] = 1e9;
        assert_ne!(from_numbers::<Parameters<f64>>(&wrong), Some(bench));
    }
}
