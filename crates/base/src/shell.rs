//! Commands that users paste into a shell.

use std::path::Path;

/// A word for a POSIX shell: unchanged where it is safe, else in single quotes. Inside them only a single quote is
/// special. A word that begins with a dash, which a program takes for an option, gets `./` before it.
pub fn word(text: &str) -> String {
    let text = if text.starts_with('-') { format!("./{text}") } else { text.to_owned() };
    let is_safe = |c: char| c.is_alphanumeric() || "/._-+:,@%=".contains(c);
    if !text.is_empty() && text.chars().all(is_safe) {
        return text;
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

/// A path as a [`word`].
pub fn path(path: &Path) -> String {
    word(&path.to_string_lossy())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_words_back_as_they_were() {
        for text in [
            "axis.csv",
            "Achse 1 + Prüflauf (kalt).csv",
            "it's $HOME `x`.csv",
            "",
            "a;b&c|d",
            "~x",
            "*?[1]",
            "a\\b",
            "#1",
        ] {
            let output = std::process::Command::new("sh").arg("-c").arg(format!("printf %s {}", word(text))).output();
            assert_eq!(String::from_utf8(output.unwrap().stdout).unwrap(), text);
        }
        assert_eq!(word("-links.csv"), "./-links.csv");
        assert_eq!(path(Path::new("data/axis_1.csv")), "data/axis_1.csv");
    }
}
