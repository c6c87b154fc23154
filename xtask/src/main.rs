//! Chores of the repository: `cargo xtask test`, `cargo xtask bless`.
//!
//! Nothing here is needed to build or to use stickslip.
#![forbid(unsafe_code)]

mod bless;
mod documentation;
mod licences;
mod suite;
mod test;
mod tools;
mod tree;

use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  test    check everything as continuous integration does, in a copy of the tracked files
  bless   rewrite the golden files from what the program gives now; read the difference before you commit it
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["test"] => test::test(),
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
