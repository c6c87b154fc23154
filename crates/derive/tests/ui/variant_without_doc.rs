use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
enum Friction<T> {
    /// None.
    None,
    Coulomb(Coulomb<T>),
}

#[derive(Clone, Copy, Fields)]
struct Coulomb<T> {
    /// Level.
    #[field(unit = "N m")]
    torque: T,
}

fn main() {}
