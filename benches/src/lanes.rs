//! Benches in lanes beside the same one after the other.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use stickslip::design::software;
use stickslip::fast_bench::{FastBench, LANES, LaneNumber};
use stickslip::{Preset, parameters};
use stickslip_core::control::reference::{Reference, Sine};
use stickslip_core::tick::Order;

/// Seconds of the bench in a round.
const DURATION: f64 = 0.5;

/// Ticks under a sine; where the first has come to [rad], so that nothing can be left out.
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
    bench.truth().plant.machine.angle.lane(0)
}

/// Simulated seconds a second on one core, in lanes and one after the other.
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
        let abreast = FastBench::abreast(&benches).ok_or("as many benches as lanes")?;
        let begin = Instant::now();
        let together = black_box(run(abreast, preset.bench.tick_rate));
        wide = wide.min(begin.elapsed().as_secs_f64());
        let begin = Instant::now();
        let mut alone = Vec::new();
        for bench in benches {
            alone.push(black_box(run(bench, preset.bench.tick_rate)));
        }
        single = single.min(begin.elapsed().as_secs_f64());
        // The same bits, or it is no comparison.
        assert_eq!(together.to_bits(), alone[0].to_bits());
    }
    let simulated = LANES as f64 * DURATION;
    Ok((simulated / wide, simulated / single))
}
