//! Friction at constant speeds, both directions.
//!
//! The measurement uses its own speed controller ([`hold_speed`]), as stiff as the delays allow, so that the result
//! does not depend on the controller under test.

use stickslip_core::friction::Stribeck;

use super::plan::{FrictionPlan, Phase};
use super::plateau::{Balance, HARMONICS, Plateau, standard_error};
use super::{UNIFORM, completed, give_back};
use stickslip_base::{Error, Watch};
use stickslip_bench::{Bench, Command, Frame};
use stickslip_design as design;
use stickslip_fit::{CurvePoint, HUBER, Side, StribeckFit, StribeckPlan, Uncertainty, fit_stribeck};

/// Size of an angle dependence, in standard errors, from which it is significant.
const SIGNIFICANT: f64 = 4.0;

/// Frequencies up to which the noise of the torque balance counts for its mean [Hz]: above, the encoder's counts,
/// differentiated twice, and the drive's resonance add noise that the mean over a plateau does not have.
const NOISE_BAND: f64 = 2.5;

/// A measured friction characteristic.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionCurve {
    /// One plateau for each velocity, in the order of measurement.
    pub plateaus: Vec<Plateau>,
    /// Share of the friction that varies with the angle: amplitude of its largest significant harmonic; 0 if none.
    pub ripple: f64,
    /// Bench time [s].
    pub duration: f64,
    /// Whether the plan was completed; if not, the plateaus are those before the cancellation.
    pub complete: bool,
}

impl FrictionCurve {
    /// Settings of the fit: both directions together, robust, with at least the uncertainty of the points' errors and
    /// of their scatter.
    pub const FIT: StribeckPlan =
        StribeckPlan { side: Side::Both, uncertainty: Uncertainty::Extra, huber: Some(HUBER) };

    /// The valid plateaus as points for a fit, corrected for the sway of their speed. The error of each point is its
    /// noise and half of that correction.
    ///
    /// An error that scales all torques alike, such as that of a torque constant, is not included: it moves the curve
    /// without adding scatter.
    pub fn points(&self) -> Vec<CurvePoint> {
        let point = |plateau: &Plateau| {
            let bias = self.sway_bias(plateau);
            CurvePoint {
                velocity: plateau.velocity,
                torque: plateau.torque - bias,
                standard_error: libm::hypot(plateau.standard_error, UNIFORM * bias),
            }
        };
        self.valid().map(point).collect()
    }

    /// Difference between a plateau's torque and friction at its mean velocity, caused by the sway of its speed [N m].
    ///
    /// Bristles average the friction over the last few µm, so that quick sways of the speed are weighted by way, not by
    /// time: the mean friction is off by g'(Ω)·σ²/Ω where the bristles' way is long against a sway, as it is at the
    /// slowest speeds. Elsewhere the effect is negligible.
    fn sway_bias(&self, plateau: &Plateau) -> f64 {
        let others =
            || self.valid().filter(|other| (other.velocity - plateau.velocity).abs() > 0.01 * plateau.velocity.abs());
        let same_side = || others().filter(|other| other.velocity * plateau.velocity > 0.0);
        let nearest = same_side().min_by(|a, b| {
            let ratio = |p: &Plateau| libm::log(p.velocity / plateau.velocity).abs();
            ratio(a).total_cmp(&ratio(b))
        });
        let slope = nearest.map_or(0.0, |n| (n.torque - plateau.torque) / (n.velocity - plateau.velocity));
        slope * plateau.sway * plateau.sway / plateau.velocity
    }

    /// The valid plateaus.
    pub fn valid(&self) -> impl Iterator<Item = &Plateau> {
        self.plateaus.iter().filter(|plateau| plateau.dropped.is_none())
    }

    /// The plateaus on which the load stuck or hunted.
    pub fn dropped(&self) -> impl Iterator<Item = &Plateau> {
        self.plateaus.iter().filter(|plateau| plateau.dropped.is_some())
    }

