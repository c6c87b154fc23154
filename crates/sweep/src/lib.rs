//! Sweeps: an ideal axis under control, with a thousand values of its parameters.
//!
//! An axis is two masses and one contact with bristles ([`stickslip_core::ideal`]), under a law that reads the motor's
//! encoder and tacho and whose torque is held from sample to sample. No currents, no noise, no supervision: for those
//! take a study (`stickslip_study`), which runs the whole bench, at a thousandth of the speed.
//!
//! The steps are chosen by the program for each variant alone: it runs a variant on ever finer rungs until two of them
//! agree ([`Course::error`]), and refuses one on which they never do. Variants run side by side in the widest vectors of
//! the processor, each with the bits that it has alone: neither its neighbours, nor their order, nor the number of threads
//! show in a result.
//!
//! ```
//! use stickslip_sweep::{Arithmetic, Plan, Variant, sweep};
//! use stickslip_core::control::Cascade;
//! use stickslip_core::drive::TwoMass;
//! use stickslip_core::friction::{ElastoPlastic, LuGre};
//! use stickslip_core::ideal::IdealAxis;
//!
//! // How far a slow sine is missed, by the stiffness of the position control.
//! let variants: Vec<_> = [10.0, 20.0, 30.0]
//!     .map(|position_gain| {
//!         let lugre = LuGre { bristle_stiffness: 3000.0, ..LuGre::default() };
//!         Variant {
//!             axis: IdealAxis {
//!                 mechanics: TwoMass::default(),
//!                 motor_viscous: 0.0,
//!                 load_viscous: lugre.sliding.viscous_friction,
//!                 bristle: ElastoPlastic { lugre, ..ElastoPlastic::default() },
//!             },
//!             law: Cascade { position_gain, ..Cascade::default() },
//!         }
//!     })
//!     .into();
//! let sine = |sample: usize| 0.2 * (std::f64::consts::TAU * 1e-3 * sample as f64).sin();
//! let plan = Plan {
//!     sample_time: 1e-3,
//!     reference: (0..=2000).map(sine).collect(),
//!     tolerance: 1e-4,
//!     arithmetic: Arithmetic::Double,
//!     threads: 2,
//! };
//! let missed = sweep(&variants, &plan, |course| {
//!     let deviations = course.angle.iter().zip(&plan.reference).map(|(angle, wanted)| (angle - wanted).abs());
//!     (deviations.fold(0.0, f64::max), course.error)
//! })?;
//! let missed: Vec<(f64, f64)> = missed.into_iter().collect::<Result<_, _>>()?;
//! assert!(missed[0].0 > missed[1].0 && missed[1].0 > missed[2].0);
//! assert!(missed.iter().all(|(_, error)| *error <= 1e-4));
//! # Ok::<(), stickslip_base::Error>(())
//! ```
#![forbid(unsafe_code)]

mod error;
mod kind;
mod ladder;
mod number;
mod run;
mod spread;
#[cfg(test)]
mod tests;

pub use error::SweepError;
pub use kind::{SweptFriction, SweptLaw};
pub use ladder::{RUNGS, Rung};
use ladder::{apart, estimate, hopeless};
pub use number::Number;
use run::Team;
use spread::{Pool, Work, spread};
use stickslip_core::ideal::IdealAxis;

use stickslip_base::Error;

/// An axis and its law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variant<B, C> {
    /// The axis.
    pub axis: IdealAxis<f64, B>,
    /// Its controller.
    pub law: C,
}

/// In which numbers a sweep runs. What it comes to is judged by the same estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Arithmetic {
    /// `f64`.
    #[default]
    Double,
    /// `f32`, of a variant that needs many steps `f64` in the end: twice as many variants at once. Its rounding is in the
    /// error that a course states.
    Single,
}

/// What is done with each variant, from rest at angle 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Time from sample to sample of the law [s].
    pub sample_time: f64,
    /// Wanted angle at each sample [rad]; the first is at rest.
    pub reference: Vec<f64>,
    /// Largest error of the load's angle, over its largest magnitude.
    pub tolerance: f64,
    /// In which numbers.
    pub arithmetic: Arithmetic,
    /// Threads.
    pub threads: usize,
}

