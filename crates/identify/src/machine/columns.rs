//! Candidates for the roles of columns and their units: by name, unit and numbers.

use stickslip_base::units::Dimension::{self, Angle, Counts, Current, Force, Length, Share, Time, Torque, Voltage};
use stickslip_base::units::measure;
use stickslip_recording::understand::stamp_unit::{StampUnit, stamp_unit};
use stickslip_recording::{Column, Recording};

/// Role of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Time,
    Position,
    Reference,
    Command,
}

impl Role {
    /// Words in names that indicate the role, in the languages of data sheets and theses.
    fn words(self) -> &'static [&'static str] {
        match self {
            Role::Time => &["t", "time", "zeit", "timestamp", "temps", "sec", "seconds"],
            Role::Position => &[
                "position", "pos", "x", "q", "qm", "y", "angle", "phi", "theta", "weg", "lage", "winkel", "encoder",
                "enc", "carriage", "slide",
            ],
            Role::Reference => &[
                "reference",
                "ref",
                "set",
                "setpoint",
                "soll",
                "sollwert",
                "desired",
                "target",
                "goal",
                "qg",
                "r",
                "demand",
                "wanted",
            ],
            Role::Command => &[
                "command",
                "cmd",
                "u",
                "vir",
                "voltage",
                "volts",
                "spannung",
                "current",
                "strom",
                "i",
                "iq",
                "torque",
                "moment",
                "drehmoment",
                "force",
                "kraft",
                "duty",
                "pwm",
                "load",
                "output",
                "control",
                "stell",
            ],
        }
    }

    fn fits(self) -> &'static [Dimension] {
        match self {
            Role::Time => &[Time],
            Role::Position | Role::Reference => &[Length, Angle, Counts],
            Role::Command => &[Voltage, Current, Share, Torque, Force],
        }
    }
}

/// Words that indicate a measurement, but not its quantity.
const MEASURED: &[&str] = &["ist", "istwert", "actual", "act", "measured", "meas"];

/// Words of a name, in small letters: `Pos_Soll (act)` has three.
fn words(name: &str) -> Vec<String> {
    name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).map(str::to_lowercase).collect()
}

/// Whether a name has one of these words, a longer one also within a compound: `Sollposition`.
fn has_word(name: &str, among: &[&str]) -> bool {
    let is = |word: &str, known: &str| word == known || (known.len() >= 4 && word.contains(known));
    words(name).iter().any(|word| among.iter().any(|known| is(word, known)))
}

/// The likeliest free column for a role; none without any indication.
pub(super) fn proposed<'a>(recording: &'a Recording, role: Role, used: &[&str]) -> Option<&'a Column> {
    let is_free = |c: &&Column| !used.contains(&c.name.as_str()) && !c.is_row_number();
    let free = recording.columns().iter().filter(is_free).filter(|c| recording.column(&c.name).is_ok());
    let mut scored: Vec<(i32, &Column)> = free.map(|c| (score(c, role), c)).filter(|(score, _)| *score > 0).collect();
    // Of equal scores the first in the file.
    scored.sort_by_key(|(score, _)| -score);
    scored.first().map(|(_, column)| *column)
}

fn score(column: &Column, role: Role) -> i32 {
    let is_named = |role: Role| has_word(&column.name, role.words());
    let constant = column.values.iter().all(|v| *v == column.values[0]);
    let rises = column.values.windows(2).all(|w| w[1] > w[0]);
    let mut score = if is_named(role) { 4 } else { 0 };
    if let Some((dimension, _)) = unit_in_header(column).as_deref().and_then(measure) {
        score += if role.fits().contains(&dimension) { 3 } else { -20 };
    }
    match role {
        Role::Time if stamp_unit(column.origin(), &column.values) == StampUnit::RowNumber && score < 4 => score -= 20,
        Role::Time if !mostly_rises(column) => score -= 20,
        Role::Time => score += 2,
        _ if constant || (rises && is_named(Role::Time)) => score -= 20,
        // A counter: a command also falls.
        Role::Command if rises => score -= 20,
        Role::Position if is_named(Role::Reference) => score -= 5,
        Role::Position if has_word(&column.name, MEASURED) => score += 1,
        // A second position may be another encoder: only its name makes it a reference.
        Role::Reference if !is_named(Role::Reference) => score -= 20,
        _ => {}
    }
    score
}

/// Whether a column may be a clock: it rises but for repeated stamps, roll-over and single faults.
fn mostly_rises(column: &Column) -> bool {
    let falls = column.values.windows(2).filter(|w| w[1] < w[0]).count();
    let rises = column.values.windows(2).filter(|w| w[1] > w[0]).count();
    rises > 0 && falls * 100 <= column.values.len()
}

/// The unit in header or name: `pos_mm`.
fn unit_in_header(column: &Column) -> Option<String> {
    let suffix = || column.name.rsplit_once('_').map(|(_, unit)| unit.to_owned());
    column.unit.clone().filter(|unit| measure(unit).is_some()).or_else(|| suffix().filter(|u| measure(u).is_some()))
}

/// The unit in the header, or the only one that names and numbers allow. A command has none: forces are in proportion
/// to it.
pub(super) fn unit_of(column: &Column, role: Role) -> Option<String> {
    let fits = |unit: &String| measure(unit).is_some_and(|(dimension, _)| role.fits().contains(&dimension));
    if let Some(unit) = unit_in_header(column).filter(fits) {
        return Some(unit);
    }
    match role {
        Role::Time => match stamp_unit(column.origin(), &column.values) {
            StampUnit::Certain(unit) => Some(unit.into()),
            StampUnit::Possible(units) if units.len() == 1 => Some(units[0].into()),
            StampUnit::Possible(_) | StampUnit::RowNumber => None,
        },
        _ => None,
    }
}
