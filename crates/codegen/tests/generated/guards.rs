//! Each check of the generated code and of its comparison fails on a fault.

use std::process::Command;

use super::support::blocks::{Lag, LagState, SlidingFriction};
use super::support::compiler::compile_and_run;
use super::support::{assert_same, case, number};
use stickslip_codegen::c::{self, CSource, NotAName};
use stickslip_codegen::record::{self, Recorded};
use stickslip_core::Fields;
use stickslip_core::block::Block;
use stickslip_core::fields::Fields as _;
use stickslip_core::scalar::{Dual, Scalar};

const DT: f64 = 1e-3;

/// Like [`Lag`], with half the output.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
struct Halved<T> {
    /// The lag.
    lag: Lag<T>,
}

impl<T: Scalar> Block<T> for Halved<T> {
    type State = LagState<T>;
    type Input = T;
    type Output = T;

    fn step(&self, state: &mut LagState<T>, input: T, dt: T) -> T {
        self.lag.step(state, input, dt) * T::of(0.5)
    }
}

#[test]
fn one_wrong_bit_is_detected_and_nan_equals_nan() {
    assert_same("equal", &[vec![1.0, f64::NAN]], &[vec![1.0, -f64::NAN]]);
    for wrong in [1.0 + f64::EPSILON, f64::NAN] {
        assert!(std::panic::catch_unwind(|| assert_same("one bit", &[vec![1.0]], &[vec![wrong]])).is_err());
    }
    assert!(std::panic::catch_unwind(|| assert_same("zeros", &[vec![0.0]], &[vec![-0.0]])).is_err());
}

#[test]
fn a_wrong_slope_is_detected() {
    let lag = Lag::<f64>::default();
    let trajectories = case::trajectories(&lag, DT);
    let right = lag.map(&mut |v: f64| <Dual<6> as Scalar>::of(v));
    super::support::slope::check(&lag, &right, &trajectories);
    let wrong = Halved { lag: right };
    assert!(std::panic::catch_unwind(|| super::support::slope::check(&lag, &wrong, &trajectories)).is_err());
}

/// Whether C code compiled with these flags has the bits of Rust.
fn has_the_bits(code: &CSource, flags: &[&str]) -> bool {
    let block = SlidingFriction::<f64>::default();
    let program = record::record::<_, f64>(&block);
    let trajectories = case::trajectories(&block, DT);
    let expected = number::run(&block, &trajectories);
    let got = compile_and_run(&program, code, "gcc", flags, &trajectories).raw;
    expected.iter().flatten().zip(got.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan())
}

#[test]
fn the_source_disables_contraction() {
    let block = SlidingFriction::<f64>::default();
    let code = c::generate::<_, f64>(&block, "block").expect("a good name");
    let greedy = ["-std=gnu99", "-O3", "-march=native", "-ffp-contract=fast"];
    assert!(has_the_bits(&code, &greedy), "the pragma of the source overrides the command line");
    if !std::arch::is_x86_feature_detected!("fma") {
        println!("NOT RUN: this processor lacks fma, contraction is not tested");
        return;
    }
    let pragma = "#pragma GCC optimize (\"fp-contract=off\")";
    let bare = CSource { source: code.source.replace(pragma, ""), ..code };
    assert!(!has_the_bits(&bare, &greedy), "without the pragma the compiler contracts, and the comparison detects it");
}

#[test]
fn fast_math_is_refused_with_a_reason() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let code = c::generate::<_, f64>(&Lag::<f64>::default(), "lag").expect("a good name");
    std::fs::write(folder.path().join("lag.h"), code.header).expect("a small file can be written");
    std::fs::write(folder.path().join("lag.c"), code.source).expect("a small file can be written");
    let parts =
        ["-ffast-math", "-ffinite-math-only", "-freciprocal-math", "-fno-signed-zeros", "-funsafe-math-optimizations"];
    for flag in parts {
        let gcc = Command::new("gcc").args([flag, "-c", "lag.c"]).current_dir(folder.path()).output();
        let gcc = gcc.expect("gcc starts: apt-get install gcc libc6-dev");
        assert!(!gcc.status.success(), "{flag} is accepted");
        assert!(String::from_utf8_lossy(&gcc.stderr).contains("compile without -ffast-math and its parts"), "{flag}");
    }
}

