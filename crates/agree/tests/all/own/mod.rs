//! What a user writes in one file of Rust, a controller or a friction, is found wherever ours are.

mod controller;
mod friction;
mod served;
