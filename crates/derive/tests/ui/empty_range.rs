use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Speed.
    #[field(unit = "rad/s", range = 1.0..=-1.0)]
    speed: T,
}

fn main() {}
