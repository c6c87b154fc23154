//! Runs the stages of a check and reports their results, times and budgets.

use std::time::{Duration, Instant};

use crate::budget::Stage;
use crate::pace::slowness;

/// The result of a stage without failures.
pub(crate) enum Outcome {
    /// All checked.
    Passed,
    /// All checked, but these tests failed at the first try. They are listed, since a test must not pass by chance.
    Retried(Vec<String>),
    /// Not checked, with the reason.
    Skipped(String),
}

/// Numbers of tests in the output of a test program.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Counts {
    pub(crate) passed: u32,
    pub(crate) failed: u32,
    pub(crate) skipped: u32,
}

impl Counts {
    /// Adds a line of a test program, `test result: ok. 12 passed; 0 failed; 1 ignored; …`, or of pytest, `2 failed,
    /// 30 passed, 1 skipped in 2.50s`. Other lines change nothing.
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

/// A finished stage.
struct Finished {
    stage: Stage,
    took: Duration,
    /// Slowness of this machine during the stage, relative to the reference machine.
    slowness: f64,
}

/// The finished stages.
#[derive(Default)]
pub(crate) struct Suite {
    /// Tests, plus each stage that was skipped or failed without a failed test.
    counts: Counts,
    skipped: Vec<String>,
    retried: Vec<String>,
    failed: Vec<String>,
    finished: Vec<Finished>,
    /// The slowest test programs with their times.
    pub(crate) slowest: Vec<(String, Duration)>,
    /// Test programs and stages that did not run, since they passed with the same inputs.
    pub(crate) unchanged: Vec<String>,
    /// The slowness measured after the last stage, which is that before the next.
    pace: Option<f64>,
}

impl Suite {
    /// Runs a stage. It fails by its own error or when it takes more than 1.5 × its budget, which is extended in
    /// proportion when the machine is slow before and after the stage. The following stages run in either case.
    pub(crate) fn stage(&mut self, stage: Stage, work: impl FnOnce(&mut Counts) -> Result<Outcome, String>) {
        println!("\n== {}", stage.name);
        let mut counts = Counts::default();
        let before = self.pace.unwrap_or_else(slowness);
        let start = Instant::now();
        let outcome = work(&mut counts);
        let took = start.elapsed();
        let after = slowness();
        self.pace = Some(after);
        self.finish(Finished { stage, took, slowness: 0.5 * (before + after) }, counts, outcome);
    }

    fn finish(&mut self, finished: Finished, counts: Counts, outcome: Result<Outcome, String>) {
        let Finished { stage: Stage { name, budget }, took, slowness } = finished;
        println!("== {name}: {:.1} s of {} s{}", took.as_secs_f64(), budget.as_secs(), machine(slowness));
        self.finished.push(finished);
        self.counts.passed += counts.passed;
        self.counts.failed += counts.failed;
        self.counts.skipped += counts.skipped;
        match outcome.and_then(|outcome| within(budget, took, slowness).map(|()| outcome)) {
            Ok(Outcome::Passed) => {}
            Ok(Outcome::Retried(names)) => self.retried.extend(names.iter().map(|which| format!("{name}: {which}"))),
            Ok(Outcome::Skipped(reason)) => self.skip(format!("{name}: {reason}")),
            Err(reason) => {
                self.counts.failed += u32::from(counts.failed == 0);
                self.failed.push(format!("{name}: {reason}"));
            }
        }
    }

    /// Adds a check that cannot be made to the list of skipped ones.
    pub(crate) fn skip(&mut self, reason: String) {
        self.counts.skipped += 1;
        self.skipped.push(reason);
    }

    /// Fails when all stages together take more than 1.5 × a budget, extended as those of the stages are.
    pub(crate) fn limit(&mut self, Stage { name, budget }: Stage) {
        let paced: f64 = self.finished.iter().map(|it| it.took.as_secs_f64() / it.slowness).sum();
        let slowness = self.total().as_secs_f64() / paced.max(f64::MIN_POSITIVE);
        if let Err(reason) = within(budget, self.total(), slowness) {
            self.counts.failed += 1;
            self.failed.push(format!("{name}: {reason}"));
        }
    }

    fn total(&self) -> Duration {
        self.finished.iter().map(|it| it.took).sum()
    }

    /// Times of the stages and test programs, what was skipped, what failed; the last line has the numbers alone.
    pub(crate) fn summary(&self) -> String {
        let list =
            |word: &str, lines: &[String]| -> String { lines.iter().map(|line| format!("{word}: {line}\n")).collect() };
        let slowest = self.slowest.iter().map(|(name, took)| format!("{:8.1} s  {name}", took.as_secs_f64()));
        let Counts { passed, failed, skipped } = self.counts;
        format!(
            "{}{}{}{}{}{}{passed} passed, {failed} failed, {skipped} skipped",
            list("time", &self.times()),
            list("slow test program", &slowest.collect::<Vec<_>>()),
            list("unchanged, not run", &self.unchanged),
            list("skipped", &self.skipped),
            list("passed at the second try", &self.retried),
            list("failed", &self.failed),
        )
    }

    /// A line for each stage, the longest first, and one for all.
    fn times(&self) -> Vec<String> {
        let total = self.total();
        let share = |took: Duration| 100.0 * took.as_secs_f64() / total.as_secs_f64().max(f64::MIN_POSITIVE);
        let mut sorted: Vec<_> = self.finished.iter().collect();
        sorted.sort_by_key(|it| std::cmp::Reverse(it.took));
        let lines = sorted.into_iter().map(|Finished { stage, took, slowness }| {
            let (seconds, budget) = (took.as_secs_f64(), stage.budget.as_secs());
            format!("{seconds:8.1} s {:3.0} %  {}, budget {budget} s{}", share(*took), stage.name, machine(*slowness))
        });
        lines.chain([format!("{:8.1} s 100 %  all stages", total.as_secs_f64())]).collect()
    }

