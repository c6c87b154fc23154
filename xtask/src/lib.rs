//! Development commands of the repository: `cargo xtask COMMAND`. Building and using stickslip require none of them.
#![forbid(unsafe_code)]

mod bench;
mod bless;
mod budget;
mod changes;
mod check;
mod command;
mod dist;
mod documentation;
mod guide;
mod licences;
pub mod map;
mod pace;
mod page;
mod programs;
mod python;
mod record;
mod rust;
mod schedule;
mod study;
mod suite;
mod test;
mod tools;
mod tree;
pub mod workspace;

pub use tree::root;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  check         check the changes against main: format, lints, interfaces, unit tests of the changed packages
  test [PART]   run all checks of continuous integration, or one part: rust, python, page, guide;
                test programs that passed with the same inputs do not run again, except with --all
  bench [NAME]  measure ratios to named peers: name, our time, the peer's time, peer / ours
  study [NAME]  run a study that is too long for the tests; default: list the studies
                (study fuzz --minutes N: mutated files of every format, for N minutes)
  map           redraw the map of the crates in ARCHITECTURE.md
  dist          build the archive for a bare machine: target/dist/stickslip-VERSION-TARGET.tar.gz
  bless         rewrite the golden files from the current output; review the difference before the commit
";

/// Runs a command. `Err` with the message for the user.
pub fn run(arguments: &[&str]) -> Result<(), String> {
    match arguments {
        ["check"] => check::check(),
        ["test", options @ ..] => test::test(&test::Options::parse(options)?),
        ["bench"] => bench::bench(None),
        ["bench", name] => bench::bench(Some(name)),
        ["study"] => study::list(),
        ["study", "fuzz", "--minutes", minutes] => study::fuzz(minutes),
        ["study", name] => study::study(name),
        ["map"] => map::map(),
        ["dist"] => dist::dist(),
        ["bless"] => bless::bless(),
        _ => Err(USAGE.into()),
    }
}
