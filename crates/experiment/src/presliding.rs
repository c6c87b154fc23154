//! Presliding: small torque cycles from rest, the hysteresis loop, and bristle stiffness and damping from it.
//!
//! Slow cycles determine the stiffness σ₀, quick ones the damping σ₁. An encoder gives the exact angle when its counter
//! changes, and only an interval between. So the loop is fitted at these edges, by simulating drive and bristles under
//! the commanded torque; the number of different edges of a loop decides which parameters are identifiable.

use std::convert::Infallible;
use std::f64::consts::TAU;

use nalgebra::Matrix2;
use stickslip_core::Fields;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::drive::{Delay, LONGEST_DELAY};
use stickslip_core::friction::{Bend, DampingVelocity, ElastoPlastic, Fading, LuGre, Static, Stribeck, advance};
use stickslip_core::scalar::{Dual, Scalar};

use super::breakaway::{TRAVEL, go_to};
use super::friction::hold_speed;
use super::{completed, give_back};
use stickslip_base::preset::Model;
use stickslip_base::quantity::Estimate;
use stickslip_base::{Error, Watch};
use stickslip_bench::{Bench, Command, Frame};
use stickslip_fit::{Stop, minimise, student_t95};

/// Fewest steps of the simulation in a tick, and its longest step [s]: with 500 µs the damping of a load on bristles of
/// 300 N m/rad is a quarter too large.
const STEPS: f64 = 2.0;
const LONGEST_STEP: f64 = 125e-6;
/// Least number of different edges of an identifiable loop.
const ENOUGH_EDGES: usize = 8;
/// Points of a loop in figures.
const PHASES: usize = 100;

/// Plan of a presliding measurement.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct PreslidingPlan<T> {
    /// Amplitude of the torque as a share of the model's breakaway torque.
    #[field(symbol = "M/M_S", unit = "1", range = 0.05..=0.95, default = 0.6)]
    pub share: T,
    /// Frequency of the slow cycles.
    #[field(symbol = "f_1", unit = "Hz", range = 1e-2..=10.0, default = 1.0)]
    pub slow_frequency: T,
    /// Number of slow cycles; the first is left out.
    #[field(symbol = "n_1", unit = "1", range = 2.0..=100.0, default = 4.0, whole)]
    pub slow_cycles: T,
    /// Frequency of the quick cycles.
    #[field(symbol = "f_2", unit = "Hz", range = 1.0..=100.0, default = 10.0)]
    pub quick_frequency: T,
    /// Number of quick cycles; the first is left out.
    #[field(symbol = "n_2", unit = "1", range = 2.0..=1000.0, default = 10.0, whole)]
    pub quick_cycles: T,
    /// Rest angle of the load.
    #[field(symbol = "φ_0", unit = "rad", range = -1e4..=1e4)]
    pub angle: T,
    /// Time at rest before the cycles.
    #[field(symbol = "T_r", unit = "s", range = 0.05..=600.0, default = 0.3)]
    pub rest_time: T,
}

impl PreslidingPlan<f64> {
    fn cycles(&self) -> [[f64; 2]; 2] {
        [[self.slow_frequency, self.slow_cycles], [self.quick_frequency, self.quick_cycles]]
    }

    /// Bench time [s], without the way to the angle.
    pub fn duration(&self) -> f64 {
        self.cycles().iter().map(|[frequency, cycles]| cycles / frequency + self.rest_time).sum()
    }
}

/// A hysteresis loop, mean over its cycles.
#[derive(Clone, Debug, PartialEq)]
pub struct Loop {
    /// Frequency of the torque [Hz].
    pub frequency: f64,
    /// Torque [N m] and angle from rest [rad], evenly spaced in time over a cycle.
    pub points: Vec<[f64; 2]>,
    /// The same for the fitted bristles; empty without a fit.
    pub fitted: Vec<[f64; 2]>,
    /// Different angles at which the counter changed.
    pub levels: usize,
    /// Ticks of the record: torque [N m] and angle [rad].
    record: Vec<[f64; 2]>,
}

