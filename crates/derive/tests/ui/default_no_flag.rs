use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Wheel<T> {
    /// On or off.
    #[field(unit = "1", flag, default = 0.5)]
    on: T,
}

fn main() {}
