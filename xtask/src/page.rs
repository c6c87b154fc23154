//! The part `page`: types, lints and unit tests of the page, then the page in a browser.

use std::path::Path;
use std::process::Command;

use crate::budget::{BROWSER, PAGE, PAGE_BUILD};
use crate::command::{PROGRAM, run};
use crate::record::Reads;
use crate::suite::Outcome;
use crate::test::Run;
use crate::tools;

pub(crate) fn check(Run { suite, cargo, record, .. }: &mut Run) {
    let web = cargo.folder.join("web");
    let npm_works = tools::works("node") && tools::works("npm");
    suite.stage(PAGE, |_| {
        if !npm_works {
            return Ok(Outcome::Skipped("npm is missing".into()));
        }
        check_sources(&web)?;
        Ok(Outcome::Passed)
    });
    let chromium = std::env::var("CHROMIUM").unwrap_or_else(|_| "chromium".into());
    if !npm_works || !tools::works(&chromium) {
        suite.skip("page in a browser: npm or chromium is missing".into());
        return;
    }
    suite.stage(PAGE_BUILD, |_| cargo.build(&["--bin", PROGRAM]).map(|()| Outcome::Passed));
    let inputs = record.inputs(Reads::All, [&cargo.program()]);
    suite.stage(BROWSER, |_| {
        let test = || run(npm(&web, "browser").env("STICKSLIP", cargo.program()));
        record.unless_unchanged(BROWSER.name, inputs, test)
    });
}

/// Checks that need no program: types, lints, unit tests.
pub(crate) fn check_sources(web: &Path) -> Result<(), String> {
    if !web.join("node_modules").exists() {
        run(Command::new("npm").current_dir(web).args(["ci", "--no-audit", "--no-fund", "--silent"]))?;
    }
    run(&mut npm(web, "check"))?;
    run(&mut npm(web, "unit"))
}

fn npm(web: &Path, script: &str) -> Command {
    let mut command = Command::new("npm");
    command.current_dir(web).args(["run", "--silent", script]);
    command
}
