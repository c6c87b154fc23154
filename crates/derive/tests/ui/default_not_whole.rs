use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
struct Encoder<T> {
    /// Lines a turn.
    #[field(unit = "lines", range = 1.0..=1e6, default = 2.5, whole)]
    lines: T,
}

fn main() {}
