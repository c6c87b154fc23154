//! Runs the commands of a page, from top to bottom.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::expected::{compare, updated};
use super::markdown::{Page, source};

/// Runs all `sh` blocks of a page in one folder, which also has `data` and `examples` of the repository, and compares
/// their output with the `text` block that follows directly. Returns the folder, so that its files can be compared.
///
/// With `UPDATE_EXPECT` set, new numbers are written into the page.
pub(crate) fn run(name: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for beside in ["data", "examples"] {
        copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(beside), &folder.path().join(beside));
    }
    let page = Page::read(name);
    let blocks = page.blocks();
    let mut text: Vec<String> = page.text.lines().map(String::from).collect();
    let mut changes = Vec::new();
    for (index, block) in blocks.iter().enumerate().filter(|(_, block)| block.kind == "sh") {
        let place = format!("{name}:{}", block.first + 1);
        let printed = printed(&block.lines.join("\n"), folder.path(), &place);
        let close =
            |next: &&super::markdown::Block| next.kind == "text" && next.first <= block.first + block.lines.len() + 3;
        let Some(expected) = blocks.get(index + 1).filter(close) else { continue };
        if std::env::var_os("UPDATE_EXPECT").is_some() {
            let lines = updated(&expected.lines, &printed).unwrap_or_else(|why| panic!("{place}: {why}"));
            changes.push((expected.first, lines));
        } else if let Err(why) = compare(&expected.lines, &printed) {
            panic!(
                "{place}: {why}\n`cargo xtask bless` copies new numbers into the page. All output:\n{}",
                printed.join("\n")
            );
        }
    }
    // The number of lines is unchanged: only numbers change.
    for (first, lines) in changes {
        let count = lines.len();
        text.splice(first..first + count, lines);
    }
    let text = text.join("\n") + "\n";
    if text != page.text {
        fs::write(source().join(name), text).expect("the page can be written");
    }
    folder
}

/// The output of a script, stdout and stderr together, without progress lines and with ordinary spaces.
fn printed(script: &str, folder: &Path, place: &str) -> Vec<String> {
    let program = Path::new(env!("CARGO_BIN_EXE_stickslip")).parent().expect("a program is in a folder");
    let mut path = vec![program.to_path_buf()];
    path.extend(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()));
    let output = Command::new("sh")
        .args(["-e", "-c", &format!("exec 2>&1\n{script}")])
        .env("PATH", std::env::join_paths(path).expect("folders of PATH have no separators"))
        .current_dir(folder)
        .output()
        .expect("sh starts");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{place}: it failed:\n{text}");
    text.lines().filter(|line| !line.ends_with(" …")).map(|line| line.replace('\u{a0}', " ")).collect()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("the temporary folder takes folders");
    for entry in fs::read_dir(from).expect("the repository has data") {
        let path = entry.expect("it can be listed").path();
        let target = to.join(path.file_name().expect("an entry has a name"));
        if path.is_dir() {
            copy(&path, &target);
        } else {
            fs::copy(&path, &target).expect("the temporary folder takes files");
        }
    }
}

/// Compares the figures of a result in the guide, `figures/RESULT/*.svg`, with those that a command has drawn.
pub(crate) fn compare_figures(result: &str, folder: &Path) {
    let shown = source().join("figures").join(result);
    for name in stale(&shown, folder) {
        if std::env::var_os("UPDATE_EXPECT").is_some() {
            fs::copy(folder.join(&name), shown.join(&name)).expect("a figure of that name was drawn");
        } else {
            panic!("figures/{result}/{name} differs from the figure of the program. `cargo xtask bless` copies it.");
        }
    }
}

/// The files of one folder that differ in the other or are missing there.
fn stale(shown: &Path, drawn: &Path) -> Vec<String> {
    let entries = fs::read_dir(shown).unwrap_or_else(|error| panic!("{}: {error}", shown.display()));
    let names = entries.map(|entry| entry.expect("it can be listed").file_name().to_string_lossy().into_owned());
    let same = |name: &String| fs::read(shown.join(name)).ok() == fs::read(drawn.join(name)).ok();
    names.filter(|name| !same(name)).collect()
}

#[test]
fn an_outdated_figure_is_found() {
    let (shown, drawn) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
    for (folder, name, text) in
        [(&shown, "a", "1"), (&shown, "b", "2"), (&shown, "c", "3"), (&drawn, "a", "1"), (&drawn, "b", "other")]
    {
        fs::write(folder.path().join(name), text).expect("it takes files");
    }
    let mut found = stale(shown.path(), drawn.path());
    found.sort();
    assert_eq!(found, ["b", "c"]);
}

#[test]
#[should_panic(expected = "a.md:1: it failed:\nso far")]
fn a_failing_command_fails_the_test() {
    printed("echo so far; false; echo and on", &std::env::temp_dir(), "a.md:1");
}
