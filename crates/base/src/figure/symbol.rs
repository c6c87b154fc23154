//! Symbols as they are printed: italic, the index upright and below. `M_S` becomes *M* with a small S.

/// A piece of a text in one style.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Run<'a> {
    /// Upright text.
    Plain(&'a str),
    /// A symbol and its index, which may be empty.
    Symbol(&'a str, &'a str),
}

/// Latin letters that are symbols when a word of the text names them: "viscous friction b", "time t".
const NAMED: &str = "btMFJK";

/// Splits a text. A symbol is one letter with an index (`M_S`, `Ω_Strib`, `σ₀`), a single Greek letter, or one of a few
/// Latin letters after the word that it denotes; names like `breakaway_torque` and units have no symbols.
pub(crate) fn runs(text: &str) -> Vec<Run<'_>> {
    let mut runs = Vec::new();
    let mut plain = 0;
    let mut before = ' ';
    for (at, letter) in text.char_indices() {
        let begins_word = !(before.is_alphanumeric() || before == '_' || "/·^".contains(before));
        before = letter;
        if at < plain || !begins_word || !letter.is_alphabetic() {
            continue;
        }
        let rest = &text[at + letter.len_utf8()..];
        let Some(index) = index_of(letter, rest, &text[..at]) else { continue };
        if plain < at {
            runs.push(Run::Plain(&text[plain..at]));
        }
        let mark = rest.len() - rest.trim_start_matches('_').len();
        runs.push(Run::Symbol(&text[at..at + letter.len_utf8()], &rest[mark..index]));
        plain = at + letter.len_utf8() + index;
    }
    if plain < text.len() {
        runs.push(Run::Plain(&text[plain..]));
    }
    runs
}

/// Number of bytes of the rest that belong to the symbol that begins with this letter; `None` if it is not a symbol.
fn index_of(letter: char, rest: &str, before: &str) -> Option<usize> {
    let ends = |rest: &str| !rest.starts_with(|next: char| next.is_alphanumeric() || "_/·^".contains(next));
    if let Some(index) = rest.strip_prefix('_') {
        let length = index.find(|next: char| !next.is_alphanumeric()).unwrap_or(index.len());
        return (length > 0 && ends(&index[length..])).then_some(1 + length);
    }
    let digits = rest.find(|next: char| !('₀'..='₉').contains(&next)).unwrap_or(rest.len());
    let greek = ('Α'..='ω').contains(&letter);
    let word = before.strip_suffix(' ').and_then(|before| before.rsplit(|c: char| !c.is_alphabetic()).next());
    let named = NAMED.contains(letter) && word.is_some_and(|word| word.chars().count() > 2);
    ((greek || named) && ends(&rest[digits..])).then_some(digits)
}

/// The text in HTML, escaped.
pub(crate) fn html(text: &str) -> String {
    let run = |run: &Run<'_>| match run {
        Run::Plain(text) => escape(text),
        Run::Symbol(letter, "") => format!("<i>{}</i>", escape(letter)),
        Run::Symbol(letter, index) => format!("<i>{}</i><sub>{}</sub>", escape(letter), escape(&level(index))),
    };
    runs(text).iter().map(run).collect()
}

/// The text inside of an SVG `text`, escaped.
pub(super) fn svg(text: &str) -> String {
    let mut lowered = false;
    let run = |run: &Run<'_>| {
        let back = if std::mem::take(&mut lowered) { " dy=\"-3\"" } else { "" };
        match run {
            Run::Plain(text) if back.is_empty() => escape(text),
            Run::Plain(text) => format!("<tspan{back}>{}</tspan>", escape(text)),
            Run::Symbol(letter, index) => {
                lowered = !index.is_empty();
                let index = match *index {
                    "" => String::new(),
                    index => format!("<tspan dy=\"3\" font-size=\"75%\">{}</tspan>", escape(&level(index))),
                };
                format!("<tspan{back} font-style=\"italic\">{}</tspan>{index}", escape(letter))
            }
        }
    };
    runs(text).iter().map(run).collect()
}

/// An index with normal digits; the page lowers it.
fn level(index: &str) -> String {
    let digit = |letter: char| char::from_u32(letter as u32 - '₀' as u32 + '0' as u32).unwrap_or(letter);
    index.chars().map(|letter| if ('₀'..='₉').contains(&letter) { digit(letter) } else { letter }).collect()
}

/// Text between tags or in an attribute.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symbol_is_italic_and_its_index_upright() {
        assert_eq!(html("breakaway torque M_S"), "breakaway torque <i>M</i><sub>S</sub>");
        assert_eq!(html("Ω_Strib, 3 % of M_S."), "<i>Ω</i><sub>Strib</sub>, 3 % of <i>M</i><sub>S</sub>.");
        assert_eq!(html("bristle stiffness σ₀"), "bristle stiffness <i>σ</i><sub>0</sub>");
        assert_eq!(html("speed Ω, rad/s"), "speed <i>Ω</i>, rad/s");
        assert_eq!(html("viscous friction b"), "viscous friction <i>b</i>");
    }

    #[test]
    fn units_names_of_files_and_words_are_not_symbols() {
        for plain in ["breakaway_torque", "15.47 N, 0.3 V", "a step of 5 mN·m·s/rad", "model_b.toml", "0.3 t", "in F/K"]
        {
            assert_eq!(html(plain), plain);
        }
    }

    #[test]
    fn the_baseline_is_restored_after_an_index() {
        assert_eq!(
            svg("M_S & M_K"),
            "<tspan font-style=\"italic\">M</tspan><tspan dy=\"3\" font-size=\"75%\">S</tspan><tspan dy=\"-3\"> &amp; \
             </tspan><tspan font-style=\"italic\">M</tspan><tspan dy=\"3\" font-size=\"75%\">K</tspan>"
        );
        assert!(svg("Ω_aΩ_b Ω_c").ends_with("<tspan dy=\"3\" font-size=\"75%\">c</tspan>"));
    }

    #[test]
    fn nothing_of_a_text_is_lost() {
        for text in ["", "M_S", "_M_S_", "M_", "M__S", "ΩΩ Ω_x_y σ₀₁b t", "a b t, time t"] {
            let all: String = runs(text)
                .iter()
                .map(|run| match run {
                    Run::Plain(text) => (*text).to_owned(),
                    Run::Symbol(letter, index) if index.is_empty() || index.starts_with('₀') => {
                        format!("{letter}{index}")
                    }
                    Run::Symbol(letter, index) => format!("{letter}_{index}"),
                })
                .collect();
            assert_eq!(all, text);
        }
    }
}
