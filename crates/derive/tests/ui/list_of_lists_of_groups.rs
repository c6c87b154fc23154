use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Speed.
    #[field(unit = "rad/s")]
    speed: T,
}

#[derive(Clone, Copy, Fields)]
struct Drive<T> {
    /// The shafts.
    shafts: [[Shaft<T>; 2]; 2],
}

fn main() {}
