//! Tests of the set-points: consistent derivatives, limits, targets, bands.

use core::f64::consts::TAU;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;

const RATE: f64 = 4000.0;

fn run(reference: Reference<f64>, seconds: f64) -> Vec<Setpoint<f64>> {
    let mut generator = Generator::new(reference, RATE);
    (0..(seconds * RATE) as usize).map(|_| generator.next()).collect()
}

fn peak(setpoints: &[Setpoint<f64>], of: impl Fn(&Setpoint<f64>) -> f64) -> f64 {
    setpoints.iter().fold(0.0, |peak, setpoint| peak.max(of(setpoint).abs()))
}

/// All references with a continuous velocity, and their largest acceleration.
fn continuous() -> Vec<Reference<f64>> {
    std::vec![
        Reference::Constant(Constant::default()),
        Reference::Ramp(Ramp::default()),
        Reference::Ramp(Ramp { velocity: -3.0, ..Ramp::default() }),
        Reference::SpeedSweep(SpeedSweep { sweeps: 2.0, acceleration: 40.0, ..SpeedSweep::default() }),
        Reference::SpeedSweep(SpeedSweep { hold_time: 0.3, acceleration: 40.0, ..SpeedSweep::default() }),
        Reference::Sine(Sine::default()),
        Reference::Chirp(Chirp::default()),
        Reference::Multisine(Multisine::default()),
        Reference::Prbs(Prbs::default()),
        Reference::PointToPoint(PointToPoint { moves: 5.0, ..PointToPoint::default() }),
        Reference::PointToPoint(PointToPoint { distance: -0.02, moves: 3.0, ..PointToPoint::default() }),
        Reference::RandomStrokes(RandomStrokes::default()),
    ]
}

#[test]
fn position_is_the_integral_of_velocity_and_velocity_that_of_acceleration() {
    for reference in continuous() {
        let setpoints = run(reference, 6.0);
        let bend = peak(&setpoints, |s| s.acceleration);
        for pair in setpoints.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let mean_velocity = 0.5 * (a.velocity + b.velocity);
            // The trapezoid rule over one cycle errs by T²/8 of a jump of the acceleration, at most its peak twice.
            let position_tolerance = 0.26 * bend / (RATE * RATE) + 1e-12;
            assert!(
                ((b.position - a.position) - mean_velocity / RATE).abs() <= position_tolerance,
                "{reference:?} {a:?}"
            );
            let mean_acceleration = 0.5 * (a.acceleration + b.acceleration);
            // … by half a cycle of it.
            let velocity_tolerance = 1.01 * bend / RATE + 1e-12;
            assert!(
                ((b.velocity - a.velocity) - mean_acceleration / RATE).abs() <= velocity_tolerance,
                "{reference:?} {a:?} {b:?}"
            );
        }
        // And over the whole run: what a sum over 24 000 cycles leaves.
        let travelled: f64 = setpoints.windows(2).map(|p| 0.5 * (p[0].velocity + p[1].velocity) / RATE).sum();
        let moved = setpoints[setpoints.len() - 1].position - setpoints[0].position;
        assert!((travelled - moved).abs() <= 1e-3 * peak(&setpoints, |s| s.position).max(1e-6), "{reference:?}");
        let gained: f64 = setpoints.windows(2).map(|p| 0.5 * (p[0].acceleration + p[1].acceleration) / RATE).sum();
        let faster = setpoints[setpoints.len() - 1].velocity - setpoints[0].velocity;
        let scale = peak(&setpoints, |s| s.velocity).max(1e-9);
        // A jump of the acceleration costs up to half a cycle of it, some forty of them in 6 s of the binary sequence
        // at random sign.
        assert!((gained - faster).abs() <= 0.15 * scale, "{reference:?}: {gained} {faster}");
    }
}

#[test]
fn every_reference_begins_at_rest_at_its_origin() {
    for reference in continuous() {
        let first = Generator::new(reference, RATE).with_origin(7.0).next();
        assert_eq!((first.position, first.velocity), (7.0, 0.0), "{reference:?}");
    }
}

