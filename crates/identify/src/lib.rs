//! Inertia and friction of an axis from a recording, with their errors.
//!
//! Two methods for the same recording. The balance of forces is linear and requires no start values; it gives inertia,
//! Coulomb and viscous friction and the friction curve. Where the controller is known, the closed loop is simulated and
//! richer models are fitted to the recorded command. The best model is selected on samples that its fit did not use, by
//! [`choose`]. Published values of the machine file are not used.
//!
//! ```
//! use std::path::Path;
//! use stickslip_identify::machine::Machine;
//!
//! let machine = r#"
//!     name = "axis"
//!     axis = "linear"
//!     sampling_period = { value = 1, unit = "ms" }
//!     [columns]
//!     position = { name = "q", unit = "m" }
//!     velocity_gain = 3
//! "#;
//! // An unknown key is an error with its place and the known keys.
//! assert!(Machine::parse(Path::new("axis.toml"), machine).is_err());
//! ```
#![forbid(unsafe_code)]

mod axis;
mod balance;
mod candidates;
pub mod cross_validation;
mod curve;
pub mod curve_file;
mod error;
mod exchanged;
mod figures;
mod files;
mod held;
mod limits;
pub mod machine;
mod model_file;
mod models;
mod motion;
mod parameters;
mod preset;
mod recorded;
mod refine;
mod report;
mod results;
mod rigid;
pub mod servo;
mod validate;

pub use axis::{AxisModel, Bristles, ClosedLoop, Loop, Prediction, coulomb};
pub use balance::Delay;
pub use candidates::{Drift, Findings, LoadFriction, PeriodicForce, Resonance, Weight};
pub use curve::{FrictionCurve, Plateau};
pub use error::IdentifyError;
pub use files::feedforward_csv;
pub use model_file::{IdentifiedModel, model_toml, read_model};
pub use models::{Candidate, Kind};
pub use motion::{Motion, Regression, force_error};
pub use parameters::{ParameterLine, parameter_lines};
pub use recorded::{DONE, done};
pub use refine::{CLOSED_LOOP, Refined};
pub use report::report;
pub use results::{summary, write};
pub use rigid::{ASYMMETRIC, Asymmetric, SYMMETRIC, Symmetric};
pub use validate::{Validation, validate};

use crate::balance::Balance;
use crate::candidates::Balanced;
use crate::machine::{Axis, Machine, Signals};
use stickslip_base::quantity::Estimate;
use stickslip_base::{Error, Watch};
use stickslip_fit::{Choice, Side, StribeckFit, StribeckPlan, choose, fit_stribeck};
use stickslip_recording::Recording;

/// Result of the identification of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// Linear or rotary: determines the units.
    pub axis: Axis,
    /// Lifted mass of a vertical axis.
    pub lift: Option<Lift>,
    /// One Coulomb and viscous friction for both directions, and an offset.
    pub symmetric: Symmetric,
    /// One friction for each direction.
    pub asymmetric: Asymmetric,
    /// What the balance of forces found beside mass and friction.
    pub findings: Findings,
    /// Friction over speed.
    pub curve: FrictionCurve,
    /// Stribeck fit of the curve for positive and for negative velocity; none where it has fewer than five points.
    pub stribeck: [Option<StribeckFit>; 2],
    /// Models of rising richness, each judged on samples that its fit did not use.
    pub candidates: Vec<Candidate>,
    /// The best model, and the one to use: a richer one only where it is significantly better.
    pub choice: Choice,
    /// Closed loop of the best model over the whole recording; none where the controller is unknown.
    pub closed_loop: Option<ClosedLoop<f64>>,
    /// SI unit of the command.
    pub command_unit: &'static str,
    /// The recording in SI units.
    pub signals: Signals,
    /// Its motion, with the force delayed as the position is.
    pub motion: Motion,
}

/// Load of a vertical axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lift {
    /// Lifted mass, where it is known [kg].
    pub mass: Option<f64>,
}