/// Result for the bristles.
#[derive(Clone, Debug, PartialEq)]
pub struct Presliding {
    /// Slow and quick loop; a cancelled experiment may lack the quick one.
    pub loops: Vec<Loop>,
    /// Stiffness σ₀ [N m/rad] with its 95 % interval, if the encoder resolves it.
    pub stiffness: Option<(f64, [f64; 2])>,
    /// Damping σ₁ [N m s/rad] likewise.
    pub damping: Option<(f64, [f64; 2])>,
    /// The stiffness is at least this [N m/rad]: otherwise the load would have crossed another count.
    pub least_stiffness: f64,
    /// Encoder counts per revolution required for both.
    pub counts_needed: f64,
    /// Encoder counts per revolution of the bench.
    pub counts: f64,
    /// Whether the plan was completed.
    pub complete: bool,
    /// Bench time [s].
    pub duration: f64,
}

impl Presliding {
    /// Loops before the fit.
    pub fn of_loops(loops: Vec<Loop>) -> Self {
        Presliding {
            loops,
            stiffness: None,
            damping: None,
            least_stiffness: f64::NAN,
            counts_needed: f64::NAN,
            counts: f64::NAN,
            complete: true,
            duration: 0.0,
        }
    }

    /// The estimates, each with its name.
    pub fn lines(&self) -> impl Iterator<Item = (&'static str, Estimate)> + '_ {
        let estimates =
            [("bristle stiffness", self.stiffness, "N m/rad"), ("bristle damping", self.damping, "N m s/rad")];
        estimates.into_iter().filter_map(|(name, estimate, unit)| {
            let (value, [low, high]) = estimate?;
            Some((name, Estimate::new(value, unit).with_half_width(0.5 * (high - low))))
        })
    }

    /// Warnings for the report.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.stiffness.is_none() || self.damping.is_none() {
            let subject = if self.stiffness.is_none() { "Presliding is" } else { "The damping of the bristles is" };
            warnings.push(format!(
                "{subject} not identifiable with this encoder of {} counts per revolution: at least {:.0} are required. The \
                 bristle stiffness is at least {:.3e} N·m/rad.",
                self.counts, self.counts_needed, self.least_stiffness
            ));
        }
        if !self.complete {
            warnings.push("Cancelled: results of the cycles measured until then.".into());
        }
        warnings
    }
}

/// Measures the hysteresis loops below breakaway. The bench must be homed and running, and its model must have the
/// measured own friction.
///
/// # Errors
/// [`Error::NotHomed`]; [`Error::BenchFault`]; [`Error::Cancelled`] before the slow cycles have ended; afterwards a
/// cancelled measurement returns its loops as not complete.
pub fn measure_presliding(
    plan: &PreslidingPlan<f64>,
    bench: &mut dyn Bench,
    watch: &Watch,
) -> Result<Presliding, Error> {
    if bench.zero().is_none() {
        return Err(Error::NotHomed);
    }
    let first = bench.step(Command::default())?;
    hold_speed(bench)?;
    let mut loops = Vec::new();
    let ended =
        go_to(bench, first.angle, plan.angle, TRAVEL, watch).and_then(|()| visit(plan, bench, watch, &mut loops));
    let complete = completed(give_back(bench, ended), !loops.is_empty())?;
    let last = bench.step(Command::default())?;
    let dt = bench.settings().tick_time();
    let duration = (last.cycle - first.cycle) as f64 * dt;
    Ok(evaluate(bench.model(), loops, plan.share, dt, complete, duration))
}

