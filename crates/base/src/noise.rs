//! Noise that depends on seed, channel and cycle alone: any sample can be computed without the previous ones.

use stickslip_core::plant::Noise;

/// Standard normals by a counter-based generator: Philox 4x32-10 (Salmon et al., SC 2011) and Box–Muller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Normals {
    seed: u64,
}

impl Normals {
    /// All channels of a seed.
    pub fn new(seed: u64) -> Self {
        Normals { seed }
    }

    /// Two independent standard normals of a channel pair in a cycle.
    pub fn pair(&self, channel: u32, cycle: u64) -> [f64; 2] {
        let [a, b, c, d] = philox([cycle as u32, (cycle >> 32) as u32, channel, 0], self.seed);
        // 53 bits each; the first in (0, 1], so that its logarithm is finite.
        let unit =
            |high: u32, low: u32| (((u64::from(high) << 32 | u64::from(low)) >> 11) as f64) / 9_007_199_254_740_992.0;
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - unit(a, b)));
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * unit(c, d));
        [radius * cos, radius * sin]
    }

    /// The normals of the virtual machine in a tick.
    pub fn of_tick(&self, cycle: u64) -> Noise<f64> {
        let [acceleration, tacho] = self.pair(0, cycle);
        let [current, first] = self.pair(1, cycle);
        let [second, third] = self.pair(2, cycle);
        Noise { acceleration, tacho, current, converters: [first, second, third] }
    }
}

/// Channel of the ticks' instants; lower channels are those of the instruments.
pub const INSTANTS: u32 = 3;

/// The ticks of a virtual bench with jitter: instant k has the error ε_k, ε normal and independent, so that ticks are
/// longer or shorter by ε_(k+1) − ε_k and none is lost. Instants are at whole steps of the virtual machine, and never
/// pass the next instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ticks {
    steps: usize,
    /// Standard deviation of ε, in steps.
    spread: f64,
}

impl Ticks {
    /// Ticks of `steps` steps of `step` [s]; the standard deviation of their instants is `jitter` [s].
    pub fn new(steps: usize, step: f64, jitter: f64) -> Self {
        Ticks { steps, spread: jitter / step }
    }

    /// Whether all ticks have the same number of steps, whatever the noise.
    pub fn are_equal(&self) -> bool {
        self.spread == 0.0
    }

    /// Number of steps of the machine in a tick.
    pub fn steps(&self, normals: &Normals, cycle: u64) -> usize {
        if self.are_equal() {
            return self.steps;
        }
        let offset = |cycle| {
            let [normal, _] = normals.pair(INSTANTS, cycle);
            // A tick has at least one step, also between a late and an early instant.
            let most = ((self.steps - 1) / 2) as f64;
            libm::round(self.spread * normal).clamp(-most, most) as isize
        };
        self.steps.saturating_add_signed(offset(cycle + 1) - offset(cycle))
    }
}

/// Ten rounds of Philox 4x32.
fn philox(counter: [u32; 4], seed: u64) -> [u32; 4] {
    let [mut a, mut b, mut c, mut d] = counter;
    let (mut key0, mut key1) = (seed as u32, (seed >> 32) as u32);
    for _ in 0..10 {
        let p0 = 0xD251_1F53_u64 * u64::from(a);
        let p1 = 0xCD9E_8D57_u64 * u64::from(c);
        (a, b, c, d) = ((p1 >> 32) as u32 ^ b ^ key0, p1 as u32, (p0 >> 32) as u32 ^ d ^ key1, p0 as u32);
        key0 = key0.wrapping_add(0x9E37_79B9);
        key1 = key1.wrapping_add(0xBB67_AE85);
    }
    [a, b, c, d]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn philox_gives_its_published_vectors() {
        // Known answers of Random123 1.14, philox4x32-10.
        assert_eq!(philox([0; 4], 0), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(philox([!0; 4], !0), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
    }

    #[test]
    fn normals_are_normal_and_independent() {
        let normals = Normals::new(7);
        let n = 100_000;
        let (mut sums, mut beyond) = ([0.0f64; 5], 0);
        let mut last = 0.0;
        for cycle in 0..n {
            let [x, y] = normals.pair(0, cycle);
            for (sum, value) in sums.iter_mut().zip([x, x * x, x * x * x * x, x * y, x * last]) {
                *sum += value / n as f64;
            }
            beyond += usize::from(x.abs() > 3.0);
            last = x;
        }
        // Standard errors: 1, √2, √96, 1, 1 over √n = 316; four of them.
        for (sum, (expected, error)) in sums.iter().zip([(0.0, 1.0), (1.0, 1.41), (3.0, 9.8), (0.0, 1.0), (0.0, 1.0)]) {
            assert!((sum - expected).abs() < 4.0 * error / 316.0, "{sums:?}");
        }
        assert!((200..350).contains(&beyond), "expected beyond 3 σ: 0.27 %; found {beyond}");
        assert_eq!(normals.pair(3, 12), Normals::new(7).pair(3, 12));
        assert_ne!(normals.pair(3, 12), Normals::new(8).pair(3, 12));
    }
    #[test]
    fn instants_have_their_standard_deviation_and_no_tick_is_lost() {
        let (normals, n) = (Normals::new(7), 40_000);
        let ticks = Ticks::new(25, 10e-6, 10e-6);
        let lengths: Vec<usize> = (0..n).map(|cycle| ticks.steps(&normals, cycle)).collect();
        let (mut instant, mut square, mut of_length) = (0.0, 0.0, 0.0);
        for &steps in &lengths {
            instant += (steps as f64 - 25.0) * 10e-6;
            square += instant * instant / n as f64;
            of_length += (steps as f64 - 25.0).powi(2) / n as f64;
        }
        // Rounding to whole steps adds h²/12; the first instant has one ε that stays. The share 1/√n of the estimate is
        // far smaller.
        let begin = libm::round(normals.pair(INSTANTS, 0)[0]) * 10e-6;
        let jitter = libm::sqrt(square - begin * begin);
        assert!((jitter / 10.4e-6 - 1.0).abs() < 0.02, "{jitter}");
        // Neighbours are independent: a length has the variance of two instants.
        assert!((of_length / (2.0 * 1.083) - 1.0).abs() < 0.03, "{of_length}");
        let total: usize = lengths.iter().sum();
        assert!(total.abs_diff(25 * n as usize) <= 24, "{total}");
    }

    #[test]
    fn a_tick_has_a_step_for_any_jitter_and_without_jitter_all_are_equal() {
        let normals = Normals::new(7);
        let steps = |ticks: Ticks| (0..10_000).map(move |cycle| ticks.steps(&normals, cycle));
        let wild = Ticks::new(10, 25e-6, 1e-3);
        assert_eq!((steps(wild).min(), steps(wild).max()), (Some(2), Some(18)));
        assert!(steps(Ticks::new(10, 25e-6, 0.0)).all(|steps| steps == 10));
        assert!(steps(Ticks::new(1, 25e-6, 1e-5)).all(|steps| steps == 1));
    }
}
