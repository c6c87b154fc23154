//! Expected friction under the paper's law, in particular around standstill.

use stickslip_core::friction::Stribeck;
use stickslip_core::render::DifferenceTorque;

use super::friction::hold_speed;
use stickslip_base::{Error, Watch};
use stickslip_bench::{Bench, Command, Frame, SpeedRamp};

/// Expected difference between desired and rendered characteristic [N m] at a velocity [rad/s].
///
/// The law multiplies by the sign of an estimate Ω + n and is faded out around standstill; with n normal of standard
/// deviation `sigma` the load motor gives E[1(|Ω + n| > Ω_fade)·sign(Ω + n)·D(|Ω + n|)] instead of D(Ω).
pub fn expected_deviation(law: &DifferenceTorque<f64>, velocity: f64, sigma: f64) -> f64 {
    let difference = velocity.signum() * (law.desired.magnitude(velocity.abs()) - law.own.magnitude(velocity.abs()));
    if sigma <= 0.0 {
        return difference - law.torque(velocity);
    }
    // Sum over ±6 σ; with this many points the place of the fade limits between them has no effect.
    const POINTS: i32 = 6000;
    let (mut mean, mut weights) = (0.0, 0.0);
    for k in -POINTS..=POINTS {
        let s = 6.0 * f64::from(k) / f64::from(POINTS);
        let weight = libm::exp(-0.5 * s * s);
        weights += weight;
        mean += weight * law.torque(velocity + sigma * s);
    }
    difference - mean / weights
}

/// RMS of [`expected_deviation`] over the velocities [rad/s] that lie inside the fade-out, each with the standard
/// deviation of its estimate [rad/s]; NaN if none does.
pub fn expected_inside_fade(law: &DifferenceTorque<f64>, velocities: impl Iterator<Item = (f64, f64)>) -> f64 {
    let squares: Vec<f64> = velocities
        .filter(|(velocity, _)| velocity.abs() <= law.fade_velocity)
        .map(|(velocity, sigma)| expected_deviation(law, velocity, sigma).powi(2))
        .collect();
    libm::sqrt(squares.iter().sum::<f64>() / squares.len() as f64)
}

/// Preload of the friction wheel for a breakaway torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreloadAdvice {
    /// Preload to set, 0 … 1.
    pub preload: f64,
    /// Preload for exactly this torque, possibly out of range.
    pub wanted: f64,
    /// Expected breakaway torque [N m].
    pub breakaway_torque: f64,
}

/// The preload for a desired breakaway torque [N m], from curve 1 (linings released) and curve 2 (pressed on fully):
/// friction of a dry lining is proportional to its preload.
pub fn advise_preload(desired: f64, released: &Stribeck<f64>, pressed: &Stribeck<f64>) -> PreloadAdvice {
    let span = pressed.breakaway_torque - released.breakaway_torque;
    let exact = if span > 0.0 { (desired - released.breakaway_torque) / span } else { 0.0 };
    let preload = exact.clamp(0.0, 1.0);
    PreloadAdvice { preload, wanted: exact, breakaway_torque: released.breakaway_torque + preload * span }
}

/// A breakaway torque measured at a preload.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// Preload of the linings, 0 … 1.
    pub preload: f64,
    /// The breakaway torque [N m].
    pub breakaway_torque: f64,
}

/// As [`advise_preload`], from measurements at any two preloads; `None` if they do not determine a line.
pub fn advise_preload_from(desired: f64, measured: [Pressed; 2]) -> Option<PreloadAdvice> {
    let [a, b] = measured;
    let slope = (b.breakaway_torque - a.breakaway_torque) / (b.preload - a.preload);
    let at = |preload: f64| Stribeck {
        breakaway_torque: a.breakaway_torque + slope * (preload - a.preload),
        ..Stribeck::default()
    };
    slope.is_finite().then(|| advise_preload(desired, &at(0.0), &at(1.0)))
}

