//! Queries of the catalogue: `sweep law:bristle M_S>0.2 -tag:bad "with wheel"`.

use std::cmp::Ordering;

use super::Value;
use super::entry::{Column, Entry};

/// The longest first: `>=` starts with `>`.
const OPERATORS: [&str; 6] = [">=", "<=", "!=", ">", "<", "="];

/// A parsed query.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Query {
    terms: Vec<Term>,
    /// Ignored terms, each with the reason.
    pub(super) hints: Vec<String>,
    /// Whether the query searches the bin.
    deleted: bool,
}

#[derive(Clone, Debug, PartialEq)]
struct Term {
    not: bool,
    condition: Condition,
}

#[derive(Clone, Debug, PartialEq)]
enum Condition {
    Word(String),
    Has { name: String, text: String },
    Compared { name: String, operator: &'static str, with: String },
}

impl Query {
    /// Parses any text; incomplete and invalid terms are ignored with a hint.
    pub(super) fn parse(text: &str) -> Self {
        let mut query = Query::default();
        for token in tokens(text) {
            let (not, token) = match token.strip_prefix('-') {
                Some(rest) if !rest.is_empty() => (true, rest),
                _ => (false, token.as_str()),
            };
            match term(token) {
                Ok(Condition::Has { name, text }) if name == "is" => match text.as_str() {
                    "deleted" => query.deleted = true,
                    _ => query.hints.push(format!("is:{text}: unknown state; is:deleted finds the runs in the bin")),
                },
                Ok(condition) => query.terms.push(Term { not, condition }),
                Err(hint) => query.hints.push(hint),
            }
        }
        query
    }