    /// The Stribeck curve of both directions together.
    ///
    /// # Errors
    /// [`Error::TooFew`] if the load slid on too few plateaus.
    pub fn fit(&self) -> Result<StribeckFit, Error> {
        fit_stribeck(&self.points(), &FrictionCurve::FIT)
    }

    /// RMS distance of the valid plateaus from a curve [N m], over those whose set speed `counts` admits
    /// [rad/s]; NaN over none.
    pub fn rms_from(&self, curve: &Stribeck<f64>, counts: impl Fn(f64) -> bool) -> f64 {
        let squares: Vec<f64> = self
            .valid()
            .filter(|plateau| counts(plateau.set_velocity.abs()))
            .map(|plateau| (plateau.torque - curve.torque(plateau.velocity)).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }
}

/// Measures the friction of the load side at the plan's speeds; with `render` under the active rendering law.
///
/// The bench must be homed and running.
///
/// # Errors
/// [`Error::BenchFault`]; [`Error::NotHomed`]; [`Error::Cancelled`] before the first plateau has ended; afterwards a
/// cancelled measurement returns its plateaus as not complete.
pub fn measure_friction(
    plan: &FrictionPlan<f64>,
    bench: &mut dyn Bench,
    render: bool,
    watch: &Watch,
) -> Result<FrictionCurve, Error> {
    if bench.zero().is_none() {
        return Err(Error::NotHomed);
    }
    let dt = bench.settings().tick_time();
    let model = *bench.model();
    let balance = Balance {
        inertia: model.drive.inertia(),
        motor_friction: &model.motor_friction,
        count: model.encoder.resolution(),
        dt,
        edge_time: plan.edge_time,
        renders: render,
    };
    let start = bench.step(Command::default())?.angle;
    hold_speed(bench)?;
    let ticks = (plan.duration(start, dt) / dt).round();
    let mut plateaus =
        Plateaus { plan, balance, watch, speeds: Vec::new(), mark: 0, frames: Vec::new(), ended: Vec::new() };
    let (mut commanded, mut done) = (Phase::Moving, 0.0);
    let ended = plan.walk(start, dt, &mut |setpoint, phase| {
        let mark = plateaus.mark(phase, commanded);
        commanded = phase;
        let command = Command { setpoint, control: true, render, mark, ..Command::default() };
        bench.hand_over(command)?.iter().for_each(|frame| plateaus.see(frame));
        done += 1.0;
        if done % 2048.0 == 0.0 {
            watch.stage("friction at constant speeds", done / ticks)?;
        }
        Ok(())
    });
    let ended = ended.and_then(|()| bench.drain(&mut |frame| plateaus.see(frame)));
    if ended.is_ok() {
        plateaus.end();
    }
    let mut plateaus = plateaus.ended;
    let complete = completed(give_back(bench, ended), !plateaus.is_empty())?;
    share_noise(&mut plateaus);
    let ripple = remove_ripple(&mut plateaus, plan);
    Ok(FrictionCurve { plateaus, ripple, duration: done * dt, complete })
}

/// The plateaus of a running measurement.
struct Plateaus<'a> {
    plan: &'a FrictionPlan<f64>,
    balance: Balance<'a>,
    /// Gets each plateau.
    watch: &'a Watch,
    /// Their velocities [rad/s], by marks from 1 on.
    speeds: Vec<f64>,
    /// Mark of the last frame.
    mark: u32,
    /// Frames of the current plateau.
    frames: Vec<Frame>,
    ended: Vec<Plateau>,
}

