//! Benches in vector lanes against the same benches one after the other.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use stickslip::design::software;
use stickslip::fast_bench::{FastBench, LANES, LaneNumber};
use stickslip::{Preset, parameters};
use stickslip_core::control::reference::{Reference, Sine};
use stickslip_core::tick::Order;

/// Simulated seconds per round.
const DURATION: f64 = 0.5;

/// Simulates a sine. Returns the final angle of the first bench [rad], so that the compiler removes nothing.
fn run<T: LaneNumber>(mut bench: FastBench<T>, rate: f64) -> f64 {
    let sine = Reference::Sine(Sine { amplitude: 2.0, frequency: 2.0, fade_time: 0.0 });
    let mut setpoints = stickslip_core::control::reference::Generator::new(sine, rate);
    let mut order = Order { control: T::of(1.0), ..Order::default() };
    for _ in 0..(DURATION * rate) as u64 {
        let setpoint = setpoints.next();
        order.reference.position = T::of(setpoint.position);
        order.reference.velocity = T::of(setpoint.velocity);
        order.reference.acceleration = T::of(setpoint.acceleration);
        bench.tick(order);
    }
    bench.true_state().plant.machine.angle.lane(0)
}

/// Simulated seconds per second on one core, in lanes and one after the other.
pub(crate) fn run_both(rounds: usize) -> Result<(f64, f64), Box<dyn Error>> {
    let mut preset: Preset<f64> = parameters::presets::find("prototype")?.read()?;
    let (mut wide, mut single) = (f64::INFINITY, f64::INFINITY);
    for round in 0..rounds as u64 {
        let mut benches = Vec::new();
        for _ in 0..LANES {
            preset.plant.drive.load_inertia *= 1.01;
            let settings = &preset.bench;
            let tick = software(&preset.model, settings)?;
            benches.push(FastBench::new(&preset.plant, tick, settings, settings.divider(), round)?);
        }
        let lanes = FastBench::in_lanes(&benches.iter().collect::<Vec<_>>())
            .ok_or("the number of benches is not the number of lanes")?;
        let start = Instant::now();
        let lane_angle = black_box(run(lanes, preset.bench.tick_rate));
        wide = wide.min(start.elapsed().as_secs_f64());
        let start = Instant::now();
        let mut angles = Vec::new();
        for bench in benches {
            angles.push(black_box(run(bench, preset.bench.tick_rate)));
        }
        single = single.min(start.elapsed().as_secs_f64());
        // The comparison is valid only with the same bits.
        assert_eq!(lane_angle.to_bits(), angles[0].to_bits());
    }
    let simulated = LANES as f64 * DURATION;
    Ok((simulated / wide, simulated / single))
}
