//! Parts of a measurement that are reported while it runs.

use std::any::Any;

use crate::{Loop, Plateau, Ramp};

/// A part of a measurement, as [`Watch::with_parts`](stickslip_base::Watch::with_parts) receives it.
#[derive(Clone, Copy, Debug)]
pub enum Part<'a> {
    /// A completed plateau of a friction measurement.
    Plateau(&'a Plateau),
    /// A completed ramp of a breakaway measurement.
    Ramp(&'a Ramp),
    /// A presliding loop, complete or in progress; a later loop of the same frequency replaces it.
    Loop(&'a Loop),
}

impl<'a> Part<'a> {
    /// The part behind a value that a watch received; `None` for any other type.
    pub fn of(part: &'a dyn Any) -> Option<Self> {
        let plateau = part.downcast_ref().map(Part::Plateau);
        plateau.or_else(|| part.downcast_ref().map(Part::Ramp)).or_else(|| part.downcast_ref().map(Part::Loop))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_recognised_by_its_type() {
        let ramp = Ramp { angle: 0.0, direction: 1.0, torque: Some(0.3) };
        assert!(matches!(Part::of(&ramp), Some(Part::Ramp(part)) if *part == ramp));
        assert!(Part::of(&1.0_f64).is_none());
    }
}
