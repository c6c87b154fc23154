//! Words that a data sheet does not use, in all texts of the repository: pages, help, messages, comments and names.
//!
//! CONTRIBUTING.md states the rule. The list has the patterns that were most frequent, with what to write instead.

use std::path::PathBuf;
use std::process::Command;

use crate::{root, text};

/// A word or phrase, and what to write instead. Letters are compared without case, `_` is a space.
const PHRASES: [(&str, &str); 48] = [
    ("whoever", "the role, or the passive"),
    ("whatever it", "the noun"),
    ("nobody", "the role, or the passive"),
    ("somebody", "the role, or the passive"),
    ("anybody", "the role, or the passive"),
    ("everybody", "the role, or the passive"),
    ("somebody's", "of the user, external"),
    ("nobody's", "unused"),
    ("anew", "again, restart"),
    ("lain", "been"),
    ("by the clock", "in real time"),
    ("of steel", "physical"),
    ("in force", "active"),
    ("the begin", "the start"),
    ("its begin", "its start"),
    ("one's own", "custom, external"),
    ("of the house", "built-in"),
    ("unless told otherwise", "default: …"),
    ("unless told", "default: …"),
    ("without it:", "default: …"),
    ("believe", "model, assume"),
    ("believes", "models, assumes"),
    ("believed", "modelled, assumed"),
    ("belief", "model, assumption"),
    ("beliefs", "models, assumptions"),
    ("is told", "is informed, is reported"),
    ("are told", "are informed, are reported"),
    ("was told", "was informed"),
    ("tells", "states, shows, lists"),
    ("says", "states, reports, lists"),
    ("what is told", "the noun"),
    ("what is known", "the noun"),
    ("what is seen", "the noun"),
    ("what is said", "the noun"),
    ("mend", "fix, correct"),
    ("mends", "fixes, corrects"),
    ("mended", "fixed, corrected"),
    ("put right", "correct"),
    ("so many", "a number of"),
    ("stands beside", "is listed next to"),
    ("stand beside", "are listed next to"),
    ("stands here", "is listed here"),
    ("stand here", "are listed here"),
    ("lies beside", "is next to"),
    ("lie beside", "are next to"),
    ("hangs on", "depends on"),
    ("hang on", "depend on"),
    ("brought along", "external"),
];

/// Places that need a phrase, with the reason.
const EXCEPTIONS: [(&str, &str, &str); 1] =
    [("docs/src/files.md", "believed", "names of columns that scripts read: tacho_believed_gain and others")];

/// A place with a phrase.
#[derive(Debug, PartialEq)]
struct Finding {
    line: usize,
    phrase: &'static str,
    instead: &'static str,
}

/// The phrases in a text.
fn findings(text: &str) -> Vec<Finding> {
    let mut found = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.to_lowercase().replace('_', " ");
        for (phrase, instead) in PHRASES {
            if contains(&line, phrase) {
                found.push(Finding { line: index + 1, phrase, instead });
            }
        }
        for phrase in ["is no", "are no"] {
            if denies_identity(&line, phrase) {
                found.push(Finding { line: index + 1, phrase, instead: "unknown, invalid, not a" });
            }
        }
    }
    found
}

/// Whether a line has a phrase as words of a text. Parts of a path or field, such as `compensation.belief`, are none.
fn contains(line: &str, phrase: &str) -> bool {
    line.match_indices(phrase).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        let after: Vec<char> = line[at + phrase.len()..].chars().take(2).collect();
        let starts = before.is_none_or(|c| !c.is_alphanumeric() && !"./:-\"`'=&<".contains(c));
        let ends = match after[..] {
            [] => true,
            ['.', next] => !next.is_alphanumeric(),
            [next, ..] => !next.is_alphanumeric() && !"/:-\"`=(>".contains(next) || phrase.ends_with(':'),
        };
        starts && ends
    })
}

/// Whether something "is no X" in the sense of "is not an X": "there is no X" and "is no longer" are usual.
fn denies_identity(line: &str, phrase: &str) -> bool {
    const USUAL: [&str; 10] =
        ["longer", "more", "less", "greater", "larger", "smaller", "later", "faster", "slower", "better"];
    let phrase = format!(" {phrase} ");
    line.match_indices(&phrase).any(|(at, _)| {
        let before = line[..at].rsplit(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
        let after = line[at + phrase.len()..].split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
        before != "there" && !USUAL.contains(&after)
    })
}

/// The files that people write and read; tables of studies and golden files are printed by programs.
fn files() -> Vec<String> {
    let endings =
        ["rs", "md", "ts", "svelte", "mjs", "py", "h", "c", "toml", "html", "yml"].map(|it| format!("*.{it}"));
    let list = Command::new("git").current_dir(root()).args(["ls-files", "--"]).args(endings).output();
    match list {
        Ok(list) if list.status.success() => String::from_utf8_lossy(&list.stdout).lines().map(str::to_owned).collect(),
        _ => walk(),
    }
}

/// All files with these endings in a tree without git.
fn walk() -> Vec<String> {
    let mut found = Vec::new();
    let mut left: Vec<PathBuf> =
        ["crates", "docs", "web/src", "web/tests", "python", "benches/src", "xtask"].map(|it| root().join(it)).into();
    left.extend(["README.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "CHANGELOG.md"].map(|it| root().join(it)));
    while let Some(path) = left.pop() {
        if path.is_dir() {
            let entries = std::fs::read_dir(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            left.extend(entries.map(|entry| entry.expect("an entry can be read").path()));
        } else if let Some(ending) = path.extension()
            && ["rs", "md", "ts", "svelte", "mjs", "py", "h", "c", "toml"].iter().any(|it| ending == *it)
        {
            let name = path.strip_prefix(root()).expect("it is in the tree");
            found.push(name.to_string_lossy().into_owned());
        }
    }
    found
}

#[test]
fn texts_use_the_words_of_a_data_sheet() {
    let files = files();
    assert!(files.len() > 900, "{} files", files.len());
    let mut wrong = Vec::new();
    for file in files.iter().filter(|file| !file.ends_with("house/words.rs")) {
        for Finding { line, phrase, instead } in findings(&text(file)) {
            if !EXCEPTIONS.iter().any(|(place, word, _)| file == place && phrase == *word) {
                wrong.push(format!("{file}:{line}: \"{phrase}\"; write: {instead}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{} places\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn a_phrase_is_found_as_words_and_not_within_words_or_paths() {
    let phrases = |text: &str| findings(text).iter().map(|it| it.phrase).collect::<Vec<_>>();
    assert_eq!(phrases("Nobody waits for it.\nfn nobody_waits() {}"), ["nobody", "nobody"]);
    assert_eq!(phrases("The value in force, and by the clock."), ["by the clock", "in force"]);
    assert_eq!(
        phrases("plain amendment in forced; `belief.toml`; compensation.belief = 1; belief: AssumedFriction<T>,"),
        [""; 0]
    );
    assert_eq!(phrases("/// X is no parameter"), ["is no"]);
    assert_eq!(phrases("there is no brake; it is no longer there; are no more"), [""; 0]);
}
