//! The present speed of the machine. Rented machines share processors: the same work may take twice as long on the next
//! one, or an hour later.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Time of the work on the reference machine of the budgets: two cores of an AMD EPYC under little other load.
const REFERENCE: Duration = Duration::from_millis(150);
/// How many numbers are printed and read back.
const NUMBERS: usize = 1_050_000;

/// How many times longer the work takes on all cores now than on the reference machine; at least 1.
pub(crate) fn slowness() -> f64 {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let took = std::thread::scope(|scope| {
        let cores: Vec<_> = (0..cores).map(|_| scope.spawn(|| work(NUMBERS))).collect();
        cores.into_iter().map(|core| core.join().expect("the work does not panic")).max()
    });
    times(took.unwrap_or_default())
}

fn times(took: Duration) -> f64 {
    (took.as_secs_f64() / REFERENCE.as_secs_f64()).max(1.0)
}

/// Time to print random numbers and to read them back: branches and tables, as a compiler has them, by code of the
/// standard library, which is the same at every optimisation level of this package.
fn work(numbers: usize) -> Duration {
    let start = Instant::now();
    let mut random = 1u64;
    let mut text = String::new();
    for _ in 0..numbers {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        text.clear();
        let _ = write!(text, "{}", random as f64 * 1e-9);
        let _ = black_box(text.parse::<f64>());
    }
    start.elapsed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_machine_has_a_factor_and_a_fast_one_has_one() {
        assert_eq!(times(3 * REFERENCE), 3.0);
        assert_eq!(times(REFERENCE / 2), 1.0);
        assert!(work(2 * NUMBERS) > work(NUMBERS / 10));
        assert!((1.0..1e3).contains(&slowness()));
    }
}
