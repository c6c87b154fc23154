//! The criterion of a tuning: one controller on all machines on which it must work.
//!
//! What does not depend on the controller is computed once: the machines, a common grid of frequencies, and the machines'
//! responses there. A controller has one response for all of them.

use std::f64::consts::PI;

use nalgebra::{Complex, DMatrix};
use stickslip_core::control::AxisControl;

use super::{CORNER_LIMIT, CORNERS, NOISE_LIMIT, Operating, PositionLoop, SENSITIVITY_LIMIT, noise_torque, size};
use crate::linear::{StateSpace, axis_under_control, port};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};

/// Evaluated time of the angle after a step of the load torque [s].
const HORIZON: f64 = 2.0;
/// Penalty for exceeding a limit, per share of it, and for an unstable loop.
const PRICE: f64 = 30.0;
const UNSTABLE: f64 = 1e3;
/// Price of gains without a design.
pub(super) const WORST: f64 = PRICE * UNSTABLE;
/// A grid of frequencies misses the very top of a peak.
const GRID: f64 = 0.995;
/// Lowest frequency of the grid [rad/s], and its points per decade: a peak of the damping 0.1 is missed by at most 0.2 %.
const SLOWEST: f64 = 1.0;
const DENSITY: f64 = 200.0;
/// Damping of a mode of the machine below which the grid is denser around it.
const WEAKLY_DAMPED: f64 = 0.2;

/// The machines on which a controller is evaluated, at the same frequencies [rad/s].
pub(super) struct TestBeds {
    beds: Vec<TestBed>,
    frequencies: Vec<f64>,
}

/// A machine on which a controller is evaluated.
struct TestBed {
    axis: StateSpace,
    /// From commanded torque to angle and tacho, at the frequencies of the grid.
    response: Vec<[Complex<f64>; 2]>,
    limit: f64,
}

impl TestBeds {
    /// The modelled machine, sliding and stuck, and its corners.
    pub(super) fn new(model: &Model<f64>, settings: &Settings<f64>, velocity: f64) -> Result<Self, Error> {
        let mut axes = Vec::new();
        for at in [Operating::Sliding(velocity), Operating::Stuck] {
            axes.push((axis_under_control(model, settings, at)?, SENSITIVITY_LIMIT));
            for load_inertia in CORNERS {
                for coupling_stiffness in CORNERS {
                    let mut off = *model;
                    off.drive.load_inertia *= load_inertia;
                    off.drive.coupling_stiffness *= coupling_stiffness;
                    axes.push((axis_under_control(&off, settings, at)?, CORNER_LIMIT));
                }
            }
        }
        let frequencies = grid(axes.iter().map(|(axis, _)| axis))?;
        let infinite = Complex::new(f64::INFINITY, 0.0);
        let bed = |(axis, limit): (StateSpace, f64)| {
            let torque = axis.select(&[port::TORQUE], &[port::ANGLE, port::TACHO])?;
            let at_once = |g: Option<DMatrix<_>>| g.map_or([infinite; 2], |g| [g[(0, 0)], g[(1, 0)]]);
            let response = torque.responses(&frequencies).map(at_once).collect();
            Ok(TestBed { axis, response, limit })
        };
        Ok(TestBeds { beds: axes.into_iter().map(bed).collect::<Result<_, Error>>()?, frequencies })
    }
}

/// Frequencies up to half the sampling rate [rad/s]: evenly in the logarithm, and close together about each weakly
/// damped mode of the machines.
fn grid<'a>(axes: impl Iterator<Item = &'a StateSpace>) -> Result<Vec<f64>, Error> {
    let (mut top, mut all) = (SLOWEST, Vec::new());
    for axis in axes {
        top = axis.dt.map_or(top, |dt| PI / dt);
        let torque = axis.channel(port::TORQUE, port::ANGLE)?;
        let points = [torque.poles()?, torque.zeros().unwrap_or_default()].concat();
        for rate in axis.rates(&points) {
            let (centre, width) = (rate.im, rate.re.abs());
            // One of each pair.
            if width < WEAKLY_DAMPED * centre {
                all.extend((-12..=12).map(|k| centre + width * libm::sinh(f64::from(k) * 0.25)));
            }
        }
    }
    let count = (DENSITY * libm::log10(top / SLOWEST)).ceil();
    all.extend((0..=count as usize).map(|k| SLOWEST * libm::pow(top / SLOWEST, k as f64 / count)));
    all.retain(|frequency| (SLOWEST..=top).contains(frequency));
    all.sort_by(f64::total_cmp);
    all.dedup_by(|next, last| *next - *last <= 1e-4 * *last);
    Ok(all)
}

impl TestBed {
    /// Peak of the sensitivity on the grid, with the controller's response there.
    fn sensitivity(&self, controller: &[[Complex<f64>; 2]]) -> f64 {
        let difference = |(k, g): (&[Complex<f64>; 2], &[Complex<f64>; 2])| {
            (Complex::new(1.0, 0.0) - k[0] * g[0] - k[1] * g[1]).norm_sqr()
        };
        // NaN, on a pole of both, is left out.
        let least = controller.iter().zip(&self.response).map(difference).fold(f64::INFINITY, f64::min);
        1.0 / libm::sqrt(least)
    }
}

/// Result of a controller.
pub(super) struct Outcome {
    pub(super) absolute_error: f64,
    pub(super) peak: f64,
    pub(super) noise_torque: f64,
    /// Share by which it exceeds limits, all together.
    pub(super) beyond: f64,
}

/// The penalised criterion of a controller, and its result if all loops are stable.
pub(super) fn price(
    TestBeds { beds, frequencies }: &TestBeds,
    controller: &AxisControl<f64>,
    torque_limit: f64,
    model: &Model<f64>,
) -> Result<(f64, Option<Outcome>), Error> {
    let dt = beds.first().and_then(|bed| bed.axis.dt).unwrap_or(HORIZON);
    let controller = PositionLoop::controller(*controller, dt, 0.0)?;
    let (mut radius, mut first) = (0.0f64, None);
    for bed in beds {
        let closes = PositionLoop { axis: bed.axis.clone(), controller: controller.clone() };
        let closed = closes.closed()?;
        radius = closed.poles()?.iter().map(|&pole| size(pole)).fold(radius, f64::max);
        first = first.or(Some((closes, closed)));
    }
    let Some((closes, closed)) = first.filter(|_| radius < 1.0) else { return Ok((UNSTABLE * radius, None)) };
    let infinite = Complex::new(f64::INFINITY, 0.0);
    let at_once = |k: Option<DMatrix<_>>| k.map_or([infinite; 2], |k| [k[(0, 0)], k[(0, 1)]]);
    let response: Vec<[Complex<f64>; 2]> = closes.back()?.responses(frequencies).map(at_once).collect();
    let excess = |bed: &TestBed| (bed.sensitivity(&response) / (GRID * bed.limit) - 1.0).max(0.0);
    let mut beyond: f64 = beds.iter().map(excess).sum();
    let noise_torque = noise_torque(&closed, model)?;
    beyond += (noise_torque / (NOISE_LIMIT * torque_limit) - 1.0).max(0.0);
    let answers = closed.channel(2, 0)?.step_response((HORIZON / dt) as usize, dt)?;
    let absolute_error = dt * answers.iter().map(|angle| angle.abs()).sum::<f64>();
    let peak = answers.iter().fold(0.0, |peak: f64, angle| peak.max(angle.abs()));
    let criterion = libm::log(absolute_error) + 0.3 * libm::log(peak);
    Ok((criterion + PRICE * beyond, Some(Outcome { absolute_error, peak, noise_torque, beyond })))
}
