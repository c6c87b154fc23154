use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Speed.
    #[field(unit = "rad/s")]
    speed: T,
}

#[derive(Clone, Copy, Fields)]
struct Drive<T> {
    /// The shaft.
    #[field(unit = "rad/s")]
    shaft: Shaft<T>,
}

fn main() {}
