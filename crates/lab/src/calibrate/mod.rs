//! The bench identifies itself: scales, masses, coupling, lags, the load motor, and its own friction.
//!
//! Three experiments through converters and counters alone. Both motors are excited by multisines while the axis turns
//! fast, each way; friction is measured at constant speeds; the load is shaken at rest, far below breakaway. In the first
//! and the last the drive is a linear system, fitted to everything that was measured at once (output error), friction
//! at constant speeds comes from [`measure_friction`]. What the software believes is where the search starts.
//!
//! # What can be known
//!
//! Angles come from the encoder's lines and the clock, absolutely; with them tacho and accelerometer calibrate
//! themselves. The load motor's K_L is its back-EMF, volts over rad/s, and thereby its torque per current. Every
//! torque of the bench, inertias and stiffness with them, is measured against that torque: their scale is no truer than
//! the current sensor's volts per ampere, and K_L and R no truer than the gain of the load amplifier. Both are taken from
//! the data sheet. The friction of the drive motor itself is entered, not measured. An offset of the load amplifier looks
//! like one of the current sensor. The delay of the computation, one tick, is known; what is estimated are the lags of
//! servo amplifier and tacho behind it.

mod fit;
mod outcome;
mod parameters;
mod record;
mod response;

pub use outcome::{Calibration, Identified, Trace};
pub use record::CalibrationPlan;

use parameters::Index;
use response::CHANNELS;

use crate::bench::{Bench, Command};
use crate::experiment::{FrictionCurve, FrictionPlan, hold_speed, measure_friction};
use crate::fit::{CurvePoint, StribeckFit, fit_stribeck};
use crate::preset::{Model, Settings};
use crate::{Error, Watch};

/// Plan of the friction measurement within a calibration.
pub fn friction_plan() -> FrictionPlan<f64> {
    FrictionPlan { slowest: 0.2, fastest: 40.0, speeds: 11.0, settling_time: 0.2, ..FrictionPlan::default() }
}

impl CalibrationPlan<f64> {
    /// Bench time that a calibration takes [s], without homing.
    pub fn bench_time(&self, model: &Model<f64>, settings: &Settings<f64>) -> f64 {
        let friction = friction_plan().duration(0.0, settings.tick_time());
        self.turning_time(model.own.stribeck_velocity) + friction + self.resting_time()
    }
}

/// Calibrates a bench that is homed and running.
///
/// # Errors
/// [`Error::NotHomed`]; [`Error::BenchFault`]; [`Error::Cancelled`]; [`Error::TooFew`] where too few plateaus slid.
pub fn calibrate(plan: &CalibrationPlan<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<Calibration, Error> {
    if bench.safety().zero().is_none() {
        return Err(Error::NotHomed);
    }
    let (model, settings) = (*bench.model(), *bench.settings());
    let dt = settings.tick_time();
    let first = bench.step(Command::default())?.cycle;
    hold_speed(bench)?;
    let turning = record::turning(plan, bench, watch);
    bench.set_controller(settings.controller, settings.divider());
    let mut segments = turning?;
    let curve = measure_friction(&friction_plan(), bench, false, watch)?;
    let [breakaway_torque, ..] = curve.fit()?.parameters;
    segments.extend(record::resting(plan, breakaway_torque, bench, watch)?);
    let last = bench.step(Command::default())?.cycle;

    let setting = fit::Setting { dt, carriage_ratio: model.drive.carriage_ratio(), ripple_order: 0 };
    let start = parameters::coordinates(&parameters::start(&model));
    let solution = fit::fit(start, segments, setting, rough(&model), watch)?;
    let torque_per_volt = parameters::values(&solution.coordinates)[Index::TorquePerVolt as usize];
    let own = own_friction(&curve, &model, torque_per_volt / model.scaling.torque_per_volt)?;
    Ok(Calibration::new(&model, &solution, curve, own, (last - first) as f64 * dt))
}

/// How far the channels may be off before the model is near: ten counts, 1 rad/s, a twentieth of g, 50 mA.
fn rough(model: &Model<f64>) -> [f64; CHANNELS] {
    let scaling = &model.scaling;
    [10.0 * model.encoder.resolution(), scaling.tacho, 0.5 * scaling.accelerometer, 0.05]
}

/// The Stribeck curve of a measurement that took the servo's data sheet for true; its torques are `scale` times as large.
fn own_friction(curve: &FrictionCurve, model: &Model<f64>, scale: f64) -> Result<StribeckFit, Error> {
    let scaled = |point: CurvePoint| {
        // What the motor itself rubs was subtracted in true torque.
        let motor = model.motor_friction.steady_torque(point.velocity, 0.0, 0.0);
        let standard_error = point.standard_error * scale;
        CurvePoint { torque: (point.torque + motor) * scale - motor, standard_error, ..point }
    };
    let points: Vec<CurvePoint> = curve.points().into_iter().map(scaled).collect();
    fit_stribeck(&points, &FrictionCurve::FIT)
}
