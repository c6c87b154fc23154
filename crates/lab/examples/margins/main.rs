//! How well is the stiffness predicted from which on a rendering law chatters?
//!
//!     cargo xtask study margins
//!
//! takes random benches, predicts the limit of each law, and looks for it on the whole virtual bench: hunting, with all
//! noise, counts and converters. Writes `docs/studies/margins.json` and `margins.md`.

mod study;

use std::fmt::Write as _;
use std::path::PathBuf;

use stickslip::{Error, Summary, output};
use study::{Limits, laws, limits};

/// Random benches for each law.
const BENCHES: u64 = 50;
/// Seed of the first; those before it were looked at while the prediction was made.
const FIRST_SEED: u64 = 101;

const HEAD: &str = "\
# Is chatter predicted?

Each row: 50 random benches (the preset `prototype` with and without its wheel; drive, load motor and lags up to 30 % off, \
noise as well, own friction and its bristles up to twice or half as much; 1 to 10 kHz), which the software knows. \
*Observed* is the stiffness of the desired bristles from which on the load torque changes by more than 20 mN·m rms from \
millisecond to millisecond while the load sticks, in a hunting run of 15.5 s, to 3 %; *predicted* is `stickslip::design::stiffness_limit`. Made \
by `cargo xtask study margins`; all numbers are in `margins.json`.

| law | with a limit | predicted/observed: least | median | greatest | predicted at least half of observed | no limit, predicted and observed | refused or limited where none is seen | limit seen where none is predicted |
|-|-|-|-|-|-|-|-|-|
";

fn main() -> Result<(), Error> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "docs/studies".into()));
    output::create_folder(&folder)?;
    let mut summary = Summary::new("cargo xtask study margins");
    let mut text = String::from(HEAD);
    for (name, law) in laws() {
        let mut all = Vec::new();
        for seed in FIRST_SEED..FIRST_SEED + BENCHES {
            let found = limits(law, seed)?;
            eprintln!("{name} {seed}: {found:?}");
            summary.row([
                ("law", name.into()),
                ("seed", seed.into()),
                ("tick_rate", found.tick_rate.into()),
                ("predicted", found.predicted.into()),
                ("observed", found.observed.into()),
            ]);
            all.push(found);
        }
        report(&mut summary, &mut text, name, &all);
    }
    output::write(&folder.join("margins.json"), summary.to_json())?;
    output::write(&folder.join("margins.md"), text)
}

fn report(summary: &mut Summary, text: &mut String, name: &str, all: &[Limits]) {
    let count = |what: &dyn Fn(&Limits) -> bool| all.iter().filter(|limits| what(limits)).count();
    let mut ratios: Vec<f64> = all.iter().filter_map(|limits| Some(limits.predicted? / limits.observed?)).collect();
    ratios.sort_by(f64::total_cmp);
    let halves = ratios.iter().filter(|&&ratio| ratio >= 0.5).count();
    let unlimited = count(&|limits| limits.predicted.is_none() && limits.observed.is_none());
    let careful = count(&|limits| limits.predicted.is_some() && limits.observed.is_none());
    let missed = count(&|limits| limits.predicted.is_none() && limits.observed.is_some());
    for (what, number) in
        [("with_limit", ratios.len()), ("unlimited", unlimited), ("careful", careful), ("missed", missed)]
    {
        summary.result(&format!("{name}.{what}"), number as f64, "1");
    }
    let shown = match (ratios.first(), ratios.last()) {
        (Some(&least), Some(&greatest)) => {
            let median = ratios[ratios.len() / 2];
            let share = halves as f64 / ratios.len() as f64;
            for (what, number) in [("least", least), ("median", median), ("greatest", greatest), ("half", share)] {
                summary.result(&format!("{name}.{what}"), number, "1");
            }
            format!("{least:.2} | {median:.2} | {greatest:.2} | {:.0} %", 100.0 * share)
        }
        _ => " | | | ".into(),
    };
    let _ = writeln!(text, "| {name} | {} | {shown} | {unlimited} | {careful} | {missed} |", ratios.len());
}
