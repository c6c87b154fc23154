//! A manoeuvre on one machine, or on several side by side.

use stickslip_core::control::reference::{Reference, Setpoint};
use stickslip_core::tick::{BenchInput, Order, Tick};

use super::inputs::{Inputs, Path};
use super::{Course, Manoeuvre};
use crate::fast_bench::{FastBench, LANES, LaneNumber, vectors};
use crate::simulation::{DelayedTorque, Sample, sample};
use stickslip_base::preset::{Preset, Settings};
use stickslip_base::{Error, Watch};
use stickslip_core::scalar::Mask as _;
use stickslip_design::software;

/// Time at rest before the manoeuvre [s].
const REST: f64 = 0.3;

/// One run: a machine in a manoeuvre.
#[derive(Clone, Copy, Debug)]
pub struct Lane<'a> {
    /// The machine with its software.
    pub preset: &'a Preset<f64>,
    /// The manoeuvre.
    pub manoeuvre: Manoeuvre,
    /// Seed of the noise.
    pub seed: u64,
    /// Place of the set-point between two counts.
    pub chance: f64,
    /// Whether the machine takes long steps in steady sliding; results differ by the integrator's error.
    pub long_steps: bool,
}

/// Runs a manoeuvre with the torque of an external controller: from a sample to a torque [N m], or `None`, with which
/// the run fails.
///
/// # Errors
/// A refused machine; [`Error::Cancelled`].
pub fn run_with(
    lane: Lane<'_>,
    controller: &mut dyn FnMut(&Sample) -> Option<f64>,
    watch: &Watch,
) -> Result<Option<Course>, Error> {
    let (bench, run) = Run::new(lane)?;
    let settings = &lane.preset.bench;
    let (tick, divider, dt) = (run.tick, settings.divider(), settings.tick_time());
    let mut brought = DelayedTorque::default();
    let mut torque = |bench: &FastBench, cycle: u64, reference: Setpoint<f64>| {
        let read = || controller(&sample(&tick, bench, cycle as f64 * dt, reference)).ok_or(());
        brought.torque(cycle, divider, read).ok()
    };
    Ok(follow(bench, &[&run], Some(&mut torque), watch)?.pop().flatten())
}

