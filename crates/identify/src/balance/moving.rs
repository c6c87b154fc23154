//! Samples at which the axis moves, away from standstill and reversals.
//!
//! At rest friction takes any value below breakaway, and close to a reversal the bristles bend: no sliding law holds
//! there, and the low-pass spreads both over its own duration. Rows within it would move Coulomb into viscous friction
//! and hide a delay.

use super::Track;

/// Share of the fastest speed below which the axis counts as at rest.
const SLOW: f64 = 0.005;
/// Duration of the low-pass in periods of its cut-off.
const REACH: f64 = 3.0;
/// Smallest share of the moving samples that must remain.
const REMAINS: f64 = 0.3;

/// For each sample whether the balance of forces may use it. `raw` is the position before the low-pass of cut-off
/// `low_pass` [Hz].
pub(super) fn moving(track: &Track, raw: &[f64], low_pass: f64, period: f64) -> Vec<bool> {
    let samples = track.velocity.len();
    let still = standstill(track, raw, low_pass, period);
    let velocity = &track.velocity;
    let at_rest: Vec<bool> =
        (0..samples).map(|i| velocity[i].abs() < still || (i > 0 && velocity[i] * velocity[i - 1] <= 0.0)).collect();
    let without = |reach: usize| {
        let mut kept = vec![true; samples];
        let mut last: Option<usize> = None;
        for i in 0..samples {
            if at_rest[i] {
                let from = last.map_or(0, |last| last + 1).max(i.saturating_sub(reach));
                kept[from..=i].fill(false);
                last = Some(i);
            } else if last.is_some_and(|last| i - last <= reach) {
                kept[i] = false;
            }
        }
        kept
    };
    let count = |kept: &[bool]| kept.iter().filter(|kept| **kept).count();
    let most = count(&without(0));
    let longest = (REACH / (low_pass * period)).ceil() as usize;
    let enough = |kept: &Vec<bool>| count(kept) as f64 >= REMAINS * most as f64;
    let mut kept =
        [longest, longest / 2, longest / 4].map(without).into_iter().find(enough).unwrap_or_else(|| without(0));
    // The low-pass continues the recording beyond its ends, without its acceleration.
    let edge = longest.min(samples / 10);
    kept[..edge].fill(false);
    kept[samples - edge..].fill(false);
    kept
}

/// Speed that noise and grid of the position cannot reach by themselves.
fn standstill(track: &Track, raw: &[f64], low_pass: f64, period: f64) -> f64 {
    let removed = raw.iter().zip(&track.position).map(|(raw, smooth)| (raw - smooth).powi(2)).sum::<f64>();
    // White noise: the low-pass takes all above its cut-off.
    let passed = 2.0 * low_pass * period;
    let noise = (removed / raw.len() as f64 / (1.0 - passed).max(0.1)).sqrt();
    let speed_noise = noise * 2.0 * std::f64::consts::PI * low_pass * (passed / 3.0).sqrt();
    let mut speeds: Vec<f64> = track.velocity.iter().map(|v| v.abs()).collect();
    speeds.sort_by(f64::total_cmp);
    let fastest = speeds[(speeds.len() - 1) * 99 / 100];
    (SLOW * fastest).max(5.0 * speed_noise).min(0.2 * fastest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_at_rest_and_around_a_reversal_are_left_out() {
        // 1 s there, 1 s at rest, 1 s back.
        let velocity: Vec<f64> = (0..3000)
            .map(|i| {
                if i < 1000 {
                    0.1
                } else if i < 2000 {
                    0.0
                } else {
                    -0.1
                }
            })
            .collect();
        let position = vec![0.0; 3000];
        let track = Track { position: position.clone(), acceleration: position.clone(), velocity };
        let kept = moving(&track, &position, 100.0, 1e-3);
        // The low-pass of 100 Hz lasts 30 ms.
        let expected: Vec<bool> = (0..3000).map(|i| (30..970).contains(&i) || (2030..2970).contains(&i)).collect();
        assert_eq!(kept.iter().zip(&expected).filter(|(a, b)| a != b).count(), 1);
        assert!(kept[969] && !kept[971] && !kept[1500] && !kept[2028] && kept[2031]);
    }
}
