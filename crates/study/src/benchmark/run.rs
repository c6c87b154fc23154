//! One entrant in one manoeuvre, on one machine or on several side by side.

use stickslip_core::control::reference::{Generator, Setpoint};
use stickslip_core::tick::{Order, Tick};

use super::Manoeuvre;
use stickslip_base::preset::Preset;
use stickslip_base::{Error, Watch};
use stickslip_design::software;
use stickslip_simulate::fast_bench::{FastBench, LANES, LaneNumber};
use stickslip_simulate::manoeuvre::Course;
use stickslip_simulate::simulation::{DelayedTorque, Sample, sample};

/// Time at rest before the manoeuvre [s].
const REST: f64 = 0.3;
/// With fewer lanes, one run after the other is faster.
const WORTH_LANES: usize = 3;

/// Runs a manoeuvre; `None` where the supervision of a bench would stop it.
pub(crate) fn run(
    preset: &Preset<f64>,
    manoeuvre: Manoeuvre,
    seed: u64,
    chance: f64,
    watch: &Watch,
) -> Result<Option<Course>, Error> {
    let (bench, run) = Run::new(preset, manoeuvre, seed, chance)?;
    Ok(follow(bench, &mut [run], None, watch)?.pop().flatten())
}

/// Runs a manoeuvre with the torque of an external controller: from a sample to a torque [N m], or `None`, with which
/// the run fails.
pub(crate) fn run_with(
    preset: &Preset<f64>,
    manoeuvre: Manoeuvre,
    seed: u64,
    chance: f64,
    controller: &mut dyn FnMut(&Sample) -> Option<f64>,
    watch: &Watch,
) -> Result<Option<Course>, Error> {
    let (bench, run) = Run::new(preset, manoeuvre, seed, chance)?;
    let (tick, divider, dt) = (run.tick, preset.bench.divider(), preset.bench.tick_time());
    let mut brought = DelayedTorque::default();
    let mut torque = |bench: &FastBench, cycle: u64, reference: Setpoint<f64>| {
        let read = || controller(&sample(&tick, bench, cycle as f64 * dt, reference)).ok_or(());
        brought.torque(cycle, divider, read).ok()
    };
    Ok(follow(bench, &mut [run], Some(&mut torque), watch)?.pop().flatten())
}

/// Runs a manoeuvre on several machines, with the same numbers as `run`. A refused machine has an error of its own.
///
/// # Errors
/// [`Error::Cancelled`] alone.
pub fn run_in_lanes(
    presets: &[&Preset<f64>],
    manoeuvre: Manoeuvre,
    seed: u64,
    chance: f64,
    watch: &Watch,
) -> Result<Vec<Result<Option<Course>, Error>>, Error> {
    let mut results: Vec<Result<Option<Course>, Error>> = Vec::with_capacity(presets.len());
    let mut waiting = Vec::new();
    for (index, preset) in presets.iter().enumerate() {
        match Run::new(preset, manoeuvre, seed, chance) {
            Ok((bench, run)) => {
                waiting.push((index, bench, run));
                results.push(Ok(None));
            }
            Err(error) => results.push(Err(error)),
        }
    }
    while let Some((_, first, _)) = waiting.first() {
        let like: FastBench = first.clone();
        let (mut indices, mut benches, mut runs) = (Vec::new(), Vec::new(), Vec::new());
        let mut others = Vec::new();
        for (index, bench, run) in waiting {
            if benches.len() < LANES && bench.beside(&like) {
                indices.push(index);
                benches.push(bench);
                runs.push(run);
            } else {
                others.push((index, bench, run));
            }
        }
        waiting = others;
        let wide = if benches.len() < WORTH_LANES { None } else { FastBench::in_lanes(&benches) };
        let courses = match wide {
            Some(bench) => follow(bench, &mut runs, None, watch)?,
            None => {
                let mut each = Vec::new();
                for (bench, run) in benches.into_iter().zip(&mut runs) {
                    each.append(&mut follow(bench, std::slice::from_mut(run), None, watch)?);
                }
                each
            }
        };
        for (index, course) in indices.into_iter().zip(courses) {
            results[index] = Ok(course);
        }
    }
    Ok(results)
}

/// Duration of a run on the virtual bench, with the rest before it [s].
pub fn simulated_time(manoeuvre: Manoeuvre, preset: &Preset<f64>, chance: f64) -> f64 {
    REST + manoeuvre.reference(preset, chance).1
}

/// Machine, set-points and limits of a run.
struct Run<'a> {
    preset: &'a Preset<f64>,
    tick: Tick<f64>,
    setpoints: Generator<'static>,
    /// Ticks at rest, and ticks in all.
    rest: u64,
    cycles: u64,
}

impl<'a> Run<'a> {
    fn new(
        preset: &'a Preset<f64>,
        manoeuvre: Manoeuvre,
        seed: u64,
        chance: f64,
    ) -> Result<(FastBench, Run<'a>), Error> {
        let settings = &preset.bench;
        let divider = settings.divider();
        let mut tick = software(&preset.model, settings)?;
        tick.law = stickslip_core::render::Law::Off;
        let bench = FastBench::new(&preset.plant, tick, settings, divider, seed)?;
        let (reference, duration) = manoeuvre.reference(preset, chance);
        let setpoints = Generator::new(reference, settings.tick_rate);
        let in_samples = |time: f64| ((time / settings.control_period()).round() as u64) * divider;
        let rest = in_samples(REST);
        Ok((bench, Run { preset, tick, setpoints, rest, cycles: rest + in_samples(duration) }))
    }

    fn begins_sample(&self, cycle: u64) -> bool {
        cycle >= self.rest && (cycle - self.rest).is_multiple_of(self.preset.bench.divider())
    }

