use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T, U> {
    /// Speed.
    #[field(unit = "rad/s")]
    speed: T,
    /// Torque.
    #[field(unit = "N m")]
    torque: U,
}

fn main() {}
