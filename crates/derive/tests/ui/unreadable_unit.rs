use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Torque.
    #[field(unit = "N  m")]
    torque: T,
}

fn main() {}
