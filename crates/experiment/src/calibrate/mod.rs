//! Calibration of the bench by itself: scales, masses, coupling, lags, the load motor, and its own friction.
//!
//! Three experiments through converters and counters alone. Both motors are excited by multisines while the axis turns
//! fast in each direction; friction is measured at constant speeds; the load is shaken at rest, far below breakaway. In
//! the first and the last the drive is a linear system, fitted to all channels at once (output error), friction at
//! constant speeds comes from [`measure_friction`]. The search starts at the controller's model.
//!
//! `record.rs` executes the runs, `segment.rs` simulates pieces of them, `response.rs` is the linear drive that is
//! fitted, `uncertainty.rs` computes the intervals. The study of the intervals is `cargo xtask study calibration`.
//!
//! # What is identifiable
//!
//! Angles come from the encoder's lines and the clock, absolutely; with them tacho and accelerometer calibrate
//! themselves. The load motor's K_L is its back-EMF, volts over rad/s, and thereby its torque per current. Every
//! torque of the bench, inertias and stiffness with them, is measured against that torque: their scale is as accurate
//! as the current sensor's volts per ampere, and K_L and R as accurate as the gain of the load amplifier. Both are
//! taken from the data sheet. The integrator of the virtual machine has an effect here: its steps of 25 µs shift a
//! millisecond's lags by 1 µs and inertias by a thousandth, more than the intervals of a quiet bench; with steps of 5
//! µs the effect vanishes. The friction of the drive motor itself is entered, not measured. An offset of the load
//! amplifier cannot be distinguished from one of the current sensor. The computing delay is known, one tick; the lags
//! of servo amplifier and tacho behind it are estimated. A bench without accelerometer and tacho is identified by
//! encoder and current alone.
//!
//! Drives on a fieldbus act later than the next tick. Where the load amplifier takes a torque, or the model has a
//! delay, the delays of both amplifiers are estimated, too. Such an amplifier has no voltage that could calibrate its
//! torque: K_L is then taken from the data sheet, and with it the scale of all torques.

mod delayed;
mod fit;
mod identified;
mod least_squares;
mod noise;
mod outcome;
mod parameters;
mod record;
mod response;
mod segment;
mod tacho_ripple;
mod uncertainty;

pub use identified::Identified;
pub use outcome::{Calibration, Trace};
pub use record::CalibrationPlan;

use parameters::{Amplifiers, Index};
use response::CHANNELS;

use crate::{FrictionCurve, FrictionPlan, give_back, hold_speed, measure_friction};
use stickslip_base::preset::{Model, ObserverChoice, Settings};
use stickslip_base::{Error, Watch};
use stickslip_bench::{Bench, Command};
use stickslip_fit::{CurvePoint, StribeckFit, fit_stribeck};

/// Least number of segments with a sliding and with a resting load.
const SEGMENTS: usize = 3;

/// Torque constants of motors that turn a bench [N m/A].
const LOAD_MOTORS: [f64; 2] = [1e-4, 10.0];

/// Plan of the friction measurement within a calibration.
pub fn friction_plan() -> FrictionPlan<f64> {
    FrictionPlan { slowest: 0.2, fastest: 40.0, speeds: 11.0, settling_time: 0.2, ..FrictionPlan::default() }
}

impl CalibrationPlan<f64> {
    /// Bench time of a calibration [s], without homing.
    pub fn bench_time(&self, model: &Model<f64>, settings: &Settings<f64>) -> f64 {
        let friction = friction_plan().duration(0.0, settings.tick_time());
        self.turning_time(model.own.stribeck_velocity) + friction + self.resting_time()
    }
}

/// Checks that a bench has the devices that a calibration requires.
///
/// # Errors
/// [`Error::OutOfRange`] without a load motor.
pub fn calibratable(model: &Model<f64>) -> Result<(), Error> {
    let [minimum, maximum] = LOAD_MOTORS;
    let value = model.load_motor.torque_constant;
    if value < minimum {
        let (name, unit) = ("the torque constant of the load motor", "N m/A");
        let remedy = "All torques are referred to the load motor; without one, identify the axis from a recording.";
        return Err(Error::OutOfRange { name, value, unit, minimum, maximum, remedy });
    }
    Ok(())
}

