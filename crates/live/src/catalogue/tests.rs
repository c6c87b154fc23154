use crate::LiveError;
use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::entry::SCHEMA;
use super::*;
use stickslip_base::report::{Provenance, Report};
use stickslip_base::{Error, Summary};

/// A project with its catalogue.
fn project() -> (tempfile::TempDir, Catalogue) {
    let folder = tempfile::tempdir().unwrap();
    let catalogue = Catalogue::in_folder(folder.path());
    (folder, catalogue)
}

/// Writes the folder of a command's results.
fn leave(folder: &Path, breakaway: f64, law: &str) -> PathBuf {
    let mut summary = Summary::new("measure friction");
    summary.result("measure.preload", 1.0, "1").result("measure.duration", 38.5, "s");
    for (velocity, torque) in [(-2.0, -0.2), (0.1, breakaway), (2.0, 0.2)] {
        summary.row([
            ("measurement", "own".into()),
            ("velocity", velocity.into()),
            ("torque", torque.into()),
            ("counts", true.into()),
        ]);
    }
    summary.file("report.html").write(folder).unwrap();
    let parameters = format!(
        "[bench]\ndesired.breakaway_torque = {breakaway}\ntick_rate = 4000\nlaw.kind = \"{law}\"\ncontroller.kind = \
         \"cascade\"\n[plant.wheel.friction.model]\nkind = \"elasto-plastic\"\n"
    );
    let provenance = Provenance::new("stickslip measure friction --preset clm-real --seed 3", Some(3), parameters);
    Report::new("Friction", provenance).write(folder).unwrap();
    folder.to_owned()
}

fn enter(catalogue: &Catalogue, path: &Path) -> i64 {
    let begun = UNIX_EPOCH + Duration::from_secs(1_700_000_000);
    let origin = RunOrigin { duration: 2.0, ..RunOrigin::now(path, begun, None) };
    catalogue.enter(&origin).unwrap().unwrap()
}

fn numbers(catalogue: &Catalogue, query: &str) -> Vec<i64> {
    catalogue.runs(query, 100).unwrap().runs.iter().map(|run| run.number).collect()
}

#[test]
fn a_run_is_entered_with_the_facts_of_its_files() {
    let (folder, catalogue) = project();
    let path = leave(&folder.path().join("stickslip-out/one"), 0.3, "bristle");
    let number = enter(&catalogue, &path);
    let details = catalogue.details(number).unwrap();
    let run = &details.run;
    assert_eq!((run.number, run.name.as_str(), run.kind.as_str()), (1, "run 1, sweep with wheel", "measure friction"));
    assert_eq!((run.begun.as_str(), run.duration), ("2023-11-14T22:13:20Z", Some(38.5)));
    assert_eq!((run.preset.as_str(), run.controller.as_str(), run.law.as_str()), ("clm-real", "cascade", "bristle"));
    let key = run.key.as_ref().unwrap();
    assert_eq!((key.name.as_str(), key.value, key.unit.as_str()), ("torque at 0.1 rad/s", 0.3, "N m"));
    assert_eq!(run.curve, [[-2.0, -0.2], [0.1, 0.3], [2.0, 0.2]]);
    assert_eq!((run.folder.as_str(), run.state), ("stickslip-out/one", State::Here));
    assert_eq!((run.record.as_deref(), run.files.as_slice()), (None, ["report.html".to_owned()].as_slice()));
    let symbol = details.values.iter().find(|value| value.path == "bench.desired.breakaway_torque").unwrap();
    assert_eq!((symbol.symbol.as_str(), symbol.unit.as_str(), symbol.number), ("M_S", "N m", Some(0.3)));
    // A folder without a run is not entered.
    assert_eq!(catalogue.enter(&RunOrigin::now(folder.path(), SystemTime::now(), None)).unwrap(), None);
    assert!(matches!(
        catalogue.details(2).as_ref().err().and_then(|error| error.of()),
        Some(LiveError::NoRun { number: 2 })
    ));
}