/// What became of a variant.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Angle of the load at each sample [rad].
    pub angle: Vec<f64>,
    /// Deflection of the bristles at each sample [rad].
    pub deflection: Vec<f64>,
    /// Estimated error of the angle, over its largest magnitude; infinite where nothing has been compared.
    pub error: f64,
    /// The rung that it was computed on.
    pub rung: Rung,
}

/// From this rung on a sweep is in `f64`: few climb so far, and their many steps would round often.
const DOUBLE: usize = 4;

/// `measure` of each variant's course, in the order of the variants; an error where the finest rungs disagree.
///
/// # Errors
/// [`Error::OutOfRange`] for a plan that cannot be run; of a variant [`SweepError::Unresolved`].
pub fn sweep<B: SweptFriction, C: SweptLaw, R: Send>(
    variants: &[Variant<B, C>],
    plan: &Plan,
    measure: impl Fn(&Course) -> R + Sync,
) -> Result<Vec<Result<R, Error>>, Error> {
    plan.check()?;
    let mut found: Vec<Option<Result<R, Error>>> = variants.iter().map(|_| None).collect();
    let mut open: Vec<Open> = sorted(variants).into_iter().map(|index| Open { index, coarser: None }).collect();
    for step in 1..RUNGS.len() {
        let arithmetic = if step < DOUBLE { plan.arithmetic } else { Arithmetic::Double };
        let climb = Climb { variants, plan, step, measure: &measure };
        let climbed = spread::<B, _, _>(&open, plan.threads, arithmetic, &climb)?;
        let indices: Vec<usize> = open.iter().map(|open| open.index).collect();
        open = Vec::new();
        for (index, climbed) in indices.into_iter().zip(climbed) {
            match climbed {
                Climbed::Done(value) => found[index] = Some(Ok(value)),
                Climbed::Refused(error) => {
                    found[index] = Some(Err(SweepError::Unresolved { index, error, tolerance: plan.tolerance }.into()));
                }
                Climbed::Open(angle, error) => open.push(Open { index, coarser: Some((angle, error)) }),
            }
        }
        if open.is_empty() {
            break;
        }
    }
    Ok(found.into_iter().map(|outcome| outcome.expect("each variant is done or refused on the last rung")).collect())
}

/// A variant that no two rungs agree on yet.
struct Open {
    index: usize,
    /// Its angles on the rung below and the error estimated there, above the first two.
    coarser: Option<(Vec<f64>, f64)>,
}

/// What became of it on the next rung.
enum Climbed<R> {
    Done(R),
    /// No rung can have an estimate within the tolerance any more; the one here.
    Refused(f64),
    /// Its angles here, and the estimate that is too large.
    Open(Vec<f64>, f64),
}

/// Runs variants on a rung, at the begin of the ladder on the one below too, and compares.
struct Climb<'a, B, C, M> {
    variants: &'a [Variant<B, C>],
    plan: &'a Plan,
    step: usize,
    measure: &'a M,
}

impl<B: SweptFriction, C: SweptLaw, R: Send, M: Fn(&Course) -> R + Sync> Work<Open> for Climb<'_, B, C, M> {
    type Done = Climbed<R>;

    fn run<T: Number>(&self, open: &[Open], pool: &Pool<T>) -> Vec<Climbed<R>> {
        let members: Vec<Variant<B, C>> = open.iter().map(|open| self.variants[open.index]).collect();
        let team = Team::new(&members, self.plan);
        let mut fine = pool.take();
        team.run(RUNGS[self.step], &mut fine);
        let mut differences = Vec::new();
        if self.step == 1 {
            let mut coarse = pool.take();
            team.run(RUNGS[0], &mut coarse);
            differences = coarse.apart(&fine, open.len());
            pool.put_back(coarse);
        }
        let courses = fine.courses(open.len());
        pool.put_back(fine);
        let outcome = |(lane, (open, course)): (usize, (&Open, [Vec<f64>; 2]))| {
            let error = match &open.coarser {
                None => estimate(differences[lane], None),
                Some((coarser, before)) => estimate(apart(coarser, &course[0]), Some(*before)),
            };
            self.judged(course, error)
        };
        open.iter().zip(courses).enumerate().map(outcome).collect()
    }
}

