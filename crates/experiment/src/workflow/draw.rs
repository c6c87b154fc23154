//! Common parts of friction figures: axes, grid of speeds, curves and plateaus as series.

use stickslip_core::friction::Stribeck;

use crate::FrictionCurve;
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::{Estimate, NORMAL95, tied};

/// A figure with the name of its file and its caption.
pub(crate) type Captioned = (&'static str, Figure, String);

/// Points of a drawn curve.
pub(crate) const POINTS: usize = 400;

pub(crate) fn torque(value: f64) -> String {
    tied(&Estimate::new(value, "N m"))
}

pub(crate) fn friction(title: &str) -> Figure {
    Figure::new(title).x(Axis::new("speed Ω", "rad/s").stretched()).y(Axis::new("friction torque", "N m"))
}

pub(crate) fn load(title: &str) -> Figure {
    Figure::new(title).y(Axis::new("load torque", "N m"))
}

/// The plateaus that slid, with the 95 % intervals used by a fit.
pub(crate) fn plateaus(role: Role, curve: &FrictionCurve) -> Series {
    let points = curve.points().into_iter();
    let bars = points.map(|point| (point.velocity, point.torque, NORMAL95 * point.standard_error));
    Series::bars(role, "plateaus", bars)
}

/// The parts of all plateaus that slid: the noisy signal.
pub fn points(curve: &FrictionCurve) -> impl Iterator<Item = (f64, f64)> + '_ {
    curve.valid().flat_map(|plateau| plateau.blocks.iter().map(|block| (block.velocity, block.torque)))
}

/// The noisy signal of the own friction.
pub fn measured(curve: &FrictionCurve) -> Series {
    Series::points(Role::Measured, "measured", points(curve))
}

/// The same with both directions on the positive side.
pub(crate) fn folded_points(curve: &FrictionCurve) -> impl Iterator<Item = (f64, f64)> + '_ {
    curve.valid().flat_map(|plateau| {
        let sign = plateau.set_velocity.signum();
        plateau.blocks.iter().map(move |block| (sign * block.velocity, sign * block.torque))
    })
}

/// Velocities from −fastest to fastest, dense around standstill, with a gap at 0, where friction jumps.
pub fn grid(fastest: f64) -> impl Iterator<Item = f64> {
    let half = move |sign: f64| {
        (0..POINTS).map(move |k| {
            let share = if sign < 0.0 { POINTS - 1 - k } else { k } as f64 / (POINTS - 1) as f64;
            sign * 1e-3 * libm::exp(libm::log(fastest / 1e-3) * share)
        })
    };
    half(-1.0).chain([f64::NAN]).chain(half(1.0))
}

pub(crate) fn curve(law: &Stribeck<f64>, fastest: f64) -> impl Iterator<Item = (f64, f64)> + use<> {
    let law = *law;
    grid(fastest).map(move |velocity| (velocity, law.torque(velocity)))
}

/// The positive half alone.
pub(crate) fn folded(law: &Stribeck<f64>, fastest: f64) -> impl Iterator<Item = (f64, f64)> + use<> {
    curve(law, fastest).filter(|(velocity, _)| *velocity > 0.0)
}