#[test]
fn smooth_references_have_no_jump_in_acceleration() {
    for (reference, jerk) in [
        (Reference::PointToPoint(PointToPoint { moves: 5.0, ..PointToPoint::default() }), 30_000.0),
        (Reference::RandomStrokes(RandomStrokes::default()), 30_000.0),
        // The sine itself, 2·(2π·f)³; fading adds less than thrice that.
        (Reference::Sine(Sine::default()), 4.0 * 2.0 * (TAU * 0.5) * (TAU * 0.5) * (TAU * 0.5)),
        (Reference::Chirp(Chirp::default()), 2.0 * 0.05 * (TAU * 50.0) * (TAU * 50.0) * (TAU * 50.0)),
    ] {
        let setpoints = run(reference, 11.0);
        let steepest = setpoints.windows(2).map(|p| (p[1].acceleration - p[0].acceleration).abs() * RATE);
        let steepest = steepest.fold(0.0, f64::max);
        assert!(steepest <= jerk * (1.0 + 1e-9), "{reference:?}: {steepest}");
    }
}

proptest! {
    #[test]
    fn strokes_keep_their_limits_and_end_at_their_target(
        distance in prop_oneof![-500.0..500.0f64, -1.0..1.0f64, -1e-3..1e-3f64],
        velocity in 0.1..300.0f64,
        acceleration in 1.0..5000.0f64,
        jerk in 10.0..1e6f64,
    ) {
        let limits = MotionLimits { velocity, acceleration, jerk };
        let stroke = Stroke::plan(distance, &limits);
        let total = stroke.duration();
        prop_assert_eq!(stroke.at(-1.0), resting(0.0));
        prop_assert_eq!(stroke.at(total + 1e-9), resting(distance));
        // Rounding of the plan, relative to what it is a difference of.
        let slack = 1.0 + 1e-9;
        let mut previous = stroke.at(0.0);
        let steps = 700;
        let dt = total / f64::from(steps);
        for k in 1..=steps {
            let now = stroke.at(f64::from(k) * dt);
            prop_assert!(now.velocity.abs() <= velocity * slack);
            prop_assert!(now.acceleration.abs() <= acceleration * slack);
            prop_assert!(now.velocity * distance >= -1e-9 * velocity * distance.abs(), "it never turns back");
            prop_assert!((now.acceleration - previous.acceleration).abs() <= jerk * dt * (1.0 + 1e-6) + 1e-9 * acceleration);
            let mean = 0.5 * (now.velocity + previous.velocity);
            // Trapezoid rule: T³/12 of the jerk.
            let tolerance = jerk * dt * dt * dt / 12.0 * 1.01 + 1e-9 * distance.abs();
            prop_assert!((now.position - previous.position - mean * dt).abs() <= tolerance);
            previous = now;
        }
    }

    #[test]
    fn strokes_are_as_fast_as_their_limits_allow(distance in 1e-4..1e3f64) {
        let limits = MotionLimits::default();
        let stroke = Stroke::plan(distance, &limits);
        let total = stroke.duration();
        // One limit holds with equality: the speed half-way, or else the acceleration at a quarter, or the jerk
        // throughout: four times t with 2·j·t³ = distance.
        let cruises = (stroke.at(0.5 * total).velocity - limits.velocity).abs() < 1e-6;
        let pushes = (stroke.at(0.25 * total).acceleration - limits.acceleration).abs() < 1e-6;
        let jerks = (total - 4.0 * (0.5 * distance / limits.jerk).cbrt()).abs() < 1e-9;
        prop_assert!(cruises || pushes || jerks, "{:?}", stroke);
        // 2·α³/j² = 0.06 rad reach the acceleration, v²/α + v·α/j = 8.83 rad the speed.
        prop_assert!(jerks == (distance < 0.06) && cruises == (distance >= 50.0 * 50.0 / 300.0 + 0.5));
    }
}

#[test]
fn moves_go_forth_and_back_and_stay() {
    let moves = PointToPoint { moves: 3.0, dwell_time: 0.1, ..PointToPoint::default() };
    let reference = Reference::PointToPoint(moves);
    let stroke = Stroke::plan(10.0, &moves.limits).duration();
    assert!((reference.duration() - 3.0 * (stroke + 0.1)).abs() < 1e-12);
    let setpoints = run(reference, 5.0);
    let after = |number: f64| setpoints[(number * (stroke + 0.1) * RATE) as usize - 10];
    assert_eq!(after(1.0), resting(10.0));
    // The target is the sum of start and distance.
    assert!(after(2.0).position.abs() < 1e-12 && after(2.0).velocity == 0.0);
    assert_eq!(*setpoints.last().unwrap(), resting(10.0));
}

