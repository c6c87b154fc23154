//! The trigger of a capture.

mod parse;

use std::fmt;

/// The trigger of a capture, as a sentence for command line and browser.
///
/// [`FromStr`](std::str::FromStr) parses it and reports faults with their column; [`Display`](fmt::Display) writes it.
///
/// ```text
/// velocity rises through 0.1, hysteresis 0.02, delay 200, hold-off 4000
/// ```
///
/// | sentence | an event is the tick in which the signal |
/// |-|-|
/// | `immediate` | (any tick) |
/// | `S above X`, `S below X` | is greater, less than X |
/// | `S rises through X` | is X or more, and was less than X − hysteresis since the last event |
/// | `S falls through X` | is X or less, and was more than X + hysteresis since the last event |
/// | `S crosses X` | either of the two |
/// | `S enters A..B` | is in the band A … B, and was out of it by more than the hysteresis since the last event |
/// | `S leaves A..B` | is outside the band, and was in it, at least the hysteresis from its ends, since the last event |
/// | `S is N` | has the value N, a whole number |
/// | `S becomes N` | has the value N, and had a different value before |
/// | `S changes` | has a different value than before |
///
/// Options follow after commas, in any order: `hysteresis H` (default: 0) in the signal's unit; `delay T` (default: 0),
/// number of ticks from the event to the trigger; `hold-off T` (default: 0), number of ticks after an event in which
/// events are ignored; `auto T` (default: off), number of ticks without an event after which the trigger occurs
/// automatically. A name with a space, a comma or a quote is in double quotes, and a quote in it is doubled. All
/// numbers are in the signal's SI unit, without a unit; times in ticks.
///
/// NaN is ignored: it is not an event, and the state before it is kept. A signal that was below the level, then NaN,
/// and is now above the level has risen through it. The same holds for lost rows: the event is detected at the first
/// row after them. Before its first value a signal has no state.
#[derive(Clone, Debug, PartialEq)]
pub struct Trigger {
    /// Condition of an event.
    pub condition: Condition,
    /// Time from the event to the trigger, in ticks.
    pub delay: u64,
    /// Time after an event in which events are ignored, in ticks.
    pub hold_off: u64,
    /// Time without an event after which the trigger occurs automatically, in ticks.
    pub auto: Option<u64>,
}

/// Condition of an event.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// Any tick.
    Immediate,
    /// A test on a signal.
    Signal {
        /// Its name.
        name: String,
        /// The test.
        test: Test,
    },
}

/// A test on a signal. Numbers are in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Test {
    /// Is greater than the level.
    Above(f64),
    /// Is less than the level.
    Below(f64),
    /// Passes a level.
    Edge {
        /// The direction.
        slope: Slope,
        /// The level.
        level: f64,
        /// Distance from the level that it must have had before.
        hysteresis: f64,
    },
    /// Enters or leaves a band.
    Window {
        /// Whether it enters or leaves.
        side: Side,
        /// Lower end, inclusive.
        low: f64,
        /// Upper end, inclusive.
        high: f64,
        /// Distance from an end, on the other side, that it must have had before.
        hysteresis: f64,
    },
    /// Has a value.
    Is(i32),
    /// Changes to a value.
    Becomes(i32),
    /// Changes its value.
    Changes,
}

/// Direction of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slope {
    /// Upwards.
    Rising,
    /// Downwards.
    Falling,
    /// Either.
    Both,
}

/// Direction through the end of a band.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Into the band.
    Enters,
    /// Out of it.
    Leaves,
}

impl From<Condition> for Trigger {
    fn from(condition: Condition) -> Self {
        Trigger { condition, delay: 0, hold_off: 0, auto: None }
    }
}

impl fmt::Display for Trigger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.condition {
            Condition::Immediate => f.write_str("immediate")?,
            Condition::Signal { name, test } => {
                let bare = !name.is_empty() && !name.contains(|c: char| c.is_whitespace() || matches!(c, ',' | '"'));
                if bare {
                    f.write_str(name)?
                } else {
                    write!(f, "\"{}\"", name.replace('"', "\"\""))?
                }
                write!(f, " {test}")?;
            }
        }
        let times = [("delay", self.delay), ("hold-off", self.hold_off)];
        for (option, ticks) in times.into_iter().filter(|(_, ticks)| *ticks > 0) {
            write!(f, ", {option} {ticks}")?;
        }
        self.auto.map_or(Ok(()), |ticks| write!(f, ", auto {ticks}"))
    }
}

impl fmt::Display for Test {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hysteresis = match *self {
            Test::Edge { hysteresis, .. } | Test::Window { hysteresis, .. } => hysteresis,
            _ => 0.0,
        };
        match *self {
            Test::Above(level) => write!(f, "above {}", number(level)),
            Test::Below(level) => write!(f, "below {}", number(level)),
            Test::Edge { slope: Slope::Rising, level, .. } => write!(f, "rises through {}", number(level)),
            Test::Edge { slope: Slope::Falling, level, .. } => write!(f, "falls through {}", number(level)),
            Test::Edge { slope: Slope::Both, level, .. } => write!(f, "crosses {}", number(level)),
            Test::Window { side, low, high, .. } => {
                let verb = if side == Side::Enters { "enters" } else { "leaves" };
                write!(f, "{verb} {}..{}", number(low), number(high))
            }
            Test::Is(value) => write!(f, "is {value}"),
            Test::Becomes(value) => write!(f, "becomes {value}"),
            Test::Changes => f.write_str("changes"),
        }?;
        if hysteresis == 0.0 { Ok(()) } else { write!(f, ", hysteresis {}", number(hysteresis)) }
    }
}

/// Shortest text that reads back to the same bits.
fn number(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or_else(|| text.clone(), String::from)
}
