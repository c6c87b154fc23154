//! A torque that follows the angle: weight beside the axis of rotation, or a magnet or bearing that pulls once a turn.
//!
//! A constant force is not told apart from the zero of the command: both are the offset.

use crate::balance::{Balance, Solved, TURN, Terms};
use crate::machine::Axis;
use stickslip_base::quantity::{Estimate, tied};

/// A·sin(q + φ) on a rotary axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weight {
    /// Amplitude [N m].
    pub amplitude: f64,
    /// Its 95 % interval.
    pub ci95: [f64; 2],
}

impl Weight {
    pub(super) fn sentence(&self) -> String {
        let half_width = 0.5 * (self.ci95[1] - self.ci95[0]);
        format!(
            "A torque with one period per turn of the axis has an amplitude of {}: weight beside the axis of rotation, \
             or a pull once a turn. It was taken into account in inertia and friction, apart from the constant offset. \
             model.toml does not contain it.",
            tied(&Estimate::new(self.amplitude, "N m").with_half_width(half_width))
        )
    }
}

/// Some terms with a weight, where it predicts unseen parts of the recording better.
pub(super) fn with(balance: &Balance<'_>, terms: Terms) -> Terms {
    if balance.axis != Axis::Rotary {
        return terms;
    }
    let heavy = Terms { waves: vec![balance.wave(TURN)], ..terms.clone() };
    // Noise has an amplitude too.
    let is_clear = |solved: &Solved| solved.amplitude(0).is_some_and(|(_, [low, _])| low > 0.0);
    let is_better = balance.gains(&[terms.clone(), heavy.clone()]) == Some(1);
    if is_better && balance.solve(&heavy, &balance.whole()).is_ok_and(|it| is_clear(&it)) { heavy } else { terms }
}

/// The weight of a solved balance.
pub(super) fn found(solved: &Solved) -> Option<Weight> {
    let place = solved.terms.waves.iter().position(|wave| wave.number == TURN)?;
    let (amplitude, ci95) = solved.amplitude(place)?;
    Some(Weight { amplitude, ci95 })
}
