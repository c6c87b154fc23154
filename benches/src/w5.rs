//! W5: wake-up latency of a complete bench (recorder, four viewers, XCP, captures, parameter changes) and of the
//! executive alone, compared with cyclictest (Debian package rt-tests) in the same minutes, with the same priority, CPU
//! and period, under load on the other CPUs.

use std::error::Error;
use std::process::Command;
use std::time::Duration;

use stickslip::Watch;
use stickslip::realtime::{SPIN, measure_wake_up};
use stickslip_rt::{Cpu, ThreadSetting, ThreadSettings, keep_off};

use crate::crowd::Crowd;
use crate::tick::Load;

const PRIORITY: u8 = 80;
/// Duration of a run of each program.
const TURN: Duration = Duration::from_secs(2);
/// Range of the histogram of cyclictest [ns]; it only counts later wake-ups.
const LATEST: usize = 1_000_000;

/// Compared rates [Hz].
pub(crate) const RATES: [f64; 3] = [1000.0, 4000.0, 10_000.0];

/// A quantile of the lateness, ours and that of cyclictest.
pub(crate) struct Pair {
    /// Median of all rounds [µs].
    pub(crate) ours: f64,
    /// Median of all rounds [µs].
    pub(crate) peer: f64,
    /// Median of the ratios peer / ours of the rounds, with its 95 % interval, which shows whether a difference on a
    /// shared machine is significant.
    pub(crate) ratio: [f64; 3],
}

/// Runs all programs in turn at a rate. Returns p50 and p99 of the complete bench, as `stickslip serve --cpu` runs it,
/// of the executive alone, sleeping until its deadline, and of the executive that spins at the end. An error without
/// cyclictest or without permission for a real-time priority.
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
            ratio: median_with_interval(&of(|ours, peer| peer / ours)),
        }
    }))
}

/// The median of sorted values with its distribution-free 95 % interval: the number of values below the true median has
/// a binomial distribution with probability 1/2.
fn median_with_interval(sorted: &[f64]) -> [f64; 3] {
    let count = sorted.len() as f64;
    let outside = (((count - 1.96 * count.sqrt()) / 2.0).max(0.0) as usize).saturating_sub(1);
    [sorted[sorted.len() / 2], sorted[outside], sorted[sorted.len() - 1 - outside]]
}

fn thread_settings(cpu: usize) -> ThreadSettings {
    ThreadSettings { priority: Some(PRIORITY), cpu: Cpu::Number(cpu), ..ThreadSettings::default() }
}

/// p50 and p99 of a bench with recorder and clients [µs].
fn attached(rate: f64, cpu: usize) -> Result<[f64; 2], Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("stickslip-w5-{}", std::process::id()));
    if folder.exists() {
        // Left by a failed round.
        std::fs::remove_dir_all(&folder)?;
    }
    std::fs::create_dir_all(&folder)?;
    let file = folder.join("run.mf4");
    let project = folder.join("project");
    let visit = || -> Result<_, stickslip::Error> {
        let crowd = Crowd::gather("clm-bench", rate, thread_settings(cpu), &project, file)?;
        std::thread::sleep(TURN);
        Ok((crowd.status()?.clock.lost, crowd.leave()?))
    };
    let (lost, left) = beside(cpu, visit)??;
    std::fs::remove_dir_all(&folder)?;
    let frames = left.measured.frames;
    if lost + frames > 0
        || left.received.iter().any(|viewer| viewer.missing > 0)
        || left.measured.rows * left.tuned.changes == 0
    {
        return Err(
            format!("{lost} cycles were lost, {:?}, {:?}, {:?}", left.received, left.tuned, left.measured).into()
        );
    }
    let quantiles = left.clocked.histograms.lateness();
    Ok([quantiles.p50, quantiles.p99].map(|time| time as f64 * 1e-3))
}

/// Runs `work` so that its threads leave the CPU to the loop, as `stickslip serve --cpu` does.
fn beside<T: Send>(cpu: usize, work: impl FnOnce() -> T + Send) -> std::io::Result<T> {
    let elsewhere = || keep_off(cpu).map(|()| work());
    std::thread::scope(|scope| scope.spawn(elsewhere).join().expect("a benchmark does not panic"))
}

fn ours(rate: f64, cpu: usize, spin: Duration) -> Result<[f64; 2], Box<dyn Error>> {
    let wake_up = beside(cpu, || measure_wake_up(rate, TURN, spin, thread_settings(cpu), "", &Watch::silent()))??;
    if !wake_up.granted.has(ThreadSetting::Priority(PRIORITY)) {
        return Err(format!("the system does not grant a real-time priority\n{}", wake_up.granted).into());
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
        .map_err(|error| format!("cannot start cyclictest ({error}). Install it: apt-get install rt-tests"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let rows = text.lines().filter(|line| !line.starts_with('#')).filter_map(|line| {
        let (time, count) = line.split_once(char::is_whitespace)?;
        Some((time.parse::<u64>().ok()?, count.trim().parse::<u64>().ok()?))
    });
    let late = text.lines().find_map(|line| line.strip_prefix("# Histogram Overflows:")?.trim().parse::<u64>().ok());
    quantiles(&rows.collect::<Vec<_>>(), late.unwrap_or(0))
        .ok_or_else(|| format!("cyclictest failed: {}", String::from_utf8_lossy(&output.stderr)).into())
}

/// p50 and p99 [µs] from counts by time [ns] and the count of later wake-ups, which are at least [`LATEST`] late.
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
    fn wake_ups_beyond_the_histogram_count_as_late() {
        let rows: Vec<(u64, u64)> = (1..=100).map(|time| (1000 * time, 1)).collect();
        assert_eq!(quantiles(&rows, 0), Some([50.0, 99.0]));
        assert_eq!(quantiles(&rows, 100), Some([100.0, 1000.0]), "p99 is beyond the histogram");
        assert_eq!(quantiles(&[], 0), None);
    }

    #[test]
    fn the_interval_of_a_median_of_twenty_one_is_from_the_sixth_to_the_sixteenth() {
        // 6 to 15 heads of 21 coins have a probability of 97 %; 7 to 14 heads have 92 %.
        let rounds: Vec<f64> = (1..=21).map(f64::from).collect();
        assert_eq!(median_with_interval(&rounds), [11.0, 6.0, 16.0]);
        assert_eq!(median_with_interval(&[1.0, 2.0]), [2.0, 1.0, 2.0], "too few values to exclude one");
    }
}
