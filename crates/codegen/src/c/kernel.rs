//! What stands above the steps: the switches of the compiler, and the functions of one number.

use super::body::{self, function_name};
use super::text::literal;
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
            #if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) \\\n    \
            || defined(__NO_SIGNED_ZEROS__) || (defined(__FINITE_MATH_ONLY__) && (__FINITE_MATH_ONLY__ > 0))\n\
            #error \"compile without -ffast-math and its parts: they change the results\"\n#endif\n\n";
    out += &format!("#include \"{name}.h\"\n\n#include <float.h>\n");
    for (header, words) in [
        ("math.h", &["fabs", "fabsf", "isfinite", "isnan", "NAN", "INFINITY"][..]),
        ("stdbool.h", &["bool"]),
        ("stddef.h", &["NULL"]),
        ("stdint.h", &["uint64_t", "uint32_t"]),
    ] {
        if words.iter().any(|word| body::mentions(code, word)) {
            out += &format!("#include <{header}>\n");
        }
    }
    out + "\n#if defined(FLT_EVAL_METHOD) && (FLT_EVAL_METHOD != 0) && (FLT_EVAL_METHOD != 16)\n\
           #error \"this target computes with more bits than the type has: on x86, compile with -msse2 -mfpmath=sse\"\n\
           #endif\n\n"
}

/// The functions that are called, and those that they call.
pub(super) fn functions<F: Precision>(called: &[Function]) -> String {
    let real = F::C_NAME;
    let mut needed = called.to_vec();
    let mut out = String::new();
    for function in [Function::Exp, Function::Ln, Function::Sin, Function::Cos, Function::Round, Function::Floor] {
        if !called.contains(&function) {
            continue;
        }
        let (graph, result) = match function {
            Function::Exp => record_function::<F>(kernel::exp),
            Function::Ln => record_function::<F>(kernel::ln),
            Function::Sin => record_function::<F>(kernel::sin),
            Function::Cos => record_function::<F>(kernel::cos),
            Function::Round => record_function::<F>(kernel::round),
            _ => record_function::<F>(kernel::floor),
        };
        let body = body::function::<F>(&graph, result);
        needed.extend(body.functions);
        out += &format!("static {real} {}(const {real} x) {{\n{}}}\n\n", function_name::<F>(function), body.lines);
    }
    let bits = [Function::PowerOfTwo, Function::Exponent].into_iter().filter(|f| needed.contains(f));
    bits.map(on_bits::<F>).collect::<String>() + &out
}

/// The two functions that see a number as bits, as in `stickslip_core::scalar`.
fn on_bits<F: Precision>(function: Function) -> String {
    let (real, name) = (F::C_NAME, function_name::<F>(function));
    let (word, whole, bias, mantissa) = match real {
        "float" => ("uint32_t", 8_388_608.0, 127.0, 23),
        _ => ("uint64_t", 4_503_599_627_370_496.0, 1023.0, 52),
    };
    let (whole, shifter) = (literal::<F>(whole), literal::<F>(whole + bias));
    let view = |of: &str| format!("const union {{ {real} number; {word} bits; }} {of}");
    let statements = if function == Function::PowerOfTwo {
        // k + bias lands in the low bits of the mantissa; the shift moves it into the exponent.
        [
            format!("{} = {{ .number = x + {shifter} }};", view("shifted")),
            format!("{} = {{ .bits = shifted.bits << {mantissa}U }};", view("power")),
            "return power.number;".into(),
        ]
        .to_vec()
    } else {
        // The exponent in the low bits of a mantissa; subtracting its scale leaves the number.
        [
            format!("{} = {{ .number = x }};", view("given")),
            format!("{} = {{ .number = {whole} }};", view("scale")),
            format!("{} = {{ .bits = (given.bits >> {mantissa}U) | scale.bits }};", view("exponent")),
            format!("return exponent.number - {shifter};"),
        ]
        .to_vec()
    };
    format!("static {real} {name}(const {real} x) {{\n    {}\n}}\n\n", statements.join("\n    "))
}
