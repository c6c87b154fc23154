#![expect(clippy::unwrap_used, reason = "tests")]

mod bus;
mod clocks;
mod controller;
mod drives;
mod fuzz;
mod objects;
