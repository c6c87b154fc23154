//! Injected faults as text.

use crate::BenchError;
use std::fmt;
use std::str::FromStr;

use stickslip_base::Error;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "documented in the table KINDS")]
pub enum Kind {
    EncoderStuck,
    CountsLost,
    EncoderWrap,
    IndexMissing,
    EncoderNan,
    TachoDead,
    TachoNan,
    AccelerometerJump,
    AccelerometerDead,
    CurrentSign,
    ControllerNan,
    ServoSaturated,
    ServoFrozen,
    LoadFrozen,
    TicksMissed,
    PowerLoss,
}

/// Definition of a kind.
struct Definition {
    kind: Kind,
    name: &'static str,
    help: &'static str,
    /// Default, unit and range of the value; `None` without a value.
    value: Option<(f64, &'static str, (f64, f64))>,
}

const fn plain(kind: Kind, name: &'static str, help: &'static str) -> Definition {
    Definition { kind, name, help, value: None }
}

const KINDS: [Definition; 16] = [
    plain(Kind::EncoderStuck, "encoder-stuck", "the counter is stuck"),
    Definition {
        kind: Kind::CountsLost,
        name: "counts-lost",
        help: "this share of the counts is lost",
        value: Some((0.02, "1", (0.0, 1.0))),
    },
    Definition {
        kind: Kind::EncoderWrap,
        name: "encoder-wrap",
        help: "the counter wraps at this number instead of its own",
        value: Some((4096.0, "counts", (16.0, 4e9))),
    },
    plain(Kind::IndexMissing, "index-missing", "the index pulse is missing"),
    plain(Kind::EncoderNan, "encoder-nan", "the counter returns NaN"),
    plain(Kind::TachoDead, "tacho-dead", "the tacho returns 0 V"),
    plain(Kind::TachoNan, "tacho-nan", "the tacho returns NaN"),
    Definition {
        kind: Kind::AccelerometerJump,
        name: "accelerometer-jump",
        help: "the accelerometer's voltage is off by this",
        value: Some((0.05, "V", (-10.0, 10.0))),
    },
    plain(Kind::AccelerometerDead, "accelerometer-dead", "the accelerometer returns 0 V"),
    plain(Kind::CurrentSign, "current-sign", "the current sensor's wires are swapped"),
    plain(Kind::ControllerNan, "controller-nan", "the position controller computes NaN once"),
    Definition {
        kind: Kind::ServoSaturated,
        name: "servo-saturated",
        help: "the input of the servo amplifier is limited to this",
        value: Some((0.5, "V", (0.0, 10.0))),
    },
    plain(Kind::ServoFrozen, "servo-frozen", "the servo amplifier keeps its input"),
    plain(Kind::LoadFrozen, "load-frozen", "the load motor's amplifier keeps its input"),
    Definition {
        kind: Kind::TicksMissed,
        name: "ticks-missed",
        help: "the software misses this number of ticks once",
        value: Some((20.0, "ticks", (1.0, 1000.0))),
    },
    plain(Kind::PowerLoss, "power-loss", "both amplifiers lose their input"),
];

impl Kind {
    /// All kinds.
    pub fn all() -> impl Iterator<Item = Kind> {
        KINDS.iter().map(|definition| definition.kind)
    }

    /// Name in a text.
    pub fn name(self) -> &'static str {
        self.definition().name
    }

    /// Effect.
    pub fn help(self) -> &'static str {
        self.definition().help
    }

    fn definition(self) -> &'static Definition {
        KINDS.iter().find(|definition| definition.kind == self).expect("a test finds each in the table")
    }
}

/// A fault with value and start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Injection {
    /// Kind.
    pub kind: Kind,
    /// Value in the unit of the kind; 0 without a value.
    pub value: f64,
    /// Bench time since the start [s].
    pub at: f64,
}

impl Injection {
    /// With the default value of the kind.
    pub fn new(kind: Kind, at: f64) -> Self {
        Injection { kind, value: kind.definition().value.map_or(0.0, |(value, ..)| value), at }
    }
}

impl fmt::Display for Injection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name())?;
        if self.kind.definition().value.is_some() {
            write!(f, "={}", self.value)?;
        }
        write!(f, "@{}s", self.at)
    }
}

impl FromStr for Injection {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let refused = |remedy: String| BenchError::Injection { fault: text.into(), remedy };
        let example = || refused("Use KIND@TIMEs, such as encoder-stuck@1.5s.".into());
        let (what, at) = text.split_once('@').ok_or_else(example)?;
        let at = at.strip_suffix('s').and_then(|at| at.parse().ok()).filter(|at: &f64| at.is_finite() && *at >= 0.0);
        let at = at.ok_or_else(example)?;
        let (name, value) = what.split_once('=').map_or((what, None), |(name, value)| (name, Some(value)));
        let names = || KINDS.map(|definition| definition.name).join(", ");
        let definition = KINDS.iter().find(|definition| definition.name == name);
        let definition = definition.ok_or_else(|| refused(format!("Available: {}.", names())))?;
        let injection = Injection::new(definition.kind, at);
        let Some(value) = value else { return Ok(injection) };
        let Some((_, unit, (low, high))) = definition.value else {
            return Err(refused(format!("{name} has no value: omit it.")).into());
        };
        match value.parse() {
            Ok(value) if (low..=high).contains(&value) => Ok(Injection { value, ..injection }),
            _ => Err(refused(format!("The value of {name} must be within {low} … {high} {unit}.")).into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_is_read_back_from_its_text() {
        for kind in Kind::all() {
            let injection = Injection::new(kind, 1.0 / 3.0);
            assert_eq!(injection.to_string().parse::<Injection>().unwrap(), injection);
        }
        let read = "encoder-stuck@1.5s".parse::<Injection>().unwrap();
        assert_eq!(read, Injection { kind: Kind::EncoderStuck, value: 0.0, at: 1.5 });
        assert_eq!(read.to_string(), "encoder-stuck@1.5s");
        assert_eq!("counts-lost=0.5@0s".parse::<Injection>().unwrap().value, 0.5);
    }

    #[test]
    fn an_invalid_fault_is_refused_with_a_remedy() {
        for (text, remedy) in [
            ("encoder-stuck", "encoder-stuck@1.5s"),
            ("encoder-stuck@1.5", "encoder-stuck@1.5s"),
            ("encoder-stuck@-1s", "encoder-stuck@1.5s"),
            ("encoder-stuck=1@1s", "has no value"),
            ("counts-lost=2@1s", "0 … 1"),
            ("counts-lost=NaN@1s", "0 … 1"),
            ("encoder@1s", "encoder-stuck, counts-lost"),
        ] {
            let message = text.parse::<Injection>().unwrap_err().to_string();
            assert!(message.contains(text) && message.contains(remedy), "{message}");
        }
    }
}
