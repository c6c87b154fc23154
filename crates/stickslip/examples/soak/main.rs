//! Losses of a bench in real time in an hour.
//!
//!     cargo xtask study soak
//!
//! runs one for an hour, 4 kHz, recorded, with four viewers of 64 signals, XCP, captures and changes of parameters, and
//! replays the record. `-- FOLDER SECONDS RATE` sets another time and rate. Writes `docs/studies/soak.json` and
//! `soak.md`.

mod crowd;
mod soak;

use std::fmt::Write as _;
use std::path::PathBuf;

use crowd::{SIGNALS, VIEWERS};
use soak::soak;
use stickslip::bench::ThreadSettings;
use stickslip::run::channels;
use stickslip::{Error, Summary, output};

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/studies".into()));
    let mut number = |default: f64| arguments.next().and_then(|text| text.parse().ok()).unwrap_or(default);
    let (seconds, rate) = (number(3600.0), number(4000.0));
    output::create_folder(&folder)?;
    let room = std::env::temp_dir().join(format!("stickslip-soak-{}", std::process::id()));
    output::create_folder(&room)?;
    let soaked = soak(rate, seconds, ThreadSettings::default(), &room)?;
    // The record of an hour is a gigabyte.
    let _ = std::fs::remove_dir_all(&room);

    let mut summary = Summary::new("cargo xtask study soak");
    let (results, replayed) = (&soaked.results, &soaked.replayed);
    let missing: u64 = results.received.iter().map(|viewer| viewer.missing).sum();
    let watched: u64 = results.received.iter().map(|viewer| viewer.cycles).sum();
    summary
        .result("soak.seconds", seconds, "s")
        .result("soak.rate", rate, "Hz")
        .result("soak.recorded", replayed.of as f64, "1")
        .result("soak.lost", soaked.lost as f64, "1")
        .result("soak.streamed", watched as f64, "1")
        .result("soak.missing", missing as f64, "1")
        .result("soak.identical", f64::from(u8::from(replayed.identical())), "1")
        .result("soak.measured", results.measured.rows as f64, "1")
        .result("soak.measured.lost", results.measured.frames as f64, "1")
        .result("soak.changes", results.tuned.changes as f64, "1")
        .result("soak.captures", results.tuned.captures as f64, "1")
        .result("soak.captures.lost", results.tuned.lost as f64, "1")
        .result("soak.bytes", soaked.bytes as f64, "bytes");
    results.clocked.add_to(&mut summary);
    for (part, memory) in soaked.memory.iter().enumerate() {
        let time = seconds * (part + 1) as f64 / f64::from(soak::PARTS);
        summary.row([("time", time.into()), ("memory", (*memory).into())]);
    }
    let megabytes = |bytes: u64| bytes as f64 / 1e6;
    let memory = |part: usize| soaked.memory.get(part).copied().map_or(f64::NAN, megabytes);
    let mut text = format!(
        "# Losses in an hour of real time\n\n\
         {seconds:.0} s of `clm-bench` in real time at {rate} Hz: homed, then a sine under the rendering law with \
         bristles. All clients were connected: all {} signals of every cycle recorded, {VIEWERS} viewers with {SIGNALS} \
         streamed signals each, an XCP master that measures 20 signals in every cycle, captures around a trigger, a \
         change of parameters each second. Made by `cargo xtask study soak` on a virtual machine with two cores, with compilers running; all numbers are in `soak.json`, a \
         run of a minute is a test.\n\n| | |\n|-|-|\n",
        channels().len()
    );
    let (changes, captures) = (results.tuned.changes, results.tuned.captures);
    let clock = results.clocked.histograms.lateness();
    for (title, value) in [
        ("cycles recorded", replayed.of.to_string()),
        ("cycles lost by full buffers", soaked.lost.to_string()),
        ("cycles streamed, all viewers together", watched.to_string()),
        ("cycles missing between their points", missing.to_string()),
        ("parameter changes, captures", format!("{changes}, {captures}")),
        ("cycles missing in captures", results.tuned.lost.to_string()),
        ("rows measured by XCP, frames lost", format!("{}, {}", results.measured.rows, results.measured.frames)),
        ("record replayed, software and virtual machine", identical(replayed.identical()).into()),
        ("size of the record", format!("{:.0} MB", megabytes(soaked.bytes))),
        ("deadlines missed", results.clocked.summary.missed.to_string()),
        ("lateness p50, p99, p99.9", format!("{:.1}, {:.1}, {:.0} µs", us(clock.p50), us(clock.p99), us(clock.p999))),
        ("memory after a tenth, half, all of the time", {
            format!("{:.1}, {:.1}, {:.1} MB", memory(1), memory(9), memory(19))
        }),
    ] {
        let _ = writeln!(text, "| {title} | {value} |");
    }
    output::write(&folder.join("soak.json"), summary.to_json())?;
    output::write(&folder.join("soak.md"), text)
}

fn us(nanoseconds: u64) -> f64 {
    nanoseconds as f64 * 1e-3
}

fn identical(identical: bool) -> &'static str {
    if identical { "bit-identical" } else { "NOT identical" }
}
