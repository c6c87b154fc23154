//! State of a contact.

use crate::Fields;
use crate::drive::nan_to_zero;
use crate::scalar::{Mask, Scalar};

/// Number of elements of a Maxwell slip.
pub const ELEMENTS: usize = 4;

/// State of a contact from step to step; initially without deflection and without time at rest. Each model uses its
/// part, so that models may be swapped.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Memory<T> {
    /// Deflection of the bristles; of a Maxwell slip the mean of its elements.
    #[field(symbol = "z", unit = "rad")]
    pub deflection: T,
    /// Deflection of each element of a Maxwell slip.
    #[field(symbol = "z_i", unit = "rad")]
    pub elements: [T; ELEMENTS],
    /// Breakaway torque less the level of a Maxwell slip, as a share of the breakaway torque.
    #[field(symbol = "q", unit = "1", range = -1e9..=1.0)]
    pub lag: T,
    /// Age of the contact: its time at rest, which sliding reduces.
    #[field(symbol = "θ", unit = "s", range = 0.0..=1e12)]
    pub age: T,
}

impl<T: Scalar> Memory<T> {
    /// All bristles and elements at this deflection [rad].
    pub fn bent(deflection: T) -> Self {
        Memory { deflection, elements: [deflection; ELEMENTS], ..Memory::default() }
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn choose(mask: T::Mask, yes: &Self, no: &Self) -> Self {
        let mut elements = yes.elements;
        for i in 0..ELEMENTS {
            elements[i] = mask.select(yes.elements[i], no.elements[i]);
        }
        Memory {
            deflection: mask.select(yes.deflection, no.deflection),
            elements,
            lag: mask.select(yes.lag, no.lag),
            age: mask.select(yes.age, no.age),
        }
    }

    /// This state with 0 for each NaN.
    #[inline(always)]
    pub(crate) fn without_nan(&self) -> Self {
        let mut elements = self.elements;
        for i in 0..ELEMENTS {
            elements[i] = nan_to_zero(elements[i]);
        }
        Memory {
            deflection: nan_to_zero(self.deflection),
            elements,
            lag: nan_to_zero(self.lag),
            age: nan_to_zero(self.age),
        }
    }
}
