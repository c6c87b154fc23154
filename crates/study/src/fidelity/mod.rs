//! Trajectory equivalence: how much a controller's motion with rendered friction differs from that with true friction.
//!
//! The same controller, reference and sensor noise act on three machines:
//!
//! - **A** has the desired friction. Its load motor gives no torque, whatever its current; the rotor's inertia and
//!   its cogging stay.
//! - **A0** has its own friction. Its load motor is disabled in the same way.
//! - **B** is A0 with an active load motor and rendering law.
//!
//! ```text
//! E = RMS(φ_B − φ_A) / RMS(φ_A0 − φ_A)
//! ```
//!
//! on the true angle φ: 0 is indistinguishable, 1 is as if nothing were rendered. Noise alone sets a *floor*, A against
//! A with another seed: E below it has no meaning. With independent noise seeds in A and B, `excess = √max(0, mean E² −
//! mean floor²)` is the part that rendering adds. Limit cycles drift in phase: for hunting and stick-slip the
//! amplitude, the interval and the number of breakaways are compared instead.
//!
//! This benchmark uses the true machine, which experiments must not.
//!
//! ```
//! use stickslip_study::fidelity::{TestBed, Cell, Mismatch, Role, Runs, Scenario, scores};
//! use stickslip_base::Watch;
//! use stickslip_core::render::Law;
//!
//! let mut cell = TestBed::find("prototype")?.cell(true, 4000.0, Mismatch::PERFECT);
//! let bench = &cell.preset;
//! cell.law = Law::Paper(stickslip_design::difference_torque(&bench.bench.desired, &bench.model, &bench.bench));
//! let (scenarios, seeds, threads) = ([Scenario::SINE_2HZ], [1, 2], 1);
//! let run = |role| Runs::simulate(&cell, role, &scenarios, &seeds, threads, &Watch::silent());
//! let scores = scores(&run(Role::Rendered)?, &run(Role::Desired)?, &run(Role::Own)?);
//! assert!(scores[0].difference < 0.2, "{scores:?}");
//! # Ok::<(), stickslip_base::Error>(())
//! ```

mod corrected;
mod plan;
mod report;
mod study;
mod test_bed;

pub use plan::{Group, Plan, Selection, by_name};
pub use stickslip_simulate::fidelity::*;
pub use study::{Outcome, Row, run_plan};
pub use test_bed::TestBed;

#[cfg(test)]
mod tests;
