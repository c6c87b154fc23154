//! Errors of the derive and their messages, as its users read them.
//!
//! `TRYBUILD=overwrite cargo test -p stickslip-derive --test ui` rewrites the `.stderr` files; review the difference.

#[test]
fn mistakes_are_refused_in_plain_words() {
    trybuild::TestCases::new().compile_fail("tests/ui/*.rs");
}