/// Calibrates a homed, running bench.
///
/// # Errors
/// As [`calibratable`]; [`Error::NotHomed`]; [`Error::BenchFault`]; [`Error::Cancelled`]; [`Error::TooFew`] if the load
/// slid on too few plateaus, or if too few segments are without a missed tick.
pub fn calibrate(plan: &CalibrationPlan<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<Calibration, Error> {
    let (model, settings) = (*bench.model(), *bench.settings());
    calibratable(&model)?;
    if bench.zero().is_none() {
        return Err(Error::NotHomed);
    }
    let dt = settings.tick_time();
    let first = bench.step(Command::default())?.cycle;
    hold_speed(bench)?;
    let turning = record::turning(plan, bench, watch);
    let mut segments = give_back(bench, turning)?;
    let curve = measure_friction(&friction_plan(), bench, false, watch)?;
    let rubbed = curve.fit()?.curve();
    segments.extend(record::resting(plan, rubbed.breakaway_torque, bench, watch)?);
    enough(&segments)?;
    let last = bench.step(Command::default())?.cycle;

    let has_instruments = settings.observer == ObserverChoice::Accelerometer;
    let carriage_ratio = model.drive.carriage_ratio();
    let amplifiers = Amplifiers::new(&model, &settings);
    let setting = segment::Setting { dt, carriage_ratio, ripple_order: 0, amplifiers, has_instruments, rubbed };
    let start = parameters::coordinates(&parameters::start(&model));
    let solution = fit::fit(start, segments, setting, rough(&model, has_instruments), watch)?;
    let at = parameters::values(&solution.coordinates);
    let own = own_friction(&curve, &model, amplifiers, &at)?;
    Ok(Calibration::new(&model, &solution, curve, own, (last - first) as f64 * dt))
}

/// Checks that missed ticks have left enough of the runs.
fn enough(segments: &[segment::Segment]) -> Result<(), Error> {
    let stuck = segments.iter().filter(|segment| segment.is_stuck()).count();
    let found = stuck.min(segments.len() - stuck);
    if found < SEGMENTS {
        let what = "segments without a missed tick";
        let remedy = "Reduce the missed ticks (stickslip doctor), or shorten the segments (plan.segment).";
        return Err(Error::TooFew { what, found, needed: SEGMENTS, remedy });
    }
    Ok(())
}

/// Residuals of the channels assumed before the model is near: ten counts, 1 rad/s, a twentieth of g, 50 mA; infinite
/// for a channel that the bench does not have.
fn rough(model: &Model<f64>, has_instruments: bool) -> [f64; CHANNELS] {
    let scaling = &model.scaling;
    let of = |deviation| if has_instruments { deviation } else { f64::INFINITY };
    [10.0 * model.encoder.resolution(), of(scaling.tacho), of(0.5 * scaling.accelerometer), 0.05]
}

/// The Stribeck curve of a measurement by the torque scale of the data sheet, mean of both directions.
fn own_friction(
    curve: &FrictionCurve,
    model: &Model<f64>,
    amplifiers: Amplifiers,
    at: &[f64; parameters::PARAMETERS],
) -> Result<StribeckFit, Error> {
    let scale = at[Index::TorquePerVolt as usize] / model.scaling.torque_per_volt;
    // Our current control holds a measured current of 0: the sensor's offset flows.
    let offset = if amplifiers.take_torque { 0.0 } else { at[Index::CurrentOffset as usize] };
    let load_torque = -at[Index::TorqueConstant as usize] * offset;
    let corrected = |point: CurvePoint| {
        // The motor's own friction was subtracted in true torque.
        let motor = model.motor_friction.steady_torque(point.velocity, 0.0, 0.0);
        let torque = (point.torque + motor) * scale - motor - load_torque;
        CurvePoint { torque, standard_error: point.standard_error * scale, ..point }
    };
    let points: Vec<CurvePoint> = curve.points().into_iter().map(corrected).collect();
    fit_stribeck(&symmetric(&points), &FrictionCurve::FIT)
}

/// Points without the part common to both directions, offset and asymmetry, which a symmetric curve cannot have: each
/// point is corrected by half the difference to its counterpart at the opposite velocity; points without one are
/// dropped.
fn symmetric(points: &[CurvePoint]) -> Vec<CurvePoint> {
    let mean = |point: &CurvePoint| {
        let opposite = |other: &&CurvePoint| (other.velocity / point.velocity + 1.0).abs() < 0.1;
        let other = points.iter().find(opposite)?;
        let standard_error = libm::hypot(point.standard_error, other.standard_error) * std::f64::consts::FRAC_1_SQRT_2;
        Some(CurvePoint { torque: 0.5 * (point.torque - other.torque), standard_error, ..*point })
    };
    points.iter().filter_map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symmetric_curve_leaves_out_the_part_common_to_both_directions() {
        let point = |velocity: f64, torque: f64| CurvePoint { velocity, torque, standard_error: 1e-3 };
        let points = symmetric(&[point(1.0, 0.25), point(-1.01, -0.15), point(7.0, 0.3)]);
        assert_eq!(points.iter().map(|p| p.torque).collect::<Vec<_>>(), [0.2, -0.2]);
        assert!((points[0].standard_error / 1e-3 - 1.0).abs() < 1e-12);
    }
}
