//! A state as a row of numbers, to the bit: kept in one cycle, put back to go on from there.
//!
//! One walk serves both ways. Whoever walks a state names each of its values once, in a fixed order; a [`StateVisitor`] reads
//! them or writes them. No allocation: it may be done between two ticks.

use crate::fields::{Field, Fields, Variant, Walk};

/// Whoever takes the numbers of a state, or gives them.
pub trait StateVisitor {
    /// The next number.
    fn number(&mut self, value: &mut f64);

    /// What was given last is no value of its kind: what was there stays.
    fn misfit(&mut self) {}
}

/// A count below 2^53.
pub fn count(keep: &mut dyn StateVisitor, value: &mut u64) {
    let mut number = *value as f64;
    keep.number(&mut number);
    let given = number as u64;
    if given as f64 == number && number < 9_007_199_254_740_992.0 { *value = given } else { keep.misfit() }
}

/// Whether something is so.
pub fn flag(keep: &mut dyn StateVisitor, value: &mut bool) {
    let mut number = u64::from(*value);
    count(keep, &mut number);
    *value = number > 0;
}

/// Which of so many.
pub fn which(keep: &mut dyn StateVisitor, value: usize, of: usize) -> usize {
    let mut number = value as u64;
    count(keep, &mut number);
    if number < of as u64 {
        return number as usize;
    }
    keep.misfit();
    value
}

/// A number that may not be known.
pub fn maybe(keep: &mut dyn StateVisitor, value: &mut Option<f64>) {
    let (mut known, mut number) = (value.is_some(), value.unwrap_or(0.0));
    flag(keep, &mut known);
    keep.number(&mut number);
    *value = known.then_some(number);
}

/// All of a struct: chosen variants, numbers and fixed counts in the order of declaration.
pub fn fields<P: Fields<f64>>(keep: &mut dyn StateVisitor, values: &mut P) {
    values.contents(&mut Contents(keep));
}

struct Contents<'a>(&'a mut dyn StateVisitor);

/// A count that is fixed is smaller.
const MOST: usize = 1 << 20;

impl Walk<f64> for Contents<'_> {
    fn number(&mut self, _: &'static Field, value: &mut f64) {
        self.0.number(value);
    }

    fn choice(&mut self, _: &'static str, variants: &'static [Variant], current: usize) -> usize {
        which(self.0, current, variants.len())
    }

    fn fixed(&mut self, count: &mut usize) {
        *count = which(self.0, *count, MOST);
    }
}
