//! A command that is held over several rows: logged slowly, or followed by the drive as it is.
//!
//! A logger that samples a fast command slowly holds values that the drive never followed for so long; a slow controller
//! holds the command itself. The balance of forces decides: the reading with the smaller residual is used.

use crate::balance::Balance;
use crate::machine::{Machine, Signals};
use crate::motion::Motion;

/// The signals with the reading of a held command that explains the motion better.
pub(crate) fn choose(signals: Signals, machine: &Machine) -> Signals {
    let Some(held) = &signals.held else { return signals };
    let as_recorded = Signals { command: held.clone(), ..signals.clone() };
    let residual = |signals: &Signals| {
        let motion = Motion::of(signals, machine).ok()?;
        let balance = Balance::of(&motion, signals, machine).ok()?;
        balance.search(&balance.plain()).ok().map(|solved| solved.fit.relative_error)
    };
    let (Some(released), Some(recorded)) = (residual(&signals), residual(&as_recorded)) else { return signals };
    if recorded < released {
        let mut findings = signals.findings;
        findings.push(format!(
            "Column `{}`: as recorded it explains the motion better than interpolated: it was used as the drive held it.",
            machine.columns.command.name
        ));
        return Signals { findings, ..as_recorded };
    }
    signals
}
