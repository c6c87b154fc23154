//! The order of the test programs: by their times in the last run, the longest first.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::programs::Program;

/// Times of test programs by their source file.
#[derive(Default)]
pub(crate) struct Times {
    all: BTreeMap<String, Duration>,
    /// Those that have run since the file was read.
    now: BTreeSet<String>,
}

impl Times {
    /// The times of the last run; none if there are none.
    pub(crate) fn of_last_run(target: &Path) -> Self {
        let text = std::fs::read_to_string(file(target)).unwrap_or_default();
        let seconds: BTreeMap<String, f64> = serde_json::from_str(&text).unwrap_or_default();
        let times = seconds.into_iter().filter_map(|(name, it)| Some((name, Duration::try_from_secs_f64(it).ok()?)));
        Self { all: times.collect(), now: BTreeSet::new() }
    }

    /// Stores the times for the next run. Without them the next run is only slower, so a failure is ignored.
    pub(crate) fn store(&self, target: &Path) {
        let seconds: BTreeMap<_, _> = self.all.iter().map(|(name, time)| (name, time.as_secs_f64())).collect();
        let _ = std::fs::write(file(target), serde_json::json!(seconds).to_string());
    }

    pub(crate) fn add(&mut self, program: &Program, time: Duration) {
        self.all.insert(program.source.clone(), time);
        self.now.insert(program.source.clone());
    }

    /// The slowest programs of this run, the longest first.
    pub(crate) fn slowest(&self, number: usize) -> Vec<(String, Duration)> {
        let mut sorted: Vec<_> = self.now.iter().map(|name| (name.clone(), self.all[name])).collect();
        sorted.sort_by_key(|(_, time)| Reverse(*time));
        sorted.truncate(number);
        sorted
    }

    /// The programs that need the machine for themselves, and the others, the longest first. A program without a time
    /// may be the longest: these are first, in the order of cargo.
    pub(crate) fn order(&self, programs: Vec<Program>) -> (Vec<Program>, VecDeque<Program>) {
        let (alone, mut together): (Vec<_>, Vec<_>) = programs.into_iter().partition(|program| program.alone);
        together.sort_by_key(|program| Reverse(self.all.get(&program.source).copied().unwrap_or(Duration::MAX)));
        (alone, together.into())
    }
}

fn file(target: &Path) -> PathBuf {
    target.join("test-times.json")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn program(source: &str, alone: bool) -> Program {
        Program {
            source: source.into(),
            executable: "true".into(),
            package: ".".into(),
            alone,
            waits: false,
            inputs: None,
        }
    }

    fn together(times: &Times, names: &[&str]) -> Vec<String> {
        let (_, ordered) = times.order(names.iter().map(|name| program(name, false)).collect());
        ordered.into_iter().map(|program| program.source).collect()
    }

    fn times(all: &[(&str, u64)]) -> Times {
        let mut times = Times::default();
        all.iter().for_each(|(name, seconds)| times.add(&program(name, false), Duration::from_secs(*seconds)));
        times
    }

    #[test]
    fn the_longest_program_is_first_after_those_without_a_time() {
        let times = times(&[("short", 1), ("long", 9), ("middle", 5)]);
        assert_eq!(together(&times, &["short", "new", "middle", "long"]), ["new", "long", "middle", "short"]);
        assert_eq!(together(&Times::default(), &["b", "a", "c"]), ["b", "a", "c"]);
    }

    #[test]
    fn programs_that_run_alone_are_separate() {
        let (alone, together) = Times::default().order(vec![program("a", false), program("b", true)]);
        assert_eq!((alone, together), (vec![program("b", true)], [program("a", false)].into()));
    }

    #[test]
    fn times_are_stored_for_the_next_run_and_a_damaged_file_is_ignored() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        assert_eq!(together(&Times::of_last_run(folder.path()), &["b", "a"]), ["b", "a"]);
        times(&[("one", 1), ("two", 2), ("three", 3)]).store(folder.path());
        let mut times = Times::of_last_run(folder.path());
        assert_eq!(together(&times, &["one", "two", "three"]), ["three", "two", "one"]);
        assert_eq!(times.slowest(10), [], "none has run yet");
        times.add(&program("two", false), Duration::from_secs(4));
        assert_eq!(times.slowest(10), [("two".into(), Duration::from_secs(4))]);
        std::fs::write(file(folder.path()), "{").expect("it can be written");
        assert_eq!(together(&Times::of_last_run(folder.path()), &["one", "two"]), ["one", "two"]);
    }
}
