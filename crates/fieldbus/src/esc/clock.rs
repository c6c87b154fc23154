//! Distributed clocks: a local clock with its error, its copy of the system time, and SYNC0.

use super::memory::{
    Memory, PORT_TIMES, RECEIVE_TIME, SYNC_ACTIVATION, SYNC_CYCLE, SYNC_START, SYSTEM_TIME, TIME_DELAY,
    TIME_DIFFERENCE, TIME_OFFSET,
};

/// Delay of a frame from one device to the next [ns].
const HOP: u64 = 600;
/// Shortest period of SYNC0 [ns].
pub(crate) const SHORTEST_CYCLE: u32 = 62_500;
/// Largest correction of the system time per datagram [ns].
const SLEW: i64 = 1000;

/// Clock of one device.
#[derive(Debug)]
pub(crate) struct Clock {
    /// Position of the device, and number of devices.
    position: u64,
    devices: u64,
    /// Deviation of the local clock from the ideal rate [parts per million].
    deviation: i64,
    /// Correction of the system time [ns].
    correction: i64,
    /// System time of the next SYNC0 [ns].
    next: Option<i64>,
    /// Whether a pulse has come since the activation.
    pulsed: bool,
}

impl Clock {
    pub(crate) fn new(position: usize, devices: usize) -> Self {
        // Each device has been on for a different time, and no two quartzes are equal.
        let deviation = [0, 18, -23, 11][position % 4];
        Clock {
            position: position as u64,
            devices: devices as u64,
            deviation,
            correction: 0,
            next: None,
            pulsed: false,
        }
    }

    fn local(&self, now: u64) -> u64 {
        let drift = i128::from(now) * i128::from(self.deviation) / 1_000_000;
        now.wrapping_add(drift as u64).wrapping_add(1_000_000_007 * (self.position + 1))
    }

    /// Instant at which a frame that enters the segment now reaches the device.
    fn arrival(&self, now: u64) -> u64 {
        now + HOP * self.position
    }

    pub(crate) fn system(&self, memory: &Memory, now: u64) -> i64 {
        let offset = memory.number::<8>(TIME_OFFSET) as i64;
        (self.local(self.arrival(now)) as i64).wrapping_add(offset).wrapping_add(self.correction)
    }

    /// Latches the instants at which a frame passes the ports.
    pub(crate) fn latch(&self, memory: &mut Memory, now: u64) {
        let arrival = self.local(self.arrival(now));
        memory.set(PORT_TIMES, &(arrival as u32).to_le_bytes());
        memory.set(RECEIVE_TIME, &arrival.to_le_bytes());
        if self.position + 1 < self.devices {
            let back = self.local(now + HOP * (2 * self.devices - 2 - self.position));
            memory.set(PORT_TIMES + 4, &(back as u32).to_le_bytes());
        }
    }

    /// Shows the present system time in its register.
    pub(crate) fn show(&self, memory: &mut Memory, now: u64) {
        memory.set(SYSTEM_TIME, &self.system(memory, now).to_le_bytes());
    }

    /// Follows the system time of the reference clock; only the lower 32 bits are compared, as in hardware.
    pub(crate) fn follow(&mut self, memory: &mut Memory, reference: u32, now: u64) {
        let delay = memory.number::<4>(TIME_DELAY) as u32;
        let own = self.system(memory, now) as u32;
        let difference = own.wrapping_sub(delay).wrapping_sub(reference) as i32;
        let sign = if difference < 0 { 1 << 31 } else { 0 };
        memory.set(TIME_DIFFERENCE, &(difference.unsigned_abs() & 0x7FFF_FFFF | sign).to_le_bytes());
        self.correction -= (i64::from(difference) / 4).clamp(-SLEW, SLEW);
    }

    pub(crate) fn reset_correction(&mut self) {
        self.correction = 0;
    }

    /// Whether SYNC0 is switched on.
    pub(crate) fn is_active(memory: &Memory) -> bool {
        memory.byte(SYNC_ACTIVATION) & 3 == 3
    }

    /// Period of SYNC0 [ns].
    pub(crate) fn cycle(memory: &Memory) -> u32 {
        memory.number::<4>(SYNC_CYCLE) as u32
    }

    /// Starts or stops SYNC0 after a write to its activation. A start in the past gives no pulse, as in hardware.
    pub(crate) fn activate(&mut self, memory: &Memory, now: u64) {
        let start = memory.number::<8>(SYNC_START) as i64;
        let ahead = start > self.system(memory, now);
        self.pulsed = false;
        self.next = (Clock::is_active(memory) && Clock::cycle(memory) >= SHORTEST_CYCLE && ahead).then_some(start);
    }

    /// Stops SYNC0 as a fault.
    pub(crate) fn stop(&mut self) {
        self.next = None;
    }

    /// Whether pulses come: the first has come, and the next will.
    pub(crate) fn is_pulsing(&self) -> bool {
        self.pulsed && self.next.is_some()
    }

    /// Instant of the next SYNC0.
    pub(crate) fn due(&self, memory: &Memory, now: u64) -> Option<u64> {
        let ahead = self.next?.wrapping_sub(self.system(memory, now));
        Some(now.saturating_add_signed(ahead))
    }

    /// The pulse has come: the next is a cycle later, after the present time also if the clock was set forward.
    pub(crate) fn pulsed(&mut self, memory: &Memory, now: u64) {
        self.pulsed = true;
        let cycle = Clock::cycle(memory);
        let following = |last: i64| {
            let behind = self.system(memory, now).wrapping_sub(last).max(0);
            last.wrapping_add(i64::from(cycle).wrapping_mul(1 + behind / i64::from(cycle)))
        };
        self.next = self.next.filter(|_| cycle >= SHORTEST_CYCLE).map(following);
    }
}
