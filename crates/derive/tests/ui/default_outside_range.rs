use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Speed.
    #[field(unit = "rad/s", range = 0.0..=1.0, default = 2.0)]
    speed: T,
}

fn main() {}
