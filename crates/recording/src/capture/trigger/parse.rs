//! Reads a trigger, and says what, where and how to mend.

use crate::RecordingError;
use std::str::FromStr;

use super::{Condition, Side, Slope, Test, Trigger};
use stickslip_base::Error;
use stickslip_base::parameters::schema::nearest;

const VERBS: [&str; 10] =
    ["above", "below", "rises", "falls", "crosses", "enters", "leaves", "is", "becomes", "changes"];
const OPTIONS: [&str; 4] = ["hysteresis", "delay", "hold-off", "auto"];
const EXAMPLE: &str = "Write it like `velocity rises through 0.1, hysteresis 0.02`, or `immediate`.";

/// What is wrong, and in which column, counted from 1.
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
    let mut given: Vec<String> = Vec::new();
    for clause in &clauses[1..] {
        let Some((option, rest)) = clause.words.split_first() else {
            return fault(clause.end, "nothing stands after a comma", format!("Remove it, or add {}.", list(&OPTIONS)));
        };
        if given.contains(&option.text) {
            return fault(option.column, format!("{} is given twice", option.text), "Say it once.");
        }
        given.push(option.text.clone());
        match option.text.as_str() {
            "hysteresis" => set_hysteresis(&mut trigger.condition, option, number(rest, option, clause.end)?)?,
            "delay" => trigger.delay = ticks(rest, option, clause.end)?,
            "hold-off" => trigger.hold_off = ticks(rest, option, clause.end)?,
            "auto" => trigger.auto = Some(ticks(rest, option, clause.end)?),
            _ => return unknown(option, "option", &OPTIONS),
        }
    }
    Ok(trigger)
}

fn condition(clause: &Clause) -> Parsed<Condition> {
    let (name, verb, rest) = match &clause.words[..] {
        [] => return fault(1, "it says nothing", EXAMPLE),
        [word] if word.text == "immediate" => return Ok(Condition::Immediate),
        [_] => return fault(clause.end, "what the signal does is missing", EXAMPLE),
        [name, verb, rest @ ..] => (name, verb, rest),
    };
    let level = || number(rest, verb, clause.end);
    let through = |slope| match rest {
        [word, rest @ ..] if word.text == "through" => {
            Ok(Test::Edge { slope, level: number(rest, word, clause.end)?, hysteresis: 0.0 })
        }
        _ => {
            let column = rest.first().map_or(clause.end, |word| word.column);
            fault(column, format!("`through` is missing after `{}`", verb.text), EXAMPLE)
        }
    };
    let test = match verb.text.as_str() {
        "above" => Test::Above(level()?),
        "below" => Test::Below(level()?),
        "rises" => through(Slope::Rising)?,
        "falls" => through(Slope::Falling)?,
        "crosses" => Test::Edge { slope: Slope::Both, level: level()?, hysteresis: 0.0 },
        "enters" => window(Side::Enters, rest, clause.end)?,
        "leaves" => window(Side::Leaves, rest, clause.end)?,
        "is" => Test::Is(whole(rest, verb, clause.end)?),
        "becomes" => Test::Becomes(whole(rest, verb, clause.end)?),
        "changes" => match rest {
            [] => Test::Changes,
            [word, ..] => return fault(word.column, format!("`{}` is too much", word.text), "`changes` stands alone."),
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
        return fault(column, format!("the band {low}..{high} is empty"), "Give the lower end first.");
    }
    Ok(Test::Window { side, low, high, hysteresis: 0.0 })
}

/// A hysteresis belongs to edges and windows, and must leave something of the band that is left.
fn set_hysteresis(condition: &mut Condition, option: &Word, given: f64) -> Parsed<()> {
    if given < 0.0 {
        return fault(option.column, format!("the hysteresis is {given}"), "It is a distance; drop the sign.");
    }
    match condition {
        Condition::Signal { test: Test::Window { side: Side::Leaves, low, high, .. }, .. }
            if *low + given > *high - given =>
        {
            let remedy = format!("Take at most half its width, {}.", super::number(0.5 * (*high - *low)));
            fault(option.column, format!("with hysteresis {given} nothing of the band is left to leave"), remedy)
        }
        Condition::Signal { test: Test::Edge { hysteresis, .. } | Test::Window { hysteresis, .. }, .. } => {
            *hysteresis = given;
            Ok(())
        }
        _ => fault(
            option.column,
            "only edges and bands have a hysteresis",
            "Remove it, or say `rises through`, `falls through`, `crosses`, `enters` or `leaves`.",
        ),
    }
}

/// The one word that belongs after `before`.
fn single<'a>(words: &'a [Word], before: &Word, end: usize) -> Parsed<&'a Word> {
    match words {
        [word] => Ok(word),
        [] => fault(end, format!("a number is missing after `{}`", before.text), EXAMPLE),
        [_, word, ..] => fault(
            word.column,
            format!("`{}` is too much", word.text),
            "One number, without a unit: signals are in SI units, times in ticks; options follow after a comma.",
        ),
    }
}

fn number(words: &[Word], before: &Word, end: usize) -> Parsed<f64> {
    let word = single(words, before, end)?;
    finite(&word.text, word.column)
}

fn finite(text: &str, column: usize) -> Parsed<f64> {
    // The true minus is what the bench itself prints.
    match text.replace('\u{2212}', "-").parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => fault(column, format!("\"{text}\" is no finite number"), "Write it like -0.5 or 2e-3, without a unit."),
    }
}

fn whole(words: &[Word], before: &Word, end: usize) -> Parsed<i32> {
    let word = single(words, before, end)?;
    word.text.replace('\u{2212}', "-").parse().or_else(|_| {
        let remedy = "For other values write a band like `enters 2.4..2.6`.";
        fault(word.column, format!("\"{}\" is no whole number of 32 bits", word.text), remedy)
    })
}

fn ticks(words: &[Word], before: &Word, end: usize) -> Parsed<u64> {
    let word = single(words, before, end)?;
    word.text.parse().or_else(|_| {
        let remedy = "Times are in ticks: seconds times the tick rate.";
        fault(word.column, format!("\"{}\" is no whole number of ticks", word.text), remedy)
    })
}

fn unknown<T>(word: &Word, what: &str, known: &[&str]) -> Parsed<T> {
    let remedy = match nearest(&word.text, known.iter().copied()) {
        Some(nearest) => format!("Did you mean `{nearest}`?"),
        None => format!("There are {}.", list(known)),
    };
    fault(word.column, format!("`{}` is no {what}", word.text), remedy)
}

fn list(known: &[&str]) -> String {
    known.join(", ")
}

/// Splits at commas and spaces, except within double quotes.
fn clauses(text: &str) -> Parsed<Vec<Clause>> {
    let mut clauses = vec![Clause { words: Vec::new(), end: 0 }];
    let mut letters = text.chars().zip(1..).peekable();
    while let Some((letter, column)) = letters.next() {
        let words = &mut clauses.last_mut().expect("there is one from the start").words;
        match letter {
            ',' => {
                clauses.last_mut().expect("there is one from the start").end = column;
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
    clauses.last_mut().expect("there is one from the start").end = text.chars().count() + 1;
    Ok(clauses)
}