/// Identifies an axis from a recording.
///
/// # Errors
/// A recording that does not match the machine file or is too short, a motion that does not determine the parameters,
/// an inertia that is not positive; [`Error::Cancelled`].
pub fn identify(recording: &Recording, machine: &Machine, watch: &Watch) -> Result<Identification, Error> {
    watch.stage("balance of forces", 0.0)?;
    let mut signals = held::choose(machine.signals(recording)?, machine);
    let (samples, recipe) = (signals.position.len(), machine.recipe);
    let needed = 2 * (recipe.skip + 30 * recipe.decimation);
    if samples < needed {
        let remedy = "Record longer: two halves, so that one validates the other.";
        return Err(Error::TooFew { what: "samples in the recording", found: samples, needed, remedy });
    }
    let contains_injected = candidates::contains_injected(&signals, machine)?;
    if contains_injected {
        signals = candidates::without_injected(signals);
    }
    let mut motion = Motion::of(&signals, machine)?;
    let mut symmetric = None;
    if machine.vertical {
        let weighed = candidates::balance(&Balance::of(&motion, &signals, machine)?)?.symmetric;
        let offset = weighed.fit.coefficients[3];
        if offset.is_finite() {
            motion.unload(offset);
        }
        symmetric = Some(weighed);
    }
    let balance = Balance::of(&motion, &signals, machine)?;
    let around = Loop::of(&signals, &motion, machine);
    let by_balance = || ByBalance::of(&balance, &signals, machine);
    let (ByBalance { balanced, aligned, curve, stribeck }, fits) =
        models::beside(by_balance, &motion, around.as_ref(), recipe, watch)?;
    let (candidates, mut closed_loops) = match &around {
        Some(around) => models::judged(fits, around, recipe.skip, watch)?,
        None => (models::by_forces(&balance, &balanced.solved, motion.offset)?, Vec::new()),
    };
    let folds: Vec<Vec<f64>> = candidates.iter().map(|candidate| candidate.folds.clone()).collect();
    let choice = choose(&folds).expect("there are candidates, each judged on the same blocks");
    let closed_loop = around.map(|_| closed_loops.swap_remove(choice.chosen));
    Ok(Identification {
        axis: machine.axis,
        lift: machine.vertical.then_some(Lift { mass: machine.lifted_mass }),
        symmetric: symmetric.unwrap_or(balanced.symmetric),
        asymmetric: balanced.asymmetric,
        curve,
        stribeck,
        candidates,
        choice,
        closed_loop,
        command_unit: machine.drive.command.si_unit(),
        findings: Findings { injected_in_command: contains_injected, ..balanced.findings },
        motion: aligned,
        signals,
    })
}

/// Results of the balance of forces.
struct ByBalance {
    balanced: Balanced,
    aligned: Motion,
    curve: FrictionCurve,
    stribeck: [Option<StribeckFit>; 2],
}

impl ByBalance {
    /// # Errors
    /// A motion that does not determine mass and friction; an inertia that is not positive; exchanged columns.
    fn of(balance: &Balance<'_>, signals: &Signals, machine: &Machine) -> Result<Self, Error> {
        let balanced = candidates::balance(balance)?;
        let fit = &balanced.asymmetric.fit;
        let mass = fit.coefficients[0];
        let is_plausible = mass > 0.0;
        exchanged::refuse(signals, machine, is_plausible.then_some(fit.relative_error))?;
        if !is_plausible {
            let remedy = "The command moves the axis the other way: reverse the sign of drive.gain, or check whether a \
                          column counts against the motion. A force that depends on the position, a spring or a weight \
                          on an arm, is not part of the model and has the same effect.";
            return Err(IdentifyError::Implausible { what: "the identified inertia", value: mass, remedy }.into());
        }
        let aligned = balance.aligned(&balanced.solved);
        let sliding = balance.sliding(&balanced.solved, &aligned);
        let curve = FrictionCurve::of(&sliding, mass, machine.recipe.low_pass, machine.recipe.skip);
        let stribeck = [Side::Positive, Side::Negative]
            .map(|side| fit_stribeck(&curve.points, &StribeckPlan { side, ..StribeckPlan::default() }).ok());
        Ok(ByBalance { balanced, aligned, curve, stribeck })
    }
}

impl Identification {
    /// The model to use.
    pub fn best(&self) -> &Candidate {
        &self.candidates[self.choice.chosen]
    }

    /// How much greater the squared error of a candidate is than the smallest, in per cent of it and with its 95 %
    /// interval, on samples that no fit used; none for the one with the smallest.
    pub fn behind(&self, candidate: usize) -> Option<Estimate> {
        let [share, half_width] = self.choice.share_behind(candidate)?;
        Some(Estimate::new(100.0 * share, "%").with_half_width(100.0 * half_width))
    }

    /// Weight of the lifted mass [N], and the rest of the constant force; only where both are known.
    pub fn weight(&self) -> Option<[f64; 2]> {
        /// Standard acceleration of free fall [m/s²].
        const GRAVITY: f64 = 9.80665;
        let mass = self.lift.filter(|_| self.axis == Axis::Linear)?.mass?;
        // The sign of the constant force determines the upward direction.
        let offset = self.symmetric.fit.coefficients[3];
        let weight = (GRAVITY * mass).copysign(offset);
        Some([weight, offset - weight])
    }

    /// Whether the friction curve shows M_S > M_K, in both directions.
    pub fn stribeck_identifiable(&self) -> bool {
        self.stribeck.iter().all(|fit| fit.as_ref().is_some_and(|f| f.drop.is_identified()))
    }

    /// The verdict on a Stribeck drop for positive and for negative velocity.
    pub fn stribeck_verdicts(&self) -> [String; 2] {
        let too_few = || "fewer than five speeds: no Stribeck drop is identifiable; record more".to_owned();
        self.stribeck.each_ref().map(|fit| fit.as_ref().map_or_else(too_few, |f| f.drop.to_string()))
    }
}

#[cfg(test)]
mod simulated;
#[cfg(test)]
mod tests;
