use stickslip_core::Fields;

#[derive(Clone, Copy, Fields)]
union Shaft<T: Copy> {
    /// Speed.
    speed: T,
}

fn main() {}
