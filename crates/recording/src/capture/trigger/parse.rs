//! Parser of triggers; its errors have fault, column and remedy.

use crate::RecordingError;
use std::str::FromStr;

use super::{Condition, Side, Slope, Test, Trigger};
use stickslip_base::Error;
use stickslip_base::parameters::schema::nearest;

const VERBS: [&str; 10] =
    ["above", "below", "rises", "falls", "crosses", "enters", "leaves", "is", "becomes", "changes"];
const OPTIONS: [&str; 4] = ["hysteresis", "delay", "hold-off", "auto"];
const EXAMPLE: &str = "Example: `velocity rises through 0.1, hysteresis 0.02`, or `immediate`.";

/// A fault with its column, from 1.
struct Fault {
    column: usize,
    fault: String,
    remedy: String,
}

type Parsed<T> = Result<T, Fault>;

fn fault<T>(column: usize, fault: impl Into<String>, remedy: impl Into<String>) -> Parsed<T> {
    Err(Fault { column, fault: fault.into(), remedy: remedy.into() })
}

struct Word {
    text: String,
    column: usize,
}

/// The words between two commas.
struct Clause {
    words: Vec<Word>,
    /// Column of the comma or the end.
    end: usize,
}

impl FromStr for Trigger {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let refused =
            |Fault { column, fault, remedy }| RecordingError::Trigger { text: text.into(), column, fault, remedy };
        Ok(trigger(text).map_err(refused)?)
    }
}

fn trigger(text: &str) -> Parsed<Trigger> {
    let clauses = clauses(text)?;
    let mut trigger = Trigger::from(condition(&clauses[0])?);
    let mut value: Vec<String> = Vec::new();
    for clause in &clauses[1..] {
        let Some((option, remainder)) = clause.words.split_first() else {
            return fault(clause.end, "no option after a comma", format!("Remove it, or add {}.", list(&OPTIONS)));
        };
        if value.contains(&option.text) {
            return fault(option.column, format!("{} is stated twice", option.text), "State it once.");
        }
        value.push(option.text.clone());
        match option.text.as_str() {
            "hysteresis" => set_hysteresis(&mut trigger.condition, option, number(remainder, option, clause.end)?)?,
            "delay" => trigger.delay = ticks(remainder, option, clause.end)?,
            "hold-off" => trigger.hold_off = ticks(remainder, option, clause.end)?,
            "auto" => trigger.auto = Some(ticks(remainder, option, clause.end)?),
            _ => return unknown(option, "option", &OPTIONS),
        }
    }
    Ok(trigger)
}

fn condition(clause: &Clause) -> Parsed<Condition> {
    let (name, verb, remainder) = match &clause.words[..] {
        [] => return fault(1, "the text is empty", EXAMPLE),
        [word] if word.text == "immediate" => return Ok(Condition::Immediate),
        [_] => return fault(clause.end, "a verb is missing after the signal", EXAMPLE),
        [name, verb, remainder @ ..] => (name, verb, remainder),
    };
    let level = || number(remainder, verb, clause.end);
    let through = |slope| match remainder {
        [word, remainder @ ..] if word.text == "through" => {
            Ok(Test::Edge { slope, level: number(remainder, word, clause.end)?, hysteresis: 0.0 })
        }
        _ => {
            let column = remainder.first().map_or(clause.end, |word| word.column);
            fault(column, format!("`through` is missing after `{}`", verb.text), EXAMPLE)
        }
    };
    let test = match verb.text.as_str() {
        "above" => Test::Above(level()?),
        "below" => Test::Below(level()?),
        "rises" => through(Slope::Rising)?,
        "falls" => through(Slope::Falling)?,
        "crosses" => Test::Edge { slope: Slope::Both, level: level()?, hysteresis: 0.0 },
        "enters" => window(Side::Enters, remainder, clause.end)?,
        "leaves" => window(Side::Leaves, remainder, clause.end)?,
        "is" => Test::Is(whole(remainder, verb, clause.end)?),
        "becomes" => Test::Becomes(whole(remainder, verb, clause.end)?),
        "changes" => match remainder {
            [] => Test::Changes,
            [word, ..] => return fault(word.column, format!("unexpected `{}`", word.text), "`changes` has no number."),
        },
        _ => return unknown(verb, "verb", &VERBS),
    };
    Ok(Condition::Signal { name: name.text.clone(), test })
}

fn window(side: Side, words: &[Word], end: usize) -> Parsed<Test> {
    let column = words.first().map_or(end, |word| word.column);
    let text: String = words.iter().map(|word| word.text.as_str()).collect();
    let Some((low, high)) = text.split_once("..") else {
        return fault(column, "a band is missing", "Write its two ends like -0.1..0.1.");
    };
    let (low, high) = (finite(low, column)?, finite(high, column)?);
    if low > high {
        return fault(column, format!("the band {low}..{high} is empty"), "State the lower end first.");
    }
    Ok(Test::Window { side, low, high, hysteresis: 0.0 })
}

