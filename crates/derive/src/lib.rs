//! `#[derive(Fields)]`: name, symbol, unit, range, default and help of each number, stated once.
//!
//! ```text
//! #[derive(Clone, Copy, Debug, PartialEq, Fields)]
//! #[fields(law = LuGre::law)]                           // relations between fields, over any kind of number
//! pub struct LuGre<T> {
//!     /// Meaning of the number: the help text.
//!     #[field(symbol = "σ₀", unit = "N m/rad", range = 1e-3..=1e7, default = 300.0)]
//!     pub bristle_stiffness: T,
//!     /// A struct of numbers: a group.
//!     pub sliding: Stribeck<T>,
//! }
//! ```
//!
//! A law is a function that gives relations between fields. Anything else is checked, of a whole file, by a
//! function over `f64` that `#[fields(check = …)]` names. Configuration outside the signal path, such as how
//! many steps a tick has, is `#[field(fixed)]`: it is not in parameter files.
//!
//! `whole` and `flag` restrict a number to whole values or 0 and 1. Of an enum, each variant holds nothing or one
//! struct; the key that names it in files is `#[fields(tag = "model")]`.
#![forbid(unsafe_code)]

mod attribute;
mod expand;
mod unit;

use proc_macro::TokenStream;

/// Writes the tables and walks of `stickslip_core::fields::Fields`, and `Default` from them.
#[proc_macro_derive(Fields, attributes(field, fields))]
pub fn derive_fields(input: TokenStream) -> TokenStream {
    let input = syn::parse_macro_input!(input as syn::DeriveInput);
    expand::expand(&input).unwrap_or_else(|error| error.to_compile_error()).into()
}
