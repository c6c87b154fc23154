//! Cross-validation of frictions on the parts of a recording that their fits did not use.
//!
//! The recording is cut into contiguous blocks. Each friction is fitted to all blocks but one, in the simulated closed
//! loop, and simulates the remaining one from the measured state at its start; this is repeated for each block. All are
//! fitted by the same criterion, the recorded command, with mass and lag of the drive free, from several starts.

use std::ops::Range;

use nalgebra::DMatrix;
use stickslip_core::friction::{Decay, Stribeck};
use stickslip_core::scalar::{Dual, Scalar};

use super::axis::{AxisModel, Bristles, Loop, coulomb};
use super::rigid::Symmetric;
use crate::machine::Recipe;
use stickslip_base::parallel::map;
use stickslip_base::{Error, Watch};
use stickslip_fit::{LongRun, Profile, ProfilePlan, Stop, minimise};

/// Parameters of the richest friction, with mass, lag and offset.
pub const PARAMETERS: usize = 13;

/// Their names. `offset` alone has a sign.
pub const NAMES: [&str; PARAMETERS] = [
    "mass",
    "positive.breakaway",
    "positive.coulomb",
    "positive.stribeck_velocity",
    "positive.viscous",
    "negative.breakaway",
    "negative.coulomb",
    "negative.stribeck_velocity",
    "negative.viscous",
    "lag",
    "bristle_stiffness",
    "bristle_damping",
    "offset",
];

/// Index of the offset.
const OFFSET: usize = 12;

/// A friction, from the simplest to the richest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Friction {
    /// One force against motion, and an offset.
    Coulomb,
    /// Viscous friction as well.
    Viscous,
    /// A Stribeck curve.
    Stribeck,
    /// Coulomb and viscous friction for each direction; no offset, which would be redundant.
    EachWay,
    /// A Stribeck curve for each direction.
    StribeckEachWay,
    /// The same with LuGre bristles instead of stick.
    LugreEachWay,
}

impl Friction {
    /// All, each with more parameters than those before it.
    pub const ALL: [Friction; 6] = [
        Friction::Coulomb,
        Friction::Viscous,
        Friction::Stribeck,
        Friction::EachWay,
        Friction::StribeckEachWay,
        Friction::LugreEachWay,
    ];

    /// Name in files.
    pub fn name(self) -> &'static str {
        ["coulomb", "viscous", "stribeck", "each_way", "stribeck_each_way", "lugre_each_way"][self as usize]
    }

    /// Title.
    pub fn title(self) -> &'static str {
        [
            "Coulomb",
            "Coulomb and viscous",
            "Stribeck",
            "Coulomb and viscous, each direction",
            "Stribeck, each direction",
            "LuGre, each direction",
        ][self as usize]
    }

    /// Whether it has a parameter of [`NAMES`].
    pub fn has(self, parameter: usize) -> bool {
        match parameter {
            0 | 2 | 9 => true,
            1 | 3 => matches!(self, Friction::Stribeck | Friction::StribeckEachWay | Friction::LugreEachWay),
            4 => self != Friction::Coulomb,
            5 | 7 => matches!(self, Friction::StribeckEachWay | Friction::LugreEachWay),
            6 | 8 => self.is_each_way(),
            10 | 11 => self == Friction::LugreEachWay,
            _ => !self.is_each_way(),
        }
    }

    fn is_each_way(self) -> bool {
        matches!(self, Friction::EachWay | Friction::StribeckEachWay | Friction::LugreEachWay)
    }

    /// The axis with these parameters, as [`NAMES`]; missing ones are ignored.
    pub fn axis<T: Scalar>(self, p: &[T; PARAMETERS]) -> AxisModel<T> {
        let side = |first: usize| {
            if !self.has(1) {
                let viscous = if self.has(4) { p[first + 3] } else { T::of(0.0) };
                return coulomb(p[first + 1], viscous);
            }
            Stribeck {
                breakaway_torque: p[first],
                kinetic_torque: p[first + 1],
                stribeck_velocity: p[first + 2],
                viscous_friction: p[first + 3],
                decay: Decay::Exponential,
            }
        };
        let positive = side(1);
        let negative = if self.is_each_way() { side(5) } else { positive };
        let bristles = self.has(10).then(|| Bristles::passive(p[10], p[11], [&positive, &negative]));
        let offset = if self.has(OFFSET) { p[OFFSET] } else { T::of(0.0) };
        AxisModel { inertia: p[0], positive, negative, offset, lag: p[9], bristles }
    }
}

/// A friction fitted to a part of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// The friction.
    pub friction: Friction,
    /// Its parameters, as [`NAMES`]; 0 for missing ones.
    pub parameters: [f64; PARAMETERS],
}

/// A block predicted by a fit to the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// Fitted to all other blocks.
    pub fit: Fit,
    /// Root mean square of the command's error in this block, in the SI unit of the command.
    pub error: f64,
}

