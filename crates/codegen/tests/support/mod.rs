//! Drives a block as every kind of number and as compiled C, and compares the bits.
#![allow(dead_code, missing_docs, unreachable_pub, reason = "each test uses a part")]

pub mod bench;
pub mod blocks;
pub mod case;
pub mod compiler;
pub mod number;
pub mod projects;
pub mod slope;

use stickslip_codegen::c;
use stickslip_codegen::record::{self, Precision, Recorded};
use stickslip_core::block::Block;
use stickslip_core::fields::Fields;
use stickslip_core::scalar::{Dual, Lanes, Scalar};

use case::Trajectory;
use compiler::{STRICT, compile_and_run};
use number::{Number, run};

/// Compiled without optimisation, which `long` and `clean` test.
pub const QUICK: [&str; 1] = ["-O1"];

/// Panics at the first result whose bits differ. All NaN are equal, for any sign and payload.
pub fn assert_same(what: &str, expected: &[Vec<f64>], got: &[Vec<f64>]) {
    assert_eq!(expected.len(), got.len(), "{what}");
    for (number, (expected, got)) in expected.iter().zip(got).enumerate() {
        assert_eq!(expected.len(), got.len(), "{what}, trajectory {number}");
        for (place, (a, b)) in expected.iter().zip(got).enumerate() {
            let same = a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
            assert!(same, "{what}: trajectory {number}, number {place}: {a:?} expected, {b:?} found");
        }
    }
}

/// Runs the block over another kind of number.
fn run_as<T: Number, B: Fields<f64>>(block: &B, trajectories: &[Trajectory]) -> Vec<Vec<f64>>
where
    B::With<T>: Block<T, Input: Default>,
{
    run(&block.map(&mut |v: f64| T::of(v)), trajectories)
}

/// Compares Rust in precision `F` with the C that is generated for it, raw and guarded.
fn agree_in_c<F: Precision + Number, B: Fields<f64>>(block: &B, trajectories: &[Trajectory], expected: &[Vec<f64>])
where
    B::With<F>: Block<F, Input: Default>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    let program = record::record::<B, F>(block);
    let code = c::print::<F>(&program, "block").expect("a good name");
    let flags = [&STRICT[..], &QUICK].concat();
    let guarded = number::run_guarded(&block.map(&mut |v: f64| F::of(v)), trajectories);
    assert_faults_are_reported(trajectories, &guarded, program.start.len());
    let ran = compile_and_run(&program, &code, "gcc", &flags, trajectories);
    assert_same(&format!("C, {}", F::C_NAME), expected, &ran.raw);
    assert_same(&format!("guarded C, {}", F::C_NAME), &guarded, &ran.guarded);
    assert_eq!(ran.fault, "", "parameters_init");
    let expected_parameters: Vec<f64> = number::numbers(block).into_iter().map(|v| F::of(v).into()).collect();
    assert_same("parameters_init", &[expected_parameters], &[ran.parameters]);
}

/// For any input: after a guarded step output and state are finite, and the status reports non-finite inputs.
fn assert_faults_are_reported(trajectories: &[Trajectory], guarded: &[Vec<f64>], states: usize) {
    for (trajectory, row) in trajectories.iter().zip(guarded) {
        assert!(row.iter().all(|number| number.is_finite()), "{:?}: {row:?}", trajectory.inputs);
        let status = row[row.len() - states - 1];
        assert!(!trajectory.fault || status != 0.0, "{:?} is not detected: {row:?}", trajectory.inputs.last());
    }
}

/// f64 = lanes = value of the dual = C double; f32 = C float.
pub fn bits_agree<B>(block: B, dt: f64)
where
    B: Block<f64, Input: Default>,
    B::With<f64>: Block<f64, Input: Default>,
    B::With<f32>: Block<f32, Input: Default>,
    B::With<Lanes<f64, 8>>: Block<Lanes<f64, 8>, Input: Default>,
    B::With<Dual<6>>: Block<Dual<6>, Input: Default>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    let trajectories = case::trajectories(&block, dt);
    let double = run(&block, &trajectories);
    assert!(double.iter().flatten().any(|v| v.is_finite() && *v != 0.0), "all results are 0 or not finite");
    assert_same("lanes", &double, &run_as::<Lanes<f64, 8>, B>(&block, &trajectories));
    assert_same("dual", &double, &run_as::<Dual<6>, B>(&block, &trajectories));
    agree_in_c::<f64, B>(&block, &trajectories, &double);

    let single = run_as::<f32, B>(&block, &trajectories);
    agree_in_c::<f32, B>(&block, &trajectories, &single);
}

/// Derivative of the dual = difference. Not for a block with a converter: its steps have the derivative 0, a difference
/// over several of them has not.
pub fn slopes_agree<B>(block: B, dt: f64)
where
    B: Block<f64, Input: Default>,
    B::With<Dual<6>>: Block<Dual<6>, Input: Default>,
{
    slope::check(&block, &block.map(&mut |v: f64| <Dual<6> as Scalar>::of(v)), &case::trajectories(&block, dt));
}
