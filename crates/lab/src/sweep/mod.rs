//! Sweeps: an ideal axis under control, with a thousand values of its parameters.
//!
//! An axis is two masses and one contact with bristles ([`stickslip_core::ideal`]), under a law that reads the motor's
//! encoder and tacho and whose torque is held from sample to sample. No currents, no noise, no supervision: for those
//! take a study ([`crate::study`]), which runs the whole bench, at a thousandth of the speed.
//!
//! The steps are chosen by the program for each variant alone: it runs a variant on ever finer rungs until two of them
//! agree ([`Course::error`]), and refuses one on which they never do. Variants run side by side in the widest vectors of
//! the processor, each with the bits that it has alone: neither its neighbours, nor their order, nor the number of threads
//! show in a result.
//!
//! ```
//! use stickslip::sweep::{Arithmetic, Plan, Variant, sweep};
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
//! # Ok::<(), stickslip::Error>(())
//! ```

mod kind;
mod ladder;
mod number;
mod run;
#[cfg(test)]
mod tests;

use std::sync::Mutex;

pub use kind::{SweptFriction, SweptLaw};
pub use ladder::{RUNGS, Rung};
use ladder::{apart, estimate};
pub use number::Number;
use run::{Samples, Team};
use stickslip_core::ideal::IdealAxis;
use stickslip_core::scalar::Lanes;

use crate::{Error, parallel};

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
    /// `f32`: twice as many variants at once. Its rounding is in the error that a course states.
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

/// Variants side by side: four vectors of the widest registers, so that one computes while another waits.
const WIDTH: usize = 32;
/// As many variants run sooner one after the other.
const FEW: usize = 2;

/// `measure` of each variant's course, in the order of the variants; an error where the finest rungs disagree.
///
/// # Errors
/// [`Error::OutOfRange`] for a plan that cannot be run; of a variant [`Error::Unresolved`].
pub fn sweep<B: SweptFriction, C: SweptLaw, R: Send>(
    variants: &[Variant<B, C>],
    plan: &Plan,
    measure: impl Fn(&Course) -> R + Sync,
) -> Result<Vec<Result<R, Error>>, Error> {
    plan.check()?;
    let mut found: Vec<Option<Result<R, Error>>> = variants.iter().map(|_| None).collect();
    let pool = Pool::<B::Singles>::default();
    let mut open: Vec<Open> =
        sorted(variants).into_iter().map(|index| Open { index, coarser: None, error: 0.0 }).collect();
    for step in 1..RUNGS.len() {
        let size = if open.len() <= FEW { 1 } else { plan.abreast::<B>() };
        let teams: Vec<&[Open]> = open.chunks(size).collect();
        let done = parallel::map(&teams, plan.threads, |team| {
            Ok(match (size, plan.arithmetic) {
                (1, Arithmetic::Double) => climb::<f64, B, C, R>(variants, plan, step, team, &pool.doubles, &measure),
                (1, Arithmetic::Single) => climb::<f32, B, C, R>(variants, plan, step, team, &pool.singles, &measure),
                (_, Arithmetic::Double) => {
                    climb::<Lanes<f64, WIDTH>, B, C, R>(variants, plan, step, team, &pool.wide_doubles, &measure)
                }
                (_, Arithmetic::Single) => {
                    climb::<B::Singles, B, C, R>(variants, plan, step, team, &pool.wide_singles, &measure)
                }
            })
        })?;
        open = Vec::new();
        for (index, climbed) in done.into_iter().flatten() {
            match climbed {
                Climbed::Done(value) => found[index] = Some(Ok(value)),
                Climbed::Open(_, error) if step + 1 == RUNGS.len() => {
                    found[index] = Some(Err(Error::Unresolved { index, error, tolerance: plan.tolerance }));
                }
                Climbed::Open(coarser, error) => open.push(Open { index, coarser: Some(coarser), error }),
            }
        }
        if open.is_empty() {
            break;
        }
    }
    Ok(found.into_iter().map(|outcome| outcome.expect("each variant is done or refused on the last rung")).collect())
}

/// A variant that no two rungs agree on yet, with its angles on the coarser one and the error estimated there.
struct Open {
    index: usize,
    coarser: Option<Vec<f64>>,
    error: f64,
}

/// What became of it on the next rung.
enum Climbed<R> {
    Done(R),
    /// Its angles there, and the estimate that is too large.
    Open(Vec<f64>, f64),
}

/// Memory for the samples of a team, taken up again by the next one; `W` are single numbers side by side.
struct Pool<W> {
    doubles: Mutex<Vec<Samples<f64>>>,
    singles: Mutex<Vec<Samples<f32>>>,
    wide_doubles: Mutex<Vec<Samples<Lanes<f64, WIDTH>>>>,
    wide_singles: Mutex<Vec<Samples<W>>>,
}

