//! Breakaway torque: slow torque ramps from rest.
//!
//! The load is at rest without torque, then the drive's torque rises until the encoder shows motion. Under a ramp the
//! load needs a moment to move by what the encoder can resolve; the torque rises meanwhile by at most Ṁ·t with x =
//! Ṁ·t³/(6·J). Bristles that creep before breakaway make the torque too small by the same amount, so that this bound is
//! taken as uncertainty to both sides: a slower ramp makes it smaller.

use stickslip_core::Fields;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::fields::{Relation, at_least};
use stickslip_core::scalar::Scalar;

use super::friction::hold_speed;
use super::{UNIFORM, completed, give_back};
use stickslip_base::preset::Model;
use stickslip_base::quantity::Estimate;
use stickslip_base::{Error, Watch};
use stickslip_bench::{Bench, Command, Frame, SpeedRamp};
use stickslip_fit::{StribeckFit, student_t95};

/// Time over which the speed is averaged [s].
const WINDOW: f64 = 0.025;
/// Speed between the ramps [rad/s], and its acceleration [rad/s²].
pub(super) const TRAVEL: [f64; 2] = [2.0, 50.0];

/// Plan of a breakaway measurement.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = BreakawayPlan::law)]
pub struct BreakawayPlan<T> {
    /// Rate of the torque ramp.
    #[field(symbol = "Ṁ", unit = "N m/s", range = 1e-4..=100.0, default = 0.1)]
    pub rate: T,
    /// Torque at which a ramp ends without breakaway.
    #[field(symbol = "M_max", unit = "N m", range = 1e-3..=500.0, default = 0.6)]
    pub largest_torque: T,
    /// Number of ramps at each angle in each direction.
    #[field(symbol = "n_r", unit = "1", range = 1.0..=100.0, default = 3.0, whole)]
    pub repetitions: T,
    /// Number of angles, evenly spaced over a turn.
    #[field(symbol = "n_φ", unit = "1", range = 1.0..=360.0, default = 4.0, whole)]
    pub angles: T,
    /// Time at rest before a ramp.
    #[field(symbol = "T_r", unit = "s", range = 0.05..=600.0, default = 0.3)]
    pub rest_time: T,
    /// Speed from which the load has broken away.
    #[field(symbol = "Ω_b", unit = "rad/s", range = 1e-3..=10.0, default = 0.05)]
    pub speed: T,
}

impl<T: Scalar> BreakawayPlan<T> {
    fn law(&self) -> [Relation<T>; 1] {
        let remedy = "The ramp is shorter than a window: increase the largest torque or reduce the rate.";
        [at_least("largest_torque", self.largest_torque, self.rate * T::of(WINDOW), remedy)]
    }
}

impl BreakawayPlan<f64> {
    /// Largest rise of the torque between breakaway and its detection [N m].
    pub fn lag(&self, model: &Model<f64>) -> f64 {
        self.rate * libm::cbrt(6.0 * model.drive.inertia() * self.speed * WINDOW / self.rate)
    }

    /// Bench time of a plan whose ramps end at a torque [s]; at most that of [`largest_torque`](Self::largest_torque).
    pub fn duration(&self, breakaway: f64) -> f64 {
        let ramp = breakaway.min(self.largest_torque) / self.rate;
        // A turn in all, and a short way back for each ramp.
        let travel = 0.3;
        2.0 * self.angles * self.repetitions * (ramp + self.rest_time + travel) + std::f64::consts::TAU / TRAVEL[0]
    }
}

/// One ramp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Commanded angle [rad].
    pub angle: f64,
    /// 1 or −1.
    pub direction: f64,
    /// Friction torque of the load at breakaway, a magnitude [N m]; `None` where it did not break away.
    pub torque: Option<f64>,
}

/// Mean of some ramps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Angle [rad]; `None` for a mean over all angles.
    pub angle: Option<f64>,
    /// Mean [N m].
    pub torque: f64,
    /// Standard deviation of one ramp [N m].
    pub spread: f64,
    /// 95 % interval: scatter, and the uncertainty by the ramp's rate.
    pub ci95: [f64; 2],
    /// Number of ramps.
    pub count: usize,
}

/// Measured breakaway torques.
#[derive(Clone, Debug, PartialEq)]
pub struct Breakaway {
    /// In the order of measurement.
    pub ramps: Vec<Ramp>,
    /// Rate of the torque ramp [N m/s].
    pub rate: f64,
    /// Time at rest before each ramp [s].
    pub rest_time: f64,
    /// Largest rise of the torque between breakaway and its detection [N m].
    pub lag: f64,
    /// Bench time [s].
    pub duration: f64,
    /// Whether the plan was completed; if not, the ramps are those before the cancellation.
    pub complete: bool,
}

