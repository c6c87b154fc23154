use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Speed.
    #[field(unit = "rpm")]
    speed: T,
}

fn main() {}
