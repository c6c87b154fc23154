//! Columns whose names were exchanged in the machine file: another reading explains the motion much better.

use crate::IdentifyError;
use crate::balance::Balance;
use crate::machine::{Machine, Signals};
use crate::motion::Motion;
use stickslip_base::Error;

/// Relative error of the force from which the other readings are tried.
const SUSPECT: f64 = 0.3;

/// Refuses a recording that another reading of its columns explains at least twice as well, with a positive inertia.
/// `stated` is the relative error of the force as the machine file states the columns; none where the inertia is
/// negative.
///
/// # Errors
/// Exchanged columns; as [`Motion::of`].
pub(crate) fn refuse(signals: &Signals, machine: &Machine, stated: Option<f64>) -> Result<(), Error> {
    if stated.is_some_and(|stated| stated < SUSPECT) {
        return Ok(());
    }
    let columns = &machine.columns;
    let plain = Signals { velocity: None, injected: None, ..signals.clone() };
    let of_position = Signals {
        position: signals.command.clone(),
        command: signals.position.clone(),
        reference: None,
        ..plain.clone()
    };
    let mut readings = vec![("position", &columns.position.name, of_position)];
    if let (Some(reference), Some(column)) = (&signals.reference, &columns.reference) {
        let command = reference.clone();
        readings.push(("reference", &column.name, Signals { command, reference: None, ..plain }));
    }
    let limit = 0.5 * stated.unwrap_or(1.0);
    for (kind, name, reading) in readings {
        // A constant column moves nothing.
        let Some(exchanged) = error(&reading, machine)?.filter(|error| *error < limit) else { continue };
        return Err(IdentifyError::Exchanged {
            command: columns.command.name.clone(),
            kind,
            name: name.clone(),
            stated: 100.0 * stated.unwrap_or(1.0),
            exchanged: 100.0 * exchanged,
        }
        .into());
    }
    Ok(())
}

/// Relative error of the force for a reading; none where the motion does not determine an inertia above 0.
fn error(signals: &Signals, machine: &Machine) -> Result<Option<f64>, Error> {
    let motion = Motion::of(signals, machine)?;
    let balance = Balance::of(&motion, signals, machine)?;
    let solved = balance.search(&balance.plain()).ok();
    Ok(solved.filter(|solved| solved.fit.coefficients[0] > 0.0).map(|solved| solved.fit.relative_error))
}
