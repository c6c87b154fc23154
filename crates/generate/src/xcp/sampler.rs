//! Measurements of a master, as packets in a bounded ring.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::Producer;

use stickslip_recording::capture::{Account, Row, Sink};

/// Mark in the number of a packet after lost rows (overload indication by the PID).
pub(super) const OVERLOAD: u8 = 0x80;

/// A running list of measurements.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plan {
    /// Its number.
    pub(super) list: u8,
    /// Divisor of the cycle numbers that it samples.
    pub(super) prescaler: u64,
    /// Whether its first packet has a time stamp.
    pub(super) timestamp: bool,
    /// Columns of each packet: 0 is the number of the cycle, then the signals.
    pub(super) packets: Vec<Vec<usize>>,
    /// Whether rows were lost since the last packet.
    pub(super) overload: bool,
}

impl Plan {
    /// Size of all its packets, each with its length [bytes].
    fn bytes(&self) -> usize {
        let values: usize = self.packets.iter().map(|columns| 8 * columns.len()).sum();
        4 * self.packets.len() + values + if self.timestamp { 4 } else { 0 }
    }
}

/// Samples every row for the lists into a ring: all packets of a row, or none if there is no room.
pub struct Sampler {
    plans: Vec<Plan>,
    width: usize,
    rate: f64,
    out: Producer<u8>,
    packed: Vec<u8>,
    lost: Arc<AtomicU64>,
    account: Account,
}

impl Sampler {
    /// For these lists, at a rate [Hz], into a ring; lost rows are counted.
    pub(super) fn new(plans: Vec<Plan>, rate: f64, out: Producer<u8>, lost: Arc<AtomicU64>) -> Self {
        let width = plans.iter().flat_map(|plan| plan.packets.iter().flatten()).max().copied().unwrap_or(0);
        let packed = Vec::with_capacity(plans.iter().map(Plan::bytes).max().unwrap_or(0));
        Sampler { plans, width, rate, out, packed, lost, account: Account::default() }
    }
}

/// The time stamp of a cycle [µs], modulo 2³² µs.
pub(super) fn timestamp(cycle: u64, rate: f64) -> u32 {
    (cycle as f64 * 1e6 / rate).round() as u64 as u32
}

impl Sink for Sampler {
    fn width(&self) -> usize {
        self.width
    }

    fn push(&mut self, row: Row<'_>) {
        self.account.arrive(&row);
        let cycle = row.cycle();
        let mut lost = row.lost();
        let mut stored = false;
        for plan in &mut self.plans {
            plan.overload |= row.lost() > 0;
            if !cycle.is_multiple_of(plan.prescaler) {
                continue;
            }
            let Ok(mut chunk) = self.out.write_chunk(plan.bytes()) else {
                plan.overload = true;
                lost += 1;
                continue;
            };
            self.packed.clear();
            for (number, columns) in plan.packets.iter().enumerate() {
                let time = plan.timestamp && number == 0;
                let length = 2 + 8 * columns.len() + if time { 4 } else { 0 };
                let mark = if plan.overload { OVERLOAD } else { 0 };
                self.packed.extend_from_slice(&(length as u16).to_le_bytes());
                self.packed.extend_from_slice(&[number as u8 | mark, plan.list]);
                if time {
                    self.packed.extend_from_slice(&timestamp(cycle, self.rate).to_le_bytes());
                }
                for &column in columns {
                    let value = column.checked_sub(1).map_or(cycle as f64, |signal| row.values()[signal]);
                    self.packed.extend_from_slice(&value.to_le_bytes());
                }
            }
            let (first, second) = chunk.as_mut_slices();
            let (begin, end) = self.packed.split_at(first.len());
            first.copy_from_slice(begin);
            second.copy_from_slice(end);
            chunk.commit_all();
            plan.overload = false;
            stored = true;
        }
        if lost > 0 {
            self.lost.fetch_add(lost, Ordering::Relaxed);
        }
        if stored {
            self.account.stored += 1;
        } else {
            self.account.discarded += 1;
        }
    }

    fn account(&self) -> Account {
        self.account
    }
}
