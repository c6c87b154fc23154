//! Which column of a recording may be what, and in which unit: by name, unit and numbers.

use stickslip_base::units::Dimension::{self, Angle, Counts, Current, Force, Length, Share, Time, Torque, Voltage};
use stickslip_base::units::measure;
use stickslip_recording::{Column, Recording};

/// What a column can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Time,
    Position,
    Reference,
    Command,
}

impl Role {
    /// Words of a name that speak for the role, in the languages of data sheets and theses.
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

/// Words that say that something was measured, and not what.
const MEASURED: &[&str] = &["ist", "istwert", "actual", "act", "measured", "meas"];

/// Words of a name, in small letters: `Pos_Soll (act)` has three.
fn words(name: &str) -> Vec<String> {
    name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).map(str::to_lowercase).collect()
}

/// Whether a name has one of these words, a longer one also within a compound: `Sollposition`.
fn named(name: &str, among: &[&str]) -> bool {
    let is = |word: &str, known: &str| word == known || (known.len() >= 4 && word.contains(known));
    words(name).iter().any(|word| among.iter().any(|known| is(word, known)))
}

/// The likeliest column for a role that is not taken; none where nothing speaks for any.
pub(super) fn proposed<'a>(recording: &'a Recording, role: Role, taken: &[&str]) -> Option<&'a Column> {
    let free =
        recording.columns().iter().filter(|c| !taken.contains(&c.name.as_str()) && recording.column(&c.name).is_ok());
    let mut scored: Vec<(i32, &Column)> = free.map(|c| (score(c, role), c)).filter(|(score, _)| *score > 0).collect();
    // Of equals the first in the file.
    scored.sort_by_key(|(score, _)| -score);
    scored.first().map(|(_, column)| *column)
}

fn score(column: &Column, role: Role) -> i32 {
    let named = |role: Role| named(&column.name, role.words());
    let constant = column.values.iter().all(|v| *v == column.values[0]);
    let rises = column.values.windows(2).all(|w| w[1] > w[0]);
    let mut score = if named(role) { 4 } else { 0 };
    if let Some((dimension, _)) = stated(column).as_deref().and_then(measure) {
        score += if role.fits().contains(&dimension) { 3 } else { -20 };
    }
    match role {
        Role::Time if !rises => score -= 20,
        Role::Time => score += 2,
        _ if constant || (rises && named(Role::Time)) => score -= 20,
        Role::Position if named(Role::Reference) => score -= 5,
        Role::Position if self::named(&column.name, MEASURED) => score += 1,
        // A second position may be another encoder: only its name makes it a reference.
        Role::Reference if !named(Role::Reference) => score -= 20,
        _ => {}
    }
    score
}

/// The unit that header or name give: `pos_mm`.
fn stated(column: &Column) -> Option<String> {
    let suffix = || column.name.rsplit_once('_').map(|(_, unit)| unit.to_owned());
    column.unit.clone().filter(|unit| measure(unit).is_some()).or_else(|| suffix().filter(|u| measure(u).is_some()))
}

/// The unit as given, or what the numbers look like.
pub(super) fn unit_of(column: &Column, role: Role) -> String {
    let fits = |unit: &String| measure(unit).is_some_and(|(dimension, _)| role.fits().contains(&dimension));
    if let Some(unit) = stated(column).filter(fits) {
        return unit;
    }
    let (low, high) = column.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let named = |among: &[&str]| named(&column.name, among);
    let unit = match role {
        // Drives record at 20 Hz at least.
        Role::Time => match (high - low) / column.values.len() as f64 {
            step if step < 0.05 => "s",
            step if step < 50.0 => "ms",
            _ => "us",
        },
        Role::Position | Role::Reference => match high - low {
            _ if column.values.iter().all(|v| v.fract() == 0.0) => "counts",
            _ if named(&["angle", "phi", "theta", "winkel"]) => {
                if high - low > 20.0 {
                    "deg"
                } else {
                    "rad"
                }
            }
            span if span < 2.0 => "m",
            _ => "mm",
        },
        Role::Command => match () {
            () if named(&["current", "strom", "i", "iq"]) => "A",
            () if named(&["torque", "moment"]) => "N m",
            () if named(&["force", "kraft"]) => "N",
            () if named(&["duty", "pwm", "load", "percent"]) => "%",
            () => "V",
        },
    };
    unit.into()
}
