//! Warnings and errors of `cargo doc`, except those about units that it reads as links.

/// Units of one word in brackets behind a quantity: "mean step [s]". Rustdoc reads `[s]` as a link.
const UNITS: [&str; 20] = [
    "s", "ns", "m", "kg", "A", "K", "rad", "mrad", "N", "V", "W", "J", "H", "Ω", "Hz", "px", "dB", "lines", "counts",
    "bytes",
];

/// The warnings and errors in the error output of `cargo doc`.
pub(crate) fn problems(stderr: &str) -> Vec<&str> {
    stderr.lines().filter(|line| is_problem(line)).collect()
}

fn is_problem(line: &str) -> bool {
    let Some(message) = line.strip_prefix("warning: ") else { return line.starts_with("error") };
    let link = message.strip_prefix("unresolved link to `").and_then(|rest| rest.strip_suffix('`'));
    let is_unit = link.is_some_and(|link| UNITS.contains(&link));
    // The number of the warnings above.
    let is_count = message.starts_with('`') && message.contains(") generated ");
    !is_unit && !is_count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_in_brackets_are_ignored() {
        let stderr = "warning: unresolved link to `s`\n  --> src/lib.rs:1:5\n = help: to escape …\n\
                      warning: `stickslip` (lib doc) generated 1 warning\n    Finished\n";
        assert_eq!(problems(stderr), [""; 0]);
    }

    #[test]
    fn broken_links_and_other_warnings_are_reported() {
        let lines = "warning: unresolved link to `Stribek`\nwarning: unclosed HTML tag `T`\nerror: could not document\n\
                     error[E0425]: cannot find value";
        assert_eq!(problems(lines), lines.lines().collect::<Vec<_>>());
    }
}
