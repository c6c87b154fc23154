use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T>(T);

fn main() {}
