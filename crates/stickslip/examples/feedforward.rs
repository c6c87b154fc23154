//! Tracking error of a sine with and without friction feedforward, on the virtual bench.

use std::f64::consts::TAU;

use stickslip::bench::{Bench, Command, VirtualBench};
use stickslip::experiment::home;
use stickslip::{Error, Preset, Watch, parameters};
use stickslip_core::control::reference::Setpoint;

/// Amplitude [rad] and frequency [Hz] of the sine.
const SINE: (f64, f64) = (2.0, 0.5);

fn main() -> Result<(), Error> {
    print!("{}", report()?);
    Ok(())
}

fn report() -> Result<String, Error> {
    let mut text = "feedforward   tracking error, rms\n".to_owned();
    for share in [0.0, 0.5, 0.8, 1.0] {
        text += &format!("{:9.0} %   {:.4} rad\n", 100.0 * share, tracking_error(share)?);
    }
    Ok(text)
}

/// RMS of reference minus measured angle [rad] over the last two of three periods, with a share of the modelled
/// friction as feedforward.
fn tracking_error(share: f64) -> Result<f64, Error> {
    let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    let mut bench = VirtualBench::new(&preset, 1)?;
    home(&mut bench, &Watch::silent())?;
    let start = bench.step(Command::default())?.angle;

    // The modelled friction: the true friction is not available to a controller.
    let friction = bench.model().own;
    let (amplitude, omega) = (SINE.0, TAU * SINE.1);
    let tick = bench.settings().tick_time();
    let period = (1.0 / (SINE.1 * tick)).round() as u64;
    let mut square = 0.0;
    for k in 0..3 * period {
        let phase = omega * k as f64 * tick;
        let setpoint = Setpoint {
            position: start + amplitude * (1.0 - phase.cos()),
            velocity: amplitude * omega * phase.sin(),
            acceleration: amplitude * omega * omega * phase.cos(),
        };
        let added_torque = share * friction.torque(setpoint.velocity);
        let frame = bench.step(Command { setpoint, control: true, added_torque, ..Command::default() })?;
        if k >= period {
            square += (setpoint.position - frame.angle).powi(2);
        }
    }
    Ok((square / (2 * period) as f64).sqrt())
}

#[test]
fn the_numbers_are_those_of_the_guide() {
    expect_test::expect_file!["feedforward.txt"].assert_eq(&report().expect("the preset is valid"));
}
