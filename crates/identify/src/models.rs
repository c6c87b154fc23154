//! The candidates, from a rigid body to bristles, each fitted and validated on other samples.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use super::axis::{AxisModel, Bristles, ClosedLoop, Loop, Prediction, coulomb};
use super::balance::{Balance, Directions, Solved, Terms};
use super::motion::{Motion, norm};
use super::refine::{LUGRE, Refined, STRIBECK, refine};
use super::rigid::{ASYMMETRIC, Asymmetric, SYMMETRIC, Symmetric};
use crate::machine::Recipe;
use stickslip_base::{Error, Watch, parallel};

/// Name of the longest stage.
const FIT: &str = "fit models in the closed loop";

/// Contiguous blocks of a half in which models are compared. A block is long compared with the correlation of the
/// residuals, and eight of them give the chance of a difference; more fits would take longer with little more
/// information.
const BLOCKS: usize = 4;

/// How rich a model is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Coulomb and viscous friction, the same both ways, and an offset.
    Symmetric,
    /// Coulomb and viscous friction for each direction.
    Asymmetric,
    /// The same, and a periodic force over position.
    Periodic,
    /// Coulomb and viscous friction for each direction, and a share of the drive force.
    Load,
    /// The same, and a periodic force over position.
    PeriodicLoad,
    /// A Stribeck curve for each direction, true stick, a lag of the drive.
    Stribeck,
    /// The same with bristles instead of stick.
    Lugre,
}

impl Kind {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Symmetric => "symmetric",
            Kind::Asymmetric => "asymmetric",
            Kind::Periodic => "periodic",
            Kind::Load => "load",
            Kind::PeriodicLoad => "periodic_load",
            Kind::Stribeck => "stribeck",
            Kind::Lugre => "lugre",
        }
    }

    /// Title.
    pub fn title(self) -> &'static str {
        match self {
            Kind::Symmetric => "Coulomb and viscous, both alike",
            Kind::Asymmetric => "Coulomb and viscous, each direction",
            Kind::Periodic => "Each direction, and a periodic force",
            Kind::Load => "Each direction, and a share of the force",
            Kind::PeriodicLoad => "Each direction, share of the force, periodic force",
            Kind::Stribeck => "Stribeck curve, each direction",
            Kind::Lugre => "LuGre bristles on Stribeck curves",
        }
    }

    /// Number of fitted parameters.
    pub fn parameters(self) -> usize {
        match self {
            Kind::Symmetric => SYMMETRIC.len(),
            Kind::Asymmetric => ASYMMETRIC.len(),
            // Sine, cosine and period; share.
            Kind::Periodic => ASYMMETRIC.len() + 3,
            Kind::Load => ASYMMETRIC.len() + 1,
            Kind::PeriodicLoad => ASYMMETRIC.len() + 4,
            Kind::Stribeck => STRIBECK,
            Kind::Lugre => LUGRE,
        }
    }
}

/// A fitted model and its errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Complexity.
    pub kind: Kind,
    /// Fitted to the whole recording.
    pub model: AxisModel<f64>,
    /// Errors of its parameters, if fitted in the closed loop.
    pub refined: Option<Refined>,
    /// Error on samples that the fit did not use, mean over both halves, each predicted by a fit to the other: of the
    /// command in the closed loop, ‖u − û‖/‖u‖, or of the force where the controller is unknown.
    pub held_out: f64,
    /// Mean squares of the same error in contiguous blocks of both halves: the folds for the choice of the model, in
    /// the squared SI unit of command or force.
    pub folds: Vec<f64>,
    /// The closed loop over the second half by the fit to the first.
    pub unseen: Option<ClosedLoop<f64>>,
    /// The closed loop over the whole recording.
    pub prediction: Option<Prediction>,
}

/// The candidates of a range of samples.
type Fits = Vec<(Kind, AxisModel<f64>, Option<Refined>)>;

