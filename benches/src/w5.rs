//! W5: how late a bench wakes up to which everything is attached (recorded, four viewers, XCP, captures, changes of
//! parameters), and the executive alone, beside cyclictest (Debian package rt-tests) in the same minutes, with the same
//! priority, CPU and period, under load on the other CPUs.

use std::error::Error;
use std::process::Command;
use std::time::Duration;

use stickslip::Watch;
use stickslip::realtime::{SPIN, measure_wake_up};
use stickslip_rt::{Cpu, Wish, Wishes, keep_off};

use crate::crowd::Crowd;
use crate::tick::Load;

const PRIORITY: u8 = 80;
/// A turn of each contestant.
const TURN: Duration = Duration::from_secs(2);
/// What cyclictest tells apart: later wake-ups it only counts [ns].
const LATEST: usize = 1_000_000;

/// Rates that are looked at [Hz].
pub(crate) const RATES: [f64; 3] = [1000.0, 4000.0, 10_000.0];

/// p50 and p99 of the lateness [µs], each the median of all turns: of the best, luck is the larger part.
pub(crate) struct Lateness {
    /// The bench with everything attached, asleep until its deadline.
    pub(crate) attached: [f64; 2],
    /// The executive, asleep until its deadline.
    pub(crate) asleep: [f64; 2],
    /// The executive that spins at the end.
    pub(crate) spinning: [f64; 2],
    /// cyclictest.
    pub(crate) peer: [f64; 2],
}

/// Runs all in turn at a rate, `rounds` times. `Err` without cyclictest or without permission for a priority.
pub(crate) fn run(rate: f64, rounds: usize) -> Result<Lateness, Box<dyn Error>> {
    let cpus = std::thread::available_parallelism()?.get();
    let cpu = cpus - 1;
    let mut turns: [Vec<[f64; 2]>; 4] = Default::default();
    let _load = Load::new(cpu.max(1));
    for _ in 0..rounds {
        turns[0].push(attached(rate, cpu)?);
        turns[1].push(ours(rate, cpu, Duration::ZERO)?);
        turns[2].push(ours(rate, cpu, SPIN)?);
        turns[3].push(cyclictest(rate, cpu)?);
    }
    let [attached, asleep, spinning, peer] = turns.map(|turns| median(&turns));
    Ok(Lateness { attached, asleep, spinning, peer })
}

fn wishes(cpu: usize) -> Wishes {
    Wishes { priority: Some(PRIORITY), cpu: Cpu::Number(cpu), ..Wishes::default() }
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

fn median(turns: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|quantile| {
        let mut values: Vec<_> = turns.iter().map(|turn| turn[quantile]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    })
}

/// As `stickslip serve --cpu` does: all threads that this starts leave the CPU to the loop.
fn beside<T: Send>(cpu: usize, work: impl FnOnce() -> T + Send) -> std::io::Result<T> {
    let elsewhere = || keep_off(cpu).map(|()| work());
    std::thread::scope(|scope| scope.spawn(elsewhere).join().expect("a benchmark does not panic"))
}

fn ours(rate: f64, cpu: usize, spin: Duration) -> Result<[f64; 2], Box<dyn Error>> {
    let wake_up = beside(cpu, || measure_wake_up(rate, TURN, spin, wishes(cpu), "", &Watch::silent()))??;
    if !wake_up.granted.has(Wish::Priority(PRIORITY)) {
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
        .ok_or_else(|| format!("cyclictest failed: {}{text}", String::from_utf8_lossy(&output.stderr)).into())
}

/// p50 and p99 [µs] of counts by time [ns] and of those that were later than all.
fn quantiles(rows: &[(u64, u64)], later: u64) -> Option<[f64; 2]> {
    let all = rows.iter().map(|(_, count)| count).sum::<u64>() + later;
    let at = |part: f64| {
        let mut sum = 0;
        rows.iter().find(|(_, count)| {
            sum += count;
            sum as f64 >= part * all as f64
        })
    };
    let micros = |part: f64| at(part).map(|(time, _)| *time as f64 * 1e-3);
    (all > 0).then(|| Some([micros(0.5)?, micros(0.99)?])).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cyclictest_could_not_tell_apart_counts_as_late() {
        let rows: Vec<(u64, u64)> = (1..=100).map(|time| (1000 * time, 1)).collect();
        assert_eq!(quantiles(&rows, 0), Some([50.0, 99.0]));
        assert_eq!(quantiles(&rows, 100), None, "p99 is among the later ones");
        assert_eq!(quantiles(&[], 0), None);
    }
}