/// Runs a triangular speed sweep through standstill, both ways, with the rendering law on; returns every tick.
///
/// # Errors
/// [`Error::Cancelled`], [`Error::BenchFault`].
pub fn sweep_through_standstill(
    bench: &mut dyn Bench,
    amplitude: f64,
    acceleration: f64,
    watch: &Watch,
) -> Result<Vec<Frame>, Error> {
    let dt = bench.settings().tick_time();
    let start = bench.step(Command::default())?.angle;
    hold_speed(bench)?;
    let mut traveller = SpeedRamp::new(start, acceleration, dt);
    let mut frames = Vec::new();
    let see = |frame: &Frame, frames: &mut Vec<Frame>| {
        if frame.command.mark == 1 {
            frames.push(*frame);
        }
    };
    for target in [amplitude, -amplitude, amplitude, 0.0] {
        watch.stage("sweep through standstill", frames.len() as f64 * dt * acceleration / (6.0 * amplitude))?;
        while traveller.setpoint.velocity != target {
            let setpoint = traveller.toward(target);
            let command = Command { setpoint, control: true, render: true, mark: 1, ..Command::default() };
            bench.hand_over(command)?.iter().for_each(|frame| see(frame, &mut frames));
        }
    }
    bench.drain(&mut |frame| see(frame, &mut frames))?;
    Ok(frames)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> DifferenceTorque<f64> {
        let desired =
            Stribeck { kinetic_torque: 0.12, stribeck_velocity: 1.5, viscous_friction: 1.2e-3, ..Stribeck::default() };
        DifferenceTorque { desired, own: Stribeck::default(), fade_velocity: 0.3, torque_limit: 1.0 }
    }

    #[test]
    fn without_noise_the_whole_difference_is_missing_inside_the_fade_out_and_nothing_outside() {
        let law = law();
        let missing = law.desired.magnitude(0.2) - law.own.magnitude(0.2);
        assert_eq!(expected_deviation(&law, 0.2, 0.0), missing);
        assert_eq!(expected_deviation(&law, -0.2, 0.0), -missing);
        assert_eq!(expected_deviation(&law, 1.0, 0.0), 0.0);
        assert!((expected_deviation(&law, 1.0, 1e-3)).abs() < 1e-6);
    }

    #[test]
    fn with_noise_a_part_of_the_difference_is_rendered() {
        let law = law();
        let missing = (law.desired.magnitude(0.2) - law.own.magnitude(0.2)).abs();
        // The estimate is beyond the upper limit with Φ(−1) = 16 % at one σ: about that share is rendered.
        let expected = expected_deviation(&law, 0.2, 0.1).abs();
        assert!(expected < 0.87 * missing && expected > 0.7 * missing, "{expected} of {missing}");
        let rms = expected_inside_fade(&law, [(0.2, 0.1), (5.0, 0.1)].into_iter());
        assert!((rms - expected).abs() < 1e-15);
    }

    #[test]
    fn the_preload_is_the_missing_share_of_the_wheel() {
        let released = Stribeck { breakaway_torque: 0.06, ..Stribeck::default() };
        let pressed = Stribeck { breakaway_torque: 0.30, ..Stribeck::default() };
        let advice = advise_preload(0.18, &released, &pressed);
        assert!((advice.preload - 0.5).abs() < 1e-12 && (advice.breakaway_torque - 0.18).abs() < 1e-12);
        let beyond = advise_preload(0.36, &released, &pressed);
        assert!((beyond.wanted - 1.25).abs() < 1e-12);
        assert_eq!((beyond.preload, beyond.breakaway_torque), (1.0, 0.3));
        assert_eq!(advise_preload(0.3, &pressed, &pressed).preload, 0.0);
        // The same line through other points; one point alone does not determine it.
        let at = |preload, breakaway_torque| Pressed { preload, breakaway_torque };
        let same = advise_preload_from(0.18, [at(0.25, 0.12), at(0.75, 0.24)]).unwrap();
        assert!((same.preload - 0.5).abs() < 1e-12 && (same.breakaway_torque - 0.18).abs() < 1e-12);
        assert_eq!(advise_preload_from(0.18, [at(1.0, 0.3), at(1.0, 0.31)]), None);
    }
}
