//! Comments: the documentation of the model as plain text.

use super::text::WIDTH;

/// Documentation as paragraphs of plain text. A line that is indented by two spaces, such as an equation, stays a
/// separate line, and so does an item of a list.
pub(crate) fn plain(markdown: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut ended = true;
    for line in markdown.lines().filter(|line| !line.trim_start().starts_with("```")) {
        let text = without_marks(line);
        let separate = line.starts_with("  ") || line.starts_with("- ");
        match out.last_mut() {
            Some(paragraph) if !ended && !separate && !text.trim().is_empty() => {
                paragraph.push(' ');
                paragraph.push_str(text.trim());
            }
            _ if text.trim().is_empty() => {}
            _ if line.starts_with("  ") => out.push(format!("  {}", text.trim())),
            _ => out.push(text.trim().into()),
        }
        ended = line.starts_with("  ") || text.trim().is_empty();
    }
    out
}

/// Without the marks of Markdown: `[`Stribeck`](super::Stribeck)` is `Stribeck`; `u[k]` and `[rad]` stay.
fn without_marks(line: &str) -> String {
    let mut out = String::new();
    let mut remainder = line;
    while let Some(open) = remainder.find('[') {
        let (before, bracket) = remainder.split_at(open);
        out.push_str(before);
        let close = bracket.find(']').unwrap_or(bracket.len() - 1);
        let (inside, after) = (&bracket[1..close.max(1)], &bracket[close + 1..]);
        if let Some(end) = after.strip_prefix('(').and_then(|target| target.find(')')) {
            out.push_str(inside);
            remainder = &after[end + 2..];
        } else if inside.starts_with('`') {
            out.push_str(inside);
            remainder = after;
        } else {
            out.push('[');
            remainder = &bracket[1..];
        }
    }
    out.push_str(remainder);
    out.replace("**", "").replace('`', "")
}

/// A block comment of paragraphs, filled to the width.
pub(super) fn comment(indent: &str, paragraphs: &[String]) -> String {
    let mut lines = Vec::new();
    for paragraph in paragraphs.iter().filter(|p| !p.is_empty()) {
        let paragraph = paragraph.replace("*/", "* /").replace("/*", "/ *");
        if paragraph.starts_with("  ") {
            lines.push(paragraph);
            continue;
        }
        let mut line = String::new();
        for word in paragraph.split_whitespace() {
            if !line.is_empty() && indent.len() + 4 + line.chars().count() + word.chars().count() > WIDTH {
                lines.push(std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
        lines.push(line);
    }
    if lines.is_empty() { String::new() } else { format!("{indent}/* {} */\n", lines.join(&format!("\n{indent} * "))) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn documentation_becomes_plain_text_with_its_equations_in_lines() {
        let doc = "Friction with the curve of [`Stribeck`](super::Stribeck),\nsee [`Self::rate`].\n\n  \
                   ż = Ω − σ₀·|Ω|·z / g\n  g = M_K [N m]\n\nBy **Dahl** at `u[k]`, [here](https://x.y).\n- one\n- two\n  three";
        let expected = [
            "Friction with the curve of Stribeck, see Self::rate.",
            "  ż = Ω − σ₀·|Ω|·z / g",
            "  g = M_K [N m]",
            "By Dahl at u[k], here.",
            "- one",
            "- two",
            "  three",
        ];
        assert_eq!(plain(doc), expected);
        assert!(plain("").is_empty());
        assert_eq!(plain("an open [bracket"), ["an open [bracket"]);
    }

    #[test]
    fn a_comment_cannot_end_early() {
        assert_eq!(comment("", &["a */ b".into(), "  c = d".into()]), "/* a * / b\n *   c = d */\n");
    }
}
