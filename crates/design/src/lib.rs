//! Design of observers and controllers: from the parameters of a machine and a sampling time to the parameters of the
//! blocks.
//!
//! Plain `f64`, may fail, runs when parameters change and never in the tick. Linear algebra is nalgebra's.
//!
//! ```
//! use stickslip_design::velocity_observer;
//!
//! // Three poles at 250 1/s, a screw lead of 5 mm and a tick of 0.25 ms.
//! let observer = velocity_observer([250.0; 3], 0.005, 0.25e-3)?;
//! assert!(observer.screw_ratio > 1256.0 && observer.screw_ratio < 1257.0);
//! # Ok::<(), stickslip_base::Error>(())
//! ```
#![forbid(unsafe_code)]

mod arm;
mod axis_control;
mod controller_kind;
mod controllers;
mod discretise;
mod drive_observer;
mod error;
mod hunting;
mod law;
pub mod linear;
mod lyapunov;
mod margin;
mod matrices;
mod placement;
mod position_loop;
mod predictive;
mod region;
mod riccati;
mod software;
mod speed_holder;
mod state_feedback;
mod velocity_observer;

pub use arm::{ArmLimit, arm_limit, arm_rendering};
pub(crate) use axis_control::notch;
pub use axis_control::{axis_control, position_controller, torque_filter};
pub use axis_control::{preview, setpoint_features};
pub use controller_kind::{as_cascade, as_pid, as_predictive, as_state_feedback};
pub use controllers::{cascade_as_pid, current_control, pid_by_bandwidth, predictive_current_control};
pub use discretise::zero_order_hold;
pub use drive_observer::modelled_drive;
pub use drive_observer::{Trust, drive_observer, motion_observer};
pub use error::DesignError;
pub use hunting::{
    Described, Hunting, HuntingPlan, HuntingPrediction, ModelledAxis, Standstill, describe, equivalent_damping,
    predict_hunting,
};
pub use law::named_law;
pub use lyapunov::{discrete_lyapunov, spectral_radius};
pub use margin::{
    CHATTER_LIMIT, LARGEST_DELAY, LARGEST_GAIN, Margin, STIFFNESSES, desired_stiffness, margin, stiffness_limit,
};
pub use matrices::linear_controller;
pub use placement::{ObserverForm, observer_gain, place_poles};
pub use position_loop::{
    CORNER_LIMIT, CORNERS, Corner, LoopQuality, NOISE_LIMIT, PositionLoop, SENSITIVITY_LIMIT, Tuned, check_delays,
    corners, tune,
};
pub use predictive::predictive;
pub use region::{Band, Bound, CAUTION, FASTEST, Feasible, Limit, Passage, Region, Shortage, Verdict, fastest};
pub use riccati::{
    KalmanFilter, Regulator, continuous_regulator, kalman_bucy_filter, kalman_filter, linear_quadratic_regulator,
};
pub use software::{brake, difference_torque, load_current_control, parameters, software};
pub use speed_holder::speed_holder;
pub(crate) use speed_holder::velocity_gain;
pub use state_feedback::state_feedback;
pub use velocity_observer::{predicted_velocity_noise, velocity_noise, velocity_observer};

#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector};

use stickslip_base::Error;

/// `Err` unless minimum ≤ value ≤ maximum; NaN is an error.
pub fn within(
    name: &'static str,
    value: f64,
    unit: &'static str,
    range: (f64, f64),
    remedy: &'static str,
) -> Result<(), Error> {
    let (minimum, maximum) = range;
    if (minimum..=maximum).contains(&value) {
        Ok(())
    } else {
        Err(Error::OutOfRange { name, value, unit, minimum, maximum, remedy })
    }
}

/// Accepted sampling times of a drive: 1 µs to 1 s.
pub(crate) fn sampling_time(dt: f64) -> Result<(), Error> {
    within("the sampling time", dt, "s", (1e-6, 1.0), "Give the period in seconds: 1/tick_rate.")
}

/// `Err` with the first element of a matrix that is not finite.
pub(crate) fn finite(what: &'static str, matrix: &DMatrix<f64>) -> Result<(), Error> {
    match matrix.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(Error::NotFinite { what, value }),
        None => Ok(()),
    }
}

/// `Err` unless the matrix is square and finite; its order.
pub(crate) fn square(what: &'static str, matrix: &DMatrix<f64>) -> Result<usize, Error> {
    let (columns, expected) = (matrix.ncols(), matrix.nrows());
    if columns != expected {
        let remedy = "A system matrix must have as many columns as rows.";
        return Err(Error::Dimension { what, found: columns, expected, remedy });
    }
    finite(what, matrix)?;
    Ok(expected)
}

/// `Err` unless the vector has as many elements as the system has states.
fn as_long_as_states(what: &'static str, vector: &DVector<f64>, states: usize) -> Result<(), Error> {
    if vector.len() != states {
        let remedy = "It must have one element for each state.";
        return Err(Error::Dimension { what, found: vector.len(), expected: states, remedy });
    }
    match vector.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(Error::NotFinite { what, value }),
        None => Ok(()),
    }
}