/// A recording and its division into blocks.
#[derive(Clone, Copy, Debug)]
pub struct Blocks<'a> {
    /// The closed loop.
    pub around: Loop<'a>,
    /// Recipe of the machine: number of dropped samples of a run.
    pub recipe: Recipe,
    /// Number of blocks; at least two.
    pub count: usize,
}

impl Blocks<'_> {
    /// Samples of a block.
    pub fn block(&self, index: usize) -> Range<usize> {
        let first = self.recipe.skip.max(2);
        let samples = self.around.motion.samples() - first;
        let at = |k: usize| first + samples * k / self.count;
        at(index)..at(index + 1)
    }

    /// All but a block, in one piece or two.
    fn others(&self, left_out: usize) -> Vec<Range<usize>> {
        let (first, hole) = (self.block(0).start, self.block(left_out));
        let end = self.block(self.count - 1).end;
        [first..hole.start, hole.end..end].into_iter().filter(|range| !range.is_empty()).collect()
    }

    /// The whole recording as one range.
    pub fn whole(&self) -> Vec<Range<usize>> {
        std::iter::once(self.block(0).start..self.block(self.count - 1).end).collect()
    }

    /// Fits each friction to all blocks but one and predicts that one: a row for each friction, a column for each
    /// block.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; a motion that does not determine mass and friction.
    pub fn cross_validate(
        &self,
        frictions: &[Friction],
        threads: usize,
        watch: &Watch,
    ) -> Result<Vec<Vec<Fold>>, Error> {
        let jobs: Vec<(Friction, usize)> =
            frictions.iter().flat_map(|friction| (0..self.count).map(|block| (*friction, block))).collect();
        let folds = map(&jobs, threads, |&(friction, block)| self.fold(friction, block, watch))?;
        Ok(folds.chunks(self.count).map(<[Fold]>::to_vec).collect())
    }

    /// One fold.
    ///
    /// # Errors
    /// As [`cross_validate`](Self::cross_validate).
    pub fn fold(&self, friction: Friction, block: usize, watch: &Watch) -> Result<Fold, Error> {
        let fit = self.fit(friction, &self.others(block), watch)?;
        Ok(Fold { fit, error: self.error(&fit, block, watch)? })
    }

    /// Root mean square of the command's error of a fit in a block, without the first samples, which still depend on
    /// the initial state of the simulation.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn error(&self, fit: &Fit, block: usize, watch: &Watch) -> Result<f64, Error> {
        let run = self.around.simulate(&fit.friction.axis(&fit.parameters), self.block(block), watch)?;
        Ok(self.around.compare(&run, self.recipe.skip).voltage_rms)
    }

    /// Fits a friction to stretches of the recording, from several starts.
    ///
    /// # Errors
    /// As [`cross_validate`](Self::cross_validate).
    pub fn fit(&self, friction: Friction, stretches: &[Range<usize>], watch: &Watch) -> Result<Fit, Error> {
        let longest = stretches.iter().max_by_key(|range| range.len()).cloned().unwrap_or_default();
        let motion = self.around.motion;
        // Mass, viscous, Coulomb and offset of the balance of forces: the start, from the same stretch of data.
        let rigid = Symmetric::identify(motion, longest, self.recipe.decimation)?.fit.coefficients;
        let [mass, viscous, coulomb, offset] = [0, 1, 2, 3].map(|k| rigid[k]);
        let fastest = motion.velocity.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let ends = motion.position.iter().fold([0.0_f64; 2], |[low, high], q| [low.min(*q), high.max(*q)]);
        let stiffness = coulomb / (1e-4 * (ends[1] - ends[0]));
        let force = coulomb.abs();
        let mut best: Option<([f64; PARAMETERS], f64)> = None;
        // A curve that rises from rest, and one that falls: a search from a level curve finds neither.
        let starts: &[[f64; 2]] = if friction.has(1) { &[[0.8, 0.1], [1.3, 0.03]] } else { &[[1.0, 1.0]] };
        for &[rest, velocity] in starts {
            let side = [rest * coulomb, coulomb, velocity * fastest, viscous];
            let damping = 0.5 * (stiffness * mass).sqrt();
            let bristles = [0.3 * motion.period, stiffness, damping, libm::exp((offset + motion.offset) / force)];
            let all = [&[mass][..], &side, &side, &bristles].concat();
            let start = std::array::from_fn(|i| if friction.has(i) { all[i].abs() } else { 0.0 });
            let coarse =
                Blocks { around: Loop { sub_steps: self.around.sub_steps.div_ceil(5), ..self.around }, ..*self };
            let stop = Stop { step: 1e-6, fall: 1e-5, evaluations: 40 };
            let minimum = minimise(start, FREE, stop, |p| coarse.residuals(friction, force, p, stretches, watch))?;
            if best.is_none_or(|(_, cost)| minimum.cost < cost) {
                best = Some((minimum.parameters, minimum.cost));
            }
        }
        let (near, _) = best.expect("there is a start");
        let minimum = minimise(near, FREE, NEAR, |p| self.residuals(friction, force, p, stretches, watch))?;
        let mut parameters = minimum.parameters;
        parameters[OFFSET] = if friction.has(OFFSET) { force * libm::log(parameters[OFFSET]) } else { 0.0 };
        Ok(Fit { friction, parameters })
    }

    /// Predicted minus recorded command over stretches, each simulated from its measured start. The offset is searched
    /// by its exponential in a unit of `force`, since it has a sign.
    fn residuals(
        &self,
        friction: Friction,
        force: f64,
        searched: [Dual<PARAMETERS>; PARAMETERS],
        stretches: &[Range<usize>],
        watch: &Watch,
    ) -> Result<Vec<Dual<PARAMETERS>>, Error> {
        let mut parameters = searched;
        if friction.has(OFFSET) {
            parameters[OFFSET] = searched[OFFSET].ln() * Dual::of(force);
        }
        let axis = friction.axis(&parameters);
        let mut residuals = Vec::new();
        for range in stretches {
            let run = self.around.simulate(&axis, range.clone(), watch)?;
            let pairs = run.command.iter().zip(&self.around.signals.command[range.clone()]).skip(self.recipe.skip);
            residuals.extend(pairs.map(|(predicted, measured)| *predicted - Dual::of(*measured)));
        }
        Ok(residuals)
    }

    /// The profile of a parameter of a fit over the whole recording, with all others fitted again.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn profile(
        &self,
        fit: &Fit,
        parameter: usize,
        unit: &str,
        (reach, steps): (f64, usize),
        watch: &Watch,
    ) -> Result<Profile, Error> {
        let coarse = Blocks { around: Loop { sub_steps: self.around.sub_steps.div_ceil(5), ..self.around }, ..*self };
        let (whole, friction, force) = (self.whole(), fit.friction, fit.parameters[2]);
        let residuals = |p| coarse.residuals(friction, force, p, &whole, watch);
        let mut searched = fit.parameters;
        if friction.has(OFFSET) {
            searched[OFFSET] = libm::exp(fit.parameters[OFFSET] / force);
        }
        // To the end with the coarse steps of the profile.
        let stop = Stop { step: 1e-6, fall: 1e-6, evaluations: 30 };
        let best = minimise(searched, FREE, stop, residuals)?.parameters;
        let slopes = residuals(std::array::from_fn(|i| Dual::variable(best[i], i)))?;
        let inflation = inflation(&best, &slopes, parameter);
        let plan = ProfilePlan { reach, steps, stop: Stop { evaluations: 15, ..stop } };
        Profile::of((NAMES[parameter], unit), (parameter, best), FREE, plan, inflation, residuals)
    }
}

