//! The friction bench as a library: measure, fit, design, render, re-measure, rank, report.
//!
//! Users import this crate. Each module is re-exported from the crate of its subject.
//!
//! ```
//! use stickslip::bench::VirtualBench;
//! use stickslip::experiment::{FrictionPlan, home, measure_friction};
//! use stickslip::{Preset, Watch, parameters};
//!
//! let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
//! let mut bench = VirtualBench::new(&preset, 1)?;
//! home(&mut bench, &Watch::silent())?;
//! let curve = measure_friction(&FrictionPlan::quick(), &mut bench, false, &Watch::silent())?;
//! for (name, value) in curve.fit()?.lines() {
//!     println!("{name}: {value}");
//! }
//! # Ok::<(), stickslip::Error>(())
//! ```
#![forbid(unsafe_code)]

pub use stickslip_base::{Error, Summary, Watch};
pub use stickslip_base::{
    figure, filter, noise, output, parameters, quantity, report, shell, stability, summary, units, watch,
};
pub use stickslip_bench as bench;
pub use stickslip_bench::BenchError;
pub use stickslip_bench::{external, realtime, run, tuning};
pub use stickslip_design::DesignError;
pub use stickslip_experiment as experiment;
pub use stickslip_experiment::ExperimentError;
pub use stickslip_experiment::{calibrate, demo, library, load, true_friction, workflow};
pub use stickslip_fit as fit;
pub use stickslip_fit::FitError;
pub use stickslip_fit::uncertainty;
pub use stickslip_generate as generate;
pub use stickslip_generate::GenerateError;
pub use stickslip_identify as identify;
pub use stickslip_identify::IdentifyError;
pub use stickslip_identify::{curve_file, machine};
pub use stickslip_live as live;
pub use stickslip_live::LiveError;
pub use stickslip_live::{catalogue, xcp};
pub use stickslip_recording as recording;
pub use stickslip_recording::RecordingError;
pub use stickslip_recording::capture;
pub use stickslip_simulate::SimulateError;
pub use stickslip_simulate::{fast_bench, integrator, simulation};
pub use stickslip_study as study;
pub use stickslip_study::{benchmark, fidelity};

/// Columns of numbers with units, and their files.
pub mod table {
    pub use stickslip_base::table::*;
    pub use stickslip_recording::table::*;
}

/// Observers, controllers, rendering laws, margins and renderable regions.
pub mod design {
    pub use stickslip_design::*;
    pub use stickslip_simulate::rendering_law;
}
pub use stickslip_design::linear;

pub use stickslip_base::{
    AdaptiveChoice, ArmDamping, AssumedFriction, CompensationChoice, ControllerChoice, ControllerMatrices, CurveChoice,
    DampedArm, DisturbanceObserverChoice, Disturbances, DriveModelTrust, FeedforwardChoice, FilterChoice,
    FrictionObserverChoice, FriedlandParkChoice, LawChoice, Model, ModelUncertainty, NetworkChoice, NotchChoice,
    Observation, ObserverChoice, Poles, PredictiveFeedback, Preset, Quadratic, Regulation, Residual, Settings,
    ShaperChoice, StateFeedback, Tracking, Vibration,
};