    /// Whether a run satisfies all terms.
    pub(super) fn finds(&self, entry: &Entry) -> bool {
        let deleted = entry.label.deleted.is_some();
        deleted == self.deleted && self.terms.iter().all(|term| term.condition.holds(entry) != term.not)
    }
}

impl Condition {
    fn holds(&self, entry: &Entry) -> bool {
        let contains = |text: &str, part: &str| text.to_lowercase().contains(&part.to_lowercase());
        match self {
            Condition::Word(word) => entry.contains(&word.to_lowercase()),
            Condition::Has { name, text } => match entry.column(name) {
                Some(Column::Text(value)) => contains(&value, text),
                Some(Column::Number(value)) => value.is_some_and(|value| contains(&value.to_string(), text)),
                // Matches any part of a path, so that `wheel:lugre` finds the wheel's model.
                None => entry.facts.values.iter().any(|value| {
                    format!(".{}.", value.path).contains(&format!(".{name}.")) && contains(&value.text, text)
                }),
            },
            Condition::Compared { name, operator, with } => match (entry.column(name), with.parse::<f64>()) {
                (Some(Column::Text(value)), _) => compares(operator, value.partial_cmp(with)),
                (Some(Column::Number(value)), Ok(with)) => value.is_some_and(|value| compare(operator, value, with)),
                (Some(Column::Number(_)), Err(_)) => false,
                (None, number) => {
                    let end = format!(".{name}");
                    let named = entry
                        .facts
                        .values
                        .iter()
                        .filter(|value| value.path == *name || value.symbol == *name || value.path.ends_with(&end));
                    let holds = |value: &Value| match &number {
                        Ok(with) => value.number.is_some_and(|value| compare(operator, value, *with)),
                        Err(_) => compares(operator, value.text.partial_cmp(with)),
                    };
                    named.into_iter().any(holds)
                }
            },
        }
    }
}

fn compare(operator: &str, value: f64, with: f64) -> bool {
    compares(operator, value.partial_cmp(&with))
}

/// Whether an operator holds for an order; always false for a NaN.
fn compares(operator: &str, order: Option<Ordering>) -> bool {
    order.is_some_and(|order| match operator {
        ">=" => order.is_ge(),
        "<=" => order.is_le(),
        "!=" => order.is_ne(),
        ">" => order.is_gt(),
        "<" => order.is_lt(),
        _ => order.is_eq(),
    })
}

fn term(token: &str) -> Result<Condition, String> {
    let operator = OPERATORS.iter().filter_map(|operator| Some((token.find(operator)?, *operator)));
    // Of operators at the same place, the first in the list.
    if let Some((at, operator)) = operator.min_by_key(|(at, _)| *at) {
        let (name, with) = (&token[..at], &token[at + operator.len()..]);
        if name.is_empty() || with.is_empty() {
            return Err(format!("{token}: incomplete comparison; write NAME{operator}VALUE, such as M_S>0.2"));
        }
        if !matches!(operator, "=" | "!=") && with.parse::<f64>().is_err() && !matches!(name, "begun" | "version") {
            return Err(format!("{token}: {with} is not a number; write the value in SI units, without the unit"));
        }
        return Ok(Condition::Compared { name: name.into(), operator, with: with.into() });
    }
    match token.split_once(':') {
        Some((name, text)) if !name.is_empty() && !text.is_empty() => {
            Ok(Condition::Has { name: name.into(), text: text.into() })
        }
        Some((name, "")) if !name.is_empty() => Err(format!("{token} has no value; write NAME:VALUE")),
        _ => Ok(Condition::Word(token.into())),
    }
}

/// Splits a text into terms; a quoted text is one term, and so is a comparison with spaces.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let (mut token, mut quoted) = (String::new(), false);
    for letter in text.chars().chain([' ']) {
        match letter {
            '"' => quoted = !quoted,
            space if space.is_whitespace() && !quoted => {
                if !token.is_empty() {
                    tokens.push(std::mem::take(&mut token));
                }
            }
            letter => token.push(letter),
        }
    }
    // A quote that is not closed yet.
    if !token.trim().is_empty() {
        tokens.push(token.trim().into());
    }
    let mut joined: Vec<String> = Vec::new();
    for token in tokens {
        let continues = OPERATORS.iter().any(|operator| token.starts_with(operator))
            || joined.last().is_some_and(|last| OPERATORS.iter().any(|operator| last.ends_with(operator)));
        match joined.last_mut().filter(|_| continues) {
            Some(last) => last.push_str(&token),
            None => joined.push(token),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_keys_and_comparisons_are_distinguished() {
        let terms = |text: &str| {
            Query::parse(text).terms.into_iter().map(|term| (term.not, term.condition)).collect::<Vec<_>>()
        };
        let word = |text: &str| Condition::Word(text.into());
        let has = |name: &str, text: &str| Condition::Has { name: name.into(), text: text.into() };
        let compared =
            |name: &str, operator, with: &str| Condition::Compared { name: name.into(), operator, with: with.into() };
        assert_eq!(terms("sweep \"with wheel\""), [(false, word("sweep")), (false, word("with wheel"))]);
        assert_eq!(terms("law:lugre -tag:bad"), [(false, has("law", "lugre")), (true, has("tag", "bad"))]);
        assert_eq!(terms("M_S>0.2"), [(false, compared("M_S", ">", "0.2"))]);
        assert_eq!(terms("M_S >= 1e-3 x"), [(false, compared("M_S", ">=", "1e-3")), (false, word("x"))]);
        assert_eq!(terms("M_S > -2"), [(false, compared("M_S", ">", "-2"))]);
        assert_eq!(terms("tick_rate!=4000"), [(false, compared("tick_rate", "!=", "4000"))]);
        assert_eq!(terms("\"half a quo"), [(false, word("half a quo"))]);
        assert!(Query::parse("is:deleted").deleted && terms("is:deleted").is_empty() && terms("").is_empty());
    }

    #[test]
    fn incomplete_terms_are_ignored_with_a_hint() {
        for text in ["M_S>", ">0.2", "M_S>much", "law:", "is:gone"] {
            let query = Query::parse(text);
            assert!(query.terms.is_empty() && query.hints.len() == 1, "{text}: {query:?}");
            assert!(query.hints[0].contains(text.trim_end_matches('>')), "{query:?}");
        }
    }
}
