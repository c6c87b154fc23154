//! Two emulated drives with free rotors, and an analogue input, on a network interface:
//!
//! ```sh
//! ip link add ec0 type veth peer name ec1 && ip link set ec0 up && ip link set ec1 up
//! cargo run -p stickslip-fieldbus --example rotors -- ec0
//! ```
//!
//! A main device on `ec1` then finds three devices.

#[cfg(target_os = "linux")]
fn main() -> std::io::Result<()> {
    use stickslip_fieldbus::{DriveSheet, Rotors, Segment, Server};

    let interface = std::env::args().nth(1).unwrap_or_else(|| "ec0".into());
    let machine = Rotors { inertia: 1e-3, friction: 1e-3 };
    let segment = Segment::new(&[DriveSheet::default(), DriveSheet::default()], 1, Box::new(machine));
    let mut server = Server::bind(&interface, segment, std::time::Duration::ZERO)?;
    let mut last = String::new();
    server.serve(|segment| {
        let states = format!("{:?}", segment.states());
        if states != last {
            println!("{states}");
            last = states;
        }
        true
    })
}

#[cfg(not(target_os = "linux"))]
fn main() {
    println!("raw sockets need Linux");
}