impl Plateaus<'_> {
    /// Mark of the commands of a phase, from the phase before.
    fn mark(&mut self, phase: Phase, before: Phase) -> u32 {
        let Phase::Plateau(velocity) = phase else { return 0 };
        if phase != before {
            self.speeds.push(velocity);
        }
        self.speeds.len() as u32
    }

    fn see(&mut self, frame: &Frame) {
        if frame.command.mark != self.mark {
            self.end();
            self.mark = frame.command.mark;
        }
        if self.mark > 0 {
            self.frames.push(*frame);
        }
    }

    fn end(&mut self) {
        if self.mark > 0 {
            let velocity = self.speeds[self.mark as usize - 1];
            let whole_turns = velocity.abs() >= self.plan.whole_turns_from;
            let plateau = self.balance.evaluate(velocity, &self.frames, whole_turns);
            self.watch.part(&plateau);
            self.ended.push(plateau);
            self.frames.clear();
        }
        self.mark = 0;
    }
}

/// Gives the axis to a P-PI cascade as stiff as its delays allow, run in every tick, so that the controller under test
/// has no effect on the measurement.
///
/// # Errors
/// As [`design::speed_holder`].
pub fn hold_speed(bench: &mut dyn Bench) -> Result<(), Error> {
    let (model, dt) = (*bench.model(), bench.settings().tick_time());
    let limit = model.scaling.torque_per_volt * model.scaling.servo_limit;
    bench.set_control(design::speed_holder(limit, &model, dt)?, 1)
}

/// Gives every plateau the error of one common noise, that of the lowest frequencies of all plateaus: a short plateau
/// has too few of them for its own estimate.
fn share_noise(plateaus: &mut [Plateau]) {
    let slid = plateaus.iter().filter(|plateau| plateau.dropped.is_none());
    let low: Vec<[f64; 2]> =
        slid.flat_map(|plateau| plateau.noise).filter(|[frequency, _]| *frequency <= NOISE_BAND).collect();
    if low.is_empty() {
        return;
    }
    for plateau in plateaus {
        plateau.standard_error = standard_error(low.iter(), plateau.averaging_time);
    }
}

/// Refers the slow plateaus, which cover an arc only, to the mean over a turn, by the angle dependence of the own
/// friction common to the fast plateaus; the load motor's torque has none. Returns the largest amplitude.
fn remove_ripple(plateaus: &mut [Plateau], plan: &FrictionPlan<f64>) -> f64 {
    // Speeds at which the velocity loop still follows a harmonic: six times the slowest whole turn.
    let fast: Vec<[[f64; 2]; HARMONICS]> = plateaus
        .iter()
        .filter(|plateau| plateau.dropped.is_none() && plateau.velocity.abs() <= 6.0 * plan.whole_turns_from)
        .filter_map(|plateau| plateau.harmonics)
        .collect();
    if fast.len() < 3 {
        return 0.0;
    }
    let n = fast.len() as f64;
    let mut common = [[0.0; 2]; HARMONICS];
    for order in 0..HARMONICS {
        let mean = [0, 1].map(|part| fast.iter().map(|h| h[order][part]).sum::<f64>() / n);
        let scatter: f64 = fast.iter().map(|h| (h[order][0] - mean[0]).powi(2) + (h[order][1] - mean[1]).powi(2)).sum();
        let error = (scatter / (n - 1.0) / n).sqrt();
        if libm::hypot(mean[0], mean[1]) > SIGNIFICANT * error {
            common[order] = mean;
        }
    }
    let (a, b) = (plan.arc_begin, plan.arc_begin + plan.arc);
    let mut factor = 1.0;
    for (order, [cos, sin]) in common.iter().enumerate() {
        let k = (order + 1) as f64;
        // Mean of cos·cos kφ + sin·sin kφ over the arc.
        let (sin_a, cos_a) = libm::sincos(k * a);
        let (sin_b, cos_b) = libm::sincos(k * b);
        factor += (cos * (sin_b - sin_a) - sin * (cos_b - cos_a)) / (k * plan.arc);
    }
    for plateau in plateaus.iter_mut().filter(|plateau| plateau.harmonics.is_none()) {
        plateau.torque = plateau.own / factor + (plateau.torque - plateau.own);
        plateau.standard_error /= factor;
    }
    common.iter().map(|[cos, sin]| libm::hypot(*cos, *sin)).fold(0.0, f64::max)
}
