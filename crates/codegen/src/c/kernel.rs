//! What stands above the steps: the switches of the compiler, and the functions of one number.

use super::body::{self, function_name};
use crate::record::{Function, Precision, record_function};
use stickslip_core::scalar::kernel;

/// Comment, switches and includes; `code` is what follows.
pub(super) fn preamble(block: &str, name: &str, code: &str) -> String {
    let mut out = format!(
        "/* {block}, written by stickslip. Change the model, not this file.\n * Each operation rounds once, in this order: \
         on every machine the results have the bits of the model. */\n"
    );
    out += "#if defined(__clang__)\n#pragma STDC FP_CONTRACT OFF\n#elif defined(__GNUC__)\n\
            #pragma GCC optimize (\"fp-contract=off\")\n#endif\n\
            #if defined(__FAST_MATH__)\n#error \"compile without -ffast-math: it changes the results\"\n#endif\n\n";
    out += &format!("#include \"{name}.h\"\n\n#include <float.h>\n");
    for (header, words) in [
        ("math.h", &["fabs", "fabsf", "NAN", "INFINITY"][..]),
        ("stdbool.h", &["bool"]),
        ("stdint.h", &["uint64_t", "uint32_t"]),
        ("string.h", &["memcpy"]),
    ] {
        if words.iter().any(|word| body::mentions(code, word)) {
            out += &format!("#include <{header}>\n");
        }
    }
    out + "\n#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16\n\
           #error \"this target computes with more bits than the type has: on x86, compile with -msse2 -mfpmath=sse\"\n\
           #endif\n\n"
}

/// The functions that are called, and those that they call.
pub(super) fn functions<F: Precision>(called: &[Function]) -> String {
    let mut needed = Vec::new();
    let mut bodies = String::new();
    for function in [Function::Exp, Function::Sin, Function::Cos, Function::Round, Function::Floor] {
        if !called.contains(&function) {
            continue;
        }
        let (graph, result) = match function {
            Function::Exp => record_function::<F>(kernel::exp),
            Function::Sin => record_function::<F>(kernel::sin),
            Function::Cos => record_function::<F>(kernel::cos),
            Function::Round => record_function::<F>(kernel::round),
            _ => record_function::<F>(kernel::floor),
        };
        let body = body::function::<F>(&graph, result);
        needed.extend(body.functions);
        let real = F::C_NAME;
        bodies += &format!("static {real} {}(const {real} x) {{\n{}}}\n\n", function_name::<F>(function), body.lines);
    }
    if called.contains(&Function::PowerOfTwo) || needed.contains(&Function::PowerOfTwo) {
        return power_of_two::<F>() + &bodies;
    }
    bodies
}

/// 2^k: k + bias lands in the low bits of the mantissa; the shift moves it into the exponent. As in `scalar`.
fn power_of_two<F: Precision>() -> String {
    let (real, name) = (F::C_NAME, function_name::<F>(Function::PowerOfTwo));
    let (word, shifter, mantissa) = match real {
        "float" => ("uint32_t", 8_388_608.0 + 127.0, 23),
        _ => ("uint64_t", 4_503_599_627_370_496.0 + 1023.0, 52),
    };
    let shifter = super::text::literal::<F>(shifter);
    format!(
        "static {real} {name}(const {real} k) {{\n    const {real} shifted = k + {shifter};\n    {word} bits;\n    \
         {real} power;\n    memcpy(&bits, &shifted, sizeof bits);\n    bits <<= {mantissa};\n    \
         memcpy(&power, &bits, sizeof power);\n    return power;\n}}\n\n"
    )
}