/// The balance of forces and, where the controller is known, beside it the fits of all candidates to the whole recording
/// and to each half.
///
/// # Errors
/// Those of the balance first; [`Error::Cancelled`].
pub(super) fn beside<B: Send>(
    balance: impl Fn() -> Result<B, Error> + Sync,
    motion: &Motion,
    around: Option<&Loop<'_>>,
    recipe: Recipe,
    watch: &Watch,
) -> Result<(B, Vec<Fits>), Error> {
    let (samples, middle) = (motion.samples(), motion.samples() / 2);
    let Some(around) = around else { return Ok((balance()?, Vec::new())) };
    // The balance, and two fits in the closed loop on each of three stretches.
    let finished = AtomicU32::new(0);
    watch.stage(FIT, 0.0)?;
    let done = || watch.stage(FIT, f64::from(finished.fetch_add(1, Ordering::Relaxed) + 1) / 7.0);
    // What takes longest is first.
    let ranges = [recipe.skip..samples, recipe.skip..middle, middle..samples];
    let jobs: Vec<Option<Range<usize>>> = std::iter::once(None).chain(ranges.map(Some)).collect();
    let results = parallel::map(&jobs, parallel::processors(), |job| match job {
        None => Ok((Some(balance()?), done().map(|()| Vec::new())?)),
        Some(range) => Ok((None, fit_all(motion, around, range.clone(), &recipe, (watch, &done))?)),
    })?;
    let mut results = results.into_iter();
    let (balanced, _) = results.next().expect("one result for each job");
    Ok((balanced.expect("the first job is the balance"), results.map(|(_, fits)| fits).collect()))
}

/// Judges the candidates by their fits to the whole recording and to each half; also the closed loop of each over the
/// whole recording.
///
/// # Errors
/// [`Error::Cancelled`].
pub(super) fn judged(
    fits: Vec<Fits>,
    around: &Loop<'_>,
    skip: usize,
    watch: &Watch,
) -> Result<(Vec<Candidate>, Vec<ClosedLoop<f64>>), Error> {
    let (samples, middle) = (around.motion.samples(), around.motion.samples() / 2);
    // The first samples of each run are dropped: they still depend on its initial state.
    let drop = skip.saturating_sub(2);
    let simulate = |model: &AxisModel<f64>, range: Range<usize>| around.simulate(model, range, watch);
    watch.stage("judge the models", 0.0)?;
    let Ok([whole, by_first, by_second]) = <[Fits; 3]>::try_from(fits) else {
        unreachable!("the whole and two halves were fitted")
    };
    let fits: Vec<_> = whole.into_iter().zip(by_first).zip(by_second).collect();
    let judged = parallel::map(&fits, parallel::processors(), |((fit, first_fit), second_fit)| {
        let whole = simulate(&fit.1, 2..samples)?;
        let [unseen, other] = [simulate(&first_fit.1, middle..samples)?, simulate(&second_fit.1, 2..middle)?];
        let halves = [&unseen, &other];
        let candidate = Candidate {
            kind: fit.0,
            held_out: halves.iter().map(|half| 0.5 * around.compare(half, drop).voltage_error).sum(),
            folds: halves.iter().flat_map(|half| mean_squares(&around.misses(half, drop))).collect(),
            unseen: Some(unseen),
            prediction: Some(around.compare(&whole, drop)),
            model: fit.1,
            refined: fit.2.clone(),
        };
        Ok((candidate, whole))
    })?;
    Ok(judged.into_iter().unzip())
}

/// Mean squares over the blocks of a half.
fn mean_squares(missed: &[f64]) -> [f64; BLOCKS] {
    std::array::from_fn(|k| {
        let block = &missed[missed.len() * k / BLOCKS..missed.len() * (k + 1) / BLOCKS];
        block.iter().map(|error| error * error).sum::<f64>() / block.len() as f64
    })
}

/// The candidates of the balance of forces alone, each judged by the force of the half that its fit did not use.
pub(super) fn by_forces(balance: &Balance<'_>, solved: &Solved, offset: f64) -> Result<Vec<Candidate>, Error> {
    let timing = solved.terms.timing.fixed();
    let plain = |directions| Terms::of(directions, timing);
    let full = solved.terms.with(timing);
    let mut all = vec![plain(full.directions)];
    if full.directions == Directions::Each {
        all.insert(0, plain(Directions::Both));
    }
    if full.load || !full.waves.is_empty() {
        all.push(full);
    }
    let whole = balance.whole();
    let halves = balance.halves();
    let forces = balance.forces(timing);
    let judge = |terms: &Terms| {
        let fitted = halves.each_ref().map(|half| balance.solve(terms, half));
        let [by_first, by_second] = fitted;
        let mut held_out = 0.0;
        for (fit, unseen) in [(by_first?, &halves[1]), (by_second?, &halves[0])] {
            let (rows, missed) = balance.misses(&fit, unseen);
            let measured: Vec<f64> = rows.iter().map(|row| forces[*row]).collect();
            held_out += 0.5 * norm(&missed) / norm(&measured);
        }
        let kind = match (terms.directions, terms.load, terms.waves.is_empty()) {
            (Directions::Both, ..) => Kind::Symmetric,
            (_, false, true) => Kind::Asymmetric,
            (_, true, true) => Kind::Load,
            (_, false, false) => Kind::Periodic,
            (_, true, false) => Kind::PeriodicLoad,
        };
        let c = balance.solve(terms, &whole)?.fit.coefficients;
        let (positive, negative, constant) = match terms.directions {
            Directions::Both => (coulomb(c[2], c[1]), coulomb(c[2], c[1]), c[3]),
            Directions::Each => (coulomb(c[2], c[1]), coulomb(c[4], c[3]), 0.0),
            // The other direction has no data.
            Directions::Only(_) => (coulomb(c[2], c[1]), coulomb(c[2], c[1]), 0.0),
        };
        let model =
            AxisModel { inertia: c[0], positive, negative, offset: constant + offset, lag: 0.0, bristles: None };
        let folds = balance.folds(terms)?;
        Ok(Candidate { kind, model, refined: None, held_out, folds, unseen: None, prediction: None })
    };
    all.iter().map(judge).collect()
}