#[test]
fn runs_of_loop_friction_study_and_load_are_entered_with_their_key_numbers() {
    let (folder, catalogue) = project();
    for (kind, words, key) in [
        ("loop", "position loop", Some("loop.sliding.sensitivity_peak")),
        ("friction", "library friction", Some("friction.breakaway_torque")),
        ("study", "study", Some("study.failed_cases")),
        ("load", "loaded external", None),
    ] {
        let path = folder.path().join(kind);
        let mut summary = Summary::new(kind);
        summary.result(key.unwrap_or("call.count"), 1.5, "1").write(&path).unwrap();
        let number = enter(&catalogue, &path);
        let run = catalogue.details(number).unwrap().run;
        assert_eq!((run.kind.as_str(), run.name), (kind, format!("run {number}, {words}")));
        assert_eq!(run.key.as_ref().map(|key| key.name.as_str()), key, "{kind}");
    }
}

#[test]
fn a_reserved_number_is_used_only_once() {
    let (folder, catalogue) = project();
    assert_eq!((catalogue.set_aside().unwrap(), catalogue.set_aside().unwrap()), (1, 2));
    let path = |name: &str| folder.path().join("stickslip-out").join(name);
    assert_eq!(enter(&catalogue, &leave(&path("another"), 0.3, "paper")), 3);
    let origin = |name: &str| {
        let path = leave(&path(name), 0.3, "paper");
        RunOrigin { number: Some(2), ..RunOrigin::now(&path, SystemTime::now(), None) }
    };
    assert_eq!(catalogue.enter(&origin("its")).unwrap(), Some(2));
    // A second use of the number is an error, but the run gets another one.
    assert_eq!(catalogue.enter(&origin("twice")).unwrap(), Some(4));
    assert_eq!(catalogue.set_aside().unwrap(), 5);
}

#[test]
fn a_search_finds_words_keys_parameters_and_results() {
    let (folder, catalogue) = project();
    assert!(numbers(&catalogue, "").is_empty(), "a search creates no catalogue");
    assert!(!catalogue.index().exists());
    for (name, breakaway, law) in [("a", 0.1, "paper"), ("b", 0.25, "bristle"), ("c", 0.4, "bristle")] {
        enter(&catalogue, &leave(&folder.path().join(name), breakaway, law));
    }
    catalogue.tag(2, &["good".into(), "Ümlaut".into()], &[]).unwrap();
    catalogue.rename(3, "the stiff one").unwrap();
    for (query, expected) in [
        ("", &[3, 2, 1][..]),
        ("M_S>0.2", &[3, 2]),
        ("M_S>0.2 M_S<0.3", &[2]),
        ("breakaway_torque = 0.1", &[1]),
        ("M_S>0.2 law:bristle -tag:good", &[3]),
        ("stiff", &[3]),
        ("STIFF", &[3]),
        ("ümlaut", &[2]),
        ("preload=1", &[3, 2, 1]),
        ("wheel:elasto tick_rate>=4000", &[3, 2, 1]),
        ("wheel:lugre", &[]),
        ("number>=2", &[3, 2]),
        ("begun>2024-01-01", &[]),
        ("controller:cascade folder:b", &[2]),
        ("kind:friction 'or 1=1", &[]),
        ("M_S>", &[3, 2, 1]),
        ("is:deleted", &[]),
    ] {
        assert_eq!(numbers(&catalogue, query), expected, "{query}");
    }
    let found = catalogue.runs("M_S>", 2).unwrap();
    assert_eq!((found.runs.len(), found.of, found.hints.len()), (2, 3, 1));
}

