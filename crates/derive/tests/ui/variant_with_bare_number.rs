use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
enum Friction<T> {
    /// None.
    None,
    /// One level.
    Coulomb(T),
}

fn main() {}