#[test]
fn random_strokes_stay_in_range_and_depend_on_the_seed() {
    let strokes = RandomStrokes::default();
    let a = run(Reference::RandomStrokes(strokes), 30.0);
    assert_eq!(a, run(Reference::RandomStrokes(strokes), 30.0));
    assert_ne!(a, run(Reference::RandomStrokes(RandomStrokes { seed: 2.0, ..strokes }), 30.0));
    let (low, high) = a.iter().fold((0.0f64, 0.0f64), |(l, h), s| (l.min(s.position), h.max(s.position)));
    assert!(low >= -20.0 && high <= 20.0, "{low} {high}");
    assert!(low < -15.0 && high > 15.0, "some forty targets reach the outer quarters: {low} {high}");
    assert!(peak(&a, |s| s.velocity) <= 50.0 && peak(&a, |s| s.acceleration) <= 300.0 * (1.0 + 1e-12));
}

#[test]
fn ramps_and_sweeps_keep_their_speeds_and_come_to_rest() {
    let ramp = Ramp { velocity: -10.0, acceleration: 100.0, hold_time: 1.0 };
    let setpoints = run(Reference::Ramp(ramp), 2.0);
    assert_eq!(setpoints[(0.6 * RATE) as usize].velocity, -10.0);
    assert!((ramp.duration() - 1.2).abs() < 1e-12);
    assert!((setpoints.last().unwrap().position + 11.0).abs() < 1e-12 && setpoints.last().unwrap().velocity == 0.0);
    for hold_time in [0.0, 0.5] {
        let sweep = SpeedSweep { peak_velocity: 20.0, acceleration: 100.0, hold_time, sweeps: 3.0 };
        let setpoints = run(Reference::SpeedSweep(sweep), sweep.duration() + 0.1);
        assert!((sweep.duration() - 6.0 * (0.4 + hold_time)).abs() < 1e-12);
        // Rounding of the time left.
        assert!((peak(&setpoints, |s| s.velocity) - 20.0).abs() < 1e-9);
        assert!(setpoints.iter().any(|s| s.velocity < -19.9), "both directions");
        assert_eq!(*setpoints.last().unwrap(), resting(0.0));
        assert!((peak(&setpoints, |s| s.position) - 20.0 * (0.2 + hold_time)).abs() < 1e-9);
    }
}

#[test]
fn steps_jump_to_their_height_and_back() {
    let setpoints = run(Reference::Steps(Steps { height: 0.1, hold_time: 0.25 }), 1.0);
    let at = |time: f64| setpoints[(time * RATE) as usize];
    assert_eq!([at(0.1), at(0.3), at(0.6), at(0.9)], [0.0, 0.1, 0.0, 0.1].map(resting));
}

/// Power of the component at this frequency [Hz], one-sided; the mean square of the signal if summed over all bins.
fn power(signal: &[f64], frequency: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (k, value) in signal.iter().enumerate() {
        let phase = TAU * (frequency * k as f64 / RATE).fract();
        re += value * phase.cos();
        im += value * phase.sin();
    }
    2.0 * (re * re + im * im) / (signal.len() * signal.len()) as f64
}

/// Part of the signal's power, its mean apart, between two frequencies [Hz].
fn part_in_band(signal: &[f64], low: f64, high: f64) -> f64 {
    let length = signal.len() as f64;
    let mean = signal.iter().sum::<f64>() / length;
    let signal: Vec<f64> = signal.iter().map(|value| value - mean).collect();
    let all = signal.iter().map(|value| value * value).sum::<f64>() / length;
    let bins = (low * length / RATE).ceil() as usize..=(high * length / RATE).floor() as usize;
    bins.map(|bin| power(&signal, bin as f64 * RATE / length)).sum::<f64>() / all
}

