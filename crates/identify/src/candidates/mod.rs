//! Forces beside inertia, Coulomb and viscous friction, each only where unseen parts of the recording are predicted
//! better with it; and what limits the result: drift, motion in one direction, resonance, a command that contains the
//! injected signal.

mod drift;
mod injected;
mod load;
mod periodic;
mod resonance;
mod weight;

pub use drift::Drift;
pub(crate) use injected::{contains_injected, without_injected};
pub use load::LoadFriction;
pub use periodic::PeriodicForce;
pub use resonance::Resonance;
pub use weight::Weight;

use super::balance::{Balance, Delay, Directions, HELD, Solved, Terms, Timing, add};
use super::rigid::{Asymmetric, Symmetric};
use crate::machine::Axis;
use stickslip_base::Error;
use stickslip_fit::LinearFit;

/// What the balance of forces found beside mass and friction.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// Delay of the position against the command.
    pub delay: Delay,
    /// Friction that grows with the transmitted force.
    pub load: Option<LoadFriction>,
    /// A torque that follows the angle of a rotary axis.
    pub weight: Option<Weight>,
    /// A periodic force over position.
    pub periodic: Option<PeriodicForce>,
    /// Coefficients that differ between the halves of the recording.
    pub drift: Vec<Drift>,
    /// The only direction with motion: +1 or −1.
    pub only: Option<i8>,
    /// A mode of vibration in the residuals.
    pub resonance: Option<Resonance>,
    /// Whether neither a set-point nor an injected force explains the motion.
    pub no_known_cause: bool,
    /// Whether the recorded command already contained the injected signal.
    pub injected_in_command: bool,
}

impl Findings {
    /// The findings, a sentence or two each.
    pub fn sentences(&self, axis: Axis) -> Vec<String> {
        let mut all = Vec::new();
        all.extend(self.delay.sentence());
        all.extend(self.load.as_ref().map(LoadFriction::sentence));
        all.extend(self.weight.as_ref().map(Weight::sentence));
        all.extend(self.periodic.as_ref().map(|it| it.sentence(axis)));
        all.extend(Drift::sentence(&self.drift, axis));
        all.extend(self.resonance.as_ref().map(Resonance::sentence));
        if let Some(only) = self.only {
            let (moved, other) = if only > 0 { ("positive", "negative") } else { ("negative", "positive") };
            all.push(format!(
                "The axis moves in {moved} direction only: friction against {other} velocity is not identifiable and \
                 is left out. model.toml uses the friction against {moved} velocity for both. A constant force is part \
                 of the Coulomb friction. Record motion in both directions."
            ));
        }
        if self.no_known_cause {
            all.push(
                "No recorded set-point and no injected force explains the motion: disturbances that the controller feeds \
                 back bias mass and friction, and the delay most. The intervals were doubled for it. Record the set-point, \
                 and name it in [columns]."
                    .into(),
            );
        }
        if self.injected_in_command {
            all.push(
                "The recorded command already contains the injected signal: the balance of forces fits much better \
                 without adding it again. It was subtracted to obtain the command of the controller."
                    .into(),
            );
        }
        all
    }
}

/// Both forms of the balance with the forces that were found.
pub(crate) struct Balanced {
    pub(crate) symmetric: Symmetric,
    pub(crate) asymmetric: Asymmetric,
    pub(crate) findings: Findings,
    /// The balance of the asymmetric form.
    pub(crate) solved: Solved,
}

/// The delay, then the extra forces, then mass and friction with both.
///
/// # Errors
/// A motion that does not determine mass and friction.
pub(crate) fn balance(balance: &Balance<'_>) -> Result<Balanced, Error> {
    let first = timed(balance, &balance.plain())?;
    let directions = first.terms.directions;
    let extra = extra(balance, &first);
    let whole = balance.whole();
    let is_plain = !extra.load && extra.waves.is_empty();
    let solved = match first.terms.timing.count() {
        // A large force that the terms lack hides the delay.
        0 if !is_plain => timed(balance, &extra).unwrap_or(first),
        _ => balance.solve(&extra.with(first.terms.timing), &whole).unwrap_or(first),
    };
    let is_late = balance.is_late(&solved);
    let solved = if is_late { balance.lagging(solved) } else { solved };
    let delay = balance.delay(&solved, is_late);
    let drift = drift::drift(balance, &solved);
    let alike = balance.solve(&Terms { directions: both(directions), ..solved.terms.clone() }, &whole)?;
    let mut symmetric = body(&balance.for_any_sample(&alike), SYMMETRIC);
    let mut asymmetric = body(&balance.for_any_sample(&solved), ASYMMETRIC);
    for Drift { index, halves, .. } in &drift {
        let ci95 = &mut asymmetric.ci95[*index];
        *ci95 = [ci95[0].min(halves[0][0]).min(halves[1][0]), ci95[1].max(halves[0][1]).max(halves[1][1])];
    }
    if drift.iter().any(|drift| drift.index == 0) {
        symmetric.ci95[0] = asymmetric.ci95[0];
    }
    let findings = Findings {
        delay,
        load: load::found(&solved),
        weight: weight::found(&solved),
        periodic: periodic::found(balance, &solved),
        drift,
        only: if let Directions::Only(only) = directions { Some(only) } else { None },
        resonance: resonance::found(balance, &solved),
        no_known_cause: balance.is_past,
        injected_in_command: false,
    };
    Ok(Balanced {
        symmetric: Symmetric { fit: symmetric },
        asymmetric: Asymmetric { fit: asymmetric },
        findings,
        solved,
    })
}

