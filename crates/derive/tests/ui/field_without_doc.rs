use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    #[field(unit = "rad/s")]
    speed: T,
}

fn main() {}