#[test]
fn a_chirp_fills_its_band_and_ends_at_rest() {
    let chirp = Chirp { start_frequency: 20.0, end_frequency: 80.0, duration: 4.0, fade_time: 0.5, amplitude: 0.1 };
    let setpoints = run(Reference::Chirp(chirp), 4.0);
    let positions: Vec<f64> = setpoints.iter().map(|s| s.position).collect();
    let inside = part_in_band(&positions, 20.0, 80.0);
    assert!(inside > 0.99, "{inside} of the power is in the band");
    let quarters = [20.0, 35.0, 50.0, 65.0].map(|low| part_in_band(&positions, low, low + 15.0));
    // The fades take from the first and the last.
    assert!(quarters.iter().all(|&part| part > 0.15), "{quarters:?}");
    let mut generator = Generator::new(Reference::Chirp(chirp), RATE);
    let last = (0..20_000).map(|_| generator.next()).last().unwrap();
    assert_eq!(last.velocity, 0.0);
    assert!(last.position.abs() < 1e-12);
    assert!(peak(&setpoints, |s| s.position) <= 0.1);
}

#[test]
fn a_multisine_has_its_components_its_power_and_a_low_crest() {
    for count in [8.0, 16.0, 32.0, 64.0] {
        for lowest_harmonic in [1.0, 5.0] {
            let highest_harmonic = lowest_harmonic + count - 1.0;
            let multisine =
                Multisine { rms: 0.02, fundamental: 2.0, lowest_harmonic, highest_harmonic, fade_time: 0.0 };
            let positions: Vec<f64> = run(Reference::Multisine(multisine), 0.5).iter().map(|s| s.position).collect();
            let rms = (positions.iter().map(|p| p * p).sum::<f64>() / positions.len() as f64).sqrt();
            assert!((rms / 0.02 - 1.0).abs() < 1e-9, "{rms}");
            let crest = positions.iter().fold(0.0f64, |peak, p| peak.max(p.abs())) / rms;
            // 1.70 to 1.98 over 8 to 64 components up to the 90th harmonic; equal phases have √(2·N), 4 to 11.
            assert!(crest < 2.0, "crest factor {crest} of {count} components from {lowest_harmonic}");
            let low = power(&positions, 2.0 * lowest_harmonic);
            let high = power(&positions, 2.0 * highest_harmonic);
            assert!((low * count / (0.02 * 0.02) - 1.0).abs() < 1e-9 && (high / low - 1.0).abs() < 1e-9);
            let inside = part_in_band(&positions, 2.0 * lowest_harmonic, 2.0 * highest_harmonic);
            assert!((inside - 1.0).abs() < 1e-9, "{inside}");
        }
    }
}

#[test]
fn a_binary_sequence_is_white_in_its_band_and_repeats() {
    let prbs = Prbs { amplitude: 5.0, chip_time: 0.01, order: 7.0, acceleration: 1e4 };
    let period = (127.0 * 0.01 * RATE) as usize;
    let setpoints = run(Reference::Prbs(prbs), 3.0 * 127.0 * 0.01);
    let (second, third) = (&setpoints[period..2 * period], &setpoints[2 * period..3 * period]);
    // Sums of chips.
    assert!(second.iter().zip(third).all(|(a, b)| (a.position - b.position).abs() < 1e-9 && a.velocity == b.velocity));
    let half = &setpoints[period + 40..period + 40 + 40 * 63];
    assert!(half.iter().zip(&setpoints[period..]).any(|(a, b)| a.velocity != b.velocity), "no shorter period");
    let speeds: Vec<f64> = second.iter().map(|s| s.velocity).collect();
    let inside = part_in_band(&speeds, 1.0 / 1.27, 100.0);
    // sin²(x)/x² of a chip has 90 % below the chip rate, slanted edges more.
    assert!(inside > 0.9, "{inside}");
    let lines: Vec<f64> = (1..40).map(|k| power(&speeds, f64::from(k) / 1.27)).collect();
    let (least, most) = lines.iter().fold((f64::MAX, 0.0f64), |(l, m), &p| (l.min(p), m.max(p)));
    // Up to 0.31 of the chip rate the envelope falls to sinc²(0.31) = 0.73.
    assert!(least / most > 0.7, "{least} to {most}");
    assert!(
        peak(&setpoints, |s| s.velocity) <= 5.0 * (1.0 + 1.0 / 127.0) && peak(&setpoints, |s| s.acceleration) <= 1e4
    );
}

