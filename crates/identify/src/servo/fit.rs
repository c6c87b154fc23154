//! Fit of a servo's model to its runs: the parameters for which the simulated closed loop moves like the recorded one.

use nalgebra::{SMatrix, SVector};
use stickslip_core::fields::{Field, Fields};
use stickslip_core::scalar::{Dual, Scalar};

use super::model::{Kind, STEP, Servo};
use crate::machine::Run;
use stickslip_base::{Error, Watch};
use stickslip_fit::{Minimum, Stop, minimise, student_t95};

/// Number of parameters of the richest model.
pub const PARAMETERS: usize = 17;

/// Parameters are searched in their logarithms; these two may have any sign and are logarithms themselves, in this
/// unit.
const SIGNED: [(&str, f64); 2] = [("offset", 0.1), ("delay", 0.01)];

/// Share of its default below which a magnitude is 0: it no longer has an effect.
const NOTHING: f64 = 1e-4;

/// Half-width of an interval in the logarithm from which on a parameter is undetermined: a factor of 20.
const UNKNOWN: f64 = 3.0;

/// Memories of the simulation [s], before that of the whole run.
const MEMORIES: [f64; 3] = [0.1, 0.3, 1.0];

/// A fitted model.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// How rich it is.
    pub kind: Kind,
    /// Its parameters.
    pub servo: Servo<f64>,
    /// 95 % interval of each field of [`Servo`]; none for parameters outside the kind, at a bound, or uncertain by more
    /// than a factor of 20.
    pub ci95: [Option<[f64; 2]>; PARAMETERS],
    /// Whether the search converged.
    pub converged: bool,
}

/// The fields of [`Servo`], in order.
pub fn fields() -> &'static [Field] {
    <Servo<f64> as Fields<f64>>::SHAPE.fields()
}

fn signed(field: &Field) -> Option<f64> {
    SIGNED.iter().find(|(name, _)| *name == field.name).map(|(_, unit)| *unit)
}

/// The searched form of the parameters.
fn searched(servo: &Servo<f64>) -> [f64; PARAMETERS] {
    let mut all = [0.0; PARAMETERS];
    let mut at = 0;
    servo.map(&mut |value: f64| {
        all[at] = signed(&fields()[at]).map_or(value, |unit| libm::exp(value / unit));
        at += 1;
        value
    });
    all
}

/// The parameters from their searched form.
fn servo<T: Scalar>(searched: &[T; PARAMETERS]) -> Servo<T> {
    let mut at = 0;
    Servo::<f64>::default().map(&mut |_: f64| {
        let value = searched[at];
        let unit = signed(&fields()[at]);
        at += 1;
        unit.map_or(value, |unit| value.ln() * T::of(unit))
    })
}

/// Starts of the search: the defaults, and each simpler model with the defaults of its missing parameters.
fn starts(kind: Kind, simpler: &[&Fitted]) -> Vec<[f64; PARAMETERS]> {
    let defaults = searched(&Servo::default());
    let from = |fitted: Option<&Fitted>| {
        let searched_values = fitted.map_or(defaults, |fitted| searched(&fitted.servo));
        std::array::from_fn(|i| {
            let field = &fields()[i];
            match (kind.has(field.name), fitted.is_some_and(|fitted| fitted.kind.has(field.name))) {
                (false, _) => 0.0,
                (true, false) => defaults[i],
                // A parameter that vanished starts again from its default.
                (true, true) => searched_values[i].max(if signed(field).is_some() { 0.0 } else { 0.1 * defaults[i] }),
            }
        })
    };
    std::iter::once(from(None)).chain(simpler.iter().map(|fitted| from(Some(fitted)))).collect()
}