fn visit(plan: &PreslidingPlan<f64>, bench: &mut dyn Bench, watch: &Watch, loops: &mut Vec<Loop>) -> Result<(), Error> {
    let dt = bench.settings().tick_time();
    let amplitude = plan.share * bench.model().own.breakaway_torque;
    for (index, [frequency, cycles]) in plan.cycles().into_iter().enumerate() {
        let setpoint = Setpoint { position: plan.angle, ..Setpoint::default() };
        for _ in 0..(plan.rest_time / dt) as u64 {
            bench.hand_over(Command { setpoint, ..Command::default() })?;
        }
        let mark = index as u32 + 1;
        let mut record = Vec::new();
        let see = |record: &mut Vec<[f64; 2]>, frame: &Frame| {
            if frame.command.mark == mark {
                record.push([frame.command.added_torque, frame.angle]);
            }
        };
        for tick in 0..(cycles / frequency / dt) as u64 {
            let added_torque = amplitude * libm::sin(TAU * frequency * tick as f64 * dt);
            let command = Command { setpoint, added_torque, mark, ..Command::default() };
            bench.hand_over(command)?.iter().for_each(|frame| see(&mut record, frame));
            if tick % 2048 == 0 {
                watch.part(&mean_loop(frequency, record.clone(), dt));
                watch.stage("presliding cycles", 0.5 * (index as f64 + tick as f64 * dt * frequency / cycles))?;
            }
        }
        bench.drain(&mut |frame| see(&mut record, frame))?;
        let ended = mean_loop(frequency, record, dt);
        watch.part(&ended);
        loops.push(ended);
    }
    Ok(())
}

fn mean_loop(frequency: f64, record: Vec<[f64; 2]>, dt: f64) -> Loop {
    let mut sums = vec![[0.0; 3]; PHASES];
    let rest = record.first().map_or(0.0, |[_, angle]| *angle);
    for (tick, [torque, angle]) in record.iter().enumerate() {
        let turns = tick as f64 * dt * frequency;
        if turns >= 1.0 {
            let sum = &mut sums[((turns - turns.floor()) * PHASES as f64) as usize % PHASES];
            *sum = [sum[0] + torque, sum[1] + angle - rest, sum[2] + 1.0];
        }
    }
    let points = sums.iter().filter(|sum| sum[2] > 0.0).map(|sum| [sum[0] / sum[2], sum[1] / sum[2]]).collect();
    let mut levels: Vec<f64> = edges(&record).map(|edge| edge.angle).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    Loop { frequency, points, fitted: Vec::new(), levels: levels.len(), record }
}

/// A change of the counter.
struct Edge {
    /// The first tick with the new count, at least 1.
    tick: usize,
    /// The angle of the edge [rad].
    angle: f64,
}

/// All changes of the counter. The angle of the edge is the larger of both counts.
fn edges(record: &[[f64; 2]]) -> impl Iterator<Item = Edge> + '_ {
    record
        .windows(2)
        .enumerate()
        .filter(|(_, pair)| pair[0][1] != pair[1][1])
        .map(|(tick, pair)| Edge { tick: tick + 1, angle: pair[0][1].max(pair[1][1]) })
}

fn evaluate(model: &Model<f64>, loops: Vec<Loop>, share: f64, dt: f64, complete: bool, duration: f64) -> Presliding {
    let counts = model.encoder.counts_per_revolution;
    let levels = loops.iter().map(|l| l.levels).min().unwrap_or(0);
    let swing = 2.0 * share * model.own.breakaway_torque;
    let least_stiffness = swing / ((loops.first().map_or(0, |l| l.levels) + 1) as f64 * model.encoder.resolution());
    let counts_needed = counts * (ENOUGH_EDGES as f64 / (levels + 1) as f64).max(1.0);
    let mut presliding = Presliding {
        loops,
        stiffness: None,
        damping: None,
        least_stiffness,
        counts_needed: 1e3 * (counts_needed / 1e3).ceil(),
        counts,
        complete,
        duration,
    };
    // Stiffness, damping and an offset in each loop need more than one level in both.
    if levels >= 2 && presliding.loops.len() == 2 {
        let (contact, [stiffness, damping]) = fit(model, &presliding.loops, least_stiffness, dt);
        // An interval with a negative end or of more than a decade counts as not identifiable.
        let identifiable =
            |(value, [low, high]): (f64, [f64; 2])| (low > 0.0 && high < 10.0 * low).then_some((value, [low, high]));
        (presliding.stiffness, presliding.damping) = (identifiable(stiffness), identifiable(damping));
        if let (Some(_), Some((contact, plastic))) = (presliding.stiffness, contact) {
            for one in &mut presliding.loops {
                one.fitted = fitted(model, &contact, plastic, one, dt);
            }
        }
    }
    presliding
}