/// A hysteresis is for edges and bands, and must be smaller than half of a band that is left.
fn set_hysteresis(condition: &mut Condition, option: &Word, value: f64) -> Parsed<()> {
    if value < 0.0 {
        return fault(
            option.column,
            format!("negative hysteresis {value}"),
            "A hysteresis is a distance; drop the sign.",
        );
    }
    match condition {
        Condition::Signal { test: Test::Window { side: Side::Leaves, low, high, .. }, .. }
            if *low + value > *high - value =>
        {
            let remedy = format!("Use at most half its width, {}.", super::number(0.5 * (*high - *low)));
            fault(option.column, format!("the hysteresis {value} is too large for the band"), remedy)
        }
        Condition::Signal { test: Test::Edge { hysteresis, .. } | Test::Window { hysteresis, .. }, .. } => {
            *hysteresis = value;
            Ok(())
        }
        _ => fault(
            option.column,
            "only edges and bands have a hysteresis",
            "Remove it, or use `rises through`, `falls through`, `crosses`, `enters` or `leaves`.",
        ),
    }
}

/// The single word after `before`.
fn single<'a>(words: &'a [Word], before: &Word, end: usize) -> Parsed<&'a Word> {
    match words {
        [word] => Ok(word),
        [] => fault(end, format!("a number is missing after `{}`", before.text), EXAMPLE),
        [_, word, ..] => fault(
            word.column,
            format!("unexpected `{}`", word.text),
            "State one number without a unit: signals are in SI units, times in ticks; options follow after a comma.",
        ),
    }
}

fn number(words: &[Word], before: &Word, end: usize) -> Parsed<f64> {
    let word = single(words, before, end)?;
    finite(&word.text, word.column)
}

fn finite(text: &str, column: usize) -> Parsed<f64> {
    // The bench prints the true minus.
    match text.replace('\u{2212}', "-").parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => fault(column, format!("\"{text}\" is not a finite number"), "Write it like -0.5 or 2e-3, without a unit."),
    }
}

fn whole(words: &[Word], before: &Word, end: usize) -> Parsed<i32> {
    let word = single(words, before, end)?;
    word.text.replace('\u{2212}', "-").parse().or_else(|_| {
        let remedy = "For other values write a band like `enters 2.4..2.6`.";
        fault(word.column, format!("\"{}\" is not a whole number of 32 bits", word.text), remedy)
    })
}

fn ticks(words: &[Word], before: &Word, end: usize) -> Parsed<u64> {
    let word = single(words, before, end)?;
    word.text.parse().or_else(|_| {
        let remedy = "Times are in ticks: seconds times the tick rate.";
        fault(word.column, format!("\"{}\" is not a whole number of ticks", word.text), remedy)
    })
}

fn unknown<T>(word: &Word, what: &str, names: &[&str]) -> Parsed<T> {
    let remedy = match nearest(&word.text, names.iter().copied()) {
        Some(nearest) => format!("Did you mean `{nearest}`?"),
        None => format!("Use one of {}.", list(names)),
    };
    fault(word.column, format!("unknown {what} `{}`", word.text), remedy)
}

fn list(names: &[&str]) -> String {
    names.join(", ")
}

/// Splits at commas and spaces, except within double quotes.
fn clauses(text: &str) -> Parsed<Vec<Clause>> {
    let mut clauses = vec![Clause { words: Vec::new(), end: 0 }];
    let mut letters = text.chars().zip(1..).peekable();
    while let Some((letter, column)) = letters.next() {
        let words = &mut clauses.last_mut().expect("there is always one").words;
        match letter {
            ',' => {
                clauses.last_mut().expect("there is always one").end = column;
                clauses.push(Clause { words: Vec::new(), end: 0 });
            }
            '"' => {
                let mut text = String::new();
                loop {
                    match letters.next() {
                        Some(('"', _)) if letters.next_if(|(next, _)| *next == '"').is_some() => text.push('"'),
                        Some(('"', _)) => break,
                        Some((letter, _)) => text.push(letter),
                        None => return fault(column, "this quote is not closed", "End the name with a double quote."),
                    }
                }
                words.push(Word { text, column });
            }
            _ if letter.is_whitespace() => {}
            _ => {
                let mut text = String::from(letter);
                while let Some((letter, _)) =
                    letters.next_if(|(next, _)| !next.is_whitespace() && !",\"".contains(*next))
                {
                    text.push(letter);
                }
                words.push(Word { text, column });
            }
        }
    }
    clauses.last_mut().expect("there is always one").end = text.chars().count() + 1;
    Ok(clauses)
}