fn rigid(motion: &Motion, range: Range<usize>, recipe: &Recipe) -> Result<[(Kind, AxisModel<f64>); 2], Error> {
    let symmetric = Symmetric::identify(motion, range.clone(), recipe.decimation)?.fit.coefficients;
    let asymmetric = Asymmetric::identify(motion, range, recipe.decimation)?.fit.coefficients;
    let both = coulomb(symmetric[2], symmetric[1]);
    let body = |inertia, positive, negative, offset: f64| AxisModel {
        inertia,
        positive,
        negative,
        offset: offset + motion.offset,
        lag: 0.0,
        bristles: None,
    };
    let [mass, positive_viscous, positive, negative_viscous, negative] = asymmetric[..] else {
        unreachable!("the asymmetric model has five parameters")
    };
    let sides = [coulomb(positive, positive_viscous), coulomb(negative, negative_viscous)];
    Ok([
        (Kind::Symmetric, body(symmetric[0], both, both, symmetric[3])),
        (Kind::Asymmetric, body(mass, sides[0], sides[1], 0.0)),
    ])
}

/// All models from one range. Each starts from the one before, without other assumptions.
fn fit_all(
    motion: &Motion,
    around: &Loop<'_>,
    range: Range<usize>,
    recipe: &Recipe,
    (watch, done): (&Watch, &(impl Fn() -> Result<(), Error> + Sync)),
) -> Result<Fits, Error> {
    let bodies = rigid(motion, range.clone(), recipe)?;
    let asymmetric = bodies[1].1;
    let mut fits: Fits = bodies.map(|(kind, model)| (kind, model, None)).into();
    // Logarithms require positive parameters; a rigid body without them is not a start for a fit.
    let sides = [asymmetric.positive, asymmetric.negative];
    let is_positive = sides.iter().all(|s| s.kinetic_torque > 0.0 && s.viscous_friction > 0.0);
    if !(asymmetric.inertia > 0.0 && is_positive) {
        return Ok(fits);
    }
    let range = range.start.max(2)..range.end;
    let extent = |values: &[f64]| values.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v));
    let fastest = extent(&motion.velocity.iter().map(|v| v.abs()).collect::<Vec<_>>());
    let stroke = extent(&motion.position) + extent(&motion.position.iter().map(|q| -q).collect::<Vec<_>>());
    let mut start = AxisModel { lag: 0.3 * motion.period, ..asymmetric };
    for side in [&mut start.positive, &mut start.negative] {
        // A curve without drop or rise would give the Stribeck velocity no slope.
        side.breakaway_torque = 0.8 * side.kinetic_torque;
        side.stribeck_velocity = 0.1 * fastest;
    }
    let stribeck = refine::<STRIBECK>(around, &start, range.clone(), recipe.skip, watch)?;
    done()?;
    let mut start = stribeck.model;
    fits.push((Kind::Stribeck, stribeck.model, Some(stribeck)));
    let stiffness = start.positive.kinetic_torque / (1e-4 * stroke);
    let damping = 0.5 * (stiffness * start.inertia).sqrt();
    start.bristles = Some(Bristles::passive(stiffness, damping, [&start.positive, &start.negative]));
    let lugre = refine::<LUGRE>(around, &start, range, recipe.skip, watch)?;
    done()?;
    fits.push((Kind::Lugre, lugre.model, Some(lugre)));
    Ok(fits)
}
