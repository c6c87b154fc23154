//! What a search asks for: `sweep law:bristle M_S>0.2 -tag:bad "with wheel"`.

use rusqlite::types::Value;

/// What a run is asked for by name, besides its parameters: the name, and what it is in the table.
const COLUMNS: [(&str, &str); 14] = [
    ("number", "number"),
    ("name", "name"),
    ("kind", "kind"),
    ("begun", "begun"),
    ("duration", "duration"),
    ("preset", "preset"),
    ("controller", "controller"),
    ("law", "law"),
    ("tag", "tags"),
    ("note", "note"),
    ("command", "command"),
    ("version", "version"),
    ("folder", "folder"),
    ("key", "key_value"),
];
/// The longest first: `>=` begins like `>`.
const OPERATORS: [&str; 6] = [">=", "<=", "!=", ">", "<", "="];

/// A search, understood.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Query {
    terms: Vec<Term>,
    /// What was not understood.
    pub(super) hints: Vec<String>,
    /// Whether runs in the bin are meant.
    deleted: bool,
}

#[derive(Clone, Debug, PartialEq)]
struct Term {
    not: bool,
    what: What,
}

#[derive(Clone, Debug, PartialEq)]
enum What {
    Word(String),
    Has { name: String, text: String },
    Compared { name: String, operator: &'static str, with: String },
}

impl Query {
    /// Whatever is typed: what makes no sense yet is left out and told.
    pub(super) fn parse(text: &str) -> Self {
        let mut query = Query::default();
        for token in tokens(text) {
            let (not, token) = match token.strip_prefix('-') {
                Some(rest) if !rest.is_empty() => (true, rest),
                _ => (false, token.as_str()),
            };
            match term(token) {
                Ok(What::Has { name, text }) if name == "is" => match text.as_str() {
                    "deleted" => query.deleted = true,
                    _ => query.hints.push(format!("is:{text}: there is is:deleted, for what is in the bin")),
                },
                Ok(what) => query.terms.push(Term { not, what }),
                Err(hint) => query.hints.push(hint),
            }
        }
        query
    }

    /// As a condition on a row of `run`, with its values.
    pub(super) fn condition(&self) -> (String, Vec<Value>) {
        let mut conditions = vec![if self.deleted { "deleted IS NOT NULL" } else { "deleted IS NULL" }.to_owned()];
        let mut values = Vec::new();
        for term in &self.terms {
            let condition = term.what.condition(&mut values);
            conditions.push(if term.not { format!("NOT coalesce({condition}, 0)") } else { condition });
        }
        (conditions.join(" AND "), values)
    }
}

impl What {
    fn condition(&self, values: &mut Vec<Value>) -> String {
        let mut put = |value: Value| {
            values.push(value);
            format!("?{}", values.len())
        };
        match self {
            What::Word(word) => format!("instr(words, {}) > 0", put(Value::Text(word.to_lowercase()))),
            What::Has { name, text } => {
                let text = put(Value::Text(text.to_lowercase()));
                if let Some(column) = column(name) {
                    return format!("instr(lower({column}), {text}) > 0");
                }
                let name = put(Value::Text(format!(".{name}.")));
                // Any part of a path, so that `wheel:lugre` finds the wheel's model.
                format!(
                    "EXISTS (SELECT 1 FROM value WHERE run = run.number AND instr('.' || path || '.', {name}) > 0 \
                     AND instr(lower(text), {text}) > 0)"
                )
            }
            What::Compared { name, operator, with } => {
                let number = with.parse::<f64>().ok();
                if let Some(column) = column(name) {
                    let with = put(number.map_or_else(|| Value::Text(with.clone()), Value::Real));
                    return format!("{column} {operator} {with}");
                }
                let (value, with) = match number {
                    Some(number) => ("value.number", put(Value::Real(number))),
                    None => ("value.text", put(Value::Text(with.clone()))),
                };
                let (symbol, end) = (put(Value::Text(name.clone())), put(Value::Text(format!(".{name}"))));
                format!(
                    "EXISTS (SELECT 1 FROM value WHERE value.run = run.number AND {value} {operator} {with} AND (value.path = \
                     {symbol} OR value.symbol = {symbol} OR substr(value.path, -length({end})) = {end}))"
                )
            }
        }
    }
}

fn column(name: &str) -> Option<&'static str> {
    COLUMNS.iter().find(|(known, _)| *known == name).map(|(_, column)| *column)
}

fn term(token: &str) -> Result<What, String> {
    let operator = OPERATORS.iter().filter_map(|operator| Some((token.find(operator)?, *operator)));
    // Of those that begin at the same place the first in the list.
    if let Some((at, operator)) = operator.min_by_key(|(at, _)| *at) {
        let (name, with) = (&token[..at], &token[at + operator.len()..]);
        if name.is_empty() || with.is_empty() {
            return Err(format!("{token}: write what {operator} how much, as M_S>0.2"));
        }
        if !matches!(operator, "=" | "!=") && with.parse::<f64>().is_err() && !matches!(name, "begun" | "version") {
            return Err(format!("{token}: {with} is no number, in SI units and without one behind it"));
        }
        return Ok(What::Compared { name: name.into(), operator, with: with.into() });
    }
    match token.split_once(':') {
        Some((name, text)) if !name.is_empty() && !text.is_empty() => {
            Ok(What::Has { name: name.into(), text: text.into() })
        }
        Some((name, "")) if !name.is_empty() => Err(format!("{token} lacks what it shall be")),
        _ => Ok(What::Word(token.into())),
    }
}

/// Words; what stands in quotes is one, and so is a comparison with spaces in it.
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
    fn words_keys_and_comparisons_are_told_apart() {
        let what =
            |text: &str| Query::parse(text).terms.into_iter().map(|term| (term.not, term.what)).collect::<Vec<_>>();
        let word = |text: &str| What::Word(text.into());
        let has = |name: &str, text: &str| What::Has { name: name.into(), text: text.into() };
        let compared =
            |name: &str, operator, with: &str| What::Compared { name: name.into(), operator, with: with.into() };
        assert_eq!(what("sweep \"with wheel\""), [(false, word("sweep")), (false, word("with wheel"))]);
        assert_eq!(what("law:lugre -tag:bad"), [(false, has("law", "lugre")), (true, has("tag", "bad"))]);
        assert_eq!(what("M_S>0.2"), [(false, compared("M_S", ">", "0.2"))]);
        assert_eq!(what("M_S >= 1e-3 x"), [(false, compared("M_S", ">=", "1e-3")), (false, word("x"))]);
        assert_eq!(what("M_S > -2"), [(false, compared("M_S", ">", "-2"))]);
        assert_eq!(what("tick_rate!=4000"), [(false, compared("tick_rate", "!=", "4000"))]);
        assert_eq!(what("\"half a quo"), [(false, word("half a quo"))]);
        assert!(Query::parse("is:deleted").deleted && what("is:deleted").is_empty() && what("").is_empty());
    }

    #[test]
    fn what_is_half_typed_is_left_out_and_told() {
        for text in ["M_S>", ">0.2", "M_S>much", "law:", "is:gone"] {
            let query = Query::parse(text);
            assert!(query.terms.is_empty() && query.hints.len() == 1, "{text}: {query:?}");
            assert!(query.hints[0].contains(text.trim_end_matches('>')), "{query:?}");
        }
    }
}
