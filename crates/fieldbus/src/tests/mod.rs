//! Tests of a whole segment, without a network.

mod bus;
mod clocks;
mod controller;
mod drives;
mod fuzz;
mod objects;
