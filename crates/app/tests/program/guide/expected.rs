//! Compares the output of commands with the page.
//!
//! A line `…` replaces any number of lines, `…` within a line any text. Everything else is compared exactly: the same
//! seed gives the same numbers on every machine.

/// Compares the lines of a page with the output. The error names the first difference.
pub(crate) fn compare(expected: &[String], printed: &[String]) -> Result<(), String> {
    align(expected, printed, &[fits]).map(|_| ())
}

/// The lines of the page with the numbers of the output. `Err` if more than numbers has changed.
pub(crate) fn updated(expected: &[String], printed: &[String]) -> Result<Vec<String>, String> {
    // A line that still fits is preferred to others of the same shape.
    let pairs = align(expected, printed, &[fits, |pattern, line| fits(&shape(pattern), &shape(line))])?;
    let mut lines = Vec::new();
    for (pattern, line) in expected.iter().zip(pairs) {
        lines.push(match line {
            Some(line) if !fits(pattern, line) && pattern.contains('…') => {
                return Err(format!("\"{pattern}\" has numbers and `…`: edit it by hand"));
            }
            Some(line) if !fits(pattern, line) => line.clone(),
            _ => pattern.clone(),
        });
    }
    Ok(lines)
}

/// The output line for each expected line, by the first criterion that a line meets; none for a line `…`.
fn align<'a>(
    expected: &[String],
    printed: &'a [String],
    criteria: &[fn(&str, &str) -> bool],
) -> Result<Vec<Option<&'a String>>, String> {
    let (mut pairs, mut next, mut skips) = (Vec::new(), 0, false);
    for pattern in expected {
        if pattern == "…" {
            skips = true;
            pairs.push(None);
            continue;
        }
        let reach = if skips { printed.len() } else { printed.len().min(next + 1) };
        let first = |fits: &fn(&str, &str) -> bool| (next..reach).find(|&i| fits(pattern, &printed[i]));
        let Some(found) = criteria.iter().find_map(first) else {
            let there = printed.get(next).map_or("nothing", String::as_str);
            return Err(format!("the page has\n  {pattern}\nbut the output is\n  {there}"));
        };
        pairs.push(Some(&printed[found]));
        (next, skips) = (found + 1, false);
    }
    match printed.get(next) {
        Some(line) if !skips => Err(format!("the output has a line that the page lacks:\n  {line}")),
        _ => Ok(pairs),
    }
}

/// Whether a line matches the pattern, with any text for each `…` in it.
fn fits(pattern: &str, line: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('…') else { return pattern == line };
    let Some(mut line) = line.strip_prefix(start) else { return false };
    let mut parts: Vec<&str> = rest.split('…').collect();
    let end = parts.pop().unwrap_or_default();
    for part in parts {
        let Some((_, after)) = line.split_once(part) else { return false };
        line = after;
    }
    line.ends_with(end)
}

/// A line with `#` for each number of any length, and one space for several.
fn shape(line: &str) -> String {
    let mut shape = String::new();
    for c in line.chars() {
        let digit = c.is_ascii_digit() || (c == '.' && shape.ends_with('#'));
        let c = if digit { '#' } else { c };
        if !("# ".contains(c) && shape.ends_with(c)) {
            shape.push(c);
        }
    }
    shape
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<String> {
        text.lines().map(String::from).collect()
    }

    #[test]
    fn only_marked_text_may_be_left_out() {
        let printed = lines("M_S 0.2996 N·m\nM_K 0.18 N·m\ntook 11.2 s: fast");
        for good in ["M_S 0.2996 N·m\nM_K 0.18 N·m\ntook … s: fast", "…\ntook … s:…", "M_S 0.2996 N·m\n…"]
        {
            assert_eq!(compare(&lines(good), &printed), Ok(()), "{good}");
        }
        for bad in ["M_S 0.2996 N·m", "M_S 0.2997 N·m\n…", "…\nM_K 0.18 N·m", "M_K 0.18 N·m\n…", "…\ntook … s"]
        {
            assert!(compare(&lines(bad), &printed).is_err(), "{bad}");
        }
    }

    #[test]
    fn new_numbers_are_copied_and_new_words_are_refused() {
        let page = lines("M_S  0.30 N·m\n…\ntook … s");
        let printed = lines("M_S  0.2996 N·m\nM_K 0.18\ntook 3 s");
        assert_eq!(updated(&page, &printed), Ok(lines("M_S  0.2996 N·m\n…\ntook … s")));
        assert_eq!(updated(&lines("…\n2 sticks\n…"), &lines("1 sticks\n2 sticks\n3 N")), Ok(lines("…\n2 sticks\n…")));
        assert!(updated(&page, &lines("M_T  0.2996 N·m\ntook 3 s")).is_err());
        assert!(updated(&lines("… 3 N·m"), &lines("M_S 4 N·m")).is_err());
    }
}