#[test]
fn name_tags_and_note_survive_the_loss_of_the_index() {
    let (folder, catalogue) = project();
    let path = leave(&folder.path().join("one"), 0.3, "paper");
    enter(&catalogue, &leave(&folder.path().join("zero"), 0.2, "paper"));
    enter(&catalogue, &path);
    catalogue.rename(2, " Second ").unwrap();
    catalogue.tag(2, &["good".into(), "bad".into()], &[]).unwrap();
    catalogue.tag(2, &[], &["bad".into()]).unwrap();
    catalogue.note(2, "after the repair").unwrap();
    let before = catalogue.details(2).unwrap();
    assert_eq!((before.run.name.as_str(), before.run.tags.as_slice()), ("Second", ["good".to_owned()].as_slice()));
    for wrong in ["", "two words", "-minus"] {
        assert!(matches!(
            catalogue.tag(2, &[wrong.into()], &[]).as_ref().err().and_then(|error| error.of()),
            Some(LiveError::RunText { .. })
        ));
    }
    assert!(catalogue.rename(2, " ").is_err() && catalogue.rename(9, "x").is_err());

    // The run is moved by hand, then the index is lost.
    fs::create_dir_all(folder.path().join("archive")).unwrap();
    fs::rename(&path, folder.path().join("archive/one")).unwrap();
    assert_eq!(catalogue.details(2).unwrap().run.state, State::Missing);
    assert!(catalogue.folder(2).unwrap_err().to_string().contains("--rebuild"));
    fs::remove_dir_all(catalogue.index()).unwrap();
    assert_eq!(catalogue.rebuild().unwrap(), Rebuilt { runs: 2, unlabelled: 0 });
    let after = catalogue.details(2).unwrap();
    let moved = Run { folder: "archive/one".into(), ..before.run.clone() };
    assert_eq!((after.run, after.values), (moved, before.values));

    // A copy is another run, and so is a run that was never entered.
    for name in ["summary.json", "report.json", "run.json"] {
        fs::create_dir_all(folder.path().join("copy")).unwrap();
        fs::copy(folder.path().join("zero").join(name), folder.path().join("copy").join(name)).unwrap();
    }
    leave(&folder.path().join("new"), 0.5, "paper");
    assert_eq!(catalogue.rebuild().unwrap(), Rebuilt { runs: 4, unlabelled: 2 });
    assert_eq!(numbers(&catalogue, ""), [4, 3, 2, 1]);
    assert_eq!(catalogue.rebuild().unwrap(), Rebuilt { runs: 4, unlabelled: 0 }, "they have labels now");
}

#[test]
fn deleted_runs_stay_in_the_bin_for_thirty_days() {
    let (folder, catalogue) = project();
    let path = leave(&folder.path().join("one"), 0.3, "paper");
    enter(&catalogue, &path);
    catalogue.delete(1).unwrap();
    assert!(!path.exists() && catalogue.delete(1).is_err());
    assert!(numbers(&catalogue, "").is_empty());
    assert_eq!(numbers(&catalogue, "is:deleted"), [1]);
    assert!(catalogue.folder(1).unwrap_err().to_string().contains("restore"));
    assert_eq!(catalogue.restore(1).unwrap(), path.canonicalize().unwrap());
    assert!(catalogue.restore(1).is_err() && path.join("summary.json").exists());

    // Its place has been taken meanwhile.
    catalogue.delete(1).unwrap();
    fs::remove_dir_all(catalogue.index()).unwrap();
    catalogue.rebuild().unwrap();
    assert_eq!(numbers(&catalogue, "is:deleted"), [1], "a rebuild finds the bin, too");
    enter(&catalogue, &leave(&path, 0.4, "paper"));
    let restored = catalogue.restore(1).unwrap();
    assert!(restored.ends_with("one-1"), "{}", restored.display());

    catalogue.delete(1).unwrap();
    let purge = || catalogue.purge(&catalogue.lock().unwrap()).unwrap();
    purge();
    assert_eq!(numbers(&catalogue, "is:deleted"), [1]);
    let mut entry = catalogue.existing(1).unwrap();
    entry.label.deleted = Some("2020-01-01T00:00:00Z".into());
    catalogue.put(&catalogue.lock().unwrap(), &entry).unwrap();
    purge();
    assert!(numbers(&catalogue, "is:deleted").is_empty() && !catalogue.bin().join("1").exists());
    assert_eq!(enter(&catalogue, &leave(&path, 0.4, "paper")), 3, "a number is never reused");

    // The last run, and a run without files.
    catalogue.delete(3).unwrap();
    let mut entry = catalogue.existing(3).unwrap();
    entry.label.deleted = Some("2020-01-01T00:00:00Z".into());
    catalogue.put(&catalogue.lock().unwrap(), &entry).unwrap();
    assert_eq!(enter(&catalogue, &leave(&path, 0.4, "paper")), 4);
    fs::remove_dir_all(&path).unwrap();
    catalogue.delete(4).unwrap();
    assert_eq!((numbers(&catalogue, "is:deleted"), numbers(&catalogue, "")), (vec![4], vec![2]));
}