/// Runs side by side, each with the same numbers as alone: `None` where the supervision of a bench would stop it. A
/// refused machine has an error of its own.
///
/// # Errors
/// [`Error::Cancelled`] alone.
pub fn run_in_lanes(lanes: &[Lane<'_>], watch: &Watch) -> Result<Vec<Result<Option<Course>, Error>>, Error> {
    let mut results: Vec<Result<Option<Course>, Error>> = Vec::with_capacity(lanes.len());
    let (mut places, mut started) = (Vec::new(), Vec::new());
    for (place, lane) in lanes.iter().enumerate() {
        results.push(Run::new(*lane).map(|run| {
            places.push(place);
            started.push(run);
            None
        }));
    }
    let benches: Vec<&FastBench> = started.iter().map(|(bench, _)| bench).collect();
    for vector in vectors(&benches, LANES) {
        let (benches, runs): (Vec<&FastBench>, Vec<&Run<'_>>) =
            vector.iter().map(|&index| (&started[index].0, &started[index].1)).unzip();
        let courses = match &benches[..] {
            [alone] => follow((*alone).clone(), &runs, None, watch)?,
            _ => FastBench::in_lanes(&benches).map_or(Ok(Vec::new()), |wide| follow(wide, &runs, None, watch))?,
        };
        for (index, course) in vector.into_iter().zip(courses) {
            results[places[index]] = Ok(course);
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
    reference: Reference<f64>,
    /// Ticks in a sample of the controller, ticks at rest, and ticks in all.
    divider: u64,
    rest: u64,
    cycles: u64,
}

impl<'a> Run<'a> {
    fn new(lane: Lane<'a>) -> Result<(FastBench, Run<'a>), Error> {
        let Lane { preset, manoeuvre, seed, chance, long_steps } = lane;
        let settings = &preset.bench;
        let divider = settings.divider();
        let mut tick = software(&preset.model, settings)?;
        tick.law = stickslip_core::render::Law::Off;
        let bench = FastBench::new(&preset.plant, tick, settings, divider, seed)?;
        let bench = if long_steps { bench.in_long_steps() } else { bench };
        let (reference, duration) = manoeuvre.reference(preset, chance);
        let in_samples = |time: f64| ((time / settings.control_period()).round() as u64) * divider;
        let rest = in_samples(REST);
        Ok((bench, Run { preset, tick, reference, divider, rest, cycles: rest + in_samples(duration) }))
    }

    fn path(&self) -> Path {
        Path { reference: self.reference, rest: self.rest, cycles: self.cycles, rate: self.preset.bench.tick_rate }
    }

    fn begins_sample(&self, cycle: u64) -> bool {
        cycle >= self.rest && (cycle - self.rest).is_multiple_of(self.divider)
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
    runs: &[&Run<'_>],
    mut torque: Option<Torque<'_, T>>,
    watch: &Watch,
) -> Result<Vec<Option<Course>>, Error> {
    let start = |run: &&Run<'_>| {
        let [deviation, velocity, torque] =
            [(); 3].map(|()| Vec::with_capacity(((run.cycles - run.rest) / run.divider + 1) as usize));
        Some(Course { period: run.preset.bench.control_period(), deviation, velocity, torque })
    };
    let mut courses: Vec<Option<Course>> = runs.iter().map(start).collect();
    let mut inputs = Inputs::of(&runs.iter().map(|run| run.path()).collect::<Vec<_>>(), &bench);
    let order = Order { control: T::of(f64::from(u8::from(torque.is_none()))), ..Order::default() };
    let mut input = BenchInput { order, ..BenchInput::default() };
    // The limits of all lanes: one comparison in a tick.
    let limits = |of: fn(&Settings<f64>) -> f64| {
        let lanes = runs.iter().map(|run| of(&run.preset.bench)).enumerate();
        lanes.fold(T::of(f64::INFINITY), |all, (lane, limit)| all.with_lane(lane, limit))
    };
    let (largest_deviation, largest_velocity) = (limits(|it| it.safety.following_error), limits(|it| it.safety.speed));
    for cycle in 0..runs.iter().map(|run| run.cycles).max().unwrap_or(0) {
        if cycle % 8192 == 0 {
            watch.check()?;
        }
        // Before the tick: the true state for its set-point.
        let (angle, velocity) = (bench.true_state().plant.machine.angle, bench.true_state().plant.machine.velocity);
        (input.order.reference, input.noise) = inputs.next(cycle, &bench);
        let deviation = input.order.reference.position - angle;
        let within = deviation.abs().le(largest_deviation) & velocity.abs().le(largest_velocity);
        let is_sampled = runs.iter().any(|run| run.begins_sample(cycle));
        if (is_sampled || (!within).anywhere()) && !record(runs, &mut courses, cycle, deviation, velocity) {
            break;
        }
        if let Some(torque) = &mut torque {
            match torque(&bench, cycle, input.order.reference) {
                Some(torque) => input.order.added_torque = torque,
                None => return Ok(vec![None; courses.len()]),
            }
        }
        bench.tick_with(&mut input);
        if is_sampled {
            let commanded = bench.true_state().tick.commanded_torque + input.order.added_torque;
            for (lane, (run, course)) in runs.iter().zip(&mut courses).enumerate() {
                if let Some(course) = course.as_mut().filter(|_| cycle < run.cycles && run.begins_sample(cycle)) {
                    course.torque.push(commanded.lane(lane));
                }
            }
        }
    }
    Ok(courses)
}

/// Records the motion of each run where its sample begins, and ends the runs outside their limits; whether any goes on.
fn record<T: LaneNumber>(
    runs: &[&Run<'_>],
    courses: &mut [Option<Course>],
    cycle: u64,
    deviation: T,
    velocity: T,
) -> bool {
    let mut any = false;
    for (lane, (run, course)) in runs.iter().zip(courses).enumerate() {
        let Some(moving) = course.as_mut().filter(|_| cycle < run.cycles) else { continue };
        let (deviation, velocity) = (deviation.lane(lane), velocity.lane(lane));
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
    any
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
        for (manoeuvre, chance) in [(Manoeuvre::FastSine, 0.5), (Manoeuvre::Strokes, 0.3)] {
            let lane =
                |preset| Lane { preset, manoeuvre, seed: 2, chance, long_steps: manoeuvre == Manoeuvre::FastSine };
            let lanes: Vec<Lane<'_>> = presets.iter().map(lane).collect();
            let together = run_in_lanes(&lanes, &Watch::silent()).unwrap();
            for (index, (together, preset)) in together.into_iter().zip(&presets).enumerate() {
                let alone = run_in_lanes(&[lane(preset)], &Watch::silent()).unwrap().remove(0);
                assert_eq!(format!("{together:?}"), format!("{alone:?}"), "machine {index}");
                match index {
                    5 => assert!(
                        matches!(
                            together.as_ref().err().and_then(|error| error.of()),
                            Some(crate::SimulateError::StepTooLarge { .. })
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
    fn runs_of_any_seed_and_manoeuvre_share_lanes_with_the_same_numbers_as_alone() {
        let presets = spread("clm-bench");
        let lane = |k: usize| Lane {
            preset: &presets[k % 2],
            manoeuvre: [Manoeuvre::FastSine, Manoeuvre::Strokes][k % 3 % 2],
            seed: 1 + (k / 2) as u64,
            chance: 0.1 * k as f64,
            long_steps: true,
        };
        let lanes: Vec<Lane<'_>> = (0..6).map(lane).collect();
        let together = run_in_lanes(&lanes, &Watch::silent()).unwrap();
        for (together, lane) in together.into_iter().zip(lanes) {
            let (together, alone) = (together.unwrap(), run_in_lanes(&[lane], &Watch::silent()).unwrap().remove(0));
            assert!(together == alone.unwrap() && together.is_some(), "{:?} with seed {}", lane.manoeuvre, lane.seed);
        }
    }

    #[test]
    fn long_steps_change_a_measure_by_less_than_another_noise() {
        let preset = spread("clm-bench")[0];
        let rms = |long_steps, seed| {
            let lane = Lane { preset: &preset, manoeuvre: Manoeuvre::FastSine, seed, chance: 0.5, long_steps };
            let course = run_in_lanes(&[lane], &Watch::silent()).unwrap().remove(0).unwrap().unwrap();
            lane.manoeuvre.judge(&course, &preset, lane.chance)[0]
        };
        let [short, long, other] = [(false, 1), (true, 1), (false, 2)].map(|(long_steps, seed)| rms(long_steps, seed));
        assert!(long != short, "no tick was taken in long steps");
        assert!((long - short).abs() < 0.2 * (other - short).abs(), "{short} {long} {other}");
    }

    #[test]
    fn only_machines_that_differ_by_numbers_share_lanes() {
        let presets = spread("prototype");
        let lane = |preset, seed| Lane { preset, manoeuvre: Manoeuvre::FastSine, seed, chance: 0.5, long_steps: false };
        let bench = |index: usize, seed: u64| Run::new(lane(&presets[index], seed)).unwrap().0;
        assert!(bench(1, 2).beside(&bench(0, 2)));
        assert!(!bench(3, 2).beside(&bench(0, 2)), "another model of friction");
        assert!(bench(1, 3).beside(&bench(0, 2)), "another noise");
        let mut shaken = presets[0];
        shaken.plant.tick_jitter = 25e-6;
        let [one, other] = [2, 3].map(|seed| Run::new(lane(&shaken, seed)).unwrap().0);
        assert!(one.beside(&one) && !other.beside(&one), "another noise, and other steps of its ticks");
        let grouped = |most| vectors(&[0, 3, 1, 2, 0, 3].map(|k| bench(k, k as u64)).each_ref(), most);
        assert_eq!(grouped(LANES), [vec![0, 2, 3, 4], vec![1], vec![5]], "two of a kind run alone");
        assert_eq!(grouped(3), [vec![0, 2, 3], vec![1], vec![5], vec![4]]);
        let wide = |count: usize| FastBench::in_lanes(&vec![&bench(0, 2); count]).is_some();
        assert_eq!([0, 1, LANES, LANES + 1].map(wide), [false, true, true, false]);
    }
}
