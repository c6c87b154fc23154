//! Cost of a row on its way to a capture, an envelope and a history, and of a query of the history.
//!
//! `cargo run --release -p stickslip --example capture`: mean of a million rows of 32 signals, best of five turns.

use std::hint::black_box;
use std::time::Instant;

use stickslip::Error;
use stickslip::capture::{Capture, Envelope, Keep, Plan, Pyramid, Stream};

const SIGNALS: usize = 32;
const ROWS: u64 = 1_000_000;
const TURNS: usize = 5;
/// Memory limit of a sink [bytes].
const LIMIT: usize = 1 << 30;

fn main() -> Result<(), Error> {
    let rows: Vec<Vec<f64>> =
        (0..4096).map(|row| (0..SIGNALS).map(|i| (0.01 * (row * (i + 1)) as f64).sin()).collect()).collect();
    println!("a row of {SIGNALS} signals                    ns");
    println!("stream without a sink        {:10.1}", cost(&rows, |_| Ok(()))?);
    // Worst case of a capture: a repeated edge, every segment replaced by the next.
    let capture = |stream: &mut Stream| stream.add(capture(16_000, 4_000)?).map(drop);
    println!("capture                      {:10.1}", cost(&rows, capture)?);
    let envelope = |stream: &mut Stream| stream.add(Envelope::new(all(), 64, 1024, LIMIT)?).map(drop);
    println!("envelope of 64 ticks         {:10.1}", cost(&rows, envelope)?);
    let pyramid = |stream: &mut Stream| stream.add(history()?).map(drop);
    println!("pyramid of 2^19 ticks        {:10.1}", cost(&rows, pyramid)?);
    let together = |stream: &mut Stream| capture(stream).and(envelope(stream)).and(pyramid(stream));
    println!("all three                    {:10.1}", cost(&rows, together)?);

    let mut stream = Stream::new(SIGNALS);
    let tap = stream.add(history()?)?;
    for (cycle, row) in (0..ROWS).zip(rows.iter().cycle()) {
        stream.push(cycle, row)?;
    }
    let history = stream.get(&tap).expect("it is in this stream");
    println!("\n2000 points of {SIGNALS} signals                 µs");
    for span in [1_000, 10_000, 100_000, 500_000] {
        let start = ROWS - span - 7;
        let time = fastest(|| drop(black_box(history.query(start..start + span, 2000))));
        println!("over {span:6} ticks            {:10.1}", 1e6 * time);
    }
    Ok(())
}

fn all() -> Vec<usize> {
    (0..SIGNALS).collect()
}

fn capture(before: u64, after: u64) -> Result<Capture, Error> {
    let plan = Plan { signals: all(), decimation: 1, before, after, keep: Keep::Latest(1) };
    let names: Vec<_> = all().iter().map(|i| format!("signal_{i}")).collect();
    Capture::new(plan, &"signal_3 rises through 0.5, hysteresis 0.1".parse()?, &names, LIMIT)
}

fn history() -> Result<Pyramid, Error> {
    Pyramid::new(all(), 1 << 19, LIMIT)
}

/// Mean time of a row [ns].
fn cost(rows: &[Vec<f64>], add: impl Fn(&mut Stream) -> Result<(), Error>) -> Result<f64, Error> {
    let mut stream = Stream::new(SIGNALS);
    add(&mut stream)?;
    let mut next = 0;
    let time = fastest(|| {
        for (cycle, row) in (next..next + ROWS).zip(rows.iter().cycle()) {
            stream.push(cycle, black_box(row)).expect("cycles increase");
        }
        next += ROWS;
    });
    Ok(1e9 * time / ROWS as f64)
}

/// The least time of some turns [s].
fn fastest(mut work: impl FnMut()) -> f64 {
    let turn = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..TURNS).map(turn).fold(f64::INFINITY, f64::min)
}
