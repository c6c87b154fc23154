//! The part above the steps: compiler switches, and functions of one number.

use super::body::{self, function_name};
use super::idiom::Helper;
use super::text::literal;
use crate::distinct::insert;
use crate::record::{Function, Real, record_function};
use stickslip_core::scalar::kernel;

/// Comment, switches and includes; `code` is the rest of the file.
pub(super) fn preamble(block: &str, name: &str, code: &str) -> String {
    let mut out = format!(
        "/* {block}, written by stickslip. Change the model, not this file.\n * Each operation rounds once, in this order: \
         the results have the bits of the model on every machine. */\n"
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

/// The helper functions of a code.
#[derive(Clone, Default)]
pub(super) struct Needs {
    /// Of one number; in order, each once.
    pub(super) functions: Vec<Function>,
    /// Of several operations in one; in order, each once.
    pub(super) helpers: Vec<Helper>,
}

impl Needs {
    pub(super) fn extend(&mut self, others: &Needs) {
        others.functions.iter().for_each(|function| self.function(*function));
        others.helpers.iter().for_each(|helper| self.helper(*helper));
    }

    pub(super) fn function(&mut self, function: Function) {
        insert(&mut self.functions, function);
    }

    pub(super) fn helper(&mut self, helper: Helper) {
        insert(&mut self.helpers, helper);
    }
}

/// The called functions, and those that they call.
pub(super) fn functions(real: Real, called: &Needs) -> String {
    let mut needs = called.clone();
    let mut out = String::new();
    for function in &called.functions {
        let (graph, result) = match function {
            Function::Exp => record_function(real, kernel::exp),
            Function::Ln => record_function(real, kernel::ln),
            Function::Sin => record_function(real, kernel::sin),
            Function::Cos => record_function(real, kernel::cos),
            Function::Round => record_function(real, kernel::round),
            Function::Floor => record_function(real, kernel::floor),
            Function::Abs | Function::PowerOfTwo | Function::Exponent => continue,
        };
        let body = body::function(real, &graph, result);
        needs.extend(&body.needs);
        out += &format!("/* {} */\n", about(*function));
        out += &format!("static {real} {}({real} x) {{\n{}}}\n\n", function_name(real, *function), body.lines);
    }
    let helpers: String = needs.helpers.into_iter().map(|helper| helper.definition(real)).collect();
    let on_bits = needs.functions.into_iter().filter_map(|function| on_bits(real, function)).collect::<String>();
    helpers + &on_bits + &out
}

fn about(function: Function) -> &'static str {
    match function {
        Function::Abs => "Magnitude.",
        Function::Exp => "Exponential, within 2 ulp; not that of the library, which differs between machines.",
        Function::Ln => "Natural logarithm of a normal positive number, within 2 ulp.",
        Function::Sin => "Sine, within 2 ulp for |x| up to 1e6 rad (float: 1e4 rad).",
        Function::Cos => "Cosine, within 2 ulp for |x| up to 1e6 rad (float: 1e4 rad).",
        Function::Round => "Nearest whole number, ties to even.",
        Function::Floor => "Largest whole number not above.",
        Function::PowerOfTwo => "2^x for a whole x: the low bits of the mantissa become the exponent.",
        Function::Exponent => "The whole k with 2^k <= |x| < 2^(k+1): the exponent becomes low bits of a mantissa.",
    }
}

/// The two functions that access the bits of a number, as in `stickslip_core::scalar`.
fn on_bits(real: Real, function: Function) -> Option<String> {
    if !matches!(function, Function::PowerOfTwo | Function::Exponent) {
        return None;
    }
    let name = function_name(real, function);
    let (word, whole, bias, mantissa) = match real.c_name {
        "float" => ("uint32_t", 8_388_608.0, 127.0, 23),
        _ => ("uint64_t", 4_503_599_627_370_496.0, 1023.0, 52),
    };
    let (whole, shifter) = (literal(real, whole), literal(real, whole + bias));
    let statements = if function == Function::PowerOfTwo {
        [
            format!("union {{ {real} number; {word} bits; }} view;"),
            format!("view.number = x + {shifter};"),
            format!("view.bits <<= {mantissa}U;"),
            "return view.number;".into(),
        ]
        .to_vec()
    } else {
        [
            format!("union {{ {real} number; {word} bits; }} view;"),
            format!("{word} exponent;"),
            "view.number = x;".into(),
            format!("exponent = view.bits >> {mantissa}U;"),
            format!("view.number = {whole};"),
            "view.bits |= exponent;".into(),
            format!("return view.number - {shifter};"),
        ]
        .to_vec()
    };
    let about = about(function);
    Some(format!("/* {about} */\nstatic {real} {name}({real} x) {{\n    {}\n}}\n\n", statements.join("\n    ")))
}
