//! Set-points shaped to avoid residual vibration.

use super::{Generator, Setpoint};

/// Most impulses of a shaper.
const IMPULSES: usize = 3;

/// A sequence of impulses with which a set-point is convolved; their weights sum up to 1. After half a period an
/// impulse cancels the vibration of the one before.
///
/// N. C. Singer, W. P. Seering, J. Dyn. Syst. Meas. Control 112 (1990) 76.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaper {
    weights: [f64; IMPULSES],
    /// Delay of each impulse in cycles.
    delays: [u64; IMPULSES],
}

impl Shaper {
    /// No shaper: the set-point is unchanged.
    pub const NOTHING: Shaper = Shaper { weights: [1.0, 0.0, 0.0], delays: [0; IMPULSES] };

    /// Two impulses half a period apart (ZV): nothing vibrates where frequency [rad/s] and damping ratio are right.
    pub fn zero_vibration(frequency: f64, damping: f64, rate: f64) -> Self {
        let (left, half) = half_period(frequency, damping, rate);
        Shaper { weights: [1.0 / (1.0 + left), left / (1.0 + left), 0.0], delays: [0, half, 0] }
    }

    /// Three impulses half a period apart (ZVD): little vibrates where they are wrong by a few percent.
    pub fn robust(frequency: f64, damping: f64, rate: f64) -> Self {
        let (left, half) = half_period(frequency, damping, rate);
        let all = (1.0 + left) * (1.0 + left);
        Shaper { weights: [1.0 / all, 2.0 * left / all, left * left / all], delays: [0, half, 2 * half] }
    }

    /// Delay of the set-point in cycles.
    pub fn delay(&self) -> u64 {
        self.delays.into_iter().fold(0, u64::max)
    }
}

/// Remaining share of an amplitude after half a period, and half a period in cycles.
fn half_period(frequency: f64, damping: f64, rate: f64) -> (f64, u64) {
    let root = libm::sqrt(1.0 - damping * damping);
    let half = core::f64::consts::PI / (frequency * root);
    (libm::exp(-damping * core::f64::consts::PI / root), libm::round(half * rate) as u64)
}

/// A generator behind a shaper.
#[derive(Clone, Copy, Debug)]
pub struct Shaped<'a> {
    parts: [Generator<'a>; IMPULSES],
    shaper: Shaper,
    cycle: u64,
}

impl<'a> Shaped<'a> {
    /// The set-points of a generator, shaped.
    pub fn new(generator: Generator<'a>, shaper: Shaper) -> Self {
        Shaped { parts: [generator; IMPULSES], shaper, cycle: 0 }
    }

    /// The cycle of the next set-point.
    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// The set-point of this cycle.
    #[expect(clippy::should_implement_trait, reason = "it never ends: an iterator's option would be unwrapped always")]
    pub fn next(&mut self) -> Setpoint<f64> {
        let mut sum = Setpoint::default();
        for ((part, &weight), &delay) in self.parts.iter_mut().zip(&self.shaper.weights).zip(&self.shaper.delays) {
            let setpoint = match self.cycle.checked_sub(delay) {
                // Parts without weight are not computed.
                Some(_) if weight > 0.0 => part.next(),
                Some(_) => continue,
                None => super::resting(part.origin()),
            };
            sum.position += weight * setpoint.position;
            sum.velocity += weight * setpoint.velocity;
            sum.acceleration += weight * setpoint.acceleration;
        }
        self.cycle += 1;
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::{MotionLimits, PointToPoint, Reference, Steps};
    use super::*;

    const RATE: f64 = 4000.0;

    /// Amplitude [rad] with which a mode of this frequency [rad/s] and damping ratio vibrates after a move.
    fn left(shaper: Shaper, frequency: f64, damping: f64) -> f64 {
        let limits = MotionLimits { velocity: 40.0, acceleration: 2000.0, jerk: 1e6 };
        let moves = PointToPoint { distance: 1.0, limits, dwell_time: 10.0, moves: 1.0 };
        let mut shaped = Shaped::new(Generator::new(Reference::PointToPoint(moves), RATE).with_origin(2.0), shaper);
        // An eighth of a cycle at a time: q̈ = −2ζω·q̇ − ω²·q − r̈.
        let (mut q, mut rate, mut peak) = (0.0, 0.0, 0.0f64);
        let dt = 0.125 / RATE;
        for cycle in 0..4000 {
            let setpoint = shaped.next();
            for _ in 0..8 {
                rate += dt * (-2.0 * damping * frequency * rate - frequency * frequency * q - setpoint.acceleration);
                q += dt * rate;
            }
            if cycle > 1500 {
                peak = peak.max(q.abs());
            }
            assert!(cycle < 3000 || (setpoint.position - 3.0).abs() < 1e-9, "it ends at {}", setpoint.position);
        }
        peak
    }

    #[test]
    fn a_vibration_ends_with_the_set_point() {
        let frequency = 63.0;
        let damping = 2e-3;
        let alone = left(Shaper::NOTHING, frequency, damping);
        let [two, three] = [Shaper::zero_vibration, Shaper::robust].map(|shaper| shaper(frequency, damping, RATE));
        assert!(alone > 0.01, "{alone}");
        assert!(left(two, frequency, damping) < 0.02 * alone && left(three, frequency, damping) < 0.02 * alone);
        // A tenth off: two impulses leave sin(π/20) of it, three the square of that.
        for off in [0.9, 1.1] {
            let alone = left(Shaper::NOTHING, off * frequency, damping);
            let [two, three] = [two, three].map(|shaper| left(shaper, off * frequency, damping) / alone);
            assert!((two - 0.156).abs() < 0.03 && three < 0.04, "{two} and {three} of it at {off}");
        }
    }

    #[test]
    fn without_a_shaper_the_set_point_is_that_of_the_generator_to_the_bit() {
        let mut plain = Generator::new(Reference::Steps(Steps::default()), RATE).with_origin(0.3);
        let mut shaped = Shaped::new(plain, Shaper::NOTHING);
        for _ in 0..8000 {
            assert_eq!(plain.next(), shaped.next());
        }
        assert_eq!(Shaper::robust(63.0, 0.0, RATE).delay(), 398);
    }
}
