//! The friction bench as a library: measure, fit, design, render, re-measure, rank, report.
#![forbid(unsafe_code)]

pub mod bench;
pub mod benchmark;
pub mod calibrate;
pub mod capture;
pub mod catalogue;
pub mod curve_file;
pub mod demo;
pub mod design;
mod error;
pub mod experiment;
pub mod fidelity;
pub mod figure;
pub mod filter;
pub mod fit;
pub mod foreign;
pub mod generate;
pub mod identify;
pub mod integrator;
mod isolated;
pub mod judged;
pub mod library;
pub mod linear;
pub mod live;
pub mod machine;
pub mod noise;
pub mod output;
mod parallel;
pub mod parameters;
mod preset;
pub mod quantity;
pub mod realtime;
pub mod recording;
pub mod report;
pub mod run;
pub mod simulation;
mod statistics;
pub mod study;
pub mod summary;
pub mod sweep;
pub mod table;
pub mod truth;
pub mod tuning;
pub mod uncertainty;
pub mod units;
pub mod watch;
pub mod workflow;
pub mod xcp;

pub use error::Error;
pub use preset::{
    AdaptiveChoice, ArmDamping, Belief, CompensationChoice, ControllerChoice, ControllerMatrices, CurveChoice,
    DampedArm, DisturbanceObserverChoice, Disturbances, Doubt, FeedforwardChoice, FilterChoice, FrictionObserverChoice,
    FriedlandParkChoice, LawChoice, Model, NetworkChoice, NotchChoice, Observation, Poles, PredictiveFeedback, Preset,
    Quadratic, Regulation, Residual, Settings, ShaperChoice, StateFeedback, Tracking, Vibration,
};
pub use summary::Summary;
pub use watch::Watch;
