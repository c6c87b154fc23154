//! Clocks of the executive: time, and waiting for a deadline.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::time::Duration;

use crate::system;

/// Time on a clock's own scale, or a difference of two such times [ns].
pub type Nanoseconds = u64;

/// Time before its deadline at which a spinning executive wakes up: longer than most wake-ups take.
pub const SPIN: Duration = Duration::from_micros(40);

/// A clock that never goes back.
pub trait Clock {
    /// Present time.
    fn now(&self) -> Nanoseconds;

    /// Waits until `deadline`, or returns immediately if it has passed. Returns the present time.
    fn wait_until(&self, deadline: Nanoseconds) -> Nanoseconds;
}

/// The monotonic clock of the system. It waits for absolute times, so that an interruption shifts no deadline.
#[derive(Clone, Copy, Debug, Default)]
pub struct MonotonicClock {
    /// Time before a deadline at which sleeping ends and spinning starts. A value above the wake-up time of the system
    /// hides the wake-up time and occupies the CPU for this part of each period.
    pub spin: Duration,
}

impl Clock for MonotonicClock {
    #[inline]
    fn now(&self) -> Nanoseconds {
        system::now()
    }

    #[inline]
    fn wait_until(&self, deadline: Nanoseconds) -> Nanoseconds {
        let spin = self.spin.as_nanos() as Nanoseconds;
        let mut now = self.now();
        if now.saturating_add(spin) < deadline {
            system::sleep_until(deadline - spin);
            now = self.now();
        }
        while now < deadline {
            std::hint::spin_loop();
            now = self.now();
        }
        now
    }
}

/// A monotonic clock whose deadlines follow another clock, for example that of a fieldbus: another thread sets how much
/// later the deadlines are.
#[derive(Clone, Debug, Default)]
pub struct ShiftedClock {
    /// The clock of the system.
    pub clock: MonotonicClock,
    /// Shift of all deadlines [ns].
    pub shift: Arc<AtomicI64>,
    /// The shift since the last wait: between two waits time must not go back.
    active: Cell<i64>,
}

impl ShiftedClock {
    /// A clock with this shift.
    pub fn new(clock: MonotonicClock, shift: Arc<AtomicI64>) -> Self {
        ShiftedClock { clock, shift, active: Cell::new(0) }
    }
}

impl Clock for ShiftedClock {
    #[inline]
    fn now(&self) -> Nanoseconds {
        self.clock.now().saturating_add_signed(-self.active.get())
    }

    #[inline]
    fn wait_until(&self, deadline: Nanoseconds) -> Nanoseconds {
        self.active.set(self.shift.load(Ordering::Relaxed));
        self.clock.wait_until(deadline.saturating_add_signed(self.active.get()));
        self.now().max(deadline)
    }
}

/// A clock that advances only on request, for deterministic tests of lateness and overruns.
#[derive(Clone, Debug, Default)]
pub struct SimulatedClock(Arc<AtomicU64>);

impl SimulatedClock {
    /// Advances the time.
    pub fn advance(&self, by: Nanoseconds) {
        self.0.fetch_add(by, Ordering::Relaxed);
    }
}

impl Clock for SimulatedClock {
    fn now(&self) -> Nanoseconds {
        self.0.load(Ordering::Relaxed)
    }

    /// Advances to the deadline unless it has passed.
    fn wait_until(&self, deadline: Nanoseconds) -> Nanoseconds {
        self.0.fetch_max(deadline, Ordering::Relaxed).max(deadline)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_never_ends_before_the_deadline() {
        for spin in [Duration::ZERO, Duration::from_micros(200), Duration::from_secs(1)] {
            let clock = MonotonicClock { spin };
            for _ in 0..20 {
                let deadline = clock.now() + 300_000;
                let woke = clock.wait_until(deadline);
                assert!(woke >= deadline && clock.now() >= woke);
            }
        }
    }

    #[test]
    fn deadlines_are_shifted_from_the_next_wait_on() {
        let clock = ShiftedClock::new(MonotonicClock::default(), Arc::default());
        let first = clock.wait_until(clock.now() + 100_000);
        clock.shift.store(5_000_000, Ordering::Relaxed);
        let before = clock.clock.now();
        let second = clock.wait_until(first + 100_000);
        assert!(second >= first + 100_000 && clock.clock.now() >= before + 5_000_000);
        clock.shift.store(0, Ordering::Relaxed);
        assert!(clock.now() >= second, "time does not go back before the next wait");
        assert!(clock.wait_until(second + 100_000) >= second + 5_000_000, "the later time is the earlier shift's");
    }

    #[test]
    fn a_deadline_that_has_passed_is_not_waited_for() {
        let clock = SimulatedClock::default();
        clock.advance(500);
        assert_eq!((clock.wait_until(300), clock.now()), (500, 500));
        assert_eq!((clock.wait_until(700), clock.now()), (700, 700));
        assert!(MonotonicClock::default().wait_until(0) > 0);
    }
}