impl Breakaway {
    /// Mean over the ramps of a direction (1, −1), at all angles; `None` if none broke away.
    pub fn direction(&self, direction: f64) -> Option<Mean> {
        self.mean(None, |ramp| ramp.direction == direction)
    }

    /// Mean over both directions and all angles.
    pub fn mean_torque(&self) -> Option<Mean> {
        self.mean(None, |_| true)
    }

    /// Mean at each angle in a direction, in rising order.
    pub fn by_angle(&self, direction: f64) -> Vec<Mean> {
        let mut angles: Vec<f64> = self.ramps.iter().map(|ramp| ramp.angle).collect();
        angles.sort_by(f64::total_cmp);
        angles.dedup();
        let at = |angle| self.mean(Some(angle), |ramp| ramp.direction == direction && ramp.angle == angle);
        angles.into_iter().filter_map(at).collect()
    }

    fn mean(&self, angle: Option<f64>, counts: impl Fn(&Ramp) -> bool) -> Option<Mean> {
        let torques: Vec<f64> = self.ramps.iter().filter(|ramp| counts(ramp)).filter_map(|ramp| ramp.torque).collect();
        let n = torques.len() as f64;
        if torques.is_empty() {
            return None;
        }
        let torque = torques.iter().sum::<f64>() / n;
        let spread = (torques.iter().map(|t| (t - torque).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
        // One ramp has no scatter.
        let scatter = if n > 1.0 { student_t95(n - 1.0) * spread / n.sqrt() } else { f64::INFINITY };
        let half_width = libm::hypot(scatter, 1.96 * UNIFORM * 2.0 * self.lag);
        Some(Mean { angle, torque, spread, ci95: [torque - half_width, torque + half_width], count: torques.len() })
    }

    /// Difference between the breakaway torque and M_S of a curve [N m], with its 95 % interval.
    pub fn beyond(&self, fit: &StribeckFit) -> Option<(f64, [f64; 2])> {
        let mean = self.mean_torque()?;
        let difference = mean.torque - fit.parameters[0];
        let half = |[low, high]: [f64; 2]| 0.5 * (high - low);
        let half_width = libm::hypot(half(mean.ci95), half(fit.ci95[0]));
        Some((difference, [difference - half_width, difference + half_width]))
    }

    /// The estimates, each with its name.
    pub fn lines(&self) -> impl Iterator<Item = (&'static str, Estimate)> + '_ {
        let means = [
            ("breakaway torque", self.mean_torque()),
            ("breakaway torque, positive", self.direction(1.0)),
            ("breakaway torque, negative", self.direction(-1.0)),
        ];
        means.into_iter().filter_map(|(name, mean)| {
            let mean = mean?;
            Some((name, Estimate::new(mean.torque, "N m").with_half_width(0.5 * (mean.ci95[1] - mean.ci95[0]))))
        })
    }

    /// Warnings for the report.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let stuck = self.ramps.iter().filter(|ramp| ramp.torque.is_none()).count();
        if stuck > 0 {
            warnings
                .push(format!("No breakaway in {stuck} of {} ramps: increase the largest torque.", self.ramps.len()));
        }
        if let Some(mean) = self.mean_torque().filter(|mean| self.lag > 0.05 * mean.torque) {
            let share = 100.0 * self.lag / mean.torque;
            warnings.push(format!("Up to {share:.0} % of the torque is detection lag: use a slower ramp."));
        }
        if !self.complete {
            warnings.push("Cancelled: results of the ramps measured until then.".into());
        }
        warnings
    }
}

/// Measures the breakaway torque of the load side. The bench must be homed and running.
///
/// # Errors
/// [`Error::NotHomed`]; [`Error::BenchFault`]; [`Error::Cancelled`] before the first ramp has ended; afterwards a
/// cancelled measurement returns its ramps as not complete.
pub fn measure_breakaway(plan: &BreakawayPlan<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<Breakaway, Error> {
    if bench.zero().is_none() {
        return Err(Error::NotHomed);
    }
    let model = *bench.model();
    let first = bench.step(Command::default())?;
    hold_speed(bench)?;
    let lag = plan.lag(&model);
    let mut ramps = Vec::new();
    let ended = visit(plan, bench, first, watch, &mut ramps);
    let complete = completed(give_back(bench, ended), !ramps.is_empty())?;
    let last = bench.step(Command::default())?;
    let duration = (last.cycle - first.cycle) as f64 * bench.settings().tick_time();
    let BreakawayPlan { rate, rest_time, .. } = *plan;
    Ok(Breakaway { ramps, rate, rest_time, lag, duration, complete })
}

/// All ramps; completed ramps are in the list also after an error.
fn visit(
    plan: &BreakawayPlan<f64>,
    bench: &mut dyn Bench,
    first: Frame,
    watch: &Watch,
    ramps: &mut Vec<Ramp>,
) -> Result<(), Error> {
    let all = 2.0 * plan.angles * plan.repetitions;
    let motor_friction = bench.model().motor_friction.steady_torque(plan.speed, 0.0, 0.0);
    let mut position = first.angle;
    for place in 0..plan.angles as u64 {
        let angle = std::f64::consts::TAU * place as f64 / plan.angles;
        for _ in 0..plan.repetitions as u64 {
            for direction in [1.0, -1.0] {
                watch.stage("breakaway from rest", ramps.len() as f64 / all)?;
                go_to(bench, position, angle, TRAVEL, watch)?;
                let mark = ramps.len() as u32 + 1;
                let (applied, stop) = ramp(plan, bench, mark, direction, angle, watch)?;
                let torque = applied.map(|applied| applied - motor_friction);
                let ramp = Ramp { angle, direction, torque };
                watch.part(&ramp);
                ramps.push(ramp);
                position = stop;
            }
        }
    }
    Ok(())
}

/// Goes from rest to rest at another angle under control, with this speed [rad/s] and acceleration [rad/s²].
pub(super) fn go_to(
    bench: &mut dyn Bench,
    from: f64,
    to: f64,
    [speed, acceleration]: [f64; 2],
    watch: &Watch,
) -> Result<(), Error> {
    let dt = bench.settings().tick_time();
    let mut traveller = SpeedRamp::new(from, acceleration, dt);
    let sign = if to < from { -1.0 } else { 1.0 };
    let under_control = |setpoint| Command { setpoint, control: true, ..Command::default() };
    while sign * (to - traveller.setpoint.position) > sign * traveller.way_to(0.0) + 1e-9 {
        bench.hand_over(under_control(traveller.toward(sign * speed)))?;
    }
    while traveller.setpoint.velocity != 0.0 {
        bench.hand_over(under_control(traveller.toward(0.0)))?;
    }
    for _ in 0..(0.1 / dt) as u64 {
        bench.hand_over(under_control(traveller.setpoint))?;
    }
    watch.check()
}

/// One ramp from rest at a position [rad]: the magnitude of the drive's torque at breakaway [N m], and where the load was caught [rad].
fn ramp(
    plan: &BreakawayPlan<f64>,
    bench: &mut dyn Bench,
    mark: u32,
    direction: f64,
    position: f64,
    watch: &Watch,
) -> Result<(Option<f64>, f64), Error> {
    let dt = bench.settings().tick_time();
    // The set-point follows the axis while control is off, so that the controller starts without a jump.
    let mut setpoint = Setpoint { position, ..Setpoint::default() };
    for _ in 0..(plan.rest_time / dt) as u64 {
        if let Some(frame) = bench.hand_over(Command { setpoint, ..Command::default() })? {
            setpoint.position = frame.angle;
        }
    }
    let window = ((WINDOW / dt).round() as usize).max(1);
    let mut angles = vec![f64::NAN; window];
    let mut torque = 0.0;
    let mut broke_away = None;
    let mut tick = 0;
    while torque < plan.largest_torque {
        torque += plan.rate * dt;
        let command = Command { setpoint, added_torque: direction * torque, mark, ..Command::default() };
        let Some(frame) = bench.hand_over(command)? else { continue };
        setpoint.position = frame.angle;
        if frame.command.mark != mark {
            continue;
        }
        let way = direction * (frame.angle - angles[tick % window]);
        angles[tick % window] = frame.angle;
        tick += 1;
        // NaN in the first window counts as rest.
        if way >= plan.speed * WINDOW {
            broke_away = Some(frame.command.added_torque.abs());
            break;
        }
        if tick % 2048 == 0 {
            watch.check()?;
        }
    }
    for _ in 0..(0.1 / dt) as u64 {
        bench.hand_over(Command { setpoint, control: true, ..Command::default() })?;
    }
    Ok((broke_away, setpoint.position))
}
