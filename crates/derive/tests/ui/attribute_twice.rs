use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Speed.
    #[field(unit = "rad/s")]
    #[field(default = 1.0)]
    speed: T,
}

fn main() {}
