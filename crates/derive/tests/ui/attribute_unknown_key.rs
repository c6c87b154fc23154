use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Speed.
    #[field(unit = "rad/s", minimum = 0.0)]
    speed: T,
}

fn main() {}
