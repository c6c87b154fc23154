//! Trial: the controller under test follows a motion on the bench, several times, and each repetition is scored.
//!
//! The motions are those of the controller benchmark, or positions of a file; the scores are those of the benchmark. The
//! benchmark judges the true angle of a virtual machine. A bench has an encoder: its deviation is set-point minus
//! measured angle, its speed the measured way within ±50 ms.
//!
//! ```
//! use stickslip_base::{Preset, Watch, parameters};
//! use stickslip_bench::VirtualBench;
//! use stickslip_experiment::home;
//! use stickslip_experiment::trial::{TrialMotion, TrialPlan, run_trial};
//! use stickslip_simulate::manoeuvre::Manoeuvre;
//!
//! let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
//! let mut bench = VirtualBench::new(&preset, 1)?;
//! home(&mut bench, &Watch::silent())?;
//! let motion = TrialMotion::Manoeuvre(Manoeuvre::FastSine);
//! let plan = TrialPlan { motion: &motion, repetitions: 2, render: false, origin: 0.0 };
//! let trial = run_trial(&plan, &preset, &mut bench, &Watch::silent())?;
//! assert!(trial.complete && trial.repetitions.len() == 2);
//! println!("{:?}", trial.repetitions[0].scores);
//! # Ok::<(), stickslip_base::Error>(())
//! ```

mod motion;
mod run;

pub use motion::{PositionFile, TrialMotion, gentle, travel};
pub use run::{Repetition, Trial, TrialPlan, run_repetition, run_trial};
