use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft<T> {
    /// Angle.
    #[field(unit = "rad", range = 0.0..=core::f64::consts::PI)]
    angle: T,
}

fn main() {}
