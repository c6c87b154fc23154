//! What is injected, as text.

use crate::BenchError;
use std::fmt;
use std::str::FromStr;

use stickslip_base::Error;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "said once, in the table of KINDS")]
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

/// What is known of a kind.
struct About {
    kind: Kind,
    name: &'static str,
    help: &'static str,
    /// How much: default, unit and range of the value; none where there is nothing to say.
    value: Option<(f64, &'static str, (f64, f64))>,
}

const fn plain(kind: Kind, name: &'static str, help: &'static str) -> About {
    About { kind, name, help, value: None }
}

const KINDS: [About; 16] = [
    plain(Kind::EncoderStuck, "encoder-stuck", "the counter stands"),
    About {
        kind: Kind::CountsLost,
        name: "counts-lost",
        help: "this share of the counts is lost",
        value: Some((0.02, "1", (0.0, 1.0))),
    },
    About {
        kind: Kind::EncoderWrap,
        name: "encoder-wrap",
        help: "the counter wraps at this number instead of its own",
        value: Some((4096.0, "counts", (16.0, 4e9))),
    },
    plain(Kind::IndexMissing, "index-missing", "the index pulse does not come"),
    plain(Kind::EncoderNan, "encoder-nan", "the counter gives no number"),
    plain(Kind::TachoDead, "tacho-dead", "the tacho gives 0 V"),
    plain(Kind::TachoNan, "tacho-nan", "the tacho gives no number"),
    About {
        kind: Kind::AccelerometerJump,
        name: "accelerometer-jump",
        help: "the accelerometer's voltage is off by this",
        value: Some((0.05, "V", (-10.0, 10.0))),
    },
    plain(Kind::AccelerometerDead, "accelerometer-dead", "the accelerometer gives 0 V"),
    plain(Kind::CurrentSign, "current-sign", "the current sensor's wires are swapped"),
    plain(Kind::ControllerNan, "controller-nan", "the position controller computes no number, once"),
    About {
        kind: Kind::ServoSaturated,
        name: "servo-saturated",
        help: "the servo amplifier takes no more than this",
        value: Some((0.5, "V", (0.0, 10.0))),
    },
    plain(Kind::ServoFrozen, "servo-frozen", "the servo amplifier keeps its input"),
    plain(Kind::LoadFrozen, "load-frozen", "the load motor's amplifier keeps its input"),
    About {
        kind: Kind::TicksMissed,
        name: "ticks-missed",
        help: "the software misses so many ticks, once",
        value: Some((20.0, "ticks", (1.0, 1000.0))),
    },
    plain(Kind::PowerLoss, "power-loss", "both amplifiers get no input any more"),
];

impl Kind {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Kind> {
        KINDS.iter().map(|about| about.kind)
    }

    /// As it stands in a text.
    pub fn name(self) -> &'static str {
        self.about().name
    }

    /// What it does.
    pub fn help(self) -> &'static str {
        self.about().help
    }

    fn about(self) -> &'static About {
        KINDS.iter().find(|about| about.kind == self).expect("a test finds each in the table")
    }
}

/// A fault, how much, and from when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Injection {
    /// What.
    pub kind: Kind,
    /// How much, in the kind's unit; 0 where there is nothing to say.
    pub value: f64,
    /// Bench time since the start [s].
    pub at: f64,
}

impl Injection {
    /// With the kind's usual value.
    pub fn new(kind: Kind, at: f64) -> Self {
        Injection { kind, value: kind.about().value.map_or(0.0, |(value, ..)| value), at }
    }
}

impl fmt::Display for Injection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name())?;
        if self.kind.about().value.is_some() {
            write!(f, "={}", self.value)?;
        }
        write!(f, "@{}s", self.at)
    }
}

impl FromStr for Injection {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let refused = |remedy: String| BenchError::Injection { fault: text.into(), remedy };
        let example = || refused("Write what and from when, as encoder-stuck@1.5s.".into());
        let (what, at) = text.split_once('@').ok_or_else(example)?;
        let at = at.strip_suffix('s').and_then(|at| at.parse().ok()).filter(|at: &f64| at.is_finite() && *at >= 0.0);
        let at = at.ok_or_else(example)?;
        let (name, value) = what.split_once('=').map_or((what, None), |(name, value)| (name, Some(value)));
        let names = || KINDS.map(|about| about.name).join(", ");
        let about = KINDS.iter().find(|about| about.name == name);
        let about = about.ok_or_else(|| refused(format!("There are {}.", names())))?;
        let injection = Injection::new(about.kind, at);
        let Some(value) = value else { return Ok(injection) };
        let Some((_, unit, (low, high))) = about.value else {
            return Err(refused(format!("{name} takes no value: leave it out.")).into());
        };
        match value.parse() {
            Ok(value) if (low..=high).contains(&value) => Ok(Injection { value, ..injection }),
            _ => Err(refused(format!("{name} takes {low} … {high} {unit}.")).into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_comes_back_from_its_text() {
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
    fn what_is_no_fault_is_refused_with_what_there_is() {
        for (text, remedy) in [
            ("encoder-stuck", "encoder-stuck@1.5s"),
            ("encoder-stuck@1.5", "encoder-stuck@1.5s"),
            ("encoder-stuck@-1s", "encoder-stuck@1.5s"),
            ("encoder-stuck=1@1s", "takes no value"),
            ("counts-lost=2@1s", "0 … 1"),
            ("counts-lost=NaN@1s", "0 … 1"),
            ("encoder@1s", "encoder-stuck, counts-lost"),
        ] {
            let said = text.parse::<Injection>().unwrap_err().to_string();
            assert!(said.contains(text) && said.contains(remedy), "{said}");
        }
    }
}