/// The two bristle models of a loop.
fn bristles<T: Scalar>(own: &Stribeck<f64>, [stiffness, damping]: [T; 2], elastic: bool) -> ElastoPlastic<T> {
    let [breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction] =
        [own.breakaway_torque, own.kinetic_torque, own.stribeck_velocity, own.viscous_friction].map(T::of);
    let decay = stickslip_core::friction::Decay::Exponential;
    let sliding = Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, decay };
    // Presliding is too slow for the fading of the damping.
    let fading = Fading::Gaussian(DampingVelocity { velocity: T::of(1.2) });
    let lugre = LuGre { sliding, bristle_stiffness: stiffness, bristle_damping: damping, fading };
    ElastoPlastic { lugre, elastic_fraction: T::of(if elastic { 0.7 } else { 0.0 }) }
}

/// Angle of the load [rad] at each tick under the commanded torques.
fn simulate<T: Scalar>(
    model: &Model<f64>,
    contact: &ElastoPlastic<T>,
    plastic: bool,
    record: &[[f64; 2]],
    dt: f64,
) -> Vec<T> {
    let drive = &model.drive;
    let [motor_inertia, load_inertia] = [drive.motor_inertia, drive.load_inertia].map(T::of);
    let [stiffness, damping] = [drive.coupling_stiffness, drive.coupling_damping].map(T::of);
    let steps = (dt / LONGEST_STEP - 1e-9).ceil().max(STEPS);
    let step = T::of(dt / steps);
    let level = T::of(model.motor_friction.steady_torque(1e-9, 0.0, 0.0));
    let brushes = Static {
        sliding: Stribeck {
            breakaway_torque: level,
            kinetic_torque: level,
            stribeck_velocity: T::of(1.0),
            viscous_friction: T::of(0.0),
            decay: stickslip_core::friction::Decay::Exponential,
        },
    };
    // The model's lag is that of amplifier and tacho together: the amplifier has a share between 0 and 1.
    let follow = 1.0 - libm::exp(-dt / steps / (0.5 * model.drive_lag).max(1e-9));
    let zero = T::of(0.0);
    // The settings of a bench admit no delay that cannot be stored.
    let delay = Delay::new(model.servo_delay, dt).unwrap_or_default();
    let (mut applied, mut commanded, mut past) = (0.0, 0.0, [0.0; LONGEST_DELAY]);
    let (mut motor_angle, mut motor_speed, mut angle, mut speed, mut deflection) = (zero, zero, zero, zero, zero);
    let mut angles = Vec::with_capacity(record.len());
    for [torque, _] in record {
        // In a tick the angle is read before the torque is written.
        angles.push(angle);
        for _ in 0..steps as usize {
            applied += follow * (commanded - applied);
            let coupling = stiffness * (motor_angle - angle) + damping * (motor_speed - speed);
            let free = T::of(applied) - coupling;
            let arrest = free + motor_inertia * motor_speed / step;
            motor_speed += step / motor_inertia * (free - brushes.torque(motor_speed, arrest));
            motor_angle += step * motor_speed;
            let bend = Bend { deflection, probe: deflection, velocity: speed, dt: step };
            let (next, friction) = if plastic { advance(&contact.lugre, bend) } else { advance(contact, bend) };
            deflection = next;
            angle += step * speed;
            speed += step / load_inertia * (coupling - friction);
        }
        commanded = delay.next(&mut past, *torque);
    }
    angles
}

/// The loop of the fitted bristles, shifted to the mean of the measured one: the rest angle within a count is unknown.
fn fitted(model: &Model<f64>, contact: &ElastoPlastic<f64>, plastic: bool, measured: &Loop, dt: f64) -> Vec<[f64; 2]> {
    let angles = simulate(model, contact, plastic, &measured.record, dt);
    let record = measured.record.iter().zip(angles).map(|([torque, _], angle)| [*torque, angle]).collect();
    let points = mean_loop(measured.frequency, record, dt).points;
    let mean = |points: &[[f64; 2]]| points.iter().map(|[_, angle]| angle).sum::<f64>() / points.len() as f64;
    let off = mean(&measured.points) - mean(&points);
    points.into_iter().map(|[torque, angle]| [torque, angle + off]).collect()
}

