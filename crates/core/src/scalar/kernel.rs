//! The value kernels of the transcendental functions, in [`Scalar`] operations only.
//!
//! One source gives `f64`, `f32`, every lane and, recorded, the C functions: the operations are the same, so that the
//! results agree bit for bit.
//! Reductions after Cody and Waite; the polynomials of sine and cosine are those of fdlibm (Sun Microsystems, 1993).

use super::{Mask, Scalar};

/// e^x within 2 ulp. 0 where it would be below the normal range, +∞ above the range of the type; NaN stays NaN.
#[inline(always)]
pub fn exp<T: Scalar>(x: T) -> T {
    // Beyond these the result is 0 or ∞ anyway, and the exponent arithmetic stays in range.
    let x = x.clamp(T::by_precision(-708.4, -87.33), T::by_precision(710.0, 89.5));
    let k = nearest(x * T::of(core::f64::consts::LOG2_E));
    // ln 2 in two parts: k times the first is exact.
    let r = x - k * T::by_precision(6.931_471_803_691_238_16e-1, 0.693_359_375);
    let r = r - k * T::by_precision(1.908_214_929_270_587_70e-10, -2.121_944_400_546_905_8e-4);
    // 1 + r + r²/2 + …: the rest interpolates at Chebyshev points, |r| ≤ ln 2/2; remainder 4e-17. Pairs, and the small
    // terms apart from the large ones, keep the chain of latencies short.
    let r2 = r * r;
    let p0 = T::of(0.5) + r * T::of(1.666_666_666_666_666_6e-1);
    let p1 = T::of(4.166_666_666_665_136_4e-2) + r * T::of(8.333_333_333_332_157e-3);
    let p2 = T::of(1.388_888_890_587_236_7e-3) + r * T::of(1.984_126_985_433_155_3e-4);
    let p3 = T::of(2.480_153_640_702_703e-5) + r * T::of(2.755_728_008_111_812_7e-6);
    let p4 = T::of(2.761_379_668_517_062e-7) + r * T::of(2.509_554_685_120_205e-8);
    let r4 = r2 * r2;
    let small = r4 * r2 * ((p2 + r2 * p3) + r4 * p4);
    let large = T::of(1.0) + (r + r2 * (p0 + r2 * p1));
    let value = large + small;
    // Twice the value times half the power: 2¹⁰²⁴ overflows, and half of 2⁻¹⁰²² comes out as 0.
    (value + value) * (k - T::of(1.0)).power_of_two()
}

/// ln x of a normal positive number, within 2 ulp. The value for other numbers is unspecified, also at 0 and below.
#[inline(always)]
pub fn ln<T: Scalar>(x: T) -> T {
    // x = 2^k·m with m in √½ … √2, where the logarithm of m does not cancel against k·ln 2.
    let k = x.exponent();
    let m = x * (-k).power_of_two();
    let high = m.gt(T::of(core::f64::consts::SQRT_2));
    let m = high.select(T::of(0.5) * m, m);
    let k = high.select(k + T::of(1.0), k);
    // ln(1 + f) = f − f²/2 + s·(f²/2 + R(s²)) with s = f/(2 + f), fdlibm's minimax R.
    let f = m - T::of(1.0);
    let s = f / (T::of(2.0) + f);
    let z = s * s;
    let w = z * z;
    let even = w
        * (T::of(3.999_999_999_940_941_908e-1)
            + w * (T::of(2.222_219_843_214_978_396e-1) + w * T::of(1.531_383_769_920_937_332e-1)));
    let odd = z
        * (T::of(6.666_666_666_666_735_130e-1)
            + w * (T::of(2.857_142_874_366_239_149e-1)
                + w * (T::of(1.818_357_216_161_805_012e-1) + w * T::of(1.479_819_860_511_658_591e-1))));
    let half = T::of(0.5) * f * f;
    let low = k * T::by_precision(1.908_214_929_270_587_70e-10, -2.121_944_400_546_905_8e-4);
    k * T::by_precision(6.931_471_803_691_238_16e-1, 0.693_359_375) - ((half - (s * (half + (even + odd)) + low)) - f)
}

