//! Stages of a check: each with its time, its budget and its say.

use std::time::{Duration, Instant};

use crate::pace::slowness;

/// What a stage that found no fault has to say.
pub(crate) enum Outcome {
    /// All checked.
    Passed,
    /// All checked, some at the second try: named, since a test must not become one that passes by luck.
    Again(Vec<String>),
    /// Not checked, and why.
    Skipped(String),
}

/// Tests as the test harness counts them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Counts {
    pub(crate) passed: u32,
    pub(crate) failed: u32,
    pub(crate) skipped: u32,
}

impl Counts {
    /// Adds a line of a test harness, `test result: ok. 12 passed; 0 failed; 1 ignored; …`, or of pytest, `2 failed,
    /// 30 passed, 1 skipped in 2.50s`; any other line changes nothing.
    pub(crate) fn read(&mut self, line: &str) {
        let harness = line.strip_prefix("test result: ").and_then(|rest| rest.split_once(". "));
        let results = match (harness, line.rsplit_once(" in ")) {
            (Some((_, results)), _) => results,
            (None, Some((results, time))) if time.starts_with(|c: char| c.is_ascii_digit()) => results,
            _ => return,
        };
        for (number, kind) in results.split([';', ',']).filter_map(|part| part.trim().split_once(' ')) {
            let count: u32 = number.parse().unwrap_or(0);
            match kind {
                "passed" => self.passed += count,
                "failed" | "error" | "errors" => self.failed += count,
                "ignored" | "skipped" => self.skipped += count,
                _ => {}
            }
        }
    }
}

/// The stages that have run.
#[derive(Default)]
pub(crate) struct Suite {
    /// Tests, plus each stage that failed without a failed test or was skipped.
    counts: Counts,
    skipped: Vec<String>,
    again: Vec<String>,
    failed: Vec<String>,
    times: Vec<String>,
}

impl Suite {
    /// Runs a stage. It fails by itself or by taking more than 1.5 × its budget, which is stretched where the machine is
    /// slow before and behind it; the next stages run all the same.
    pub(crate) fn stage(
        &mut self,
        name: &str,
        budget: Duration,
        work: impl FnOnce(&mut Counts) -> Result<Outcome, String>,
    ) {
        println!("\n== {name}");
        let mut counts = Counts::default();
        let before = slowness();
        let start = Instant::now();
        let outcome = work(&mut counts);
        let took = start.elapsed();
        self.finish(name, budget, (took, 0.5 * (before + slowness())), counts, outcome);
    }

    fn finish(
        &mut self,
        name: &str,
        budget: Duration,
        (took, slowness): (Duration, f64),
        counts: Counts,
        outcome: Result<Outcome, String>,
    ) {
        let machine = if slowness > 1.1 { format!(", the machine {slowness:.1} times slower") } else { String::new() };
        let time = format!("{name}: {:.1} s of {} s{machine}", took.as_secs_f64(), budget.as_secs());
        println!("== {time}");
        self.times.push(time);
        self.counts.passed += counts.passed;
        self.counts.failed += counts.failed;
        self.counts.skipped += counts.skipped;
        let outcome = match outcome {
            Ok(_) if took > budget.mul_f64(1.5 * slowness) => Err(format!(
                "took {:.1} s, more than 1.5 × its budget of {} s{machine}",
                took.as_secs_f64(),
                budget.as_secs()
            )),
            other => other,
        };
        match outcome {
            Ok(Outcome::Passed) => {}
            Ok(Outcome::Again(names)) => self.again.extend(names.iter().map(|which| format!("{name}: {which}"))),
            Ok(Outcome::Skipped(reason)) => {
                self.counts.skipped += 1;
                self.skipped.push(format!("{name}: {reason}"));
            }
            Err(reason) => {
                self.counts.failed += u32::from(counts.failed == 0);
                self.failed.push(format!("{name}: {reason}"));
            }
        }
    }