#[test]
fn a_name_that_is_not_valid_in_c_is_refused() {
    for name in ["", "2fast", "my-lag", "double", "a b", "größe"] {
        let refused = c::generate::<_, f64>(&Lag::<f64>::default(), name);
        assert_eq!(refused, Err(NotAName(name.into())));
    }
    assert!(NotAName("2fast".into()).to_string().contains("a letter first"));
}

#[test]
fn recorded_numbers_do_not_live_outside_a_recording() {
    let outside = std::panic::catch_unwind(|| Recorded::of(1.0));
    let panic = outside.expect_err("there is no recording");
    let plain = panic.downcast_ref::<&str>().map(|text| text.to_string());
    let message = plain.or(panic.downcast_ref::<String>().cloned()).expect("a panic has a message");
    assert!(message.contains("within `record`"), "{message}");
}

/// The text for a small block.
#[test]
fn the_c_of_a_lag_reads_like_the_lag() {
    let code = c::generate::<_, f32>(&Lag::<f64>::default(), "lag").expect("a good name");
    let expected = "\
static void lag_raw_step(const lag_parameters *p, lag_state *s, const lag_input *in, float dt,
    lag_output *out) {
    const float value = s->value;

    const float t1 = (dt / (p->double_ + dt)) * (in->value - value);
    const float value_out = stickslip_clampf(value + t1, -p->limit, p->limit);

    s->value = value_out;
    out->value = value_out;
}
";
    assert!(code.source.contains(expected), "{}", code.source);
    assert!(code.header.contains("    /* Largest value.\n     * [1], 0 to 1e9, default 20 */\n    float limit;\n"));
    assert!(code.header.contains("void lag_parameters_init(lag_parameters *p);"));
    assert!(code.source.contains("    s->value = 0.25f;\n"), "the state starts at its default");
}

/// Constant numbers leave no operation.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
struct Constants<T> {
    /// A factor.
    #[field(unit = "1", default = 2.0)]
    factor: T,
}

impl<T: Scalar> Block<T> for Constants<T> {
    type State = ();
    type Input = T;
    type Output = [T; 3];

    fn step(&self, _state: &mut (), input: T, _dt: T) -> [T; 3] {
        let none = T::of(f64::INFINITY) - T::of(f64::INFINITY);
        let known = (T::of(0.1) + T::of(0.2)).exp();
        let shared = input * self.factor;
        [known * T::of(1.0) * shared, shared - T::of(0.0), shared + none]
    }
}

#[test]
fn constants_are_folded_as_rust_computes_them_and_nan_is_not() {
    let source = |code: CSource| {
        let step = code.source.split("block_raw_step(").nth(1).unwrap_or_default();
        step.split("\n}\n").next().unwrap_or_default().to_string()
    };
    let double = source(c::generate::<_, f64>(&Constants::<f64>::default(), "block").expect("a good name"));
    assert!(double.contains(&format!("{:?}", Scalar::exp(0.1 + 0.2))), "{double}");
    let single = source(c::generate::<_, f32>(&Constants::<f64>::default(), "block").expect("a good name"));
    assert!(single.contains(&format!("{:?}f", Scalar::exp(0.1f32 + 0.2f32))), "{single}");
    assert!(double.contains("INFINITY - INFINITY"), "a NaN is left to the machine: {double}");
    assert_eq!(double.matches("p->factor").count(), 1, "a product that is needed three times is computed once");
}

#[test]
fn laws_between_parameters_are_recorded_with_their_path() {
    let program = record::record::<_, f64>(&super::support::bench::bench());
    let paths: Vec<&str> = program.laws.laws.iter().map(|law| law.path.as_str()).collect();
    let fading = "lugre.fading";
    assert!(paths.contains(&format!("machine.parts.plant.screw_friction.model.{fading}").as_str()), "{paths:?}");
    let known = |law: &record::Law| program.laws.graph.constant(law.bound).is_none();
    assert!(program.laws.laws.iter().all(known), "a bound follows from parameters, which stay variable");
}
