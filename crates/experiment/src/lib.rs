//! Experiments: named recipes that run on any [`Bench`].
//!
//! A plan is a struct of parameters, an experiment a function, a result is data with uncertainty. The same recipe runs
//! on the virtual bench and on hardware; it does not use the inside of the virtual machine.
//!
//! A cancelled experiment returns its data so far, marked as not `complete`; without any data it fails with
//! [`Error::Cancelled`].
//!
//! ```
//! use stickslip_base::{Preset, Watch, parameters};
//! use stickslip_bench::VirtualBench;
//! use stickslip_experiment::{FrictionPlan, home, measure_friction};
//!
//! let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
//! let mut bench = VirtualBench::new(&preset, 1)?;
//! home(&mut bench, &Watch::silent())?;
//! let curve = measure_friction(&FrictionPlan::quick(), &mut bench, false, &Watch::silent())?;
//! assert!(curve.fit()?.parameters[0] > 0.25);
//! # Ok::<(), stickslip_base::Error>(())
//! ```
#![forbid(unsafe_code)]

mod breakaway;
pub mod calibrate;
pub mod demo;
mod error;
mod friction;

mod learning;
pub mod library;
pub mod load;
mod missed;
mod next_speeds;
mod part;
mod plan;
mod plateau;
mod presliding;
mod rendering;
mod response;
mod tracking;
pub mod trial;
pub mod true_friction;
pub mod workflow;

pub use breakaway::{Breakaway, BreakawayPlan, Mean, Ramp, measure_breakaway};
pub use error::ExperimentError;
pub use friction::hold_speed;
pub use friction::{FrictionCurve, measure_friction};
pub use learning::{Learned, LearningPlan, Repetition, learn_torque};
pub use next_speeds::{Addition, Goal, next_speeds};
pub use part::Part;
pub use plan::{FrictionPlan, Phase};
pub use plateau::{Block, Dropped, Plateau};
pub use presliding::{Loop, Presliding, PreslidingPlan, measure_presliding};
pub use rendering::{
    PreloadAdvice, Pressed, advise_preload, advise_preload_from, expected_deviation, expected_inside_fade,
    sweep_through_standstill,
};
pub use response::{Answer, COHERENT, Line, Response, ResponsePlan, measure_response};
pub use stickslip_bench::home;
pub use tracking::{Followed, Motion, Tracked, TrackedSample, TrackingPlan, record_tracking};

use stickslip_base::Error;
use stickslip_bench::{Bench, Change};
use stickslip_design as design;

/// Standard uncertainty of a uniformly distributed value, over the width of its range: 1/√12 (GUM, 4.3.7).
const UNIFORM: f64 = 0.288_675_134_594_812_9;

/// Gives the axis back to the controller under test; after a cancellation it is stopped first.
///
/// # Errors
/// The error of the experiment, or of the stop.
pub(crate) fn give_back<R>(bench: &mut dyn Bench, ended: Result<R, Error>) -> Result<R, Error> {
    if matches!(ended, Err(Error::Cancelled)) {
        bench.come_to_rest()?;
    }
    let settings = *bench.settings();
    let mut parameters = *bench.parameters();
    parameters.tick.control = design::axis_control(bench.model(), &settings)?;
    parameters.tick.control_period = settings.control_period();
    bench.change(Change::Parameters(parameters))?;
    ended
}

/// `true` if an experiment was completed, `false` if it was cancelled with data.
///
/// # Errors
/// Any failure, and [`Error::Cancelled`] without data.
fn completed(ended: Result<(), Error>, gained: bool) -> Result<bool, Error> {
    match ended {
        Err(Error::Cancelled) if gained => Ok(false),
        ended => ended.map(|()| true),
    }
}