/// sin x; see [`Scalar::sin`].
#[inline(always)]
pub fn sin<T: Scalar>(x: T) -> T {
    let (quadrant, r) = reduce(x);
    turn(quadrant, r)
}

/// cos x; see [`Scalar::cos`].
#[inline(always)]
pub fn cos<T: Scalar>(x: T) -> T {
    let (quadrant, r) = reduce(x);
    turn(quadrant + T::of(1.0), r)
}

/// Nearest whole number, ties to even, for |x| far below 2^51 (`f32`: 2^22).
#[inline(always)]
fn nearest<T: Scalar>(x: T) -> T {
    // Adding 1.5·2^(p−1) leaves no bits for a fraction, whatever the sign.
    let shifter = T::by_precision(6_755_399_441_055_744.0, 12_582_912.0);
    (x + shifter) - shifter
}

/// Nearest whole number; see [`Scalar::round`].
#[inline(always)]
pub fn round<T: Scalar>(x: T) -> T {
    // Adding 2^(p−1) leaves no bits for a fraction; from there on every number is whole.
    let shifter = T::by_precision(4_503_599_627_370_496.0, 8_388_608.0);
    let size = x.abs();
    let whole = (size + shifter) - shifter;
    let signed = x.lt(T::of(0.0)).select(-whole, whole);
    size.lt(shifter).select(signed, x)
}

/// Largest whole number not above; see [`Scalar::floor`].
#[inline(always)]
pub fn floor<T: Scalar>(x: T) -> T {
    let nearest = round(x);
    nearest.gt(x).select(nearest - T::of(1.0), nearest)
}

/// x = n·π/2 + r with |r| ≤ π/4: n and r.
#[inline(always)]
fn reduce<T: Scalar>(x: T) -> (T, T) {
    let n = nearest(x * T::of(core::f64::consts::FRAC_2_PI));
    let r = x - n * T::by_precision(1.570_796_326_734_125_614_17, 1.570_312_5);
    let r = r - n * T::by_precision(6.077_100_506_303_965_976_60e-11, 4.837_512_969_970_703e-4);
    let r = r - n * T::by_precision(2.022_266_248_795_950_631_54e-21, 7.549_789_954_891_882e-8);
    (n, r)
}

/// sin(n·π/2 + r).
#[inline(always)]
fn turn<T: Scalar>(n: T, r: T) -> T {
    let quadrant = n - T::of(4.0) * floor(n * T::of(0.25));
    let odd = (quadrant - T::of(2.0) * floor(quadrant * T::of(0.5))).gt(T::of(0.5));
    let value = odd.select(cosine(r), sine(r));
    quadrant.gt(T::of(1.5)).select(-value, value)
}

/// sin r for |r| ≤ π/4, without reduction.
#[inline(always)]
pub fn sine<T: Scalar>(r: T) -> T {
    let z = r * r;
    let z2 = z * z;
    let p0 = T::of(-1.666_666_666_666_663_243_48e-1) + z * T::of(8.333_333_333_322_489_461_24e-3);
    let p1 = T::of(-1.984_126_982_985_794_931_34e-4) + z * T::of(2.755_731_370_707_006_767_89e-6);
    let p2 = T::of(-2.505_076_025_340_686_341_95e-8) + z * T::of(1.589_690_995_211_550_102_21e-10);
    r + r * z * (p0 + z2 * (p1 + z2 * p2))
}

/// cos r for |r| ≤ π/4, without reduction.
#[inline(always)]
pub fn cosine<T: Scalar>(r: T) -> T {
    let z = r * r;
    let high = T::of(2.480_158_728_947_672_941_78e-5)
        + z * (T::of(-2.755_731_435_139_066_330_35e-7)
            + z * (T::of(2.087_572_321_298_174_827_90e-9) + z * T::of(-1.135_964_755_778_819_482_65e-11)));
    let p = T::of(4.166_666_666_666_660_190_37e-2) + z * (T::of(-1.388_888_888_887_410_957_49e-3) + z * high);
    // 1 − z/2 is rounded; the rounding error is added back.
    let half = T::of(0.5) * z;
    let w = T::of(1.0) - half;
    w + ((T::of(1.0) - w - half) + z * z * p)
}
