//! Time budgets: the only table of them.

use std::time::Duration;

/// A stage of `cargo xtask test`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    pub(crate) name: &'static str,
    pub(crate) budget: Duration,
}

const fn stage(name: &'static str, seconds: u64) -> Stage {
    Stage { name, budget: Duration::from_secs(seconds) }
}

// From a bare clone, on two cores of the machine that `pace` refers to.
pub(crate) const FULL_RUN: Stage = stage("full run", 25 * 60);

pub(crate) const TOOLS: Stage = stage("tools", 120);
pub(crate) const COPY: Stage = stage("copy of the tracked files", 10);
pub(crate) const FORMAT: Stage = stage("format", 10);
pub(crate) const LINTS: Stage = stage("lints", 180);
pub(crate) const LICENCES: Stage = stage("licences", 10);
pub(crate) const BARE_CORE: Stage = stage("core without std", 20);
pub(crate) const WINDOWS: Stage = stage("Windows check", 90);
pub(crate) const COMPILE: Stage = stage("tests compile", 480);
pub(crate) const TESTS: Stage = stage("tests", 480);
pub(crate) const DOC_TESTS: Stage = stage("doc tests", 40);
pub(crate) const DOCUMENTATION: Stage = stage("documentation", 60);
// The builds of the parts that follow: for a part that runs alone. In the full run little is left to build.
pub(crate) const PYTHON_BUILD: Stage = stage("program and Python module", 600);
pub(crate) const PYTHON: Stage = stage("python", 240);
pub(crate) const PAGE: Stage = stage("page", 120);
pub(crate) const PAGE_BUILD: Stage = stage("program", 500);
pub(crate) const BROWSER: Stage = stage("browser", 300);
pub(crate) const GUIDE: Stage = stage("guide", 10);
pub(crate) const GUIDE_TESTS: Stage = stage("guide tests", 700);
pub(crate) const LEFTOVERS: Stage = stage("no files left behind", 5);
