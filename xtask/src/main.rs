//! Chores of the repository: `cargo xtask test`, `cargo xtask bench`, `cargo xtask study`, `cargo xtask dist`,
//! `cargo xtask bless`.
//!
//! Nothing here is needed to build or to use stickslip.
#![forbid(unsafe_code)]

mod bench;
mod bless;
mod dist;
mod documentation;
mod guide;
mod licences;
mod pace;
mod programs;
mod python;
mod study;
mod suite;
mod test;
mod tools;
mod tree;

use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  test          check everything as continuous integration does, in a copy of the tracked files
  bench [NAME]  ratios against named peers: name, our time, the peer's, peer / ours
  study NAME    what takes too long for the tests; its result is committed: calibrated, calibration, coverage, fidelity, margins, prediction, soak
  dist          one archive that runs on a bare machine: target/dist/stickslip-VERSION-TARGET.tar.gz
  bless         rewrite the golden files from what the program gives now; read the difference before you commit it
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["test"] => test::test(),
        ["bench"] => bench::bench(None),
        ["bench", name] => bench::bench(Some(name)),
        ["study", name] => study::study(name),
        ["dist"] => dist::dist(),
        ["bless"] => bless::bless(),
        _ => Err(USAGE.into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}
