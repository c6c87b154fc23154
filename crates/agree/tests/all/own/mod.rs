//! A user's controller or friction in one file of Rust is available wherever the built-in ones are.

mod controller;
mod friction;
mod served;
