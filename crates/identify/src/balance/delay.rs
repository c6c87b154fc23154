//! The delay of the position against the command: search, interval, and what it means.

use super::{Balance, HELD, Solved, Terms, Timing};
use nalgebra::{DMatrix, DVector};
use stickslip_base::Error;
use stickslip_base::quantity::{Estimate, tied};
use stickslip_fit::choose;

/// Delays that are searched, in milliseconds, or in samples where a sample is longer.
const SEARCHED: [i32; 2] = [-20, 40];
/// Half-width of an interval of the delay above which the motion does not determine it, in the unit of [`SEARCHED`].
const UNDETERMINED: f64 = 10.0;
/// Half-width above which no delay is stated, in the same unit.
const CLEAR: f64 = 3.0;

/// Delay of the recorded position against the recorded command, beyond the half sampling period for which a command is
/// held on average: lag of the drive, transport over a fieldbus and a shift between two recorded columns together.
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
    /// The part of it that is a lag of first order, where the motion distinguishes it: time constant [s] and its 95 %
    /// interval.
    pub lag: Option<(f64, [f64; 2])>,
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
                 sampling period. All intervals include one more or less, and hold only for an axis without a longer delay \
                 and without friction that grows with the force. Strokes at several speeds, with quick changes of speed and \
                 stretches of constant speed between them, determine it."
                    .into(),
            );
        }
        let milliseconds = |value: f64| Estimate::new(1e3 * value, "ms");
        let half_width = 0.5e3 * (self.ci95[1] - self.ci95[0]);
        let amount = tied(&milliseconds(self.value.abs()).with_half_width(half_width));
        let (late, early, cause) = match self.value > 0.0 {
            true => ("position", "command", self.cause()),
            false => (
                "command",
                "position",
                "a command that was recorded late or held, or a position that was recorded early, acts like this"
                    .into(),
            ),
        };
        self.is_significant.then(|| {
            format!(
                "The {late} is recorded {amount} late against the {early}. The delay was taken into account, with its \
                 uncertainty, in mass and friction: {cause}."
            )
        })
    }

    /// What makes a position late.
    fn cause(&self) -> String {
        let Some((lag, [low, high])) = self.lag else {
            return "a lag of the drive, a transport delay and a shift between two recorded columns act alike here, and this is \
                    their total"
                .into();
        };
        let lag = tied(&Estimate::new(1e3 * lag, "ms").with_half_width(0.5e3 * (high - low)));
        format!(
            "it contains a lag of first order with a time constant of {lag}, as drives and filters have it; the rest is a \
             transport delay or a shift between two recorded columns"
        )
    }
}

impl Balance<'_> {
    /// Searches the delay of some terms; the balance at its solution, or, where the motion does not determine the delay,
    /// without it.
    ///
    /// # Errors
    /// A motion that does not determine mass and friction.
    pub(crate) fn search(&self, terms: &Terms) -> Result<Solved, Error> {
        let unit = self.unit();
        let whole = self.whole();
        let [first, last] = SEARCHED;
        let cost = |late: &i32| self.cost(&terms.with(Timing::held(f64::from(*late) * unit + HELD)));
        let costs: Vec<f64> = (first..=last).map(|late| cost(&late)).collect();
        let least = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
        let start = f64::from(first + least as i32) * unit + HELD;
        let held = || self.solve(&terms.with(Timing::held(HELD)), &whole);
        let solved = self.solve(&terms.with(Timing::from(start)), &whole);
        let inside = |solved: &Solved| {
            (f64::from(first) * unit..=f64::from(last) * unit).contains(&solved.terms.timing.delay)
                && self.determines(solved)
        };
        solved.ok().filter(inside).map_or_else(held, Ok)
    }

    /// Unit of [`SEARCHED`]: one millisecond in whole samples, at least one.
    fn unit(&self) -> f64 {
        (1e-3 / self.motion.period).round().max(1.0)
    }

    /// Whether the interval of the delay is short enough for a result.
    pub(super) fn determines(&self, solved: &Solved) -> bool {
        let [low, high] = solved.fit.ci95[solved.terms.count()];
        0.5 * (high - low) < UNDETERMINED * self.unit()
    }

    /// The delay of a solved balance.
    pub(crate) fn delay(&self, solved: &Solved, is_significant: bool) -> Delay {
        let period = self.motion.period;
        let seconds = |samples: f64| (samples - HELD) * period;
        let timing = solved.terms.timing;
        if timing.count() == 0 {
            let unknown = [f64::NEG_INFINITY, f64::INFINITY];
            return Delay { value: 0.0, ci95: unknown, is_determined: false, is_significant: false, lag: None };
        }
        let ci95 = solved.fit.ci95[solved.terms.count()].map(seconds);
        let is_significant = is_significant && (ci95[0] > 0.0 || ci95[1] < 0.0);
        let lag = if is_significant { self.lag(solved) } else { None };
        Delay { value: seconds(timing.total()), ci95, is_determined: true, is_significant, lag }
    }

    /// Whether a solved balance has a delay: its interval excludes 0, and it predicts parts of the recording better that
    /// its fit did not use.
    pub(crate) fn is_late(&self, solved: &Solved) -> bool {
        let Some([low, high]) = solved.fit.ci95.get(solved.terms.count()).copied() else { return false };
        let excludes_zero = low > HELD || high < HELD;
        let is_clear = 0.5 * (high - low) < CLEAR * self.unit();
        let without = solved.terms.with(Timing::held(HELD));
        excludes_zero && is_clear && self.gains(&[without, solved.terms.clone()]) == Some(1)
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
        let halves = self.halves();
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
    fn cost(&self, terms: &Terms) -> f64 {
        let rows = self.rows(&self.whole(), terms);
        let delay = terms.timing.delay;
        let (count, force) = (terms.count(), &self.force);
        let mut columns = Vec::with_capacity(count * rows.len());
        for &row in &rows {
            terms.columns(self.track.at(row as f64 + delay), force[row] + self.motion.offset, &mut columns);
        }
        let columns = DMatrix::from_column_slice(count, rows.len(), &columns);
        let measured = DVector::from_iterator(rows.len(), rows.iter().map(|row| force[*row]));
        let pull = &columns * &measured;
        let Some(solver) = (&columns * columns.transpose()).cholesky() else { return f64::INFINITY };
        (measured.norm_squared() - pull.dot(&solver.solve(&pull))) / rows.len().max(1) as f64
    }
}