/// Fits one kind of model to runs, from its own defaults and from each simpler model that was fitted to them.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn fit(kind: Kind, runs: &[&Run], simpler: &[&Fitted], watch: &Watch) -> Result<Fitted, Error> {
    let residuals = |searched: &[Dual<PARAMETERS>; PARAMETERS],
                     run: &Run,
                     step: f64,
                     memory: Option<f64>|
     -> Result<Vec<_>, Error> {
        let positions = servo(searched).simulate_in_steps(kind, run, step, memory, watch)?;
        Ok(positions.iter().zip(&run.position).map(|(q, measured)| *q - Dual::of(*measured)).collect())
    };
    let bounds: [[f64; 2]; PARAMETERS] = std::array::from_fn(|i| {
        let field = &fields()[i];
        let range = [field.minimum, field.maximum];
        match signed(field) {
            Some(unit) => range.map(|bound| libm::exp(bound / unit)),
            None if kind.has(field.name) => range,
            None => [0.0; 2],
        }
    });
    let search = |start: [f64; PARAMETERS], step: f64, memory: Option<f64>| {
        // Stick makes the sum of squares rough; changes below 1e-6 of it are far below the parameters' errors.
        minimise(start, bounds, Stop { step: 1e-5, fall: 1e-6, evaluations: 40 }, |p| {
            let mut all = Vec::new();
            for run in runs {
                all.extend(residuals(&p, run, step, memory)?);
            }
            Ok::<_, Error>(all)
        })
    };
    // A simulation with full memory has many local minima, one with a short memory has few: each is the start of the
    // next. Most of the way in coarse steps, in a third of the time.
    let mut near: Option<Minimum<PARAMETERS>> = None;
    for start in starts(kind, simpler) {
        let mut found = search(start, 3.0 * STEP, Some(MEMORIES[0]))?;
        for memory in MEMORIES[1..].iter().map(|memory| Some(*memory)).chain([None]) {
            found = search(found.parameters, 3.0 * STEP, memory)?;
        }
        near = near.filter(|best| best.cost <= found.cost).or(Some(found));
    }
    let near = near.expect("the defaults are a start").parameters;
    let minimum = search(near, STEP, None)?;
    let best = minimum.parameters;
    let here: [_; PARAMETERS] = std::array::from_fn(|i| Dual::variable(best[i], i));
    let mut blocks = Vec::new();
    for run in runs {
        blocks.push(Block::of(&residuals(&here, run, STEP, None)?, &best));
    }
    let free = std::array::from_fn(|i| {
        let field = &fields()[i];
        let least = if signed(field).is_some() { 0.0 } else { NOTHING * field.default };
        kind.has(field.name) && best[i] > bounds[i][0].max(least) && best[i] < bounds[i][1]
    });
    let half_widths = jackknife(&blocks, free);
    let [low, high] = [-1.0, 1.0].map(|sign| {
        let end: [f64; PARAMETERS] = std::array::from_fn(|i| best[i] * libm::exp(sign * half_widths[i]));
        values(&servo(&end))
    });
    let is_determined = |i: usize| free[i] && half_widths[i] < UNKNOWN;
    let ci95 = std::array::from_fn(|i| is_determined(i).then_some([low[i], high[i]]));
    Ok(Fitted { kind, servo: servo(&best), ci95, converged: minimum.converged })
}

/// The values of the fields, in order.
pub fn values(servo: &Servo<f64>) -> [f64; PARAMETERS] {
    let mut all = [0.0; PARAMETERS];
    let mut at = 0;
    servo.map(&mut |value: f64| {
        all[at] = value;
        at += 1;
        value
    });
    all
}

type Matrix = SMatrix<f64, PARAMETERS, PARAMETERS>;
type Vector = SVector<f64, PARAMETERS>;

/// Contribution of one run to the normal equations.
struct Block {
    information: Matrix,
    pull: Vector,
}

impl Block {
    fn of(residuals: &[Dual<PARAMETERS>], parameters: &[f64; PARAMETERS]) -> Self {
        let mut block = Block { information: Matrix::zeros(), pull: Vector::zeros() };
        for residual in residuals {
            let row = Vector::from_fn(|i, _| residual.gradient[i] * parameters[i]);
            block.information += row * row.transpose();
            block.pull += row * residual.value;
        }
        block
    }
}

/// Half-widths of the 95 % intervals in the logarithm. Samples of a run are correlated, so that only whole runs are
/// independent: each is left out in turn, and the changes of the parameters give their error (Efron's jackknife to
/// first order, Student's t for one degree of freedom less than there are runs). Infinite where a parameter depends on
/// a single run.
fn jackknife(blocks: &[Block], free: [bool; PARAMETERS]) -> [f64; PARAMETERS] {
    let count = blocks.len() as f64;
    let total = blocks.iter().fold(Matrix::zeros(), |sum, block| sum + block.information);
    let mut variance = Vector::zeros();
    for left_out in blocks {
        let mut rest = total - left_out.information;
        let mut pull = left_out.pull;
        for i in (0..PARAMETERS).filter(|i| !free[*i]) {
            rest.row_mut(i).fill(0.0);
            rest.column_mut(i).fill(0.0);
            rest[(i, i)] = 1.0;
            pull[i] = 0.0;
        }
        let Some(factor) = rest.cholesky() else { return [f64::INFINITY; PARAMETERS] };
        let moved = factor.solve(&pull);
        variance += moved.component_mul(&moved) * ((count - 1.0) / count);
    }
    let critical = student_t95(count - 1.0);
    std::array::from_fn(|i| critical * variance[i].sqrt())
}
