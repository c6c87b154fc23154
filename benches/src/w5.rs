//! W5: how late a bench wakes up to which everything is attached (recorded, four viewers, XCP, captures, changes of
//! parameters), and the executive alone, beside cyclictest (Debian package rt-tests) in the same minutes, with the same
//! priority, CPU and period, under load on the other CPUs.

use std::error::Error;
use std::process::Command;
use std::time::Duration;

use stickslip::Watch;
use stickslip::realtime::{SPIN, measure_wake_up};
use stickslip_rt::{Cpu, ThreadSetting, ThreadSettings, keep_off};

use crate::crowd::Crowd;
use crate::tick::Load;

const PRIORITY: u8 = 80;
/// A turn of each contestant.
const TURN: Duration = Duration::from_secs(2);
/// What cyclictest tells apart: later wake-ups it only counts [ns].
const LATEST: usize = 1_000_000;

/// Rates that are looked at [Hz].
pub(crate) const RATES: [f64; 3] = [1000.0, 4000.0, 10_000.0];

/// A quantile of the lateness beside cyclictest's.
pub(crate) struct Pair {
    /// Median of all rounds [µs].
    pub(crate) ours: f64,
    /// Median of all rounds [µs].
    pub(crate) peer: f64,
    /// Median of the rounds' ratios peer / ours, and the interval that has the true one in 95 of 100 cases: on a
    /// machine with neighbours it says whether there is a difference at all.
    pub(crate) ratio: [f64; 3],
}

/// Runs all in turn at a rate: p50 and p99 of the bench with everything attached, as `stickslip serve --cpu` runs it, of
/// the executive alone, asleep until its deadline, and of the executive that spins at the end. `Err` without cyclictest or without permission for a
/// priority.
pub(crate) fn run(rate: f64, rounds: usize) -> Result<[Pair; 6], Box<dyn Error>> {
    let cpus = std::thread::available_parallelism()?.get();
    let cpu = cpus - 1;
    let mut turns = Vec::new();
    let _load = Load::new(cpu.max(1));
    for _ in 0..rounds {
        let ours = [attached(rate, cpu)?, ours(rate, cpu, Duration::ZERO)?, ours(rate, cpu, SPIN)?];
        turns.push((ours, cyclictest(rate, cpu)?));
    }
    Ok(std::array::from_fn(|index| {
        let of = |value: fn(f64, f64) -> f64| {
            let mut values: Vec<f64> =
                turns.iter().map(|(ours, peer)| value(ours[index / 2][index % 2], peer[index % 2])).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let median = |value| of(value)[rounds / 2];
        Pair {
            ours: median(|ours, _| ours),
            peer: median(|_, peer| peer),
            ratio: certain(&of(|ours, peer| peer / ours)),
        }
    }))
}

/// The median of sorted values with its 95 % interval, whatever their distribution: as many lie below the true one as
/// heads come when coins are tossed.
fn certain(sorted: &[f64]) -> [f64; 3] {
    let count = sorted.len() as f64;
    let outside = (((count - 1.96 * count.sqrt()) / 2.0).max(0.0) as usize).saturating_sub(1);
    [sorted[sorted.len() / 2], sorted[outside], sorted[sorted.len() - 1 - outside]]
}

fn wishes(cpu: usize) -> ThreadSettings {
    ThreadSettings { priority: Some(PRIORITY), cpu: Cpu::Number(cpu), ..ThreadSettings::default() }
}

/// A bench in the middle of its crowd.
fn attached(rate: f64, cpu: usize) -> Result<[f64; 2], Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("stickslip-w5-{}", std::process::id()));
    if folder.exists() {
        // Of a round that failed.
        std::fs::remove_dir_all(&folder)?;
    }
    std::fs::create_dir_all(&folder)?;
    let file = folder.join("run.mf4");
    let project = folder.join("project");
    let visit = || -> Result<_, stickslip::Error> {
        let crowd = Crowd::gather("clm-bench", rate, wishes(cpu), &project, file)?;
        std::thread::sleep(TURN);
        Ok((crowd.status()?.clock.lost, crowd.leave()?))
    };
    let (lost, left) = beside(cpu, visit)??;
    std::fs::remove_dir_all(&folder)?;
    let frames = left.measured.frames;
    if lost + frames > 0
        || left.seen.iter().any(|seen| seen.missing > 0)
        || left.measured.rows * left.tuned.changes == 0
    {
        return Err(format!(
            "{lost} cycles were lost on their way, {:?}, {:?}, {:?}",
            left.seen, left.tuned, left.measured
        )
        .into());
    }
    let quantiles = left.clocked.histograms.lateness();
    Ok([quantiles.p50, quantiles.p99].map(|time| time as f64 * 1e-3))
}