/// Some terms with their delay.
///
/// # Errors
/// A motion that does not determine mass and friction.
fn timed(balance: &Balance<'_>, terms: &Terms) -> Result<Solved, Error> {
    let solved = balance.search(terms)?;
    // A long delay that predicts nothing better is a wrong minimum.
    let is_wrong = (solved.terms.timing.total() - HELD).abs() > 1.0 && !balance.is_late(&solved);
    if is_wrong { balance.solve(&terms.with(Timing::held(HELD)), &balance.whole()) } else { Ok(solved) }
}

/// The terms with those extra forces that predict unseen parts of the recording significantly better.
fn extra(balance: &Balance<'_>, first: &Solved) -> Terms {
    let plain = weight::with(balance, first.terms.with(first.terms.timing.fixed()));
    let load = Terms { load: true, ..plain.clone() };
    let mut all = vec![plain.clone()];
    if let Some(waves) = periodic::search(balance, &plain) {
        all.push(Terms { waves, ..plain.clone() });
    }
    all.push(load.clone());
    if let Some(waves) = periodic::search(balance, &load) {
        all.push(Terms { waves, ..load });
    }
    let chosen = balance.gains(&all).unwrap_or(0);
    let mut terms = all.swap_remove(chosen);
    // Where the controller feeds strong disturbances back, predictions of the force judge badly: both halves decide.
    terms.load |= load::is_in_both_halves(balance, &Terms { load: true, ..terms.clone() });
    // A load share that may be 0 is not reported.
    let is_clear = |terms: &Terms| {
        balance.solve(terms, &balance.whole()).is_ok_and(|solved| !terms.load || load::found(&solved).is_some())
    };
    if is_clear(&terms) { terms } else { Terms { load: false, ..terms } }
}

pub(crate) fn both(directions: Directions) -> Directions {
    if directions == Directions::Each { Directions::Both } else { directions }
}

/// Error of differences and interpolation, as a share of a coefficient: no interval is narrower.
const NUMERICAL: f64 = 1e-4;
const SYMMETRIC: usize = 4;
const ASYMMETRIC: usize = 5;

/// Mass and friction of a solved balance in their usual order; not a number where the motion has none.
fn body(solved: &Solved, count: usize) -> LinearFit {
    let missing = usize::MAX;
    let places: Vec<usize> = match solved.terms.directions {
        Directions::Only(only) if count == ASYMMETRIC => {
            if only > 0 {
                vec![0, 1, 2, missing, missing]
            } else {
                vec![0, missing, missing, 1, 2]
            }
        }
        Directions::Only(_) => vec![0, 1, 2, missing],
        _ => (0..count).collect(),
    };
    let pick = |values: &[f64]| places.iter().map(|i| values.get(*i).copied().unwrap_or(f64::NAN)).collect();
    let mut fit = solved.fit.clone();
    for i in 0..fit.coefficients.len() {
        let error = NUMERICAL * fit.coefficients[i].abs();
        add(&mut fit, i, error);
    }
    LinearFit {
        coefficients: pick(&fit.coefficients),
        covariance: places.iter().map(|i| fit.covariance.get(*i).map_or_else(|| pick(&[]), |row| pick(row))).collect(),
        standard_errors: pick(&fit.standard_errors),
        white_standard_errors: pick(&fit.white_standard_errors),
        ci95: places.iter().map(|i| fit.ci95.get(*i).copied().unwrap_or([f64::NAN; 2])).collect(),
        ..fit
    }
}