#[test]
fn a_run_in_the_folder_of_another_replaces_it() {
    let (folder, catalogue) = project();
    let path = leave(&folder.path().join("one"), 0.3, "paper");
    enter(&catalogue, &path);
    enter(&catalogue, &leave(&path, 0.4, "paper"));
    assert_eq!(catalogue.details(1).unwrap().run.state, State::Replaced);
    assert_eq!(catalogue.folder(2).unwrap(), path.canonicalize().unwrap());
    assert_eq!(
        catalogue.details(1).unwrap().values.iter().find(|value| value.symbol == "M_S").unwrap().number,
        Some(0.3)
    );
    // The later one's files stay.
    catalogue.rename(1, "gone").unwrap();
    catalogue.delete(1).unwrap();
    assert!(path.join("summary.json").exists() && catalogue.folder(2).is_ok());
    catalogue.restore(1).unwrap();
}

#[test]
fn concurrent_changes_lose_nothing() {
    let (folder, catalogue) = project();
    const EACH: usize = 12;
    thread::scope(|scope| {
        for writer in 0..6 {
            let (catalogue, folder) = (&catalogue, folder.path());
            scope.spawn(move || {
                for run in 0..EACH {
                    let number = enter(catalogue, &leave(&folder.join(format!("{writer}-{run}")), 0.3, "paper"));
                    catalogue.tag(number, &[format!("w{writer}")], &[]).unwrap();
                    assert!(catalogue.runs("M_S>0.2", 5).unwrap().of > 0);
                }
            });
        }
    });
    let mut numbers = numbers(&catalogue, "");
    numbers.sort_unstable();
    assert_eq!(numbers, (1..=72).collect::<Vec<i64>>());
    assert_eq!(catalogue.runs("tag:w3", 100).unwrap().of as usize, EACH);
}

#[test]
fn a_lock_excludes_other_changes_but_no_search() {
    let (folder, catalogue) = project();
    enter(&catalogue, &leave(&folder.path().join("one"), 0.3, "paper"));
    let lock = catalogue.lock().unwrap();
    thread::scope(|scope| {
        let tagged = scope.spawn(|| catalogue.tag(1, &["good".into()], &[]).unwrap());
        assert_eq!(numbers(&catalogue, ""), [1]);
        thread::sleep(Duration::from_millis(20));
        assert!(!tagged.is_finished() && numbers(&catalogue, "tag:good").is_empty());
        drop(lock);
    });
    assert_eq!(numbers(&catalogue, "tag:good"), [1]);
}

#[test]
fn incomplete_entries_are_ignored() {
    let (folder, catalogue) = project();
    enter(&catalogue, &leave(&folder.path().join("one"), 0.3, "paper"));
    // Temporary files of a killed process.
    fs::write(catalogue.index().join(".1.json.tmp"), "{\"schema\"").unwrap();
    fs::write(catalogue.index().join("2.json.tmp"), "{\"schema\"").unwrap();
    assert_eq!(numbers(&catalogue, ""), [1]);
    // If its label cannot be written, no part of the entry remains.
    let path = leave(&folder.path().join("two"), 0.3, "paper");
    fs::create_dir(path.join("run.json")).unwrap();
    assert!(matches!(catalogue.enter(&RunOrigin::now(&path, SystemTime::now(), None)), Err(Error::File { .. })));
    assert_eq!(numbers(&catalogue, ""), [1]);
}

