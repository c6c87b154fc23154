//! The delay of the position against the command: search, interval, and what it means.

use super::{Balance, Directions, HELD, Solved, Terms};
use nalgebra::{DMatrix, DVector};
use stickslip_base::Error;
use stickslip_base::quantity::{Estimate, tied};
use stickslip_fit::choose;

/// Delays that are searched, in milliseconds, or in samples where a sample is longer.
const SEARCHED: [i32; 2] = [-20, 40];
/// Half-width of an interval of the delay above which the motion does not determine it, in the unit of [`SEARCHED`].
const UNDETERMINED: f64 = 10.0;

/// Delay of the recorded position against the recorded command, beyond the half sampling period for which a command is
/// held on average. Lag of the drive, transport over a fieldbus and a shift between two logged channels act alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delay {
    /// Delay [s]; positive where the position is late.
    pub value: f64,
    /// Its 95 % interval [s].
    pub ci95: [f64; 2],
    /// Whether the motion determines it. Where it does not, all coefficients are those without a delay.
    pub is_determined: bool,
    /// Whether it differs from 0: the interval excludes 0, and unseen parts of the recording are predicted better.
    pub is_significant: bool,
}

impl Delay {
    /// The delay as a number with its interval.
    pub fn estimate(&self) -> Estimate {
        Estimate::new(self.value, "s").with_half_width(0.5 * (self.ci95[1] - self.ci95[0]))
    }

    /// The finding in a sentence or two; none for a delay that is 0 within its interval.
    pub fn sentence(&self) -> Option<String> {
        if !self.is_determined {
            return Some(
                "The delay between command and position: this motion does not determine it, and it was taken as half a \
                 sampling period. An unknown delay changes viscous friction most. Strokes at several speeds with \
                 stretches of constant speed between reversals determine it."
                    .into(),
            );
        }
        let milliseconds = |value: f64| Estimate::new(1e3 * value, "ms");
        let half_width = 0.5e3 * (self.ci95[1] - self.ci95[0]);
        let amount = tied(&milliseconds(self.value.abs()).with_half_width(half_width));
        let (late, early, cause) = match self.value > 0.0 {
            true => (
                "position",
                "command",
                "a lag of the drive, a transport delay and a shift between two recorded \
                      columns act alike here, and this is their total",
            ),
            false => (
                "command",
                "position",
                "a command that was recorded late or held, or a position that was recorded \
                       early, acts like this",
            ),
        };
        self.is_significant.then(|| {
            format!(
                "The {late} is recorded {amount} late against the {early}. The delay was taken into account, with its \
                 uncertainty, in mass and friction: {cause}."
            )
        })
    }
}

impl Balance<'_> {
    /// Searches the delay; the balance of both directions at its solution, or, where the motion does not determine the
    /// delay, without it.
    ///
    /// # Errors
    /// A motion that does not determine mass and friction.
    pub(crate) fn search(&self, directions: Directions) -> Result<Solved, Error> {
        let unit = (1e-3 / self.motion.period).round().max(1.0);
        let whole = self.whole();
        let [first, last] = SEARCHED;
        let cost = |late: &i32| self.cost(directions, f64::from(*late) * unit + HELD);
        let costs: Vec<f64> = (first..=last).map(|late| cost(&late)).collect();
        let least = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
        let start = f64::from(first + least as i32) * unit + HELD;
        let held = || self.solve(&Terms::of(directions, HELD, false), &whole);
        let Ok(solved) = self.solve(&Terms::of(directions, start, true), &whole) else { return held() };
        let [low, high] = solved.fit.ci95[solved.fit.ci95.len() - 1];
        let inside = (f64::from(first) * unit..=f64::from(last) * unit).contains(&solved.delay);
        if inside && 0.5 * (high - low) < UNDETERMINED * unit { Ok(solved) } else { held() }
    }

    /// The delay of a solved balance, and whether it predicts parts of the recording better that its fit did not use.
    pub(crate) fn delay(&self, solved: &Solved) -> Delay {
        let period = self.motion.period;
        let seconds = |samples: f64| (samples - HELD) * period;
        if !solved.terms.estimates_delay {
            let unknown = [f64::NEG_INFINITY, f64::INFINITY];
            return Delay { value: 0.0, ci95: unknown, is_determined: false, is_significant: false };
        }
        let [low, high] = solved.fit.ci95[solved.fit.ci95.len() - 1];
        let ci95 = [low, high].map(seconds);
        let excludes_zero = ci95[0] > 0.0 || ci95[1] < 0.0;
        let without = Terms { delay: HELD, estimates_delay: false, ..solved.terms.clone() };
        let is_significant = excludes_zero && self.gains(&[without, solved.terms.clone()]) == Some(1);
        Delay { value: seconds(solved.delay), ci95, is_determined: true, is_significant }
    }

    /// The terms to use: those that predict unseen parts of the recording significantly better than simpler ones before
    /// them. None where they cannot be compared.
    pub(crate) fn gains(&self, all: &[Terms]) -> Option<usize> {
        let folds: Vec<Vec<f64>> = all.iter().map(|terms| self.folds(terms)).collect::<Result<_, _>>().ok()?;
        choose(&folds).map(|choice| choice.chosen)
    }

    /// Mean squares of the errors in four blocks of each half, each predicted by a fit to the other half.
    ///
    /// # Errors
    /// A half that does not determine the coefficients.
    pub(crate) fn folds(&self, terms: &Terms) -> Result<Vec<f64>, Error> {
        const BLOCKS: usize = 4;
        let middle = self.motion.samples() / 2;
        let halves = [self.recipe.skip..middle, middle..self.motion.samples()];
        let mut folds = Vec::new();
        for (seen, unseen) in [(0, 1), (1, 0)] {
            let solved = self.solve(terms, &halves[seen])?;
            let (rows, missed) = self.misses(&solved, &halves[unseen]);
            if rows.len() < 2 * BLOCKS {
                let (needed, remedy) = (2 * BLOCKS, "Record longer.");
                return Err(Error::TooFew { what: "rows to predict", found: rows.len(), needed, remedy });
            }
            folds.extend((0..BLOCKS).map(|k| {
                let block = &missed[missed.len() * k / BLOCKS..missed.len() * (k + 1) / BLOCKS];
                block.iter().map(|e| e * e).sum::<f64>() / block.len() as f64
            }));
        }
        Ok(folds)
    }

    /// Mean square of the balance with a fixed delay, by plain least squares.
    fn cost(&self, directions: Directions, delay: f64) -> f64 {
        let terms = Terms::of(directions, delay, false);
        let rows = self.rows(&self.whole(), &terms);
        let (count, force) = (terms.count(), &self.force);
        let mut columns = Vec::with_capacity(count * rows.len());
        for &row in &rows {
            terms.columns(self.track.at(row as f64 + delay), force[row], &mut columns);
        }
        let columns = DMatrix::from_column_slice(count, rows.len(), &columns);
        let measured = DVector::from_iterator(rows.len(), rows.iter().map(|row| force[*row]));
        let pull = &columns * &measured;
        let Some(solver) = (&columns * columns.transpose()).cholesky() else { return f64::INFINITY };
        (measured.norm_squared() - pull.dot(&solver.solve(&pull))) / rows.len().max(1) as f64
    }
}