/// Bristles, and whether they lack an elastic zone.
type Contact = (ElastoPlastic<f64>, bool);

/// The model with the smaller residual, and its σ₀ and σ₁, each with its 95 % interval.
fn fit(model: &Model<f64>, loops: &[Loop], least: f64, dt: f64) -> (Option<Contact>, [(f64, [f64; 2]); 2]) {
    let residuals = |parameters: [Dual<2>; 2], plastic: bool| {
        let contact = bristles(&model.own, parameters, !plastic);
        let mut residuals: Vec<Dual<2>> = Vec::new();
        for one in loops {
            let angles = simulate(model, &contact, plastic, &one.record, dt);
            // The counter changed between two ticks, on average in the middle.
            let between = |tick: usize| Dual::of(0.5) * (angles[tick - 1] + angles[tick]);
            let off: Vec<Dual<2>> = edges(&one.record).map(|edge| between(edge.tick) - Dual::of(edge.angle)).collect();
            // The rest angle within a count is unknown; the mean determines it.
            let sum = off.iter().fold(Dual::of(0.0), |sum, r| sum + *r);
            let mean = sum / Dual::of(off.len() as f64);
            residuals.extend(off.into_iter().map(|r| r - mean));
        }
        residuals
    };
    const BOUNDS: [[f64; 2]; 2] = [[1e-3, 1e8], [1e-6, 1e4]];
    let stop = Stop { step: 1e-6, fall: 1e-9, evaluations: 40 };
    let mut best: Option<(f64, [f64; 2], bool)> = None;
    for plastic in [false, true] {
        for factor in [1.2, 3.0] {
            // Half of the critical damping.
            let stiffness = factor * least;
            let start = [stiffness, (stiffness * model.drive.load_inertia).sqrt()];
            let Ok(minimum) = minimise(start, BOUNDS, stop, |p| Ok::<_, Infallible>(residuals(p, plastic)));
            if best.is_none_or(|(cost, _, _)| minimum.cost < cost) {
                best = Some((minimum.cost, minimum.parameters, plastic));
            }
        }
    }
    let unknown = [(f64::NAN, [0.0, f64::INFINITY]); 2];
    let Some((cost, parameters, plastic)) = best else { return (None, unknown) };
    let contact = Some((bristles(&model.own, parameters, !plastic), plastic));
    let rows = residuals(std::array::from_fn(|i| Dual::variable(parameters[i], i)), plastic);
    // Edges repeat in every cycle: only those that differ in level and direction add information.
    let distinct: f64 = loops.iter().map(|one| 2.0 * one.levels as f64).sum();
    let freedom = distinct - 4.0;
    let all = rows.len() as f64;
    let normal = rows.iter().fold(Matrix2::zeros(), |sum, row| {
        sum + Matrix2::from_fn(|i, j| row.gradient[i] * parameters[i] * row.gradient[j] * parameters[j])
    });
    let Some(inverse) = normal.try_inverse() else { return (contact, unknown) };
    if freedom < 1.0 {
        return (contact, unknown);
    }
    // Distinct edges instead of all: the mean square stays, the information of the rows shrinks by all/distinct.
    let variance = cost / all * (distinct / freedom) * (all / distinct);
    // Model uncertainty, as halves of uniform distributions: the motor's own presliding, of which the model has the
    // level only, and for the damping the amplifier's share of the lag.
    let amplitude = loops.iter().flat_map(|one| &one.record).map(|[torque, _]| *torque).fold(0.0, f64::max);
    let brushes = model.motor_friction.steady_torque(1e-9, 0.0, 0.0) / amplitude;
    let lag = 0.5 * model.drive_lag * parameters[0] / parameters[1];
    let estimates = std::array::from_fn(|i| {
        let open = libm::hypot(brushes, if i == 1 { lag } else { 0.0 }) / 3f64.sqrt();
        let noise = student_t95(freedom) * (variance * inverse[(i, i)]).sqrt();
        let half_width = libm::hypot(noise, 1.96 * open);
        (parameters[i], [parameters[i] * libm::exp(-half_width), parameters[i] * libm::exp(half_width)])
    });
    (contact, estimates)
}