    /// Notes something that is not checked, beside the stages.
    pub(crate) fn skip(&mut self, what: String) {
        self.counts.skipped += 1;
        self.skipped.push(what);
    }

    /// The times, what was skipped, what failed, and the sum alone on the last line.
    pub(crate) fn summary(&self) -> String {
        let list =
            |word: &str, lines: &[String]| -> String { lines.iter().map(|line| format!("{word}{line}\n")).collect() };
        let Counts { passed, failed, skipped } = self.counts;
        format!(
            "{}{}{}{}{passed} passed, {failed} failed, {skipped} skipped",
            list("time: ", &self.times),
            list("skipped: ", &self.skipped),
            list("passed at the second try: ", &self.again),
            list("failed: ", &self.failed),
        )
    }

    /// Whether nothing failed.
    pub(crate) fn passed(&self) -> bool {
        self.failed.is_empty() && self.counts.failed == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn finished(took: Duration, counts: Counts, outcome: Result<Outcome, String>) -> Suite {
        let mut suite = Suite::default();
        suite.finish("stage", 10 * SECOND, (took, 1.0), counts, outcome);
        suite
    }

    #[test]
    fn the_lines_of_the_test_harness_add_up() {
        let mut counts = Counts::default();
        for line in [
            "running 3 tests",
            "test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 2 filtered out; finished in 0.00s",
            "test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.10s",
            "test result: of a user's own printing",
            "it passed in the end",
            "1 failed, 20 passed, 3 skipped, 1 error in 7.12s",
            "4 passed in 75.01s (0:01:15)",
        ] {
            counts.read(line);
        }
        assert_eq!(counts, Counts { passed: 39, failed: 4, skipped: 4 });
    }

    #[test]
    fn a_stage_beyond_its_budget_fails_and_one_within_passes() {
        let slow = finished(16 * SECOND, Counts::default(), Ok(Outcome::Passed));
        assert!(!slow.passed());
        assert!(slow.summary().contains("failed: stage: took 16.0 s, more than 1.5 × its budget of 10 s\n"));
        assert!(finished(14 * SECOND, Counts::default(), Ok(Outcome::Passed)).passed());
    }

    #[test]
    fn a_slow_machine_stretches_the_budget() {
        let on_slow = |took| {
            let mut suite = Suite::default();
            suite.finish("stage", 10 * SECOND, (took, 2.0), Counts::default(), Ok(Outcome::Passed));
            suite
        };
        assert!(on_slow(29 * SECOND).passed());
        let beyond = on_slow(31 * SECOND).summary();
        assert!(beyond.contains("failed: stage: took 31.0 s") && beyond.contains("the machine 2.0 times slower"));
    }

    #[test]
    fn a_skipped_stage_is_named_and_counted() {
        let suite = finished(SECOND, Counts::default(), Ok(Outcome::Skipped("no compiler".into())));
        assert!(suite.passed());
        assert!(suite.summary().contains("skipped: stage: no compiler\n"));
        assert!(suite.summary().ends_with("\n0 passed, 0 failed, 1 skipped"));
    }

    #[test]
    fn a_second_try_is_told() {
        let suite = finished(SECOND, Counts::default(), Ok(Outcome::Again(vec!["by::clock".into()])));
        assert!(suite.passed());
        assert!(suite.summary().contains("passed at the second try: stage: by::clock\n"));
    }

    #[test]
    fn a_failed_test_counts_once_and_a_stage_without_tests_counts_as_one() {
        let counts = Counts { passed: 7, failed: 2, skipped: 0 };
        let tests = finished(SECOND, counts, Err("a test failed".into()));
        assert!(tests.summary().ends_with("\n7 passed, 2 failed, 0 skipped"));
        let build = finished(SECOND, Counts::default(), Err("does not compile".into()));
        assert!(build.summary().ends_with("\n0 passed, 1 failed, 0 skipped"));
        assert!(!tests.passed() && !build.passed());
    }
}
