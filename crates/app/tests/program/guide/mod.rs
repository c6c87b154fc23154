//! The guide in `docs/src` tells what the program does: commands and what they print, figures, files, symbols, links.

mod commands;
mod expected;
mod files;
mod markdown;
mod symbols;

use std::collections::BTreeSet;
use std::sync::LazyLock;

use commands::{compare_figures, run};
use markdown::{Page, source};
use tempfile::TempDir;

/// Pages with short commands.
const OTHERS: [&str; 8] =
    ["introduction.md", "controllers.md", "files.md", "errors.md", "studies.md", "library.md", "fmu.md", "external.md"];

/// Recipes whose files other tests look at, too.
pub(crate) static DRIVE_ENGINEER: LazyLock<TempDir> = LazyLock::new(|| run("drive-engineer.md"));
pub(crate) static LABORATORY: LazyLock<TempDir> = LazyLock::new(|| run("laboratory.md"));
pub(crate) static LOOP: LazyLock<TempDir> = LazyLock::new(|| run("loop.md"));
pub(crate) static MICROCONTROLLER: LazyLock<TempDir> = LazyLock::new(|| run("microcontroller.md"));
pub(crate) static TEACHER: LazyLock<TempDir> = LazyLock::new(|| run("teacher.md"));

#[test]
fn the_recipe_for_drive_engineers_runs_and_shows_its_figures() {
    compare_figures("identify", &DRIVE_ENGINEER.path().join("stickslip-out/identify"));
}

#[test]
fn the_recipe_for_laboratories_runs_and_shows_its_figures() {
    compare_figures("render", &LABORATORY.path().join("stickslip-out/render"));
}

#[test]
fn the_lesson_runs_and_shows_its_figures() {
    compare_figures("demo", &TEACHER.path().join("stickslip-out/demo"));
}

#[test]
fn the_recipe_for_researchers_runs() {
    run("researcher.md");
}

#[test]
fn the_recipe_for_hardware_runs() {
    run("own-hardware.md");
}

#[test]
fn the_page_on_loops_runs_and_shows_its_figures() {
    compare_figures("loop", &LOOP.path().join("stickslip-out/loop"));
}

#[test]
fn introduction_and_reference_run() {
    for page in OTHERS {
        run(page);
    }
}

#[test]
fn no_command_and_no_figure_of_the_guide_is_left_out() {
    let with_commands: Vec<String> = Page::all()
        .into_iter()
        .filter(|page| page.blocks().iter().any(|block| block.kind == "sh"))
        .map(|page| page.name)
        .collect();
    let recipes = [
        "drive-engineer.md",
        "laboratory.md",
        "loop.md",
        "microcontroller.md",
        "own-hardware.md",
        "researcher.md",
        "teacher.md",
    ];
    let run: BTreeSet<&str> = recipes.into_iter().chain(OTHERS).collect();
    assert_eq!(with_commands, run.into_iter().collect::<Vec<_>>());
    let figures = std::fs::read_dir(source().join("figures")).expect("the guide has figures");
    let figures: BTreeSet<_> = figures.map(|entry| entry.expect("it can be listed").file_name()).collect();
    // Those of the page are pictures of a browser, which no command draws; those of prediction are a study's.
    assert_eq!(
        figures,
        ["demo", "fidelity", "identify", "loop", "page", "prediction", "render"].map(Into::into).into()
    );
}

#[test]
fn every_page_stands_in_the_summary() {
    let summary = Page::read("SUMMARY.md");
    let listed: BTreeSet<String> = summary.links().into_iter().collect();
    let pages: BTreeSet<String> = Page::all().into_iter().map(|page| page.name).filter(|n| n != "SUMMARY.md").collect();
    assert_eq!(listed, pages, "left the summary, right the folder");
}

/// Links, pictures and included files of a page that lead nowhere.
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
    let dead = page.links().into_iter().filter(|target| !leads(target));
    dead.chain(page.includes().into_iter().filter(|file| !source().join(file).is_file())).collect()
}

#[test]
fn every_link_and_picture_within_the_guide_leads_somewhere() {
    for page in Page::all() {
        assert_eq!(dead_links(&page), [] as [String; 0], "{}", page.name);
    }
}

#[test]
fn a_dead_link_is_found() {
    let text = "# Here\n[a](#here) [b](#there) [c](SUMMARY.md) [d](nowhere.md) [e](SUMMARY.md#nowhere)\n\
                {{#include ../integrator.md}} {{#include ../gone.md}}";
    let page = Page { name: "a.md".into(), text: text.into() };
    assert_eq!(dead_links(&page), ["#there", "nowhere.md", "SUMMARY.md#nowhere", "../gone.md"]);
}
