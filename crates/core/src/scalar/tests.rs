//! Properties of the number types.

use proptest::prelude::*;

use super::*;

fn ulps(a: f64, b: f64) -> f64 {
    if a == b { 0.0 } else { (a - b).abs() / (b.abs() * f64::EPSILON / 2.0).max(f64::MIN_POSITIVE) / 2.0 }
}

proptest! {
    #[test]
    fn exp_is_within_two_ulp(x in -708.0..709.7f64) {
        prop_assert!(ulps(Scalar::exp(x), f64::exp(x)) <= 2.0);
    }

    #[test]
    fn the_logarithm_is_within_two_ulp(e in -300.0..300.0f64, x in 0.5..2.0f64) {
        let size = f64::powf(10.0, e);
        for v in [size, x] {
            prop_assert!(ulps(Scalar::ln(v), f64::ln(v)) <= 2.0);
            prop_assert!((Scalar::ln(v as f32) - f32::ln(v as f32)).abs() <= 2.0 * f32::EPSILON * (v as f32).ln().abs() || e.abs() > 37.0);
        }
        prop_assert_eq!(size.exponent(), f64::floor(f64::log2(size)));
    }

    #[test]
    fn sine_and_cosine_are_close(x in -1e6..1e6f64) {
        // Near a zero the relative error of the reduction counts in absolute terms: 2 ulp of 1.
        prop_assert!((Scalar::sin(x) - f64::sin(x)).abs() <= 2.0 * f64::EPSILON);
        prop_assert!((Scalar::cos(x) - f64::cos(x)).abs() <= 2.0 * f64::EPSILON);
    }

    #[test]
    fn exp_of_single_precision_is_within_two_ulp(x in -86.9..88.7f32) {
        let exact = f64::exp(f64::from(x));
        let got = f64::from(Scalar::exp(x));
        prop_assert!((got - exact).abs() <= 2.0 * exact * f64::from(f32::EPSILON));
    }

    #[test]
    fn rounding_is_that_of_ieee(x in -1e17..1e17f64, y in -1e3..1e3f64) {
        for v in [x, y] {
            prop_assert_eq!(Scalar::round(v), v.round_ties_even());
            prop_assert_eq!(Scalar::floor(v), f64::floor(v));
        }
    }

    #[test]
    fn lanes_have_the_bits_of_their_scalars(x in prop::array::uniform8(-50.0..50.0f64)) {
        let lanes = Lanes(x);
        let f = |v: f64| Scalar::exp(v * 0.3) * Scalar::sin(v) / (Scalar::cos(v) + 2.0);
        let wide = (lanes * Scalar::of(0.3)).exp() * lanes.sin() / (lanes.cos() + Scalar::of(2.0));
        for i in 0..8 {
            prop_assert_eq!(wide.0[i].to_bits(), f(x[i]).to_bits());
        }
    }

    #[test]
    fn the_dual_has_value_and_slope(x in -5.0..5.0f64) {
        let f = |v: Dual<1>| (v * v).exp() / (v.sin() + Dual::of(2.0)) - v.cos();
        let g = |v: f64| Scalar::exp(v * v) / (Scalar::sin(v) + 2.0) - Scalar::cos(v);
        let dual = f(Dual::variable(x, 0));
        prop_assert_eq!(dual.value.to_bits(), g(x).to_bits());
        let h = 1e-6;
        let slope = (g(x + h) - g(x - h)) / (2.0 * h);
        // Central difference: error about 1e-10 of the scale.
        prop_assert!((dual.gradient[0] - slope).abs() <= 1e-6 * (1.0 + slope.abs() + dual.value.abs()));
    }
}

#[test]
fn special_values_of_exp() {
    assert_eq!(Scalar::exp(0.0), 1.0);
    assert_eq!(Scalar::exp(f64::NEG_INFINITY), 0.0);
    assert_eq!(Scalar::exp(f64::INFINITY), f64::INFINITY);
    assert_eq!(Scalar::exp(710.0), f64::INFINITY);
    assert_eq!(Scalar::exp(709.7), f64::exp(709.7));
    assert!(Scalar::exp(f64::NAN).is_nan());
    // Never a subnormal number: they are slow on some machines and flushed on others.
    assert!(Scalar::exp(-708.03) >= f64::MIN_POSITIVE);
    for below in [-708.05f64, -708.4, -745.0, -1e300] {
        assert_eq!(Scalar::exp(below).to_bits(), 0, "at {below}");
    }
    assert!(Scalar::exp(-86.98f32) >= f32::MIN_POSITIVE);
    assert_eq!(Scalar::exp(-87.0f32).to_bits(), 0);
    assert_eq!(Scalar::exp(f32::NEG_INFINITY), 0.0);
    assert_eq!(Scalar::exp(f32::INFINITY), f32::INFINITY);
    assert!(Scalar::exp(f32::NAN).is_nan());
}

#[test]
fn nan_falls_on_the_safe_side() {
    let nan = f64::NAN;
    assert_eq!(Scalar::sign(nan), 0.0);
    assert!(Scalar::clamp(nan, -1.0, 1.0).is_nan());
    assert!(!Scalar::lt(nan, 0.0) && !Scalar::ge(nan, 0.0));
    assert!(Scalar::round(nan).is_nan() && Scalar::floor(nan).is_nan() && Scalar::sin(nan).is_nan());
    assert!(Scalar::sin(f64::INFINITY).is_nan());
}
