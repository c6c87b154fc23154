use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
#[fields(law = Friction::law)]
enum Friction<T> {
    /// One level.
    Coulomb(Coulomb<T>),
}

#[derive(Clone, Copy, Fields)]
struct Coulomb<T> {
    /// Level.
    #[field(unit = "N m")]
    torque: T,
}

fn main() {}