/// The experiment that would determine a parameter, for [`NAMES`].
pub fn would_tell(parameter: usize) -> &'static str {
    match parameter {
        0 => "Record stronger accelerations.",
        1 | 3 | 5 | 7 => "Record slow strokes: constant speeds far below those recorded, and breakaway from rest.",
        4 | 8 => "Record faster strokes.",
        9 => "Record a frequency response of the drive.",
        10 => "Record presliding: slow strokes of some micrometres around rest.",
        11 => "Record presliding: fast strokes of some micrometres around rest.",
        _ => "Record constant speeds in both directions.",
    }
}

const FREE: [[f64; 2]; PARAMETERS] = [[0.0, f64::INFINITY]; PARAMETERS];
/// Near the end stick makes the sum of squares rough: below 1e-4 of it a search makes no progress.
const NEAR: Stop = Stop { step: 1e-6, fall: 1e-4, evaluations: 10 };

/// Variance of a parameter with the correlation of its residuals counted, over that by as many white ones.
fn inflation(parameters: &[f64; PARAMETERS], residuals: &[Dual<PARAMETERS>], parameter: usize) -> f64 {
    // Ten samples are one row, as for the standard errors of a fit.
    const ROW: usize = 10;
    let free: Vec<usize> = (0..PARAMETERS).filter(|i| parameters[*i] > 0.0).collect();
    let slope = |residual: &Dual<PARAMETERS>, i: usize| residual.gradient[free[i]] * parameters[free[i]];
    let count = free.len();
    let normal =
        DMatrix::from_fn(count, count, |i, j| residuals.iter().map(|r| slope(r, i) * slope(r, j)).sum::<f64>());
    let (Some(inverse), Some(at)) = (normal.try_inverse(), free.iter().position(|i| *i == parameter)) else {
        return 1.0;
    };
    let rows = residuals.len().div_ceil(ROW);
    let pull = |t: usize, i: usize| -> f64 {
        residuals[t * ROW..residuals.len().min((t + 1) * ROW)].iter().map(|r| slope(r, i) * r.value).sum()
    };
    let influence = DMatrix::from_fn(1, rows, |_, t| (0..count).map(|i| inverse[(at, i)] * pull(t, i)).sum::<f64>());
    let white = residuals.iter().map(|r| r.value * r.value).sum::<f64>() / (residuals.len() - count) as f64;
    LongRun::of(&influence).covariance[(0, 0)] / (white * inverse[(at, at)])
}
