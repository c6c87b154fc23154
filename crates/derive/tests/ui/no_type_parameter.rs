use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Shaft {
    /// Speed.
    #[field(unit = "rad/s")]
    speed: f64,
}

fn main() {}
