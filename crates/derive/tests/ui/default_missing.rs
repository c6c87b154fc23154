use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Inertia.
    #[field(unit = "kg m^2", range = 1e-7..=1.0)]
    inertia: T,
}

fn main() {}
