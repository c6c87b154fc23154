//! An injected signal that the recorded command already contains: both readings are tried, and the residual decides.

use crate::balance::Balance;
use crate::machine::{Machine, Signals};
use crate::motion::Motion;
use stickslip_base::Error;

/// Whether the recorded command already contains the injected signal.
///
/// # Errors
/// As [`Motion::of`].
pub(crate) fn contains_injected(signals: &Signals, machine: &Machine) -> Result<bool, Error> {
    if signals.injected.is_none() {
        return Ok(false);
    }
    let folds = |signals: &Signals| -> Result<Option<f64>, Error> {
        let motion = Motion::of(signals, machine)?;
        let balance = Balance::of(&motion, signals, machine)?;
        let terms = balance.plain();
        let timing = balance.search(&terms).map_or(terms.timing, |solved| solved.terms.timing.fixed());
        let folds = balance.folds(&terms.with(timing)).ok();
        Ok(folds.map(|folds| folds.iter().sum::<f64>() / folds.len() as f64))
    };
    let stated = folds(signals)?;
    let contained = folds(&Signals { injected: None, ..signals.clone() })?;
    // A clear difference: the stated reading holds otherwise.
    Ok(matches!((stated, contained), (Some(stated), Some(contained)) if contained < 0.5 * stated))
}

/// The signals with the injected one subtracted from the command.
pub(crate) fn without_injected(mut signals: Signals) -> Signals {
    if let Some(injected) = &signals.injected {
        signals.command.iter_mut().zip(injected).for_each(|(command, injected)| *command -= injected);
    }
    signals
}
