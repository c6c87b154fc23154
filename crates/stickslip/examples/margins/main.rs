//! Accuracy of the predicted stiffness at which a rendering law starts to chatter.
//!
//!     cargo xtask study margins
//!
//! takes random benches, predicts the limit of each law, and measures it on the whole virtual bench: hunting, with all
//! noise, counts and converters. Writes `docs/studies/margins.json` and `margins.md`.

mod study;

use std::fmt::Write as _;
use std::path::PathBuf;

use stickslip::{Error, Summary, output};
use study::{Limits, laws, levels, limits};

/// Random benches for each law.
const BENCHES: u64 = 50;
/// Seed of the first bench; those before it were used in the development.
const FIRST_SEED: u64 = 101;

const HEAD: &str = "\
# Prediction of chatter

50 random benches (the preset `prototype` with and without its wheel; drive, load motor, lags and noise up to 30 % \
off, own friction and its bristles up to twice or half as much; 1 to 10 kHz); the software's model has the same values. \
*Observed* is the stiffness of the desired bristles from which on the load torque changes by more than 20 mN·m rms from \
millisecond to millisecond while the load sticks, in a hunting run of 15.5 s, to 3 %. An unstable loop may stay \
below this for some time, in particular at 1 kHz: there the prediction is far on the safe side; *predicted* is \
`stickslip::design::stiffness_limit`. Made by `cargo xtask study margins`; all numbers are in `margins.json`.

| law | benches | predicted/observed: least | median | greatest | predicted at least half of observed |
|-|-|-|-|-|-|
";

fn main() -> Result<(), Error> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "docs/studies".into()));
    output::create_folder(&folder)?;
    let mut summary = Summary::new("cargo xtask study margins");
    let mut text = String::from(HEAD);
    for (name, law) in laws() {
        let mut all = Vec::new();
        for seed in FIRST_SEED..FIRST_SEED + BENCHES {
            let limits = limits(law, seed)?;
            eprintln!("{name} {seed}: {limits:?}");
            summary.row([
                ("law", name.into()),
                ("seed", seed.into()),
                ("tick_rate", limits.tick_rate.into()),
                ("predicted", limits.predicted.into()),
                ("observed", limits.observed.into()),
            ]);
            all.push(limits);
        }
        let ratios = all.iter().filter_map(|limits: &Limits| Some(limits.predicted? / limits.observed?)).collect();
        report(&mut summary, &mut text, name, ratios);
    }
    admittance(&mut summary, &mut text)?;
    output::write(&folder.join("margins.json"), summary.to_json())?;
    output::write(&folder.join("margins.md"), text)
}

/// The ratios of predicted to observed.
fn report(summary: &mut Summary, text: &mut String, name: &str, mut ratios: Vec<f64>) {
    ratios.sort_by(f64::total_cmp);
    let count = ratios.len();
    let half = ratios.iter().filter(|&&ratio| ratio >= 0.5).count() as f64 / count as f64;
    let [least, median, greatest] = [0, count / 2, count - 1].map(|k| ratios[k]);
    summary.result(&format!("{name}.benches"), count as f64, "1");
    for (key, number) in [("least", least), ("median", median), ("greatest", greatest), ("half", half)] {
        summary.result(&format!("{name}.{key}"), number, "1");
    }
    let _ = writeln!(text, "| {name} | {count} | {least:.2} | {median:.2} | {greatest:.2} | {:.0} % |", 100.0 * half);
}

/// The admittance has no limit of stiffness: its chatter itself is compared.
fn admittance(summary: &mut Summary, text: &mut String) -> Result<(), Error> {
    let mut all = Vec::new();
    for seed in FIRST_SEED..FIRST_SEED + BENCHES {
        let [predicted, observed] = levels(seed)?;
        eprintln!("admittance {seed}: {predicted} {observed}");
        summary.row([
            ("law", "admittance".into()),
            ("seed", seed.into()),
            ("predicted_chatter", Some(predicted).filter(|chatter| chatter.is_finite()).into()),
            ("observed_chatter", Some(observed).filter(|chatter| chatter.is_finite()).into()),
        ]);
        all.push([predicted, observed]);
    }
    text.push_str(
        "\nThe admittance (bandwidth 350 rad/s) has no limit of stiffness, but its chatter may be too large: predicted \
         over observed, at the preset's stiffness, of the accepted benches.\n\n\
         | law | benches | predicted/observed: least | median | greatest | predicted at least half of observed |\n\
         |-|-|-|-|-|-|\n",
    );
    let admitted = all.iter().filter(|levels| levels.iter().all(|chatter| chatter.is_finite()));
    report(summary, text, "admittance", admitted.map(|[predicted, observed]| predicted / observed).collect());
    let refused = all.iter().filter(|[predicted, _]| predicted.is_infinite()).count();
    summary.result("admittance.refused", refused as f64, "1");
    let _ = writeln!(
        text,
        "\n{refused} of {} are refused as unstable. Of the others most chatter more than predicted.",
        all.len()
    );
    Ok(())
}
