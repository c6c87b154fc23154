use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Wheel<T> {
    /// On or off.
    #[field(unit = "1", flag, range = 0.0..=2.0)]
    on: T,
}

fn main() {}
