//! Points of a friction curve eight side by side, and the sums over them that a fit needs.
//!
//! With e = exp(−x), x = v/Ω_Strib and h = e·x the curve is M_K + (M_S − M_K)·e + b·v, and all its derivatives, the second
//! ones too, are products of e, h, x, v and 1: one pass over the points gives all that a Newton step takes. Eight sums
//! run beside each other and are added at the end, in one order: the bits do not depend on the vectors of a processor.

use multiversion::multiversion;
use stickslip_core::scalar::{Lanes, Mask as _, Scalar as _};

/// Numbers side by side: a vector of the widest registers.
pub(super) const WIDTH: usize = 8;
pub(super) type Wide = Lanes<f64, WIDTH>;

/// A point in the units of the fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) speed: f64,
    pub(super) torque: f64,
    pub(super) weight: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Eight {
    speed: Wide,
    torque: Wide,
    weight: Wide,
}

/// Points, with the sums that no Stribeck velocity changes.
#[derive(Clone, Debug)]
pub(super) struct Points {
    /// What is left of the last has no weight.
    eights: Vec<Eight>,
    pub(super) plain: Plain,
    /// The slowest and the fastest that was measured, also where these points are means of others [rad/s].
    pub(super) speeds: [f64; 2],
}

/// Weighted sums of 1, v, v², M, v·M and M².
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plain {
    pub(super) one: f64,
    pub(super) v: f64,
    pub(super) vv: f64,
    pub(super) torque: f64,
    pub(super) v_torque: f64,
    pub(super) torque_torque: f64,
}

/// Weighted sums at a curve, named by their factors; r is measured minus curve.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) r: f64,
    pub(super) re: f64,
    pub(super) rv: f64,
    pub(super) rh: f64,
    pub(super) rhx: f64,
    pub(super) rr: f64,
    pub(super) e: f64,
    pub(super) ee: f64,
    pub(super) h: f64,
    pub(super) he: f64,
    pub(super) hv: f64,
    pub(super) hh: f64,
}

/// Weighted sums of e, e², e·v and e·M at eight Stribeck velocities.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Falling {
    pub(super) e: Wide,
    pub(super) ee: Wide,
    pub(super) ev: Wide,
    pub(super) e_torque: Wide,
}

/// Weight, weight·speed and weight·torque of the points within a part of an octave, in two turns; the fourth number is
/// none.
type Bin = [[f64; 4]; 2];

/// Bits of a speed below its exponent and a 64th of an octave.
const SHIFT: u32 = 52 - 6;
/// Bins that the coarse means take together: eighths of an octave.
const COARSE: usize = 8;

impl Points {
    /// Columns of one length; without weights each has 1.
    pub(super) fn of(speeds: &[f64], torques: &[f64], weights: Option<&[f64]>) -> Self {
        let eights = eights(speeds, torques, weights);
        let (plain, speeds) = plain(&eights);
        Points { eights, plain, speeds }
    }

    pub(super) fn of_samples(samples: &[Sample]) -> Self {
        let column = |of: fn(&Sample) -> f64| samples.iter().map(of).collect::<Vec<f64>>();
        Points::of(&column(|s| s.speed), &column(|s| s.torque), Some(&column(|s| s.weight)))
    }

    /// At least as many as there are points.
    pub(super) fn len(&self) -> usize {
        self.eights.len() * WIDTH
    }

    /// Sums at M_S, M_K, Ω_Strib, b.
    pub(super) fn sums(&self, parameters: [f64; 4]) -> Sums {
        sums(&self.eights, parameters)
    }

    /// Sums at eight Stribeck velocities.
    pub(super) fn falling(&self, velocities: Wide) -> Falling {
        falling(&self.eights, velocities)
    }

    /// Means over bins of the speed, fine and coarse, each a point with the weight of all that it stands for. A fit of
    /// the fine ones is off that of the points by some 1e-5 of its parameters, of the coarse ones by 1e-3.
    pub(super) fn means(&self) -> [Points; 2] {
        let bins = bins(&self.eights, self.speeds);
        [1, COARSE].map(|together| {
            let eights = means(&bins, together);
            Points { plain: plain(&eights).0, eights, speeds: self.speeds }
        })
    }
}

