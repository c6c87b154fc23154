//! Result files of an identification for a drive: a feedforward table.

use std::fmt::Write;

use super::Identification;
use crate::machine::Machine;
use stickslip_base::units::measure;

/// `feedforward.csv`: force, and the command for it, at constant speeds in both directions, up to the fastest recorded
/// speed. Speed and command are in the units of the recording, force in N or N m. Rest is omitted: friction has a step
/// there.
pub fn feedforward_csv(result: &Identification, machine: &Machine) -> String {
    const STEPS: i32 = 50;
    let (speed, factor) = speed_unit(machine);
    let command = measure(&machine.drive.unit).map_or(1.0, |(_, factor)| factor);
    let fastest = result.motion.velocity.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut text = format!("velocity [{speed}],force [{}],command [{}]\n", result.force().1, machine.drive.unit);
    for step in (-STEPS..=STEPS).filter(|step| *step != 0) {
        // Finer towards rest, where the curve bends.
        let share = f64::from(step) / f64::from(STEPS);
        let velocity = fastest * share * share.abs();
        let needed = result.best().model.steady_force(velocity);
        let row = [velocity / factor, needed, needed / machine.gain / command];
        writeln!(text, "{:.9e},{:.9e},{:.9e}", row[0], row[1], row[2]).expect("a string takes all");
    }
    text
}

/// Unit of speed for the unit of position, and its SI value.
fn speed_unit(machine: &Machine) -> (String, f64) {
    let speed = machine.axis.velocity();
    let unit = machine.columns.position.unit.as_ref().map(|unit| format!("{unit}/s"));
    let known = unit.and_then(|unit| Some((measure(&unit).filter(|(measures, _)| *measures == speed)?.1, unit)));
    known.map_or((speed.si_unit().to_owned(), 1.0), |(factor, unit)| (unit, factor))
}
