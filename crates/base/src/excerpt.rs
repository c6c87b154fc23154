//! Text of users within messages: short, on one line, without control characters.
//!
//! A cell may have 300,000 characters and a line 20 MB; a message repeats only their beginning and states their length.

/// Longest text that is repeated completely [characters].
const LONGEST: usize = 80;
/// Characters of a longer text that are repeated.
const BEGINNING: usize = 60;
/// Longest message of a parser [characters]; it contains its own quotations.
const MESSAGE: usize = 600;
/// Length at which a list of names ends [characters].
const LIST: usize = 500;

/// A text of a user for a message: complete up to 80 characters, otherwise its beginning and its length. Control
/// characters are escaped, since a terminal would obey them.
pub fn excerpt(text: &str) -> String {
    cut(text, LONGEST, BEGINNING).replace('\n', "\\n")
}

/// A message that may contain text of a user: complete up to 600 characters, otherwise its beginning and its length.
pub fn message(text: &str) -> String {
    cut(text, MESSAGE, MESSAGE - 100)
}

/// The message of a parser on one line, cut as [`message`]. Use the message without the quoted line of the file.
pub fn parser_message(text: &str) -> String {
    message(&text.trim().replace('\n', ", "))
}

/// Names in a row, separated by commas, each cut; a long list ends with its number of names.
pub fn list<S: AsRef<str>>(names: &[S]) -> String {
    let mut text = String::new();
    for (index, name) in names.iter().enumerate() {
        if index > 0 {
            text += ", ";
        }
        if text.len() > LIST {
            return format!("{text}… ({} in all)", names.len());
        }
        text += &excerpt(name.as_ref());
    }
    text
}

/// Line and column of a byte of a text, from 1; columns are counted in characters.
pub fn place(text: &str, offset: usize) -> [usize; 2] {
    let mut offset = offset.min(text.len());
    while !text.is_char_boundary(offset) {
        offset -= 1;
    }
    let before = &text[..offset];
    let start = before.rfind('\n').map_or(0, |end| end + 1);
    [1 + before.bytes().filter(|byte| *byte == b'\n').count(), 1 + before[start..].chars().count()]
}

fn cut(text: &str, longest: usize, beginning: usize) -> String {
    let (mut shown, mut length) = (String::new(), 0);
    let mut kept = None;
    for character in text.chars() {
        let escaped = character.is_control() && character != '\n';
        let width = if escaped { character.escape_default().count() } else { 1 };
        if length + width > beginning && kept.is_none() {
            kept = Some(shown.len());
        }
        if length + width > longest {
            let end = kept.unwrap_or(shown.len());
            return format!("{}… ({} characters)", &shown[..end], text.chars().count());
        }
        length += width;
        if escaped { shown.extend(character.escape_default()) } else { shown.push(character) }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_cut_with_its_length() {
        assert_eq!(excerpt("Prüfstand 3"), "Prüfstand 3");
        assert_eq!(excerpt(&"ü".repeat(80)), "ü".repeat(80));
        assert_eq!(excerpt(&"ü".repeat(300_000)), format!("{}… (300000 characters)", "ü".repeat(60)));
    }

    #[test]
    fn control_characters_do_not_reach_the_terminal() {
        assert_eq!(excerpt("a\u{1b}[31m\nb"), "a\\u{1b}[31m\\nb");
        assert_eq!(excerpt(&"\0".repeat(100)), format!("{}… (100 characters)", "\\u{0}".repeat(12)));
        assert_eq!(parser_message("unexpected key\nexpected `=`\n"), "unexpected key, expected `=`");
    }

    #[test]
    fn a_long_list_ends_with_its_number_of_names() {
        assert_eq!(list(&["a", "b"]), "a, b");
        let names: Vec<String> = (0..10_000).map(|k| format!("name {k}")).collect();
        let text = list(&names);
        assert!(text.len() < 600 && text.ends_with("… (10000 in all)"), "{text}");
    }

    #[test]
    fn places_count_lines_and_characters() {
        assert_eq!(place("ä = 1\nb = ?", 11), [2, 5]);
        assert_eq!(place("ä", 1), [1, 1]);
        assert_eq!(place("a", 9), [1, 2]);
    }
}