impl<B, C, R, M: Fn(&Course) -> R> Climb<'_, B, C, M> {
    fn judged(&self, [angle, deflection]: [Vec<f64>; 2], error: f64) -> Climbed<R> {
        let (tolerance, above) = (self.plan.tolerance, RUNGS.len() - 1 - self.step);
        if error <= tolerance {
            let course = Course { angle, deflection, error, rung: RUNGS[self.step] };
            Climbed::Done((self.measure)(&course))
        } else if above == 0 || hopeless(error, above, tolerance) {
            Climbed::Refused(error)
        } else {
            // An error that is no number too: finer steps may give one.
            Climbed::Open(angle, error)
        }
    }
}

/// `measure` of each variant's course on one rung, in the order of the variants: for who knows which one will do.
/// Nothing is compared, so that the error of each course is infinite; what is no number stays in it.
///
/// # Errors
/// [`Error::OutOfRange`] for a plan that cannot be run.
pub fn on_rung<B: SweptFriction, C: SweptLaw, R: Send>(
    variants: &[Variant<B, C>],
    plan: &Plan,
    rung: Rung,
    measure: impl Fn(&Course) -> R + Sync,
) -> Result<Vec<R>, Error> {
    plan.check()?;
    let order = sorted(variants);
    let stand = Stand { variants, plan, rung, measure: &measure };
    let done = spread::<B, _, _>(&order, plan.threads, plan.arithmetic, &stand)?;
    let mut found: Vec<Option<R>> = variants.iter().map(|_| None).collect();
    for (index, value) in order.iter().zip(done) {
        found[*index] = Some(value);
    }
    Ok(found.into_iter().map(|value| value.expect("each variant is in a team")).collect())
}

/// Runs variants on one rung.
struct Stand<'a, B, C, M> {
    variants: &'a [Variant<B, C>],
    plan: &'a Plan,
    rung: Rung,
    measure: &'a M,
}

impl<B: SweptFriction, C: SweptLaw, R: Send, M: Fn(&Course) -> R + Sync> Work<usize> for Stand<'_, B, C, M> {
    type Done = R;

    fn run<T: Number>(&self, indices: &[usize], pool: &Pool<T>) -> Vec<R> {
        let members: Vec<Variant<B, C>> = indices.iter().map(|index| self.variants[*index]).collect();
        let mut samples = pool.take();
        Team::new(&members, self.plan).run(self.rung, &mut samples);
        let courses = samples.courses(indices.len());
        pool.put_back(samples);
        let measured = |[angle, deflection]: [Vec<f64>; 2]| {
            (self.measure)(&Course { angle, deflection, error: f64::INFINITY, rung: self.rung })
        };
        courses.into_iter().map(measured).collect()
    }
}

/// The variants in the order of their numbers, the law's first: who moves alike, sticks at the same time.
fn sorted<B: SweptFriction, C: SweptLaw>(variants: &[Variant<B, C>]) -> Vec<usize> {
    let keys: Vec<Vec<f64>> = variants
        .iter()
        .map(|Variant { axis, law }| {
            let mut key = kind::numbers(&law.over::<f64>());
            key.extend(kind::numbers(&axis.bristle.over::<f64>()));
            key.extend(kind::numbers(&axis.mechanics));
            key.extend([axis.motor_viscous, axis.load_viscous]);
            key
        })
        .collect();
    let mut order: Vec<usize> = (0..variants.len()).collect();
    let compare = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    };
    order.sort_by(|a, b| compare(&keys[*a], &keys[*b]));
    order
}

impl Plan {
    fn check(&self) -> Result<(), Error> {
        let within = |name, value: f64, unit, minimum, maximum, remedy| {
            if (minimum..=maximum).contains(&value) {
                return Ok(());
            }
            Err(Error::OutOfRange { name, value, unit, minimum, maximum, remedy })
        };
        within("the sample time", self.sample_time, "s", 1e-6, 0.1, "A law runs at 10 Hz to 1 MHz.")?;
        let least = if self.arithmetic == Arithmetic::Single { 1e-5 } else { 1e-9 };
        within("the tolerance", self.tolerance, "1", least, 0.1, "Single precision cannot resolve less than 1e-5.")?;
        within("the reference", self.reference.len() as f64, "samples", 2.0, 1e8, "Give it samples.")?;
        // Not `max` alone, which passes over NaN.
        let bounded = self.reference.iter().all(|angle| angle.is_finite());
        let largest =
            self.reference.iter().fold(if bounded { 0.0 } else { f64::INFINITY }, |most, a| a.abs().max(most));
        within("the reference", largest, "rad", 0.0, 1e6, "Give an angle at each sample.")
    }
}
