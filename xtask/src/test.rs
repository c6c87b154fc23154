//! `cargo xtask test [PART]`: all checks, in stages.

use std::str::FromStr;

use crate::budget::{COPY, FULL_RUN, LEFTOVERS, TOOLS};
use crate::command::Cargo;
use crate::record::Record;
use crate::suite::{Outcome, Suite};
use crate::tools::Tools;
use crate::{guide, page, python, rust, tools, tree};

/// A part of the checks. Each builds what it needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Rust,
    Python,
    Page,
    Guide,
}

impl Part {
    /// All parts, in the order in which they run.
    pub(crate) const ALL: [Self; 4] = [Self::Rust, Self::Python, Self::Page, Self::Guide];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Rust => "rust",
            Self::Python => "python",
            Self::Page => "page",
            Self::Guide => "guide",
        }
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let names = Self::ALL.map(Self::name).join(", ");
        let part = Self::ALL.into_iter().find(|part| part.name() == name);
        part.ok_or_else(|| format!("unknown part \"{name}\"; the parts are {names}"))
    }
}

/// Options of a run.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Options {
    /// The only part that runs; default: all.
    part: Option<Part>,
    /// Whether tests run that passed with the same inputs.
    all: bool,
}

impl Options {
    /// Reads `[PART] [--all]`.
    pub(crate) fn parse(arguments: &[&str]) -> Result<Self, String> {
        let mut options = Self::default();
        for argument in arguments {
            match (*argument, options.part) {
                ("--all", _) => options.all = true,
                (part, None) => options.part = Some(part.parse()?),
                (_, Some(_)) => return Err(format!("unknown argument \"{argument}\": one part at a time")),
            }
        }
        Ok(options)
    }
}

/// State that the parts share.
pub(crate) struct Run {
    pub(crate) suite: Suite,
    pub(crate) tools: Tools,
    pub(crate) record: Record,
    /// Cargo in the copy.
    pub(crate) cargo: Cargo,
}

/// Runs one part, or all, in a copy of the tracked files. `Err` if a stage failed.
pub(crate) fn test(options: &Options) -> Result<(), String> {
    let root = tree::root()?;
    let copy = tree::copy_of(&root);
    let files = tree::files(&root)?;
    let parts = options.part.map_or(Part::ALL.to_vec(), |part| vec![part]);
    let mut suite = Suite::default();

    let mut tools = None;
    suite.stage(TOOLS, |_| {
        tools = Some(tools::ensure(&parts));
        Ok(Outcome::Passed)
    });
    let tools = tools.expect("the stage has run");
    for line in &tools.missing {
        suite.skip(line.clone());
    }
    suite.stage(COPY, |_| {
        tree::mirror(&root, &files, &copy)?;
        println!("{} files in {}", files.len(), copy.display());
        Ok(Outcome::Passed)
    });

    let cargo = Cargo::new(&copy, &root);
    let record = Record::new(&cargo.target, &copy, &files, &environment_of(&tools), options.all);
    let mut run = Run { suite, tools, record, cargo };
    // Mostly waits for the package index, while the stages of Rust run.
    let mut environment = parts.contains(&Part::Python).then(|| python::prepare(&run.cargo.target));
    for part in &parts {
        match part {
            Part::Rust => rust::check(&mut run),
            Part::Python => python::check(&mut run, environment.take().expect("prepared for this part")),
            Part::Page => page::check(&mut run),
            Part::Guide => guide::check(&mut run, !parts.contains(&Part::Rust)),
        }
    }
    let Run { mut suite, record, .. } = run;
    suite.unchanged = record.into_unchanged();
    suite.stage(LEFTOVERS, |_| {
        let leftovers = tree::leftovers(&root, &files, &copy)?;
        let names: Vec<_> = leftovers.iter().map(|path| path.display().to_string()).collect();
        if names.is_empty() { Ok(Outcome::Passed) } else { Err(format!("a test wrote {}", names.join(", "))) }
    });
    if options.part.is_none() {
        suite.limit(FULL_RUN);
    }
    println!("\n{}", suite.summary());
    if suite.passed() { Ok(()) } else { Err("not passed: see `failed:` above".into()) }
}

/// Inputs of the results other than files: missing tools, and the variables that choose tools.
fn environment_of(tools: &Tools) -> Vec<String> {
    let chosen = ["PATH", "CC", "CHROMIUM"].map(|name| std::env::var(name).unwrap_or_default());
    [&tools.missing[..], &chosen].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_and_all_are_options_in_any_order_and_two_parts_are_refused() {
        let page = Options { part: Some(Part::Page), all: true };
        assert_eq!(Options::parse(&["--all", "page"]).as_ref(), Ok(&page));
        assert_eq!(Options::parse(&["page", "--all"]).as_ref(), Ok(&page));
        assert_eq!(Options::parse(&[]), Ok(Options::default()));
        let refusal = "unknown argument \"python\": one part at a time";
        assert_eq!(Options::parse(&["page", "python"]), Err(refusal.into()));
    }

    #[test]
    fn an_unknown_part_is_an_error_that_lists_the_parts() {
        for part in Part::ALL {
            assert_eq!(part.name().parse(), Ok(part));
        }
        let refusal = "pages".parse::<Part>();
        assert_eq!(refusal, Err("unknown part \"pages\"; the parts are rust, python, page, guide".into()));
    }
}