/// As `stickslip serve --cpu` does: all threads that this starts leave the CPU to the loop.
fn beside<T: Send>(cpu: usize, work: impl FnOnce() -> T + Send) -> std::io::Result<T> {
    let elsewhere = || keep_off(cpu).map(|()| work());
    std::thread::scope(|scope| scope.spawn(elsewhere).join().expect("a benchmark does not panic"))
}

fn ours(rate: f64, cpu: usize, spin: Duration) -> Result<[f64; 2], Box<dyn Error>> {
    let wake_up = beside(cpu, || measure_wake_up(rate, TURN, spin, wishes(cpu), "", &Watch::silent()))??;
    if !wake_up.granted.has(ThreadSetting::Priority(PRIORITY)) {
        return Err(format!("the system grants no priority\n{}", wake_up.granted).into());
    }
    let quantiles = wake_up.histograms.lateness();
    Ok([quantiles.p50, quantiles.p99].map(|time| time as f64 * 1e-3))
}

fn cyclictest(rate: f64, cpu: usize) -> Result<[f64; 2], Box<dyn Error>> {
    let loops = (rate * TURN.as_secs_f64()) as usize;
    let output = Command::new("cyclictest")
        .args(["--quiet", "--mlockall", "--nsecs", "--threads=1"])
        .args([format!("--affinity={cpu}"), format!("--priority={PRIORITY}"), format!("--interval={}", 1e6 / rate)])
        .args([format!("--loops={loops}"), format!("--histogram={LATEST}")])
        .output()
        .map_err(|error| format!("cannot start cyclictest ({error}): apt-get install rt-tests"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let rows = text.lines().filter(|line| !line.starts_with('#')).filter_map(|line| {
        let (time, count) = line.split_once(char::is_whitespace)?;
        Some((time.parse::<u64>().ok()?, count.trim().parse::<u64>().ok()?))
    });
    let late = text.lines().find_map(|line| line.strip_prefix("# Histogram Overflows:")?.trim().parse::<u64>().ok());
    quantiles(&rows.collect::<Vec<_>>(), late.unwrap_or(0))
        .ok_or_else(|| format!("cyclictest failed: {}", String::from_utf8_lossy(&output.stderr)).into())
}

/// p50 and p99 [µs] of counts by time [ns] and of those that were later than all: those are [`LATEST`] late at least.
fn quantiles(rows: &[(u64, u64)], later: u64) -> Option<[f64; 2]> {
    let all = rows.iter().map(|(_, count)| count).sum::<u64>() + later;
    let at = |part: f64| {
        let mut sum = 0;
        let row = rows.iter().find(|(_, count)| {
            sum += count;
            sum as f64 >= part * all as f64
        });
        row.map_or(LATEST as f64, |(time, _)| *time as f64) * 1e-3
    };
    (all > 0).then(|| [at(0.5), at(0.99)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cyclictest_could_not_tell_apart_counts_as_late() {
        let rows: Vec<(u64, u64)> = (1..=100).map(|time| (1000 * time, 1)).collect();
        assert_eq!(quantiles(&rows, 0), Some([50.0, 99.0]));
        assert_eq!(quantiles(&rows, 100), Some([100.0, 1000.0]), "p99 is among the later ones");
        assert_eq!(quantiles(&[], 0), None);
    }

    #[test]
    fn a_median_of_twenty_one_lies_between_the_sixth_and_the_sixteenth() {
        // From 6 to 15 heads of 21 coins: 97 of 100 cases; from 7 to 14 were 92.
        let rounds: Vec<f64> = (1..=21).map(f64::from).collect();
        assert_eq!(certain(&rounds), [11.0, 6.0, 16.0]);
        assert_eq!(certain(&[1.0, 2.0]), [2.0, 1.0, 2.0], "too few to leave one out");
    }
}
