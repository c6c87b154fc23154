use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Speed.
    speed: T,
}

fn main() {}
