//! Tests of the guide in `docs/src`: commands and their output, figures, files, symbols, links.

mod commands;
mod expected;
mod files;
mod markdown;
mod symbols;

use std::collections::BTreeSet;
use std::sync::LazyLock;

use commands::{compare_figures, run};
use markdown::{Block, Page, source};
use tempfile::TempDir;

/// Pages whose commands run in a test of their own. One test runs those of all other pages.
const SEPARATE: [&str; 7] = [
    "loop.md",
    "microcontroller.md",
    "own-hardware.md",
    "tutorial-bench.md",
    "tutorial-controller.md",
    "tutorial-lesson.md",
    "tutorial-recording.md",
];

/// Pages whose files are compared in other tests, too.
pub(crate) static BENCH: LazyLock<TempDir> = LazyLock::new(|| run("tutorial-bench.md"));
pub(crate) static LESSON: LazyLock<TempDir> = LazyLock::new(|| run("tutorial-lesson.md"));
pub(crate) static LOOP: LazyLock<TempDir> = LazyLock::new(|| run("loop.md"));
pub(crate) static MICROCONTROLLER: LazyLock<TempDir> = LazyLock::new(|| run("microcontroller.md"));
pub(crate) static RECORDING: LazyLock<TempDir> = LazyLock::new(|| run("tutorial-recording.md"));

#[test]
fn the_tutorial_on_recordings_runs_and_shows_its_figures() {
    compare_figures("identify", &RECORDING.path().join("stickslip-out/identify"));
}

#[test]
fn the_tutorial_on_the_bench_runs_and_shows_its_figures() {
    compare_figures("render", &BENCH.path().join("corrected"));
}

#[test]
fn the_lesson_runs_and_shows_its_figures() {
    compare_figures("demo", &LESSON.path().join("stickslip-out/demo"));
    compare_figures("slow-drop", &LESSON.path().join("slow-drop"));
}

#[test]
fn the_tutorial_on_controllers_runs_and_shows_its_figures() {
    let folder = run("tutorial-controller.md");
    compare_figures("benchmark", &folder.path().join("stickslip-out/benchmark"));
}

#[test]
fn the_page_on_hardware_runs() {
    run("own-hardware.md");
}

#[test]
fn the_page_on_loops_runs_and_shows_its_figures() {
    compare_figures("loop", &LOOP.path().join("stickslip-out/loop"));
}

#[test]
fn all_other_pages_run() {
    for page in pages_with_commands().iter().filter(|page| !SEPARATE.contains(&page.as_str())) {
        run(page);
    }
}

fn pages_with_commands() -> Vec<String> {
    let runs = |page: &Page| page.blocks().iter().any(|block| block.kind == "sh");
    Page::all().into_iter().filter(runs).map(|page| page.name).collect()
}

#[test]
fn pages_with_a_separate_test_have_commands() {
    let pages = pages_with_commands();
    for page in SEPARATE {
        assert!(pages.iter().any(|name| name == page), "{page} has no `sh` block");
    }
}

#[test]
fn every_folder_of_figures_has_a_test() {
    let figures = std::fs::read_dir(source().join("figures")).expect("the guide has figures");
    let figures: BTreeSet<_> = figures.map(|entry| entry.expect("it can be listed").file_name()).collect();
    // Those in `page` are pictures of a browser; studies draw those in `fidelity` and `prediction`.
    let known = ["benchmark", "demo", "fidelity", "identify", "loop", "page", "prediction", "render", "slow-drop"];
    assert_eq!(figures, known.map(Into::into).into());
}

/// Blocks with commands that are neither run nor marked: `console` blocks without a reason in the two lines above them,
/// and commands in blocks of another kind.
fn unmarked(page: &Page) -> Vec<String> {
    let lines: Vec<&str> = page.text.lines().collect();
    let marked = |block: &Block| {
        let fence = block.first - 1;
        lines[fence.saturating_sub(2)..fence].iter().any(|line| gives_a_reason(line))
    };
    let is_unmarked = |block: &&Block| match block.kind.as_str() {
        "sh" => false,
        "console" => !marked(block),
        _ => block.lines.iter().any(|line| line.starts_with("stickslip ")),
    };
    let blocks = page.blocks();
    blocks.iter().filter(is_unmarked).map(|block| format!("{}:{}", page.name, block.first)).collect()
}

fn gives_a_reason(line: &str) -> bool {
    let line = line.to_lowercase();
    line.split_once("not run by the tests").is_some_and(|(_, reason)| reason.chars().any(char::is_alphabetic))
}

#[test]
fn every_command_is_run_or_marked_with_a_reason() {
    for page in Page::all() {
        assert_eq!(unmarked(&page), [] as [String; 0], "above the block: _Not run by the tests: REASON._");
    }
}

#[test]
fn a_command_without_a_mark_is_found() {
    let text = "_Not run by the tests: needs a board._\n\n```console\nstickslip serve\n```\n\nNot run by the tests.\n\
                ```console\nls\n```\n```text\nstickslip serve\n```\n```sh\nstickslip demo\n```\n";
    let page = Page { name: "a.md".into(), text: text.into() };
    assert_eq!(unmarked(&page), ["a.md:8", "a.md:11"]);
}

#[test]
fn every_page_is_listed_in_the_summary() {
    let summary = Page::read("SUMMARY.md");
    let listed: BTreeSet<String> = summary.links().into_iter().collect();
    let pages: BTreeSet<String> = Page::all().into_iter().map(|page| page.name).filter(|n| n != "SUMMARY.md").collect();
    assert_eq!(listed, pages, "left: the summary, right: the folder");
}

/// Links and pictures of a page whose target does not exist.
fn dead_links(page: &Page) -> Vec<String> {
    let leads = |target: &str| {
        let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
        let other = match file {
            "" => return page.anchors().iter().any(|a| a == anchor),
            file if !source().join(file).is_file() => return false,
            file => file,
        };
        anchor.is_empty() || Page::read(other).anchors().iter().any(|a| a == anchor)
    };
    page.links().into_iter().filter(|target| !leads(target)).collect()
}

#[test]
fn every_link_and_picture_within_the_guide_has_a_target() {
    for page in Page::all() {
        assert_eq!(dead_links(&page), [] as [String; 0], "{}", page.name);
    }
}

#[test]
fn a_dead_link_is_found() {
    let text = "# Here\n[a](#here) [b](#there) [c](SUMMARY.md) [d](nowhere.md) [e](SUMMARY.md#nowhere)";
    let page = Page { name: "a.md".into(), text: text.into() };
    assert_eq!(dead_links(&page), ["#there", "nowhere.md", "SUMMARY.md#nowhere"]);
}

/// Code hosts show nothing for `{{#include …}}`.
#[test]
fn no_page_includes_a_file() {
    for page in Page::all() {
        assert!(!page.text.contains("{{#"), "{}: copy the text of the file into the page", page.name);
    }
}