// Not inlined: the compiler would otherwise build the loops before it around these eight numbers.
#[inline(never)]
fn total(wide: &Wide) -> f64 {
    let [a, b, c, d, e, f, g, h] = wide.0;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

#[inline(never)]
fn ends(slowest: &Wide, fastest: &Wide) -> [f64; 2] {
    [slowest.0.iter().copied().fold(f64::INFINITY, f64::min), fastest.0.iter().copied().fold(0.0, f64::max)]
}

fn bin(speed: f64) -> u64 {
    speed.to_bits() >> SHIFT
}

// All of these are chosen at run time by what the processor can do.

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn eights(speeds: &[f64], torques: &[f64], weights: Option<&[f64]>) -> Vec<Eight> {
    let mut eights = Vec::with_capacity(speeds.len().div_ceil(WIDTH));
    let (whole, rest) = speeds.as_chunks::<WIDTH>();
    let (whole_torques, rest_torques) = torques.as_chunks::<WIDTH>();
    let (whole_weights, rest_weights) = weights.unwrap_or_default().as_chunks::<WIDTH>();
    let eight = |speed: &[f64; WIDTH], torque: &[f64; WIDTH], weight: Wide| Eight {
        speed: Lanes(*speed),
        torque: Lanes(*torque),
        weight,
    };
    if weights.is_some() {
        let all = whole.iter().zip(whole_torques).zip(whole_weights);
        eights.extend(all.map(|((speed, torque), weight)| eight(speed, torque, Lanes(*weight))));
    } else {
        let all = whole.iter().zip(whole_torques);
        eights.extend(all.map(|(speed, torque)| eight(speed, torque, Wide::of(1.0))));
    }
    if let Some(first) = rest.first() {
        let mut last = Eight { speed: Wide::of(*first), ..Eight::default() };
        for (lane, (speed, torque)) in rest.iter().zip(rest_torques).enumerate() {
            let weight = rest_weights.get(lane).copied().unwrap_or(1.0);
            (last.speed.0[lane], last.torque.0[lane], last.weight.0[lane]) = (*speed, *torque, weight);
        }
        eights.push(last);
    }
    eights
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn plain(eights: &[Eight]) -> (Plain, [f64; 2]) {
    let zero = Wide::of(0.0);
    let (mut one, mut v, mut vv, mut torque, mut v_torque, mut torque_torque) = (zero, zero, zero, zero, zero, zero);
    let (mut slowest, mut fastest) = (Wide::of(f64::INFINITY), zero);
    for &Eight { speed, torque: t, weight } in eights {
        let (wv, wt) = (weight * speed, weight * t);
        one += weight;
        v += wv;
        vv += wv * speed;
        torque += wt;
        v_torque += wt * speed;
        torque_torque += wt * t;
        slowest = speed.lt(slowest).select(speed, slowest);
        fastest = speed.gt(fastest).select(speed, fastest);
    }
    let plain = Plain {
        one: total(&one),
        v: total(&v),
        vv: total(&vv),
        torque: total(&torque),
        v_torque: total(&v_torque),
        torque_torque: total(&torque_torque),
    };
    (plain, ends(&slowest, &fastest))
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn sums(eights: &[Eight], parameters: [f64; 4]) -> Sums {
    let [breakaway, kinetic, velocity, viscous] = parameters;
    let (drop, kinetic, viscous) = (Wide::of(breakaway - kinetic), Wide::of(kinetic), Wide::of(viscous));
    let inverse = Wide::of(1.0 / velocity);
    let zero = Wide::of(0.0);
    let (mut s_r, mut s_re, mut s_rv, mut s_rh, mut s_rhx, mut s_rr) = (zero, zero, zero, zero, zero, zero);
    let (mut s_e, mut s_ee, mut s_h, mut s_he, mut s_hv, mut s_hh) = (zero, zero, zero, zero, zero, zero);
    for &Eight { speed: v, torque, weight } in eights {
        let x = v * inverse;
        let e = (-x).exp();
        let h = e * x;
        let r = torque - (kinetic + drop * e + viscous * v);
        let (wr, we, wh) = (weight * r, weight * e, weight * h);
        let rh = wr * h;
        s_r += wr;
        s_re += wr * e;
        s_rv += wr * v;
        s_rh += rh;
        s_rhx += rh * x;
        s_rr += wr * r;
        s_e += we;
        s_ee += we * e;
        s_h += wh;
        s_he += wh * e;
        s_hv += wh * v;
        s_hh += wh * h;
    }
    Sums {
        r: total(&s_r),
        re: total(&s_re),
        rv: total(&s_rv),
        rh: total(&s_rh),
        rhx: total(&s_rhx),
        rr: total(&s_rr),
        e: total(&s_e),
        ee: total(&s_ee),
        h: total(&s_h),
        he: total(&s_he),
        hv: total(&s_hv),
        hh: total(&s_hh),
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn falling(eights: &[Eight], velocities: Wide) -> Falling {
    let inverse = Wide::of(-1.0) / velocities;
    let mut sums = Falling::default();
    for Eight { speed, torque, weight } in eights {
        for lane in 0..WIDTH {
            let (v, torque) = (Wide::of(speed.0[lane]), Wide::of(torque.0[lane]));
            let e = (v * inverse).exp();
            let we = Wide::of(weight.0[lane]) * e;
            sums.e += we;
            sums.ee += we * e;
            sums.ev += we * v;
            sums.e_torque += we * torque;
        }
    }
    sums
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn bins(eights: &[Eight], speeds: [f64; 2]) -> Vec<Bin> {
    let [first, last] = speeds.map(bin);
    let mut bins = vec![Bin::default(); (last - first) as usize + 1];
    for &Eight { speed, torque, weight } in eights {
        let (wv, wt) = (weight * speed, weight * torque);
        for lane in 0..WIDTH {
            // Points that follow each other often meet in one bin: by turns they do not wait for each other.
            let Some(turns) = bins.get_mut((bin(speed.0[lane]) - first) as usize) else { continue };
            let turn = &mut turns[lane % 2];
            let more = [weight.0[lane], wv.0[lane], wt.0[lane], 0.0];
            for (sum, more) in turn.iter_mut().zip(more) {
                *sum += more;
            }
        }
    }
    bins
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn means(bins: &[Bin], together: usize) -> Vec<Eight> {
    let one = Wide::of(1.0);
    let eight = |bins: &[Bin]| {
        let mut sums = [Wide::of(0.0); 3];
        for (lane, bins) in bins.chunks(together).enumerate() {
            for [even, odd] in bins {
                for k in 0..3 {
                    sums[k].0[lane] += even[k] + odd[k];
                }
            }
        }
        let [weight, speed, torque] = sums;
        let there = weight.gt(Wide::of(0.0));
        let divisor = there.select(weight, one);
        // Nobody's speed may be any.
        Eight { speed: there.select(speed / divisor, one), torque: torque / divisor, weight }
    };
    bins.chunks(WIDTH * together).map(eight).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::normal;
    use super::*;

    fn columns(count: usize) -> [Vec<f64>; 3] {
        let speed = |k: usize| 0.1 * libm::pow(500.0, (k * 37 % count) as f64 / count as f64);
        let noise = |k: usize, channel: u64| normal(channel, k as u64);
        let column = |of: &dyn Fn(usize) -> f64| (0..count).map(of).collect();
        [column(&speed), column(&|k| 0.3 + 0.05 * noise(k, 1)), column(&|k| 1.0 + 0.2 * noise(k, 2).abs())]
    }

    /// Two sums over a count of terms of either sign, in different orders.
    fn agree(ours: f64, terms: impl Iterator<Item = f64>) {
        let (sum, size) = terms.fold((0.0, 0.0), |(sum, size), term: f64| (sum + term, size + term.abs()));
        assert!((ours - sum).abs() <= 1e-13 * size, "{ours} {sum}");
    }

    #[test]
    fn sums_are_those_of_the_points_whatever_is_left_of_the_last_vector() {
        for count in [5, 8, 61] {
            let [speeds, torques, weights] = columns(count);
            let points = Points::of(&speeds, &torques, Some(&weights));
            let p = [0.32, 0.2, 2.5, 3e-3];
            let sums = points.sums(p);
            let each = |term: &dyn Fn(f64, f64, f64, f64) -> f64| {
                let term = |k: usize| {
                    let (v, e) = (speeds[k], libm::exp(-speeds[k] / p[2]));
                    weights[k] * term(v, e, e * v / p[2], torques[k] - (p[1] + (p[0] - p[1]) * e + p[3] * v))
                };
                (0..count).map(term).collect::<Vec<_>>().into_iter()
            };
            agree(sums.r, each(&|_, _, _, r| r));
            agree(sums.re, each(&|_, e, _, r| r * e));
            agree(sums.rv, each(&|v, _, _, r| r * v));
            agree(sums.rh, each(&|_, _, h, r| r * h));
            agree(sums.rhx, each(&|v, _, h, r| r * h * v / p[2]));
            agree(sums.rr, each(&|_, _, _, r| r * r));
            agree(sums.e, each(&|_, e, _, _| e));
            agree(sums.ee, each(&|_, e, _, _| e * e));
            agree(sums.h, each(&|_, _, h, _| h));
            agree(sums.he, each(&|_, e, h, _| h * e));
            agree(sums.hv, each(&|v, _, h, _| h * v));
            agree(sums.hh, each(&|_, _, h, _| h * h));
            agree(points.plain.v_torque, (0..count).map(|k| weights[k] * speeds[k] * torques[k]));
            let falling = points.falling(Wide::of(p[2]));
            assert_eq!(falling.e.0, [falling.e.0[0]; WIDTH]);
            agree(falling.e_torque.0[3], (0..count).map(|k| weights[k] * libm::exp(-speeds[k] / p[2]) * torques[k]));
            let slowest = speeds.iter().copied().fold(f64::INFINITY, f64::min);
            assert_eq!(points.speeds[0], slowest);
        }
    }

    #[test]
    fn means_keep_weight_speed_and_torque_of_all() {
        let [speeds, torques, weights] = columns(3001);
        let points = Points::of(&speeds, &torques, Some(&weights));
        let [fine, coarse] = points.means();
        assert!(coarse.len() < fine.len() && fine.len() < points.len());
        for means in [fine, coarse] {
            let (ours, all) = (means.plain, points.plain);
            for (ours, all) in [(ours.one, all.one), (ours.v, all.v), (ours.torque, all.torque)] {
                // Roundings of three thousand terms of one sign.
                assert!((ours / all - 1.0).abs() < 1e-13);
            }
            assert!(ours.vv < all.vv && ours.vv > 0.99 * all.vv, "what lies within a bin is left out");
        }
    }
}
