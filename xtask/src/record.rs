//! Test programs and stages that passed, with a fingerprint of their inputs: with the same inputs they need not run again.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::suite::Outcome;

/// Files of the tree that a test may read while it runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reads {
    /// All files except Rust sources, which are in the compiled program: the unit tests of a crate.
    NoSources,
    /// All files.
    All,
}

/// The test programs and stages that passed, in a file of the target folder.
pub(crate) struct Record {
    file: PathBuf,
    /// Fingerprints by the name of the test program or stage.
    passed: BTreeMap<String, u64>,
    /// Fingerprints of the tree without and with its Rust sources; `None` if a file cannot be read.
    tree: [Option<u64>; 2],
    /// Whether everything runs.
    runs_all: bool,
    /// The test programs and stages that did not run, since they passed with the same inputs.
    unchanged: Vec<String>,
}

impl Record {
    /// The record of the last runs for a tree of these files. `environment` has the other inputs of the results.
    pub(crate) fn new(
        target: &Path,
        tree: &Path,
        files: &BTreeSet<PathBuf>,
        environment: &[String],
        all: bool,
    ) -> Self {
        let file = target.join("test-record.json");
        let passed = std::fs::read_to_string(&file).ok().and_then(|text| serde_json::from_str(&text).ok());
        let fingerprint = |sources: bool| {
            let is_read = |file: &&PathBuf| sources || file.extension().is_none_or(|ending| ending != "rs");
            let mut hasher = DefaultHasher::new();
            environment.hash(&mut hasher);
            for name in files.iter().filter(is_read) {
                name.hash(&mut hasher);
                read_into(&mut hasher, &tree.join(name))?;
            }
            Some(hasher.finish())
        };
        let tree = [fingerprint(false), fingerprint(true)];
        Self { file, passed: passed.unwrap_or_default(), tree, runs_all: all, unchanged: Vec::new() }
    }

    /// Fingerprint of the tree and of compiled files; `None` if a file cannot be read.
    pub(crate) fn inputs<'a>(&self, reads: Reads, compiled: impl IntoIterator<Item = &'a PathBuf>) -> Option<u64> {
        let [without, with] = self.tree;
        let mut hasher = DefaultHasher::new();
        match reads {
            Reads::NoSources => without?,
            Reads::All => with?,
        }
        .hash(&mut hasher);
        for file in compiled {
            read_into(&mut hasher, file)?;
        }
        Some(hasher.finish())
    }

    /// Whether the test program or stage passed with these inputs and need not run. It is listed in the summary.
    pub(crate) fn is_unchanged(&mut self, name: &str, inputs: Option<u64>) -> bool {
        let unchanged = !self.runs_all && inputs.is_some() && self.passed.get(name) == inputs.as_ref();
        if unchanged {
            self.unchanged.push(name.into());
        }
        unchanged
    }

    /// Adds a test program or stage that passed. The file is written at once, so that a run that is interrupted later
    /// counts. If it cannot be written, the next run tests again.
    pub(crate) fn add(&mut self, name: &str, inputs: Option<u64>) {
        if let Some(inputs) = inputs {
            self.passed.insert(name.into(), inputs);
            let _ = std::fs::write(&self.file, serde_json::json!(self.passed).to_string());
        }
    }

    /// Does the work of a stage unless it passed with these inputs.
    pub(crate) fn unless_unchanged(
        &mut self,
        name: &str,
        inputs: Option<u64>,
        work: impl FnOnce() -> Result<(), String>,
    ) -> Result<Outcome, String> {
        if !self.is_unchanged(name, inputs) {
            work()?;
            self.add(name, inputs);
        }
        Ok(Outcome::Passed)
    }

    /// The test programs and stages that did not run.
    pub(crate) fn into_unchanged(self) -> Vec<String> {
        self.unchanged
    }
}

/// Adds the content of a file to a hash; `None` if it cannot be read.
fn read_into(hasher: &mut DefaultHasher, path: &Path) -> Option<()> {
    let mut file = File::open(path).ok()?;
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block).ok()? {
            0 => return Some(()),
            length => hasher.write(&block[..length]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tree with a source, a data file and a compiled program; the target folder is the tree.
    fn tree() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        ["lib.rs", "data.csv", "program"].iter().for_each(|name| write(&folder, name, "1"));
        folder
    }

    fn write(folder: &tempfile::TempDir, name: &str, text: &str) {
        std::fs::write(folder.path().join(name), text).expect("it can be written");
    }

    fn record(folder: &tempfile::TempDir, environment: &str, all: bool) -> Record {
        let files = ["lib.rs", "data.csv"].map(PathBuf::from).into();
        Record::new(folder.path(), folder.path(), &files, &[environment.into()], all)
    }

    fn inputs(record: &Record, folder: &tempfile::TempDir, reads: Reads) -> Option<u64> {
        record.inputs(reads, [&folder.path().join("program")])
    }

    /// Whether something that passed before a change need not run after it.
    fn unchanged_after(reads: Reads, change: impl FnOnce(&tempfile::TempDir)) -> bool {
        let folder = tree();
        let mut before = record(&folder, "", false);
        before.add("it", inputs(&before, &folder, reads));
        change(&folder);
        let mut after = record(&folder, "", false);
        let unchanged = after.is_unchanged("it", inputs(&after, &folder, reads));
        assert_eq!(after.into_unchanged().len(), usize::from(unchanged));
        unchanged
    }

    #[test]
    fn a_passed_program_runs_again_when_a_file_that_it_may_read_has_changed() {
        for reads in [Reads::NoSources, Reads::All] {
            assert!(unchanged_after(reads, |_| ()));
            assert!(!unchanged_after(reads, |folder| write(folder, "data.csv", "2")));
            assert!(!unchanged_after(reads, |folder| write(folder, "program", "2")));
            assert_eq!(unchanged_after(reads, |folder| write(folder, "lib.rs", "2")), reads == Reads::NoSources);
        }
    }

    #[test]
    fn another_environment_a_missing_file_a_damaged_record_and_a_request_make_it_run() {
        let folder = tree();
        let mut first = record(&folder, "gcc", false);
        first.add("it", inputs(&first, &folder, Reads::All));
        let runs = |environment: &str, all: bool| {
            let mut record = record(&folder, environment, all);
            !record.is_unchanged("it", inputs(&record, &folder, Reads::All))
        };
        assert!(!runs("gcc", false));
        assert!(runs("clang", false) && runs("gcc", true));
        write(&folder, "test-record.json", "{");
        assert!(runs("gcc", false));
        std::fs::remove_file(folder.path().join("program")).expect("it exists");
        assert_eq!(inputs(&first, &folder, Reads::All), None);
        assert!(!first.is_unchanged("it", None));
    }

    #[test]
    fn a_stage_that_failed_runs_again() {
        let folder = tree();
        let mut record = record(&folder, "", false);
        let inputs = inputs(&record, &folder, Reads::All);
        assert!(record.unless_unchanged("it", inputs, || Err("failed".into())).is_err());
        let passes = || {
            write(&folder, "ran", "1");
            Ok(())
        };
        assert!(record.unless_unchanged("it", inputs, passes).is_ok());
        assert!(folder.path().join("ran").exists());
        assert!(record.unless_unchanged("it", inputs, || Err("it ran".into())).is_ok());
    }
}