#[test]
fn every_register_has_maximum_length() {
    for order in 3..=16u32 {
        // One cycle a chip: the sign of the speed is the sequence.
        let prbs = Prbs { amplitude: 1.0, chip_time: 1e-3, order: f64::from(order), acceleration: 1e6 };
        let length = (1usize << order) - 1;
        let mut generator = Generator::new(Reference::Prbs(prbs), 1000.0);
        let ends: Vec<f64> = (0..=2 * length).map(|_| generator.next().position).collect();
        let chips: Vec<bool> = ends.windows(2).map(|p| p[1] > p[0]).collect();
        assert_eq!(chips[..length].iter().filter(|&&chip| chip).count(), length / 2 + 1, "order {order}");
        assert_eq!(chips[..length], chips[length..]);
        // All windows of n chips differ exactly if none but the whole is a period.
        let windows: std::collections::BTreeSet<_> = (0..length).map(|k| &chips[k..k + order as usize]).collect();
        assert_eq!(windows.len(), length, "order {order}");
    }
}

#[test]
fn samples_are_joined_by_lines_and_the_last_one_stays() {
    let samples = [0.0, 1.0, 0.5];
    let mut generator = Generator::from_samples(&samples, 100.0, 1000.0);
    let setpoints: Vec<_> = (0..40).map(|_| generator.next()).collect();
    assert!((setpoints[5].position - 0.5).abs() < 1e-12 && (setpoints[5].velocity - 100.0).abs() < 1e-9);
    assert!((setpoints[15].position - 0.75).abs() < 1e-12 && (setpoints[15].velocity + 50.0).abs() < 1e-9);
    assert_eq!(setpoints[39], resting(0.5));
    assert_eq!(Generator::from_samples(&[], 100.0, 1000.0).next(), resting(0.0));
    let mut broken = Generator::from_samples(&[0.0, f64::NAN, 0.0], 100.0, 1000.0);
    assert!((0..30).map(|_| broken.next()).any(|s| s.position.is_nan()), "the supervision must get it");
}

#[test]
fn time_is_as_exact_after_a_week_as_at_the_start() {
    let sine = Sine { frequency: 7.3, fade_time: 0.0, ..Sine::default() };
    let mut generator = Generator::new(Reference::Sine(sine), 1000.0);
    // A week of whole periods: 7.3 Hz repeats every 10 s.
    let first = (0..1234).map(|_| generator.next()).last().unwrap();
    let week = 7.0 * 86_400.0;
    let later = sine.at(week + 1.233);
    // 4.4e6 turns at 2⁻⁵³ relative.
    assert!((later.position - first.position).abs() < 1e-7, "{first:?} {later:?}");
}

#[test]
fn numbers_that_contradict_each_other_are_refused() {
    use crate::fields::{Field, Fields, Laws, ParameterError, Relation};
    struct First(Option<ParameterError>);
    impl Laws<f64> for First {
        fn enter(&mut self, _: &'static Field) {}
        fn leave(&mut self) {}
        fn state(&mut self, law: Relation<f64>) {
            self.0 = self.0.take().or(law.check().err());
        }
    }
    let field = |reference: Reference<f64>| {
        let mut first = First(None);
        reference.laws(&mut first);
        first.0.map(|error| (error.field, error.relation))
    };
    let chirp = Chirp { duration: 1.0, fade_time: 0.6, ..Chirp::default() };
    assert_eq!(field(Reference::Chirp(chirp)), Some(("fade_time", "at most")));
    let reversed = Multisine { lowest_harmonic: 9.0, highest_harmonic: 8.0, ..Multisine::default() };
    assert_eq!(field(Reference::Multisine(reversed)), Some(("highest_harmonic", "at least")));
    let wide = Multisine { lowest_harmonic: 1.0, highest_harmonic: 65.0, ..Multisine::default() };
    assert_eq!(field(Reference::Multisine(wide)), Some(("highest_harmonic", "at most")));
    let slow = Prbs { amplitude: 5.0, chip_time: 0.01, acceleration: 900.0, ..Prbs::default() };
    assert_eq!(field(Reference::Prbs(slow)), Some(("amplitude", "at most")));
    for reference in continuous() {
        assert_eq!(field(reference), None, "{reference:?}");
    }
}