#[test]
fn a_damaged_entry_and_one_of_a_newer_version_are_reported_and_rebuilt() {
    let (folder, catalogue) = project();
    for name in ["one", "two", "three"] {
        enter(&catalogue, &leave(&folder.path().join(name), 0.3, "paper"));
    }
    let entry = |number: i64| catalogue.index().join(format!("{number}.json"));
    let text = fs::read_to_string(entry(1)).unwrap();
    fs::write(entry(1), text.replace(SCHEMA, "stickslip.catalogue-entry/9")).unwrap();
    fs::write(entry(2), &text[..text.len() / 2]).unwrap();
    fs::write(entry(7), text).unwrap();
    let found = catalogue.runs("", 9).unwrap();
    assert_eq!((found.of, found.hints.len()), (1, 3), "{found:?}");
    let newer = catalogue.rename(1, "new").unwrap_err().to_string();
    assert!(newer.contains("stickslip.catalogue-entry/9") && newer.contains("Use the version"), "{newer}");
    for number in [2, 7] {
        let damaged = catalogue.details(number).unwrap_err().to_string();
        assert!(damaged.contains(&format!("{number}.json")) && damaged.contains("--rebuild"), "{damaged}");
    }
    // A damaged entry of a deleted run does not affect other runs.
    fs::create_dir_all(catalogue.bin().join("2")).unwrap();
    assert_eq!(enter(&catalogue, &leave(&folder.path().join("four"), 0.3, "paper")), 8);
    let second = RunOrigin { number: Some(2), ..RunOrigin::now(&folder.path().join("four"), SystemTime::now(), None) };
    assert_eq!(catalogue.enter(&second).unwrap(), Some(9));
    fs::write(catalogue.index().join("last"), "many").unwrap();
    assert!(catalogue.set_aside().unwrap_err().to_string().contains("--rebuild"));
    assert_eq!(catalogue.rebuild().unwrap(), Rebuilt { runs: 4, unlabelled: 0 });
    let found = catalogue.runs("", 9).unwrap();
    assert_eq!((found.of, found.hints.len()), (4, 0), "{found:?}");
    assert_eq!(catalogue.set_aside().unwrap(), 10);
}

#[test]
fn a_run_is_unchanged_if_the_catalogue_cannot_be_written() {
    let (folder, catalogue) = project();
    let path = leave(&folder.path().join("one"), 0.3, "paper");
    // A file in place of its folder: the folder cannot be created, regardless of permissions.
    fs::write(folder.path().join("stickslip-out"), "").unwrap();
    let refused = catalogue.enter(&RunOrigin::now(&path, SystemTime::now(), None)).unwrap_err();
    assert!(refused.to_string().contains("stickslip-out"), "{refused}");
    assert!(path.join("summary.json").exists() && !path.join("run.json").exists());
}

#[test]
fn a_project_in_the_working_folder_shares_its_catalogue() {
    let folder = tempfile::tempdir().unwrap();
    let working = Catalogue::in_folder(folder.path());
    let inside = folder.path().join("stickslip-out/project");
    assert_eq!(Catalogue::of_project(&inside, folder.path()), working);
    let elsewhere = tempfile::tempdir().unwrap();
    let own = Catalogue::of_project(elsewhere.path(), folder.path());
    assert!(own != working && own.covers(&elsewhere.path().join("runs")) && !own.covers(folder.path()));
}

#[test]
fn a_record_alone_is_a_run() {
    use stickslip_bench::run::{About, RunWriter};
    let (folder, catalogue) = project();
    let path = folder.path().join("axis.mf4");
    let preset = stickslip_base::parameters::presets::find("clm-bench").unwrap().read().unwrap();
    let about = About { command: "stickslip serve --preset clm-bench".into(), preset, seed: Some(1) };
    RunWriter::create(&path, &about).unwrap().finish().unwrap();
    assert_eq!(enter(&catalogue, &path), 1);
    let run = catalogue.details(1).unwrap().run;
    assert_eq!((run.kind.as_str(), run.record.as_deref()), ("recording", Some("axis.mf4")));
    assert_eq!((run.preset.as_str(), run.controller.as_str()), ("clm-bench", "cascade"));
    assert_eq!(catalogue.folder(1).unwrap(), path.canonicalize().unwrap());
    catalogue.delete(1).unwrap();
    assert!(!path.exists());
    catalogue.restore(1).unwrap();
    assert!(path.exists());
    // Without its label, from the record itself.
    fs::remove_file(folder.path().join("axis.mf4.run.json")).unwrap();
    assert_eq!(catalogue.rebuild().unwrap(), Rebuilt { runs: 1, unlabelled: 1 });
}
