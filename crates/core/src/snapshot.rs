//! A state as a row of numbers, exact to the bit: stored in one cycle, restored later to continue from there.
//!
//! One walk serves both directions. It visits each value of a state once, in a fixed order; a [`StateVisitor`] reads or
//! writes them. No allocation: snapshots are possible between two ticks.

use crate::fields::{Field, Fields, Variant, Walk};

/// A visitor that reads or writes the numbers of a state.
pub trait StateVisitor {
    /// The next number.
    fn number(&mut self, value: &mut f64);

    /// The last number is invalid for its value, which stays unchanged.
    fn invalid(&mut self) {}
}

/// A count below 2^53.
pub fn count(visitor: &mut dyn StateVisitor, value: &mut u64) {
    let mut number = *value as f64;
    visitor.number(&mut number);
    let whole = number as u64;
    if whole as f64 == number && number < 9_007_199_254_740_992.0 { *value = whole } else { visitor.invalid() }
}

/// A truth value.
pub fn flag(visitor: &mut dyn StateVisitor, value: &mut bool) {
    let mut number = u64::from(*value);
    count(visitor, &mut number);
    *value = number > 0;
}

/// An index below a count.
pub fn choice(visitor: &mut dyn StateVisitor, value: usize, of: usize) -> usize {
    let mut number = value as u64;
    count(visitor, &mut number);
    if number < of as u64 {
        return number as usize;
    }
    visitor.invalid();
    value
}

/// An optional number.
pub fn optional(visitor: &mut dyn StateVisitor, value: &mut Option<f64>) {
    let (mut is_some, mut number) = (value.is_some(), value.unwrap_or(0.0));
    flag(visitor, &mut is_some);
    visitor.number(&mut number);
    *value = is_some.then_some(number);
}

/// All values of a struct: chosen variants, numbers and fixed counts in the order of declaration.
pub fn fields<P: Fields<f64>>(visitor: &mut dyn StateVisitor, values: &mut P) {
    values.contents(&mut Contents(visitor));
}

struct Contents<'a>(&'a mut dyn StateVisitor);

/// Upper bound of fixed counts.
const LARGEST_COUNT: usize = 1 << 20;

impl Walk<f64> for Contents<'_> {
    fn number(&mut self, _: &'static Field, value: &mut f64) {
        self.0.number(value);
    }

    fn choice(&mut self, _: &'static str, variants: &'static [Variant], current: usize) -> usize {
        choice(self.0, current, variants.len())
    }

    fn fixed(&mut self, count: &mut usize) {
        *count = choice(self.0, *count, LARGEST_COUNT);
    }
}
