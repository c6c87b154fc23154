//! Shared basis of stickslip: units and quantities with uncertainty, presets and parameter files, figures, tables and
//! reports, progress and cancellation, and the errors of all crates above.
//!
//! ```
//! use stickslip_base::{Error, Preset, parameters};
//!
//! let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
//! assert_eq!(preset.bench.tick_rate, 4000.0);
//! # Ok::<(), Error>(())
//! ```
#![forbid(unsafe_code)]

mod error;
pub mod excerpt;
pub mod figure;
pub mod filter;
pub mod input;
pub mod isolated;
pub mod noise;
pub mod output;
pub mod parallel;
pub mod parameters;
pub mod preset;
pub mod quantity;
pub mod report;
pub mod shell;
pub mod stability;
pub mod statistics;
pub mod summary;
pub mod table;
pub mod units;
pub mod watch;

pub use error::{Error, did_you_mean};
pub use excerpt::excerpt;
pub use preset::{
    AdaptiveChoice, ArmDamping, AssumedFriction, CompensationChoice, ControllerChoice, ControllerMatrices, CurveChoice,
    DampedArm, DisturbanceObserverChoice, Disturbances, DriveModelTrust, FeedforwardChoice, FilterChoice,
    FrictionObserverChoice, FriedlandParkChoice, LawChoice, Model, ModelUncertainty, NetworkChoice, NotchChoice,
    Observation, ObserverChoice, Poles, PredictiveFeedback, Preset, Quadratic, Regulation, Residual, Settings,
    ShaperChoice, StateFeedback, Tracking, Vibration,
};
pub use summary::Summary;
pub use watch::Watch;