    /// Whether all stages passed.
    pub(crate) fn passed(&self) -> bool {
        self.failed.is_empty() && self.counts.failed == 0
    }
}

fn machine(slowness: f64) -> String {
    if slowness > 1.1 { format!(", machine {slowness:.1} times slower") } else { String::new() }
}

fn within(budget: Duration, took: Duration, slowness: f64) -> Result<(), String> {
    if took <= budget.mul_f64(1.5 * slowness) {
        return Ok(());
    }
    let (seconds, budget) = (took.as_secs_f64(), budget.as_secs());
    Err(format!("took {seconds:.1} s, more than 1.5 × its budget of {budget} s{}", machine(slowness)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);
    const STAGE: Stage = Stage { name: "stage", budget: Duration::from_secs(10) };

    fn finished(took: Duration, counts: Counts, outcome: Result<Outcome, String>) -> Suite {
        let mut suite = Suite::default();
        suite.finish(Finished { stage: STAGE, took, slowness: 1.0 }, counts, outcome);
        suite
    }

    fn passed(name: &'static str, took: Duration, slowness: f64, suite: &mut Suite) {
        let stage = Stage { name, budget: STAGE.budget };
        suite.finish(Finished { stage, took, slowness }, Counts::default(), Ok(Outcome::Passed));
    }

    #[test]
    fn results_of_test_programs_and_pytest_add_up() {
        let mut counts = Counts::default();
        for line in [
            "running 3 tests",
            "test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 2 filtered out; finished in 0.00s",
            "test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.10s",
            "test result: printed by a test",
            "it passed in the end",
            "1 failed, 20 passed, 3 skipped, 1 error in 7.12s",
            "4 passed in 75.01s (0:01:15)",
        ] {
            counts.read(line);
        }
        assert_eq!(counts, Counts { passed: 39, failed: 4, skipped: 4 });
    }

    #[test]
    fn a_stage_fails_beyond_its_budget_and_passes_within() {
        let slow = finished(16 * SECOND, Counts::default(), Ok(Outcome::Passed));
        assert!(!slow.passed());
        assert!(slow.summary().contains("failed: stage: took 16.0 s, more than 1.5 × its budget of 10 s\n"));
        assert!(finished(14 * SECOND, Counts::default(), Ok(Outcome::Passed)).passed());
    }

    #[test]
    fn a_slow_machine_extends_the_budget() {
        let on_slow = |took| {
            let mut suite = Suite::default();
            passed("stage", took, 2.0, &mut suite);
            suite
        };
        assert!(on_slow(29 * SECOND).passed());
        let beyond = on_slow(31 * SECOND).summary();
        assert!(beyond.contains("failed: stage: took 31.0 s") && beyond.contains("machine 2.0 times slower"));
    }

    #[test]
    fn the_whole_run_has_a_budget_that_a_slow_machine_extends() {
        let limited = |slowness| {
            let mut suite = Suite::default();
            passed("one", 10 * SECOND, slowness, &mut suite);
            passed("two", 10 * SECOND, slowness, &mut suite);
            suite.limit(STAGE);
            suite
        };
        assert!(limited(1.0).summary().contains("failed: stage: took 20.0 s, more than 1.5 × its budget of 10 s\n"));
        assert!(limited(2.0).passed());
    }

    #[test]
    fn the_summary_has_the_longest_stage_first_with_its_share() {
        let mut suite = Suite::default();
        passed("short", SECOND, 1.0, &mut suite);
        passed("long", 3 * SECOND, 1.0, &mut suite);
        suite.slowest = vec![("crates/rt/tests/causes.rs".into(), 2 * SECOND)];
        let expected = "time:      3.0 s  75 %  long, budget 10 s\n\
                        time:      1.0 s  25 %  short, budget 10 s\n\
                        time:      4.0 s 100 %  all stages\n\
                        slow test program:      2.0 s  crates/rt/tests/causes.rs\n\
                        0 passed, 0 failed, 0 skipped";
        assert_eq!(suite.summary(), expected);
    }

    #[test]
    fn unchanged_programs_that_did_not_run_are_listed() {
        let unchanged = vec!["crates/rt/tests/causes.rs".into()];
        let suite = Suite { unchanged, ..Suite::default() };
        assert!(suite.summary().contains("unchanged, not run: crates/rt/tests/causes.rs\n"));
    }

    #[test]
    fn a_skipped_stage_is_listed_and_counted() {
        let suite = finished(SECOND, Counts::default(), Ok(Outcome::Skipped("no compiler".into())));
        assert!(suite.passed());
        assert!(suite.summary().contains("skipped: stage: no compiler\n"));
        assert!(suite.summary().ends_with("\n0 passed, 0 failed, 1 skipped"));
    }

    #[test]
    fn a_test_that_passes_at_the_second_try_is_listed() {
        let suite = finished(SECOND, Counts::default(), Ok(Outcome::Retried(vec!["by::clock".into()])));
        assert!(suite.passed());
        assert!(suite.summary().contains("passed at the second try: stage: by::clock\n"));
    }

    #[test]
    fn a_failed_test_counts_once_and_a_failed_stage_without_tests_counts_one() {
        let counts = Counts { passed: 7, failed: 2, skipped: 0 };
        let tests = finished(SECOND, counts, Err("a test failed".into()));
        assert!(tests.summary().ends_with("\n7 passed, 2 failed, 0 skipped"));
        let build = finished(SECOND, Counts::default(), Err("does not compile".into()));
        assert!(build.summary().ends_with("\n0 passed, 1 failed, 0 skipped"));
        assert!(!tests.passed() && !build.passed());
    }
}