/// Empty.
impl<W> Default for Pool<W> {
    fn default() -> Self {
        let (doubles, singles) = (Mutex::default(), Mutex::default());
        Pool { doubles, singles, wide_doubles: Mutex::default(), wide_singles: Mutex::default() }
    }
}

/// Runs variants on a rung, at the begin of the ladder on the one below too, and compares.
fn climb<T: Number, B: SweptFriction, C: SweptLaw, R>(
    variants: &[Variant<B, C>],
    plan: &Plan,
    step: usize,
    team: &[Open],
    pool: &Mutex<Vec<Samples<T>>>,
    measure: &impl Fn(&Course) -> R,
) -> Vec<(usize, Climbed<R>)> {
    let members: Vec<Variant<B, C>> = team.iter().map(|open| variants[open.index]).collect();
    let of_team = Team { members: &members, sample_time: plan.sample_time, reference: &plan.reference };
    let mut fine = taken(pool);
    of_team.run(RUNGS[step], &mut fine);
    let mut differences = Vec::new();
    if step == 1 {
        let mut coarse = taken(pool);
        of_team.run(RUNGS[0], &mut coarse);
        differences = coarse.apart(&fine, team.len());
        put_back(pool, coarse);
    }
    let courses = fine.courses(team.len());
    put_back(pool, fine);
    let outcome = |(lane, (open, [angle, deflection])): (usize, (&Open, [Vec<f64>; 2]))| {
        let difference = open.coarser.as_ref().map_or_else(|| differences[lane], |coarser| apart(coarser, &angle));
        let error = estimate(difference, open.error);
        // Not `error > tolerance`: what is no number is not resolved.
        let climbed = if error <= plan.tolerance {
            Climbed::Done(measure(&Course { angle, deflection, error, rung: RUNGS[step] }))
        } else {
            Climbed::Open(angle, error)
        };
        (open.index, climbed)
    };
    team.iter().zip(courses).enumerate().map(outcome).collect()
}

fn taken<T: Number>(pool: &Mutex<Vec<Samples<T>>>) -> Samples<T> {
    pool.lock().expect("nobody panics with the lock").pop().unwrap_or_default()
}

fn put_back<T: Number>(pool: &Mutex<Vec<Samples<T>>>, samples: Samples<T>) {
    pool.lock().expect("nobody panics with the lock").push(samples);
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
    let pool = Pool::<B::Singles>::default();
    let size = if order.len() <= FEW { 1 } else { plan.abreast::<B>() };
    let teams: Vec<&[usize]> = order.chunks(size).collect();
    let done = parallel::map(&teams, plan.threads, |team| {
        Ok(match (size, plan.arithmetic) {
            (1, Arithmetic::Double) => stand::<f64, B, C>(variants, plan, rung, team, &pool.doubles),
            (1, Arithmetic::Single) => stand::<f32, B, C>(variants, plan, rung, team, &pool.singles),
            (_, Arithmetic::Double) => stand::<Lanes<f64, WIDTH>, B, C>(variants, plan, rung, team, &pool.wide_doubles),
            (_, Arithmetic::Single) => stand::<B::Singles, B, C>(variants, plan, rung, team, &pool.wide_singles),
        }
        .iter()
        .map(&measure)
        .collect::<Vec<R>>())
    })?;
    let mut found: Vec<Option<R>> = variants.iter().map(|_| None).collect();
    for (index, value) in order.iter().zip(done.into_iter().flatten()) {
        found[*index] = Some(value);
    }
    Ok(found.into_iter().map(|value| value.expect("each variant is in a team")).collect())
}

/// Runs variants on a rung.
fn stand<T: Number, B: SweptFriction, C: SweptLaw>(
    variants: &[Variant<B, C>],
    plan: &Plan,
    rung: Rung,
    team: &[usize],
    pool: &Mutex<Vec<Samples<T>>>,
) -> Vec<Course> {
    let members: Vec<Variant<B, C>> = team.iter().map(|index| variants[*index]).collect();
    let mut samples = taken(pool);
    Team { members: &members, sample_time: plan.sample_time, reference: &plan.reference }.run(rung, &mut samples);
    let courses = samples.courses(team.len());
    put_back(pool, samples);
    let course = |[angle, deflection]: [Vec<f64>; 2]| Course { angle, deflection, error: f64::INFINITY, rung };
    courses.into_iter().map(course).collect()
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
    /// How many variants run side by side.
    fn abreast<B: SweptFriction>(&self) -> usize {
        match self.arithmetic {
            Arithmetic::Double => WIDTH,
            Arithmetic::Single => B::Singles::LANES,
        }
    }

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