    /// A NaN is outside.
    fn is_within_limits(&self, deviation: f64, velocity: f64) -> bool {
        let safety = &self.preset.bench.safety;
        deviation.abs() <= safety.following_error && velocity.abs() <= safety.speed
    }
}

/// External torque in a tick [N m]; `None` fails every run.
type Torque<'a, T> = &'a mut dyn FnMut(&FastBench<T>, u64, Setpoint<T>) -> Option<T>;

/// Lets each lane follow its set-points to the end, or until it leaves its limits.
fn follow<T: LaneNumber>(
    mut bench: FastBench<T>,
    runs: &mut [Run<'_>],
    mut torque: Option<Torque<'_, T>>,
    watch: &Watch,
) -> Result<Vec<Option<Course>>, Error> {
    let start = |run: &Run<'_>| Some(Course { period: run.preset.bench.control_period(), ..Course::default() });
    let mut courses: Vec<Option<Course>> = runs.iter().map(start).collect();
    let mut order = Order { control: T::of(f64::from(u8::from(torque.is_none()))), ..Order::default() };
    for cycle in 0..runs.iter().map(|run| run.cycles).max().unwrap_or(0) {
        if cycle % 8192 == 0 {
            watch.check()?;
        }
        // Before the tick: the true state for its set-point.
        let (angle, velocity) = (bench.true_state().plant.machine.angle, bench.true_state().plant.machine.velocity);
        let mut any = false;
        for (lane, (run, course)) in runs.iter_mut().zip(&mut courses).enumerate() {
            let Some(moving) = course.as_mut().filter(|_| cycle < run.cycles) else { continue };
            let mut position = 0.0;
            if cycle >= run.rest {
                let setpoint = run.setpoints.next();
                position = setpoint.position;
                order.reference = with_lane(order.reference, lane, setpoint);
            }
            let (deviation, velocity) = (position - angle.lane(lane), velocity.lane(lane));
            if !run.is_within_limits(deviation, velocity) {
                *course = None;
                continue;
            }
            any = true;
            if run.begins_sample(cycle) {
                moving.deviation.push(deviation);
                moving.velocity.push(velocity);
            }
        }
        if !any {
            break;
        }
        if let Some(torque) = &mut torque {
            match torque(&bench, cycle, order.reference) {
                Some(torque) => order.added_torque = torque,
                None => return Ok(vec![None; courses.len()]),
            }
        }
        bench.tick(order);
        let commanded = bench.true_state().tick.commanded_torque + order.added_torque;
        for (lane, (run, course)) in runs.iter().zip(&mut courses).enumerate() {
            if let Some(course) = course.as_mut().filter(|_| cycle < run.cycles && run.begins_sample(cycle)) {
                course.torque.push(commanded.lane(lane));
            }
        }
    }
    Ok(courses)
}

fn with_lane<T: LaneNumber>(all: Setpoint<T>, lane: usize, one: Setpoint<f64>) -> Setpoint<T> {
    Setpoint {
        position: all.position.with_lane(lane, one.position),
        velocity: all.velocity.with_lane(lane, one.velocity),
        acceleration: all.acceleration.with_lane(lane, one.acceleration),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::parameters::presets::find;

    fn spread(machine: &str) -> Vec<Preset<f64>> {
        let mut preset: Preset<f64> = find(machine).unwrap().read().unwrap();
        preset.bench.tick_rate = 1000.0;
        preset.bench.control_divider = 1.0;
        let mut presets = vec![preset; 11];
        for (k, preset) in presets.iter_mut().enumerate() {
            preset.plant.drive.load_inertia *= 1.0 + 0.1 * k as f64;
        }
        // Another configuration, a refused step and a stopped run among the others.
        presets[3].plant.screw_friction.model = stickslip_core::friction::Model::Nothing;
        presets[5].plant.drive.coupling_stiffness = 1e9;
        presets[7].bench.safety.following_error = 1e-6;
        presets
    }

    #[test]
    fn machines_side_by_side_have_the_same_numbers_as_alone() {
        let presets = spread("prototype");
        let machines: Vec<_> = presets.iter().collect();
        for (manoeuvre, chance) in [(Manoeuvre::FastSine, 0.5), (Manoeuvre::Strokes, 0.3)] {
            let together = run_in_lanes(&machines, manoeuvre, 2, chance, &Watch::silent()).unwrap();
            for (index, (together, preset)) in together.into_iter().zip(&presets).enumerate() {
                let alone = run(preset, manoeuvre, 2, chance, &Watch::silent());
                assert_eq!(format!("{together:?}"), format!("{alone:?}"), "machine {index}");
                match index {
                    5 => assert!(
                        matches!(
                            together.as_ref().err().and_then(|error| error.of()),
                            Some(stickslip_simulate::SimulateError::StepTooLarge { .. })
                        ),
                        "{together:?}"
                    ),
                    7 => assert_eq!(together.unwrap(), None),
                    _ => assert!(together.unwrap().unwrap().torque.len() > 100),
                }
            }
        }
    }

    #[test]
    fn only_machines_that_differ_by_numbers_share_lanes() {
        let presets = spread("prototype");
        let bench = |index: usize, seed: u64| Run::new(&presets[index], Manoeuvre::FastSine, seed, 0.5).unwrap().0;
        assert!(bench(1, 2).beside(&bench(0, 2)));
        assert!(!bench(3, 2).beside(&bench(0, 2)), "another model of friction");
        assert!(!bench(1, 3).beside(&bench(0, 2)), "another noise");
        let wide = |count: usize| FastBench::in_lanes(&vec![bench(0, 2); count]).is_some();
        assert_eq!([0, 1, LANES, LANES + 1].map(wide), [false, true, true, false]);
    }
}
